"""What a frame of `transforms.json` says of its lens, in whichever of the known forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

from storage.readers.bad_input import BadInput, shortened
from storage.readers.drives.headers import photograph_size
from storage.readers.drives.json_fields import Layers, json_number, nearest, shown_json
from storage.readers.drives.recordings import (
    FISHEYE,
    LARGEST_SIDE,
    PANORAMA,
    PINHOLE,
    Lens,
    check_lens,
    shown_number,
)

_PINHOLES = (
    "PINHOLE", "SIMPLE_PINHOLE", "PERSPECTIVE", "OPENCV", "SIMPLE_RADIAL", "RADIAL", "FULL_OPENCV"
)  # fmt: skip
_FISHEYES = ("OPENCV_FISHEYE", "FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE")
_PANORAMAS = ("EQUIRECTANGULAR", "SPHERICAL")
_EXPECTED = (
    "a pinhole with the distortion k1, k2, k3, p1, p2 or without, a fisheye with k1 to k4, or "
    "EQUIRECTANGULAR"
)
_COEFFICIENTS = {
    PINHOLE: ("k1", "k2", "p1", "p2", "k3"), FISHEYE: ("k1", "k2", "k3", "k4"), PANORAMA: ()
}  # fmt: skip
_FOREIGN = {PINHOLE: ("k4", "k5", "k6"), FISHEYE: ("p1", "p2", "k5", "k6"), PANORAMA: ()}
"""Coefficients that are known for other lenses, and would be lost."""


class _Asked(NamedTuple):
    file: Path
    layers: Layers
    camera: str

    def number(self, key: str) -> tuple[str, float | None]:
        """A field's whole name and its value, None where it stands nowhere."""
        where, value = nearest(self.layers, key)
        if where is None:
            return key, None
        return where + key, json_number(self.file, where + key, value)

    def field(self, key: str) -> str:
        where, _ = nearest(self.layers, key)
        return (where or "") + key


def transform_lens(file: Path, camera: str, layers: Layers, photograph: Path) -> Lens | None:
    """The lens of a frame: each value from the nearest layer that has it.

    Focal lengths may stand as ``fl_x``, ``x_fov`` (degrees) or ``camera_angle_x`` (radians), and
    likewise down, where the one across counts if there is none; the principal point is the middle
    of the picture where none is given; the size that of the photograph. None for a photograph that
    is not there and whose size is not said.

    Raises BadInput for fields of another type, out of range or of no lens that is known.
    """
    asked = _Asked(file, layers, camera)
    model = _model(asked)
    size = _size(asked, photograph)
    if size is None:
        return None
    lens = Lens(model, *size)
    if model != PANORAMA:
        # The file counts from the first pixel's outer corner, a lens from its middle.
        fl_x, fl_y = _focal_lengths(asked, size)
        cx, cy = (asked.number(key)[1] for key in ("cx", "cy"))
        middle = [side / 2 if at is None else at for side, at in zip(size, (cx, cy), strict=True)]
        coefficients = tuple(asked.number(key)[1] or 0.0 for key in _COEFFICIENTS[model])
        lens = Lens(
            model, *size, fl_x, fl_y, middle[0] - 0.5, middle[1] - 0.5, coefficients=coefficients
        )
    return check_lens(file, lens, asked.field, corner=0.5)


def _model(asked: _Asked) -> str:
    where, name = nearest(asked.layers, "camera_model")
    if where is not None and name not in (*_PINHOLES, *_FISHEYES, *_PANORAMAS):
        raise BadInput(asked.file, f"{where}camera_model", shown_json(name), _EXPECTED)
    model = FISHEYE if name in _FISHEYES else PANORAMA if name in _PANORAMAS else PINHOLE
    if nearest(asked.layers, "is_fisheye")[1]:
        model = FISHEYE
    if nearest(asked.layers, "equirectangular")[1]:
        model = PANORAMA
    for key in (*_FOREIGN[model], "latlong", "ftheta_p0"):
        where, value = nearest(asked.layers, key)
        if value:
            raise BadInput(asked.file, f"{where}{key}", shown_json(value), _EXPECTED)
    return model


def _size(asked: _Asked, photograph: Path) -> tuple[int, int] | None:
    sides = []
    for key in ("w", "h"):
        field, side = asked.number(key)
        if side is None:
            continue
        if side != int(side) or not 1 <= side <= LARGEST_SIDE:
            expected = f"a whole number of pixels from 1 to {LARGEST_SIDE}"
            raise BadInput(asked.file, field, shown_number(side), expected)
        sides.append(int(side))
    if len(sides) == 2:
        return sides[0], sides[1]
    return photograph_size(photograph) if photograph.exists() else None


def _focal_lengths(asked: _Asked, size: tuple[int, int]) -> tuple[float, float]:
    across = _focal_length(asked, "x", size[0])
    down = _focal_length(asked, "y", size[1])
    either = across if across is not None else down
    if either is None:
        raise BadInput(
            asked.file,
            "fl_x",
            f"missing for camera {asked.camera}",
            f"a number in the frame, in cameras.{shortened(asked.camera, 40)} or at the top; "
            "or camera_angle_x",
        )
    return either, down if down is not None else either


def _focal_length(asked: _Asked, axis: str, side: int) -> float | None:
    _, focal = asked.number(f"fl_{axis}")
    if focal is not None:
        return focal
    for key, half_turn in ((f"{axis}_fov", 180.0), (f"camera_angle_{axis}", math.pi)):
        field, angle = asked.number(key)
        if angle is None:
            continue
        if not 0 < angle < half_turn:
            expected = f"an angle between 0 and {half_turn:.4g}"
            raise BadInput(asked.file, field, shown_number(angle), expected)
        return side / 2 / math.tan(angle / half_turn * math.pi / 2)
    return None
