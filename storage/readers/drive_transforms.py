"""`transforms.json`, the way nerfstudio and instant-ngp write down photographs with their cameras.

Only the JSON is read here; what the frames make together is `storage.readers.drives`'s to judge.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.opening import DEEPEST_JSON, LARGEST_JSON, parsed_json, whole_file

TRANSFORMS = "transforms.json"

LARGEST_SIDE = 32_766
"""Pixels; OpenCV's undistortion counts them in 16 bits."""

MOST_FRAMES = 40_000
"""Read and checked in some seconds."""

_EXPECTED = "a folder with transforms.json, as nerfstudio and instant-ngp have it"
_PINHOLES = ("PINHOLE", "SIMPLE_PINHOLE", "PERSPECTIVE", "OPENCV", "SIMPLE_RADIAL", "RADIAL")
_FARTHEST = 1e8  # metres: more than any coordinate on earth, in whatever grid
_ROTATION_TOLERANCE = 1e-3
_LARGEST_NUMBER = 1e15  # of a camera
_FOCAL_RANGE = 1e4  # of the width: from beyond any pinhole to beyond any telescope
_LARGEST_COEFFICIENT = 1e9  # of the distortion; a long lens has large ones of high powers

_Layers = Sequence[tuple[str, dict[str, Any]]]


class Lens(NamedTuple):
    """A pinhole and OpenCV's radial-tangential distortion.

    fl_x, fl_y: focal lengths, pixels. cx, cy: the principal point, pixels from the outer corner of
    the first pixel, as in the file. w, h: the picture's width and height, pixels. The coefficients
    stand in OpenCV's order.
    """

    fl_x: float
    fl_y: float
    cx: float
    cy: float
    w: int
    h: int
    k1: float
    k2: float
    p1: float
    p2: float
    k3: float


class Frame(NamedTuple):
    """One photograph.

    pose: (4, 4) float64, camera to world in OpenCV's axes (x right, y down, z forward), metres.
    """

    camera: str
    time: float
    photograph: Path
    pose: NDArray[np.float64]
    lens: Lens


def read_transforms(path: str | os.PathLike[str]) -> tuple[Path, list[Frame]]:
    """The path of a folder's `transforms.json` and its frames, in its order.

    What a lens has may stand with the frame, with the frame's camera under `cameras`, or at the
    top; the nearest is taken. A `camera` may be a name or a number: 1 and "1" are one camera.
    Matrices become the nearest rotation. Fields that are not named here are not looked at.

    Raises BadInput for a folder or file that is missing or no JSON, for a field that is missing, of
    another type, not finite or out of range, for a matrix that is not 4 x 4 or no rotation with a
    place, for lenses that are no pinholes, and for a photograph's path that leaves the folder
    (links inside are followed).
    """
    folder = Path(path)
    file = folder / TRANSFORMS
    top = _object(file, "content", _json(folder, file))
    listed = _required(file, [("", top)], "frames", "a list of frames")
    if not isinstance(listed, list):
        raise BadInput(file, "frames", _shown(listed), "a list of frames")
    if len(listed) > MOST_FRAMES:
        raise BadInput(file, "number of frames", f"{len(listed)}", f"at most {MOST_FRAMES}")
    cameras = _object(file, "cameras", top.get("cameras", {}))
    return file, [_frame(file, row, entry, cameras, top) for row, entry in enumerate(listed)]


def shown_number(value: float) -> str:
    """A time as short as it can be told from all others: 3, 3.2."""
    return repr(float(value)).removesuffix(".0")


def _json(folder: Path, file: Path) -> Any:
    if not folder.is_dir():
        raise BadInput(folder, "drive", "a file" if folder.exists() else "missing", _EXPECTED)
    if not file.exists():
        raise BadInput(folder, "drive", f"without {TRANSFORMS}", _EXPECTED)
    try:
        return parsed_json(whole_file(file, _EXPECTED, LARGEST_JSON))
    except json.JSONDecodeError as error:
        found = f"broken in line {error.lineno}, column {error.colno}"
        raise BadInput(file, "JSON", found, "a complete JSON object") from error
    except BadInput:
        raise
    except ValueError as error:  # no text, numbers of 5000 digits, nested too deep
        expected = f"a complete JSON object, nested {DEEPEST_JSON} deep at most"
        raise BadInput(file, "JSON", "broken", expected) from error


def _frame(file: Path, row: int, entry: Any, cameras: dict[str, Any], top: dict[str, Any]) -> Frame:
    where = f"frames[{row}]"
    own = [(f"{where}.", _object(file, where, entry))]
    camera = _camera(file, own)
    time = _number(file, f"{where}.time", _required(file, own, "time", "a number"))
    photograph = _photograph(file, own)
    pose = _pose(file, own)
    shared = _object(file, f"cameras.{camera}", cameras.get(camera, {}))
    layers = [*own, (f"cameras.{camera}.", shared), ("", top)]
    return Frame(camera, time, photograph, pose, _lens(file, camera, layers))


def _camera(file: Path, own: _Layers) -> str:
    value = _required(file, own, "camera", "a name or a number")
    if isinstance(value, str) and value.strip():
        return value.strip()
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if is_number and abs(value) <= _LARGEST_NUMBER:  # not NaN, infinite or of 400 digits
        return str(int(value)) if value == int(value) else str(value)
    raise BadInput(file, f"{own[0][0]}camera", _shown(value), "a name or a number")


def _photograph(file: Path, own: _Layers) -> Path:
    expected = "the path of a photograph, from the folder"
    value = _required(file, own, "file_path", expected)
    field = f"{own[0][0]}file_path"
    if not isinstance(value, str) or not value or "\0" in value:
        raise BadInput(file, field, _shown(value), expected)
    folder = Path(os.path.abspath(file.parent))
    photograph = Path(os.path.abspath(folder / value))
    if folder not in photograph.parents:
        raise BadInput(file, field, _shown(value), "a path inside the folder")
    return photograph


def _pose(file: Path, own: _Layers) -> NDArray[np.float64]:
    expected = "4 rows of 4 numbers"
    rows = _required(file, own, "transform_matrix", expected)
    field = f"{own[0][0]}transform_matrix"
    whole = isinstance(rows, list) and len(rows) == 4
    if not whole or any(not isinstance(row, list) or len(row) != 4 for row in rows):
        raise BadInput(file, field, "not 4 x 4", expected)
    pose = np.array(
        [
            [_number(file, f"{field}[{i}][{j}]", value) for j, value in enumerate(row)]
            for i, row in enumerate(rows)
        ]
    )
    turn = pose[:3, :3]
    # Large entries first: their squares may overflow.
    if (
        np.abs(turn).max() > 1 + _ROTATION_TOLERANCE
        or np.abs(turn.T @ turn - np.eye(3)).max() > _ROTATION_TOLERANCE
        or np.linalg.det(turn) < 0
    ):
        raise BadInput(
            file, field, "no rotation", "orthonormal, right-handed axes in columns 1 to 3"
        )
    if np.abs(pose[3] - (0, 0, 0, 1)).max() > 1e-6:
        raise BadInput(file, f"{field}[3]", _shown(rows[3]), "[0, 0, 0, 1], the place in column 4")
    if np.abs(pose[:3, 3]).max() > _FARTHEST:
        raise BadInput(
            file, field, f"a place {np.abs(pose[:3, 3]).max():.3g} m away", "a place on earth"
        )
    # Whoever uses a pose takes the transpose for the inverse; a few decimals are not enough.
    left, _, right = np.linalg.svd(turn)
    pose[:3, :3] = left @ right
    pose[3] = (0, 0, 0, 1)
    pose[:3, 1:3] *= -1  # OpenGL's y up and z backwards to OpenCV's y down and z forward
    return pose


def _lens(file: Path, camera: str, layers: _Layers) -> Lens:
    _check_pinhole(file, layers)

    def found(key: str) -> tuple[str, float]:
        where, value = _nearest(layers, key)
        if where is None:
            raise BadInput(
                file,
                key,
                f"missing for camera {camera}",
                f"a number in the frame, in cameras.{shortened(camera, 40)} or at the top",
            )
        return where + key, _number(file, where + key, value)

    values: dict[str, float] = {}
    for key in ("w", "h"):
        field, side = found(key)
        if side != int(side) or not 1 <= side <= LARGEST_SIDE:
            expected = f"a whole number of pixels from 1 to {LARGEST_SIDE}"
            raise BadInput(file, field, shown_number(side), expected)
        values[key] = int(side)
    for key in ("fl_x", "fl_y"):
        field, values[key] = found(key)
        if values[key] <= 0:
            raise BadInput(file, field, shown_number(values[key]), "more than 0 pixels")
        least, most = values["w"] / _FOCAL_RANGE, values["w"] * _FOCAL_RANGE
        if not least <= values[key] <= most:
            expected = f"{least:g} to {most:g} pixels, for a picture {values['w']} wide"
            raise BadInput(file, field, shown_number(values[key]), expected)
    for key, side_of in (("cx", "w"), ("cy", "h")):
        field, values[key] = found(key)
        if not 0 < values[key] < values[side_of]:
            expected = f"a place inside the picture, between 0 and {values[side_of]} pixels"
            raise BadInput(file, field, shown_number(values[key]), expected)
    for key in ("k1", "k2", "p1", "p2", "k3"):
        where, value = _nearest(layers, key)
        values[key] = 0.0 if where is None else _number(file, where + key, value)
        if abs(values[key]) > _LARGEST_COEFFICIENT:
            expected = f"a coefficient of at most {_LARGEST_COEFFICIENT:g}"
            raise BadInput(file, f"{where}{key}", shown_number(values[key]), expected)
    return Lens(**values)  # type: ignore[arg-type]  # w and h are integers, see above


def _check_pinhole(file: Path, layers: _Layers) -> None:
    expected = "a pinhole with the distortion k1, k2, k3, p1, p2 or without"
    where, model = _nearest(layers, "camera_model")
    if where is not None and model not in _PINHOLES:
        raise BadInput(file, f"{where}camera_model", _shown(model), expected)
    for key in ("is_fisheye", "k4", "k5", "k6"):
        where, value = _nearest(layers, key)
        if value:
            raise BadInput(file, f"{where}{key}", _shown(value), expected)


def _nearest(layers: _Layers, key: str) -> tuple[str | None, Any]:
    """Where a field stands first, as a prefix of its name, and its value; None, None if nowhere."""
    return next(((where, layer[key]) for where, layer in layers if key in layer), (None, None))


def _required(file: Path, own: _Layers, key: str, expected: str) -> Any:
    where, value = _nearest(own, key)
    if where is None:
        raise BadInput(file, f"{own[0][0]}{key}", "missing", expected)
    return value


def _object(file: Path, field: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise BadInput(file, field, _shown(value), "a JSON object")
    return value


def _number(file: Path, field: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise BadInput(file, field, _shown(value), "a number")
    try:
        number = float(value)
    except OverflowError:  # an integer of 400 digits
        number = math.inf
    if not math.isfinite(number):
        raise BadInput(file, field, shown_number(number), "a finite number")
    return number


def _shown(value: Any) -> str:
    """A value as JSON, not too long."""
    return shortened(json.dumps(value, ensure_ascii=False))
