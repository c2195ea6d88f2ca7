"""Environments, such as a room around the cloth: equirectangular pictures of radiance.

What a file is, is decided by its first bytes. Radiance pictures and OpenEXR files are decoded
where BTFs and photographs are; their sizes are looked at here before a pixel is decoded.
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.opening import check_memory, first_bytes
from storage.readers.pictures.exr_files import exr_header, read_exr
from storage.readers.pictures.picture_sizes import LARGEST_PICTURE, MEMORY_PER_BYTE
from storage.readers.pictures.radiance_files import (
    SIGNATURE,
    RadianceHeader,
    radiance_header,
    radiance_pixels,
)
from storage.readers.pictures.radiance_values import mended

SMALLEST_WIDTH = 16
LARGEST_WIDTH = 16384

_EXPECTED = "a Radiance .hdr or an OpenEXR .exr file"
_EXR_SIGNATURE = b"\x76\x2f\x31\x01"
_HALF_SIGNATURE = b"32-bit_rle_"  # of a header without its first line
_EIGHT_BITS = "a Radiance .hdr or an OpenEXR .exr file: 8 bits hold no radiance of lamps or the sun"
_CONVERTED = "a Radiance .hdr or an OpenEXR .exr file: convert it, with oiiotool for instance"
_OTHER_SIGNATURES = {
    b"\x89PNG\r\n\x1a\n": ("PNG", _EIGHT_BITS),
    b"\xff\xd8\xff": ("JPEG", _EIGHT_BITS),
    b"GIF8": ("GIF", _EIGHT_BITS),
    b"BM": ("BMP", _EIGHT_BITS),
    b"RIFF": ("WebP", _EIGHT_BITS),
    b"II*\0": ("TIFF", _CONVERTED),
    b"MM\0*": ("TIFF", _CONVERTED),
    b"PF\n": ("PFM", _CONVERTED),
    b"PF ": ("PFM", _CONVERTED),
    b"8BPS": ("PSD", _CONVERTED),
    b"DDS ": ("DDS", _CONVERTED),
    b"\xabKTX": ("KTX", _CONVERTED),
    b"\xff\x0a": ("JPEG XL", _CONVERTED),
    b"version https://git-lfs": ("a pointer of Git LFS", "the file itself: run git lfs pull"),
    b"\0\0\0\x0cJXL ": ("JPEG XL", _CONVERTED),
}
_LONGEST_HEADER = 1_000_000  # bytes of a Radiance header; the usual ones have some hundred
_PIXEL_BYTES = 32  # while a picture is decoded and mended
_NEARLY = 0.01  # by which width may differ from twice the height


class EnvironmentFile(NamedTuple):
    """``radiance``: (height, width, 3) float32, width = 2 * height, the top row first: linear RGB
    with the primaries of sRGB, 0 and more, in the file's own unit. ``notes``: sentences on what was
    converted, mended or left out.
    """

    radiance: NDArray[np.float32]
    notes: tuple[str, ...]


def read_environment(path: str | PathLike[str]) -> EnvironmentFile:
    """Read an environment as equirectangular linear radiance.

    Parameters: ``path``, a Radiance picture (.hdr, RGBE or XYZE in all its codes; exposures are
    divided out) or an OpenEXR file (.exr, half or float; of several layers the beauty). Other
    primaries become sRGB's; grey gives three equal channels; alpha is left out. A cube's cross,
    and the column of faces that OpenEXR marks as a cube, are unfolded.

    Raises BadInput for a file that is missing, truncated, damaged, of another format (PNG, JPEG
    and TIFF hold no radiance) or projection, narrower than 16 pixels, mostly without numbers or
    negative, or all black.
    """
    file = Path(path)
    start = first_bytes(file, _LONGEST_HEADER, _EXPECTED, LARGEST_PICTURE)
    if start.startswith(SIGNATURE) or _HALF_SIGNATURE in start[:1000]:
        light, cube, notes = _radiance_picture(file, start)
    elif start.startswith(_EXR_SIGNATURE):
        light, cube, notes = _exr_picture(file)
    else:
        raise _no_radiance(file, start)
    light, size_notes = _equirectangular(file, light, cube)
    light, value_notes = mended(file, light)
    if light.shape[2] == 1:
        light = np.repeat(light, 3, axis=2)
    return EnvironmentFile(np.ascontiguousarray(light), (*notes, *size_notes, *value_notes))


def _no_radiance(file: Path, start: bytes) -> BadInput:
    for signature, (name, expected) in _OTHER_SIGNATURES.items():
        if start.startswith(signature):
            return BadInput(file, "format", name, expected)
    found = "unknown" if start else "unknown (the file is empty)"
    return BadInput(file, "format", found, _EXPECTED)


def _radiance_picture(
    file: Path, start: bytes
) -> tuple[NDArray[np.float32], bool, tuple[str, ...]]:
    try:
        header = radiance_header(file, start)
    except IndexError:
        raise BadInput(
            file, "content", "truncated or damaged", "a complete Radiance file"
        ) from None
    _check_size(file, header.width, header.height, cube=False)
    _check_memory(file, header)
    return radiance_pixels(file, file.read_bytes()), False, header.notes


def _exr_picture(file: Path) -> tuple[NDArray[Any], bool, tuple[str, ...]]:
    header = exr_header(file)
    _check_size(file, header.width, header.height, header.cube)
    picture = read_exr(file, header)
    if picture.alpha is None:
        return picture.colours, header.cube, picture.notes
    below = np.count_nonzero(~(picture.alpha >= 1))
    alpha = (f"Alpha, below 1 in {below} pixels, was left out.",) if below else ()
    return picture.colours, header.cube, (*picture.notes, *alpha)


def _check_size(file: Path, width: int, height: int, cube: bool) -> None:
    from storage.readers.pictures.cube_maps import is_cross

    found = f"{width} x {height} pixels"
    if cube:
        if height != 6 * width:
            raise BadInput(file, "size of a cube's faces", found, "a height of six widths")
    elif not is_cross(width, height) and abs(width - 2 * height) > max(1, _NEARLY * 2 * height):
        other = _other_way(width, height)
        raise BadInput(file, "size", found, f"a width of twice the height{other}")
    if (4 * width if cube else max(width, height)) < SMALLEST_WIDTH:
        raise BadInput(file, "size", found, f"a width of at least {SMALLEST_WIDTH} pixels")


def _other_way(width: int, height: int) -> str:
    """For what projections have such a size, what to do."""
    if width == height:
        return (
            ": unfold an angular map or a mirror ball first, with HDR Shop for instance, and crop "
            "a stereo pair to one eye"
        )
    if 6 in (width / max(height, 1), height / max(width, 1)):
        return ": convert a cube's faces first, with cmft for instance, as their order differs"
    if width > 2 * height:
        return ": fill up what is missing above or below, or crop a stereo pair to one eye"
    return ": an equirectangular picture all around"


def _check_memory(file: Path, header: RadianceHeader) -> None:
    found = f"{header.width} x {header.height} pixels"
    needed = _PIXEL_BYTES * header.width * header.height
    stored = file.stat().st_size - header.pixels_at
    check_memory(file, "size", found, needed, stored, MEMORY_PER_BYTE)


def _equirectangular(
    file: Path, light: NDArray[Any], cube: bool
) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Twice as wide as high, at most 16384 wide."""
    from storage.readers.pictures import cube_maps

    notes = []
    height, width = light.shape[:2]
    if cube:
        light = cube_maps.of_column(light)
        notes.append("The six faces of a cube were unfolded.")
    elif cube_maps.is_cross(width, height):
        unfolded = cube_maps.of_cross(light)
        if unfolded is None:
            found = f"{width} x {height} pixels with something in a cross's corners"
            raise BadInput(file, "size", found, "a width of twice the height, or a cube's cross")
        light = unfolded
        notes.append("The cross of a cube's faces was unfolded.")
    height, width = light.shape[:2]
    wanted = min(height, width // 2, LARGEST_WIDTH // 2)
    if (height, width) != (wanted, 2 * wanted):
        light = _averaged(light, wanted)
        notes.append(
            f"{width} x {height} pixels were averaged to {2 * wanted} x {wanted}, "
            f"for a width of twice the height and at most {LARGEST_WIDTH}."
        )
    return light, tuple(notes)


def _averaged(light: NDArray[Any], height: int) -> NDArray[np.float32]:
    import cv2

    smaller = cv2.resize(
        light.astype(np.float32), (2 * height, height), interpolation=cv2.INTER_AREA
    )
    return np.asarray(smaller, np.float32).reshape(height, 2 * height, light.shape[2])
