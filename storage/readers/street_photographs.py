"""Photographs in scikit-image's wheel: what the built-in street is papered with; a stereo pair."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.pictures.image_decoding import decode_image
from storage.readers.pictures.srgb_curve import srgb_of_light

_NAMES = (
    "astronaut",
    "brick",
    "camera",
    "chelsea",
    "coffee",
    "coins",
    "grass",
    "gravel",
    "moon",
    "motorcycle_left",
    "page",
)


def street_photographs() -> dict[str, NDArray[np.uint8]]:
    """Photographs by name, (height, width, 3) uint8 sRGB, row 0 at the top; grey ones thrice.

    Nothing is downloaded: the files come with scikit-image. Raises BadInput for one that is missing
    or broken.
    """
    folder = files("skimage") / "data"
    photographs = {}
    for file_name in (*(f"{name}.png" for name in _NAMES), "rocket.jpg"):
        with as_file(folder / file_name) as file:
            codes = _codes(file)
        three = np.repeat(codes, 3, axis=2) if codes.shape[2] == 1 else codes
        photographs[file.stem] = three
    return photographs


def _codes(file: Path) -> NDArray[np.uint8]:
    """(height, width, 1 or 3) uint8 codes of sRGB, whatever profile or gamma the file has."""
    colours = decode_image(file).colours
    if colours.dtype == np.uint8:
        return colours
    return np.rint(255 * srgb_of_light(colours)).astype(np.uint8)


class StereoPair(NamedTuple):
    """A rectified pair with what is known of it."""

    left: NDArray[np.uint8]
    """(y, x, 3), sRGB."""
    right: NDArray[np.uint8]
    disparity: NDArray[np.float32]
    """(y, x), pixels, of the left picture; not finite where it was not measured."""
    most: int
    """No disparity is larger."""


def motorcycle() -> StereoPair:
    """A real calibrated pair (Scharstein and others 2014), as scikit-image brings it."""
    folder = files("skimage") / "data"
    pictures = []
    for side in ("left", "right"):
        with as_file(folder / f"motorcycle_{side}.png") as file:
            pictures.append(decode_image(file).colours)
    with as_file(folder / "motorcycle_disp.npz") as file, np.load(file) as stored:
        disparity = stored["arr_0"].astype(np.float32)
    return StereoPair(pictures[0], pictures[1], disparity, 80)
