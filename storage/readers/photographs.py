"""Photographs, such as one of fur, to linear RGB."""

from __future__ import annotations

from importlib.resources import as_file, files
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.pictures.decoded_image import DecodedImage
from storage.readers.pictures.image_decoding import decode_image
from storage.readers.pictures.srgb_curve import light_of_srgb

SMALLEST_SIDE = 64
SUFFIXES = (
    *(".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".webp", ".avif", ".bmp", ".gif"),
    *(".jp2", ".jpe", ".jfif"),
)
"""Of the files that are read, lower case."""
_LEAST_OPAQUE = 0.01  # of the pixels
_MOST_BROKEN = 0.001  # of the pixels
_MOST_NEGATIVE = 0.01  # of all light
_HALF_MOST = 65504  # the largest number of a half float


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
    "cat": BuiltinPhotograph(
        "chelsea.png", (0, 0, 451, 300), "The whole picture of that cat (Stefan van der Walt, CC0)"
    ),
    "chelsea_cheek": BuiltinPhotograph(
        "chelsea.png", (143, 151, 64, 64), "The same cat's cheek (Stefan van der Walt, CC0)"
    ),
}


class PhotographFile(NamedTuple):
    """A photograph as linear light.

    radiance: (height, width, 3) float32, the top row first, linear RGB with the primaries of sRGB:
    in [0, 1] for integer files (IEC 61966-2-1), 0 and more for floats and HDR; 0 where it is
    transparent.
    opaque: (height, width) bool, or None for a photograph without transparent pixels.
    notes: sentences on what was converted, mended or left out.
    """

    radiance: NDArray[np.float32]
    opaque: NDArray[np.bool_] | None
    notes: tuple[str, ...]


def read_photograph(
    path: str | PathLike[str], crop: tuple[int, int, int, int] | None = None
) -> PhotographFile:
    """Read a photograph as linear light.

    Parameters: ``path``, a PNG, JPEG, TIFF, WebP, AVIF, BMP, GIF, JPEG 2000 or OpenEXR file, grey,
    RGB, CMYK or L*a*b*, with any ICC profile, integers as codes and floats as linear light;
    ``crop``, in pixels of the upright picture: left, top, width, height.

    Grey files give three equal channels. Pixels with less than half an alpha are transparent. Of a
    file with several pictures the first is read. Negative values become 0, and single ones that are
    no number what is around them.

    Raises BadInput for a file that is missing, truncated, of another format or colour space,
    smaller than 64 pixels on a side or larger than 400 megapixels, and for a picture (inside
    the crop) that is transparent, all black or all of one colour, or with many values that are
    negative or no numbers.
    """
    file = Path(path)
    image = _cropped(file, decode_image(file), crop)
    opaque, alpha_notes = _opaque(file, image.alpha)
    light, light_notes = _mended(file, _linear_light(image.colours), opaque)
    _check_content(file, light if opaque is None else light[opaque][None])
    whole = np.ascontiguousarray(np.broadcast_to(light, (*light.shape[:2], 3)))
    return PhotographFile(whole, opaque, (*image.notes, *alpha_notes, *light_notes))


def builtin_photograph(name: str) -> PhotographFile:
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
    alpha = None if image.alpha is None else image.alpha[box]
    return image._replace(colours=image.colours[box], alpha=alpha)


def _check_sides(file: Path, whose: str, width: int, height: int) -> None:
    for side, pixels in (("width", width), ("height", height)):
        if pixels < SMALLEST_SIDE:
            unit = "pixel" if pixels == 1 else "pixels"
            raise BadInput(
                file, whose + side, f"{pixels} {unit}", f"at least {SMALLEST_SIDE} pixels"
            )


def _opaque(
    file: Path, alpha: NDArray[np.float32] | None
) -> tuple[NDArray[np.bool_] | None, tuple[str, ...]]:
    """Where the picture is opaque, None for everywhere, and what is to be said of it."""
    if alpha is None or (alpha == 1).all():
        return None, ()
    opaque = alpha >= 0.5
    share = float(opaque.mean())
    if share < _LEAST_OPAQUE:
        raise BadInput(
            file,
            "alpha",
            f"transparent in {_percent(1 - share)} of the pixels",
            f"at least {_percent(_LEAST_OPAQUE)} of opaque ones; save it without its alpha channel",
        )
    notes = []
    if share < 1:
        notes.append(f"{_percent(1 - share)} of the pixels are transparent and were left out.")
    partly = float(((alpha > 0) & (alpha < 1)).mean())
    if partly > 0:
        notes.append(
            f"{_percent(partly)} of the pixels are partly transparent: "
            "with half an alpha and more they were taken as opaque."
        )
    return (opaque if share < 1 else None), tuple(notes)


def _percent(share: float) -> str:
    """A share in words.

    >>> _percent(0.078), _percent(1e-6), _percent(0.9999)
    ('7.8 %', 'less than 0.1 %', 'more than 99.9 %')
    """
    if share < 0.001:
        return "less than 0.1 %"
    return "more than 99.9 %" if 0.999 < share < 1 else f"{100 * share:.3g} %"


def _linear_light(colours: NDArray[Any]) -> NDArray[np.float32]:
    if colours.dtype.kind == "f":
        with np.errstate(over="ignore", invalid="ignore"):  # a double becomes infinite
            return colours.astype(np.float32)
    codes = np.arange(np.iinfo(colours.dtype).max + 1)
    light: NDArray[np.float32] = light_of_srgb(codes / codes[-1]).astype(np.float32)[colours]
    return light


def _mended(
    file: Path, light: NDArray[np.float32], opaque: NDArray[np.bool_] | None
) -> tuple[NDArray[np.float32], tuple[str, ...]]:
    """Light without negatives, infinities and what is no number; 0 where it is transparent."""
    if opaque is not None:
        light = np.where(opaque[..., None], light, 0)
    notes = []
    broken = ~np.isfinite(light)
    if broken.any():
        _check_count(file, "not finite", _in_any_channel(broken))
        infinite = light == np.inf
        light = np.where(infinite, np.float32(_HALF_MOST), light)
        if infinite.any():
            count = _pixels(_in_any_channel(infinite))
            notes.append(f"{count} infinitely bright and became {_HALF_MOST}.")
        unknown = _in_any_channel(~np.isfinite(light))
        if unknown.any():
            light = light[_nearest(unknown)]
            notes.append(f"{_pixels(unknown)} no number and became like the nearest one.")
    negative = light < 0
    if negative.any():
        amount = np.abs(light, dtype=np.float64)
        if amount[negative].sum() > _MOST_NEGATIVE * amount.sum():
            raise BadInput(
                file,
                "light",
                f"negative in {_percent(float(negative.any(axis=2).mean()))} of the pixels",
                "0 and more; save a photograph, not a difference or a depth map",
            )
        light = np.maximum(light, 0)
        notes.append(f"{_pixels(_in_any_channel(negative))} negative and became 0.")
    return light, tuple(notes)


def _check_count(file: Path, what: str, pixels: NDArray[np.bool_]) -> None:
    if pixels.mean() > _MOST_BROKEN:
        row, column = np.argwhere(pixels)[0]
        raise BadInput(
            file,
            f"light in {_percent(float(pixels.mean()))} of the pixels",
            f"{what}, first at column {column}, row {row}",
            f"at most {_percent(_MOST_BROKEN)} of such pixels, which are mended; save it anew",
        )


def _nearest(unknown: NDArray[np.bool_]) -> tuple[NDArray[np.intp], ...]:
    """Row and column of the nearest known pixel of each."""
    from scipy.ndimage import distance_transform_edt

    return tuple(distance_transform_edt(unknown, return_distances=False, return_indices=True))


def _in_any_channel(values: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return np.logical_or.reduce(values, axis=2)


def _pixels(where: NDArray[np.bool_]) -> str:
    count = np.count_nonzero(where)
    return "1 pixel was" if count == 1 else f"{count} pixels were"


def _check_content(file: Path, light: NDArray[np.float32]) -> None:
    expected = "a picture with light and dark pixels; check what was saved"
    if light.max() == 0:
        raise BadInput(file, "picture", "all black", expected)
    if (light == light[0, 0]).all():
        raise BadInput(file, "picture", "all of one colour", expected)
