"""The formats of drives: what each is known by, and which one a folder is in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from storage.readers.bad_input import BadInput
from storage.readers.drives.colmap import find_colmap, read_colmap
from storage.readers.drives.kitti_odometry import find_kitti_odometry, read_kitti_odometry
from storage.readers.drives.kitti_raw import find_kitti_raw, read_kitti_raw
from storage.readers.drives.nuscenes import find_nuscenes, read_nuscenes
from storage.readers.drives.recordings import Recording
from storage.readers.drives.transforms import find_transforms, read_transforms
from storage.readers.drives.unposed import (
    find_film,
    find_photographs,
    read_film_recording,
    read_photographs_recording,
)
from storage.readers.opening import unreadable
from storage.readers.photograph_folders import FEWEST


class Format(NamedTuple):
    """One way to write down a drive.

    known_by: the files by which it is told from others.
    sentence: what of it is read.
    find: the file (or folder) that a folder is known by, None where it is in another format.
    read: the recording of what was found, in the folder: nothing outside of that is looked at.
    """

    name: str
    known_by: str
    sentence: str
    find: Callable[[Path], Path | None]
    read: Callable[[Path, Path], Recording]


FORMATS = (
    Format(
        "nerfstudio, instant-ngp, Blender",
        "transforms.json or transforms_train.json",
        "All of their forms; pinholes with or without distortion, fisheyes, equirectangular "
        "pictures, masks; camera and time by fields of their own or by the files' names.",
        find_transforms,
        read_transforms,
    ),
    Format(
        "nuScenes",
        "v1.0-…/scene.json, sample_data.json …",
        "Keyframes and sweeps of all cameras of one scene: the one of which most pictures are "
        "there.",
        find_nuscenes,
        read_nuscenes,
    ),
    Format(
        "KITTI raw",
        "calib_cam_to_cam.txt, …_sync/image_00/data",
        "Rectified pictures of one drive of a day, with poses by oxts.",
        find_kitti_raw,
        read_kitti_raw,
    ),
    Format(
        "KITTI odometry",
        "calib.txt, image_0 or image_l",
        "image_0 to image_3 or image_l and image_r; poses.txt or poses/NN.txt beside sequences; "
        "times.txt.",
        find_kitti_odometry,
        read_kitti_odometry,
    ),
    Format(
        "COLMAP",
        "sparse/0/cameras.bin, images.bin (or .txt), images/",
        "Models as binary or text files, with and without rigs, all camera models that OpenCV "
        "has; of several models the largest.",
        find_colmap,
        read_colmap,
    ),
)
"""The most specific first: what a folder is in several of is read as the first of them."""

UNPOSED = (
    Format(
        "a film",
        "film.mp4, .mov, .mkv, .avi …",
        "Of one camera, by FFmpeg; its poses are found. A .gpx of its name beside it tells scale "
        "and north.",
        find_film,
        read_film_recording,
    ),
    Format(
        "photographs without poses",
        f"a folder of {FEWEST} photographs or more",
        "Of one camera in the order of their names; their poses are found. EXIF's focal length "
        "and GPS are used, or a .gpx in the folder.",
        find_photographs,
        read_photographs_recording,
    ),
)
"""What is read where there is none of these: nobody says where it was taken."""


def read_recording(path: Path) -> Recording:
    """The recording of a folder, in the first format that it is in; others are named in a note.

    Raises BadInput for what is missing or in no format, and as the format's reader does.
    """
    try:
        return _recording(path)
    except OSError as error:  # a folder that may not be listed, above all
        raise unreadable(Path(error.filename or path), error, "files that can be read") from error


def _recording(path: Path) -> Recording:
    found = _those_of(FORMATS, path) or _those_of(UNPOSED, path)
    if not found:
        what = "a folder without any of these" if path.is_dir() else "a file"
        raise BadInput(
            path,
            "drive",
            what if path.exists() else "missing",
            "one of "
            + "; ".join(f"{known.known_by} ({known.name})" for known in (*FORMATS, *UNPOSED)),
        )
    known, file = found[0]
    recording = known.read(file, path)
    others = ", ".join(other.name for other, _ in found[1:])
    if not others:
        return recording
    note = f"Read as {known.name}; the folder is also in the form of {others}, which is not read."
    return recording._replace(notes=(note, *recording.notes))


def _those_of(formats: Sequence[Format], path: Path) -> list[tuple[Format, Path]]:
    return [(known, file) for known in formats if (file := known.find(path)) is not None]
