"""COLMAP's sparse models with the photographs that they were made of."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from storage.readers.bad_input import BadInput, shortened
from storage.readers.drives.colmap_models import (
    ColmapCamera,
    ColmapImage,
    count_images,
    read_cameras,
    read_images,
    read_points,
    read_rig_frames,
)
from storage.readers.drives.motions import inverse, place, quaternion_rotation, rigid
from storage.readers.drives.naming import by_number, cameras_and_times
from storage.readers.drives.recordings import (
    FISHEYE,
    PANORAMA,
    PINHOLE,
    Frame,
    Lens,
    Recording,
    check_lens,
    counted,
    file_inside,
)

_MODEL_FOLDERS = (
    ".", "sparse", "colmap/sparse", "colmap", "dense/sparse", "dense/0/sparse",
    "undistorted/sparse",
)  # fmt: skip
_PICTURE_FOLDERS = ("images", "image", "imgs", "pictures", ".")
_ENDINGS = (".bin", ".txt")  # COLMAP itself prefers the binary one
_MOST_MODELS = 1000


def find_colmap(path: Path) -> Path | None:
    """The file of images of the model with most of them, in a folder or where it usually lies: the
    first such place whose photographs are there, too."""
    found = []
    for name in _MODEL_FOLDERS:
        models = [_images_file(path / name) or max(_numbered(path / name), key=_size, default=None)]
        found += [file for file in models if file is not None]
    return next((file for file in found if _has_pictures(file, path)), next(iter(found), None))


def read_colmap(file: Path, root: Path) -> Recording:
    """A model's photographs. The unit and the up axis are COLMAP's own, which nobody knows.

    Where the model has rigs, a frame of a rig is an instant; otherwise names tell (folder or
    prefix the camera, number the time). Cameras without photographs are left out.

    Raises BadInput for a model that is broken, a camera model that is not known or has terms that
    OpenCV's five do not have, a camera that is missing, and photographs that are nowhere.
    """
    folder, ending = file.parent, file.suffix
    cameras_file = folder / f"cameras{ending}"
    cameras, images = read_cameras(cameras_file), read_images(file)
    if not images:
        raise BadInput(file, "number of images", "0", "at least 3 photographs with a pose")
    pictures = _picture_folder(file, root, images)
    lenses = {}
    for number in {image.camera for image in images}:
        if number not in cameras:
            raise BadInput(file, f"camera {number}", "missing", f"a camera in {cameras_file.name}")
        lenses[number] = _lens(cameras_file, number, cameras[number])
    frames = []
    told, guessed = _told(folder, ending, images)
    for image, (camera, time) in zip(images, told, strict=True):
        field = f"pose of image {image.number}"
        turn = quaternion_rotation(file, field, image.quaternion)
        pose = inverse(rigid(turn, place(file, field, image.translation)))
        photograph = file_inside(file, pictures, image.name, f"name of image {image.number}")
        frames.append(Frame(camera, time, photograph, pose, lenses[image.camera]))
    points_file = folder / f"points3D{ending}"
    points = read_points(points_file) if points_file.exists() else np.empty((0, 3))
    notes = tuple(_notes(file, len(images)))
    return Recording(file, frames, notes=notes, guessed=guessed, points=points)


def _images_file(folder: Path) -> Path | None:
    for ending in _ENDINGS:
        file = folder / f"images{ending}"
        if file.is_file() and (folder / f"cameras{ending}").is_file():
            return file
    return None


def _numbered(folder: Path) -> list[Path]:
    """The models 0, 1 … that COLMAP makes of photographs that do not hang together."""
    if not folder.is_dir():
        return []
    names = [name for name in os.listdir(folder) if name.isdecimal()]
    found = (_images_file(folder / name) for name in sorted(names, key=by_number)[:_MOST_MODELS])
    return [file for file in found if file is not None]


def _size(file: Path) -> int:
    try:
        return count_images(file)
    except BadInput:
        return -1


def _has_pictures(file: Path, root: Path) -> bool:
    try:
        images = read_images(file)
        return bool(images) and bool(_picture_folder(file, root, images))
    except BadInput:
        return False


def _picture_folder(file: Path, root: Path, images: Sequence[ColmapImage]) -> Path:
    """Where the photographs lie: the nearest of the usual folders that has most of them."""
    some = images[:: max(len(images) // 64, 1)]
    found, most = None, 0
    for base in (file.parent, *file.parent.parents):
        for name in _PICTURE_FOLDERS:
            there = sum(os.path.exists(base / name / image.name) for image in some)
            if there > most:
                found, most = base / name, there
        if base == root:
            break
    if found is None:
        first = shortened(images[0].name, 40)
        expected = f"a folder images with {first}, in the folder that was given"
        raise BadInput(file, "folder of its photographs", "nowhere", expected)
    return found


def _lens(file: Path, number: int, camera: ColmapCamera) -> Lens:
    values = [float(value) for value in camera.parameters]
    kind, size = camera.model, (camera.width, camera.height)
    if kind == "EQUIRECTANGULAR":
        return check_lens(file, Lens(PANORAMA, *size), lambda key: f"{key} of camera {number}")
    one_focal = kind.startswith("SIMPLE") or kind in ("RADIAL", "RADIAL_FISHEYE")
    if one_focal:
        values.insert(0, values[0])
    focal, rest = values[:4], values[4:]
    if kind in ("SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"):
        model, coefficients = PINHOLE, [*rest, 0.0, 0.0, 0.0, 0.0, 0.0][:5]
    elif kind in (
        "SIMPLE_FISHEYE", "FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "OPENCV_FISHEYE"
    ):  # fmt: skip
        model, coefficients = FISHEYE, [*rest, 0.0, 0.0, 0.0, 0.0][:4]
    elif kind == "FULL_OPENCV" and not any(rest[5:]):
        model, coefficients = PINHOLE, rest[:5]
    else:
        found = f"{kind} with terms beyond k3" if kind == "FULL_OPENCV" else kind
        expected = "a model with OpenCV's k1, k2, p1, p2, k3 or fisheye; colmap image_undistorter"
        raise BadInput(file, f"model of camera {number}", found, f"{expected} makes one")
    centre = focal[2] - 0.5, focal[3] - 0.5  # counted from the first pixel's middle
    lens = Lens(model, *size, focal[0], focal[1], *centre, coefficients=tuple(coefficients))
    return check_lens(file, lens, lambda key: f"{key} of camera {number}", corner=0.5)


def _told(
    folder: Path, ending: str, images: Sequence[ColmapImage]
) -> tuple[list[tuple[str, float]], bool]:
    """Camera and time of each image, by its rig's frame if there are rigs of several cameras; and
    whether they are guessed."""
    named = cameras_and_times([image.name for image in images])
    file = folder / f"frames{ending}"
    frame_of = read_rig_frames(file) if file.exists() else {}
    members: dict[int, list[int]] = defaultdict(list)
    for row, image in enumerate(images):
        members[frame_of.get(image.number, -1 - image.number)].append(row)
    if all(len(rows) == 1 for rows in members.values()):
        return named, True
    # The frames' own numbers have no order: that of the names has.
    order = sorted(members.values(), key=lambda rows: min(by_number(images[r].name) for r in rows))
    times = [{named[row][1] for row in rows} for rows in order]
    numbered = all(len(own) == 1 for own in times) and len(set.union(*times)) == len(order)
    cameras = {(image.camera, named[row][0]) for row, image in enumerate(images)}
    one_to_one = len(cameras) == len({c for c, _ in cameras}) == len({n for _, n in cameras})
    told = list(named)
    for count, rows in enumerate(order):
        for row in rows:
            camera = named[row][0] if one_to_one else f"camera {images[row].camera}"
            told[row] = camera, named[row][1] if numbered else float(count)
    return told, False


def _notes(file: Path, count: int) -> list[str]:
    model = file.parent
    beside = [other for other in _numbered(model.parent) if other.parent != model]
    if not model.name.isdecimal() or not beside:
        return []
    others = ", ".join(f"{other.parent.name} ({_size(other)})" for other in beside[:4])
    more = f" and {len(beside) - 4} more" if len(beside) > 4 else ""
    return [
        f"Model {model.name} is read ({counted(count, 'photograph')}); beside it and not read: "
        f"{others}{more}."
    ]
