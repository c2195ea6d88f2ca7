"""The photographs that the built-in street is papered with: those in scikit-image's wheel."""

from __future__ import annotations

from importlib.resources import as_file, files

import numpy as np
from numpy.typing import NDArray

from storage.readers.image_decoding import decode_image

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
    for name in _NAMES:
        with as_file(folder / f"{name}.png") as file:
            colours = decode_image(file).colours
        photographs[name] = np.repeat(colours, 3, axis=2) if colours.shape[2] == 1 else colours
    with as_file(folder / "rocket.jpg") as file:
        photographs["rocket"] = decode_image(file).colours
    return photographs
