"""What every format's module makes of its files: a `Recording`, before anything is judged of it."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.films import Film

MOST_FRAMES = 40_000
"""Read and checked in some seconds."""
LARGEST_SIDE = 32_766
"""Pixels; OpenCV counts them in 16 bits."""

PINHOLE = "pinhole"
FISHEYE = "fisheye"
PANORAMA = "panorama"

_FOCAL_RANGE = 1e4  # of the width: from beyond any pinhole to beyond any telescope
_LARGEST_COEFFICIENT = 1e9  # of the distortion; a long lens has large ones of high powers


class Lens(NamedTuple):
    """How a camera's photograph came about.

    model: "pinhole"; "fisheye", an equidistant projection as OpenCV's; or "panorama", an
        equirectangular picture of everything around: its middle is straight ahead.
    w, h: the photograph's width and height, pixels.
    fl_x, fl_y, cx, cy: focal lengths and principal point, pixels, the middle of the first pixel at
        (0, 0); a panorama has none (0).
    coefficients: distortion: OpenCV's k1, k2, p1, p2, k3 of a pinhole, k1 to k4 of a fisheye.
    azimuth: of a view into a panorama, degrees to the right of its middle.
    """

    model: str
    w: int
    h: int
    fl_x: float = 0.0
    fl_y: float = 0.0
    cx: float = 0.0
    cy: float = 0.0
    coefficients: tuple[float, ...] = ()
    azimuth: float = 0.0


class Frame(NamedTuple):
    """One photograph.

    time: in the recording's unit.
    pose: (4, 4) float64, camera to world in OpenCV's axes (x right, y down, z forward), in the
        recording's unit of length; None where it is not known.
    lens: None where nothing is known of it.
    mask: a picture that is black where the photograph is not to be used, or None.
    """

    camera: str
    time: float
    photograph: Path
    pose: NDArray[np.float64] | None
    lens: Lens | None
    mask: Path | None = None


class Recording(NamedTuple):
    """What a format's files hold.

    file: the one that is named where something is wrong with the whole.
    frames: in no order; photographs that are listed and not there among them.
    metric: the unit of length is known to be the metre.
    up_known: the world's z is known to point up.
    notes: sentences about how it was read.
    guessed: cameras and times are taken from the photographs' names.
    spread: photographs of one instant are as far apart in time at most, in steps of one camera.
    points: (n, 3) float64, points that the poses were found with, in the same world.
    checked: the lenses' sizes are those that the photographs' own heads say.
    film: what all photographs are frames of, in the order of their times.
    places: (f, 3) float64, degrees north and east and metres above the sea of each frame, NaN where
        it is not known; one camera's.
    """

    file: Path
    frames: Sequence[Frame]
    metric: bool = False
    up_known: bool = False
    notes: tuple[str, ...] = ()
    guessed: bool = False
    spread: float = 0.25
    points: NDArray[np.float64] = np.empty((0, 3))
    checked: bool = False
    film: Film | None = None
    places: NDArray[np.float64] | None = None


def shown_number(value: float) -> str:
    """A number as short as it can be told from all others: 3, 3.2."""
    return repr(float(value)).removesuffix(".0")


def check_count(file: Path, count: int) -> None:
    """Raise BadInput for more photographs than can be read and checked in some seconds."""
    if count > MOST_FRAMES:
        raise BadInput(file, "number of frames", f"{count}", f"at most {MOST_FRAMES}")


def file_inside(file: Path, folder: Path, name: str, field: str) -> Path:
    """Where a name in a file leads from a folder: upwards never; what is written with backslashes
    is found, too. Raises BadInput for a name that leaves the folder or is none."""
    expected = "the path of a picture, from the folder"
    if not name or "\0" in name:
        raise BadInput(file, field, f'"{name}"', expected)
    root = Path(os.path.abspath(folder))
    found = Path(os.path.abspath(root / name))
    if "\\" in name and not os.path.exists(found):
        found = Path(os.path.abspath(root / name.replace("\\", "/")))
    if root not in found.parents:
        raise BadInput(file, field, f'"{name}"', "a path inside the folder")
    return found


def check_lens(file: Path, lens: Lens, field: Callable[[str], str], corner: float = 0.0) -> Lens:
    """The lens, if it can be one.

    ``field`` says what a value ("fl_x", "k1" …) is called in the file; ``corner`` is 0.5 where the
    file counts pixels from the first one's outer corner. Raises BadInput for a picture without a
    size, focal lengths of no camera, a principal point outside of the picture, coefficients out of
    any range; and for any that is not finite.
    """
    for key in ("w", "h"):
        side = getattr(lens, key)
        if not 1 <= side <= LARGEST_SIDE:
            expected = f"a whole number of pixels from 1 to {LARGEST_SIDE}"
            raise BadInput(file, field(key), shown_number(side), expected)
    if lens.model == PANORAMA:
        return lens
    for key in ("fl_x", "fl_y"):
        focal = getattr(lens, key)
        least, most = lens.w / _FOCAL_RANGE, lens.w * _FOCAL_RANGE
        if not focal > 0:
            raise BadInput(file, field(key), shown_number(focal), "more than 0 pixels")
        if not least <= focal <= most:
            expected = f"{least:g} to {most:g} pixels, for a picture {lens.w} wide"
            raise BadInput(file, field(key), shown_number(focal), expected)
    for key, side in (("cx", lens.w), ("cy", lens.h)):
        value = getattr(lens, key) + corner
        first = corner - 0.5
        if not first < value < side + first:
            expected = f"a place inside the picture, between {first:g} and {side + first:g} pixels"
            raise BadInput(file, field(key), shown_number(value), expected)
    keys = ("k1", "k2", "p1", "p2", "k3") if lens.model == PINHOLE else ("k1", "k2", "k3", "k4")
    for key, value in zip(keys, lens.coefficients, strict=False):
        if not abs(value) <= _LARGEST_COEFFICIENT:
            expected = f"a coefficient of at most {_LARGEST_COEFFICIENT:g}"
            raise BadInput(file, field(key), shown_number(value), expected)
    return lens


def pinhole_lens(k: NDArray[np.float64], width: int, height: int) -> Lens:
    """The lens of K (3, 3), the middle of the first pixel at (0, 0), without distortion."""
    focal, centre = (float(k[0, 0]), float(k[1, 1])), (float(k[0, 2]), float(k[1, 2]))
    return Lens(PINHOLE, width, height, *focal, *centre)


def counted(count: int, noun: str) -> str:
    """ "1 photograph", "2 photographs"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def listed(names: Sequence[str]) -> str:
    """Some names in a sentence, sorted."""
    more = f" and {len(names) - 8} more" if len(names) > 8 else ""
    return shortened(", ".join(sorted(names)[:8])) + more
