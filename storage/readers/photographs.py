"""Photographs, such as one of fur, to linear RGB."""

from __future__ import annotations

from importlib.resources import as_file, files
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.image_decoding import DecodedImage, decode_image

SMALLEST_SIDE = 64


class BuiltinPhotograph(NamedTuple):
    """A photograph in scikit-image's wheel, the crop that is used, and what it shows."""

    file: str
    crop: tuple[int, int, int, int]
    description: str


BUILTIN_PHOTOGRAPHS = {
    "grass": BuiltinPhotograph(
        "grass.png", (0, 0, 512, 512), "Short grass and clover, grey (linolafett, CC0)"
    ),
    "chelsea": BuiltinPhotograph(
        "chelsea.png", (88, 14, 112, 64), "A tabby cat's forehead (Stefan van der Walt, CC0)"
    ),
    "chelsea_cheek": BuiltinPhotograph(
        "chelsea.png", (143, 151, 64, 64), "The same cat's cheek (Stefan van der Walt, CC0)"
    ),
}


def read_photograph(
    path: str | PathLike[str], crop: tuple[int, int, int, int] | None = None
) -> NDArray[np.float32]:
    """Read a photograph as linear light.

    Parameters: ``path``, a PNG, JPEG or TIFF file (8 or 16 bit integers, or a float TIFF) or an
    OpenEXR file (half or float), grey or RGB, alpha only where it is opaque; ``crop``, in
    pixels of the upright picture: left, top, width, height.

    Returns (height, width, 3) float32, the top row first: linear RGB with the primaries of
    sRGB, in [0, 1] for integer files (IEC 61966-2-1), 0 and more for floats. Grey files give
    three equal channels.

    Raises BadInput for a file that is missing, truncated, of another format or colour space,
    smaller than 64 pixels on a side or larger than 400 megapixels, and for a picture (inside
    the crop) with transparent pixels, with values that are negative or not finite, all black,
    or all of one colour. Of a TIFF with several pages the first is read.
    """
    file = Path(path)
    image = _cropped(file, decode_image(file), crop)
    if image.opaque is not None and not image.opaque.all():
        holes = image.opaque.size - np.count_nonzero(image.opaque)
        raise BadInput(file, "alpha", f"less than opaque in {holes} pixel(s)", "an opaque picture")
    light = _linear_light(image.colours)
    _check_content(file, light)
    return np.ascontiguousarray(np.broadcast_to(light, (*light.shape[:2], 3)))


def builtin_photograph(name: str) -> NDArray[np.float32]:
    """One of ``BUILTIN_PHOTOGRAPHS``, read as by :func:`read_photograph`.

    Raises BadInput for an unknown name.
    """
    if name not in BUILTIN_PHOTOGRAPHS:
        raise BadInput(name, "built-in photograph", "unknown", ", ".join(BUILTIN_PHOTOGRAPHS))
    photograph = BUILTIN_PHOTOGRAPHS[name]
    with as_file(files("skimage") / "data" / photograph.file) as file:
        return read_photograph(file, photograph.crop)


def _cropped(
    file: Path, image: DecodedImage, crop: tuple[int, int, int, int] | None
) -> DecodedImage:
    height, width = image.colours.shape[:2]
    _check_sides(file, "", width, height)
    if crop is None:
        return image
    left, top, crop_width, crop_height = crop
    inside = left >= 0 and top >= 0 and left + crop_width <= width and top + crop_height <= height
    if not inside:
        raise BadInput(
            file,
            "crop",
            f"left {left}, top {top}, {crop_width} x {crop_height} pixels",
            f"a box inside the picture's {width} x {height} pixels",
        )
    _check_sides(file, "crop's ", crop_width, crop_height)
    box = np.s_[top : top + crop_height, left : left + crop_width]
    return DecodedImage(image.colours[box], None if image.opaque is None else image.opaque[box])


def _check_sides(file: Path, whose: str, width: int, height: int) -> None:
    for side, pixels in (("width", width), ("height", height)):
        if pixels < SMALLEST_SIDE:
            unit = "pixel" if pixels == 1 else "pixels"
            raise BadInput(
                file, whose + side, f"{pixels} {unit}", f"at least {SMALLEST_SIDE} pixels"
            )


def _linear_light(colours: NDArray[Any]) -> NDArray[np.float32]:
    if colours.dtype.kind == "f":
        with np.errstate(over="ignore"):  # a double beyond float32 becomes inf and is refused
            return colours.astype(np.float32)
    codes = np.arange(np.iinfo(colours.dtype).max + 1)
    light: NDArray[np.float32] = _light_of_srgb(codes / codes[-1]).astype(np.float32)[colours]
    return light


def _light_of_srgb(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    """Linear light in [0, 1] of sRGB values in [0, 1] (IEC 61966-2-1, 5.2)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def _check_content(file: Path, light: NDArray[np.float32]) -> None:
    for field, good, expected in (
        ("pixel value", np.isfinite(light), "finite values"),
        ("pixel value", light >= 0, "0 or more"),
    ):
        if not good.all():
            row, column, channel = np.argwhere(~good)[0]
            value = light[row, column, channel]
            raise BadInput(file, f"{field} at column {column}, row {row}", f"{value}", expected)
    if light.max() == 0:
        raise BadInput(file, "picture", "all black", "a picture with light and dark pixels")
    if (light == light[0, 0]).all():
        raise BadInput(file, "picture", "all of one colour", "a picture with light and dark pixels")
