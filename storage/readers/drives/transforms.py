"""`transforms.json`, the way nerfstudio and instant-ngp write down photographs with their cameras.

Two fields more may stand in each of its frames: `camera`, a name or a number, and `time`, a
number; photographs of one time were taken together. Without them the names of the files tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.drives.headers import ENDINGS
from storage.readers.drives.json_fields import (
    Layers,
    json_file,
    json_matrix,
    json_number,
    json_object,
    json_text,
    required,
    shown_json,
)
from storage.readers.drives.motions import inverse, place, rigid, rotation
from storage.readers.drives.naming import cameras_and_times
from storage.readers.drives.recordings import (
    Frame,
    Recording,
    check_count,
    counted,
    file_inside,
    shown_number,
)
from storage.readers.drives.transform_lenses import transform_lens

TRANSFORMS = ("transforms.json", "transforms_train.json")
"""The first that is there is read."""

_EXPECTED = "a folder with transforms.json, as nerfstudio and instant-ngp have it"
_LARGEST_NUMBER = 1e15  # of a camera
_SCALE_TOLERANCE = 1e-3  # of axes that are as long as they should be
_NOT_READ = ("ply_file_path", "depth_file_path")


def find_transforms(folder: Path) -> Path | None:
    """The file that a folder is known by."""
    return next((folder / name for name in TRANSFORMS if (folder / name).exists()), None)


def read_transforms(file: Path, folder: Path) -> Recording:
    """The frames of `transforms.json`; ``folder``: where it is, with the photographs.

    What a lens has may stand with the frame, with the frame's camera under `cameras`, or at the
    top; the nearest is taken. A `camera` may be a name or a number: 1 and "1" are one camera.
    Matrices may have 3 or 4 rows and become the nearest rotation; a scale inside them, what was
    done to the world before the file was written (`applied_transform`, `applied_scale`) are taken
    out again. Fields that are not named here are not looked at.

    Raises BadInput for a file that is missing or no JSON, for a field that is missing, of another
    type, not finite or out of range, for a matrix that is not 4 x 4 or 3 x 4 or no rotation with a
    place, for lenses that are not known, and for a picture's path that leaves the folder (links
    inside are followed).
    """
    top = json_object(file, "content", json_file(file, _EXPECTED))
    entries = required(file, [("", top)], "frames", "a list of frames")
    if not isinstance(entries, list):
        raise BadInput(file, "frames", shown_json(entries), "a list of frames")
    check_count(file, len(entries))
    cameras = json_object(file, "cameras", top.get("cameras", {}))
    owns = [
        [(f"frames[{row}].", json_object(file, f"frames[{row}]", entry))]
        for row, entry in enumerate(entries)
    ]
    names = [_file_name(file, own, "file_path") for own in owns]
    told = cameras_and_times(names)
    undone, notes = _undone(file, top)
    frames, scaled = [], 0
    for own, name, (camera, time) in zip(owns, names, told, strict=True):
        pose, scale = _pose(file, own)
        scaled += abs(scale - 1) > _SCALE_TOLERANCE
        camera = _camera(file, own, camera)
        shared = json_object(file, f"cameras.{camera}", cameras.get(camera, {}))
        layers = [*own, (f"cameras.{camera}.", shared), ("", top)]
        photograph = _picture(file, own, "file_path", name)
        lens = transform_lens(file, camera, layers, photograph)
        frames.append(
            Frame(camera, _time(file, own, time), photograph, undone(pose), lens, _mask(file, own))
        )
    if scaled:
        notes.append(f"The axes of {counted(scaled, 'matrix')} were scaled: divided out.")
    guessed = _guessed(owns, len({frame.camera for frame in frames}))
    notes += guessed
    notes += [f"{key} is not read." for key in _NOT_READ if any(key in own[0][1] for own in owns)]
    notes += [f"{key} is not read." for key in _NOT_READ if key in top]
    return Recording(file, frames, notes=tuple(notes), guessed=bool(guessed))


def _guessed(owns: Sequence[Layers], cameras: int) -> list[str]:
    lacking = [key for key in ("camera", "time") if any(key not in own[0][1] for own in owns)]
    if not lacking:
        return []
    what = " and ".join(lacking)
    return [f"Taken from the names of the files: {what} ({counted(cameras, 'camera')})."]


def _camera(file: Path, own: Layers, otherwise: str) -> str:
    if "camera" not in own[0][1]:
        return otherwise
    value = own[0][1]["camera"]
    if isinstance(value, str) and value.strip():
        return value.strip()
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if is_number and abs(value) <= _LARGEST_NUMBER:  # not NaN, infinite or of 400 digits
        return str(int(value)) if value == int(value) else str(value)
    raise BadInput(file, f"{own[0][0]}camera", shown_json(value), "a name or a number")


def _time(file: Path, own: Layers, otherwise: float) -> float:
    if "time" not in own[0][1]:
        return otherwise
    return json_number(file, f"{own[0][0]}time", own[0][1]["time"])


def _file_name(file: Path, own: Layers, key: str) -> str:
    expected = "the path of a picture, from the folder"
    return json_text(file, f"{own[0][0]}{key}", required(file, own, key, expected), expected)


def _picture(file: Path, own: Layers, key: str, name: str) -> Path:
    """Where a picture is; one whose name has no ending has that of the file which is there."""
    found = file_inside(file, file.parent, name, f"{own[0][0]}{key}")
    if not found.exists():
        for ending in (*ENDINGS, *(ending.upper() for ending in ENDINGS)):
            ended = found.with_name(found.name + ending)
            if ended.exists():
                return ended
    return found


def _mask(file: Path, own: Layers) -> Path | None:
    if own[0][1].get("mask_path") is None:
        return None
    return _picture(file, own, "mask_path", _file_name(file, own, "mask_path"))


def _pose(file: Path, own: Layers) -> tuple[NDArray[np.float64], float]:
    """Camera to world in OpenCV's axes, and what they were scaled by."""
    rows = required(file, own, "transform_matrix", "4 rows of 4 numbers")
    field = f"{own[0][0]}transform_matrix"
    matrix = json_matrix(file, field, rows, ((4, 4), (3, 4)))
    turn, scale = rotation(file, field, matrix[:3, :3])
    if len(matrix) == 4 and np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-6:
        expected = "[0, 0, 0, 1], the place in column 4"
        raise BadInput(file, f"{field}[3]", shown_json(rows[3]), expected)
    pose = rigid(turn, place(file, field, matrix[:3, 3]))
    pose[:3, 1:3] *= -1  # OpenGL's y up and z backwards to OpenCV's y down and z forward
    return pose, scale


class _Undone:
    """What was done to the world, backwards: a rigid motion and a scale."""

    def __init__(self, motion: NDArray[np.float64], scale: float) -> None:
        self.backwards, self.scale = inverse(motion), scale

    def __call__(self, pose: NDArray[np.float64]) -> NDArray[np.float64]:
        moved = pose.copy()
        moved[:3, 3] /= self.scale
        return self.backwards @ moved


def _undone(file: Path, top: dict[str, Any]) -> tuple[_Undone, list[str]]:
    """How poses come back into the world they were found in, and what is to be said of it.

    nerfstudio turns COLMAP's world by `applied_transform` and may scale it by `applied_scale`.
    """
    motion, scale, notes = np.eye(4), 1.0, []
    if top.get("applied_transform") is not None:
        field = "applied_transform"
        matrix = json_matrix(file, field, top[field], ((4, 4), (3, 4)))
        turn, scale = rotation(file, field, matrix[:3, :3])
        motion = rigid(turn, place(file, field, matrix[:3, 3]) / scale)
        notes.append("applied_transform is taken out: the world is the one before it.")
    if top.get("applied_scale") is not None:
        given = json_number(file, "applied_scale", top["applied_scale"])
        if not 1e-9 < given < 1e9:
            raise BadInput(file, "applied_scale", shown_number(given), "a scale above 0")
        scale *= given
        notes.append(f"applied_scale is taken out: {shortened(shown_number(given))}.")
    return _Undone(motion, scale), notes
