"""Environments, such as a room around the cloth: equirectangular pictures of radiance.

What a file is, is decided by its first bytes. Radiance pictures and OpenEXR files are decoded
where BTFs and photographs are; their sizes are looked at here before a pixel is decoded.
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.image_decoding import decode_image
from storage.readers.opening import check_memory, first_bytes
from storage.readers.picture_sizes import LARGEST_PICTURE, MEMORY_PER_BYTE
from storage.readers.radiance_files import (
    SIGNATURE,
    RadianceHeader,
    radiance_header,
    radiance_pixels,
)

SMALLEST_WIDTH = 16
LARGEST_WIDTH = 16384

_EXPECTED = "a Radiance .hdr or an OpenEXR .exr file"
_EXR_SIGNATURE = b"\x76\x2f\x31\x01"
_OTHER_SIGNATURES = {
    b"\x89PNG\r\n\x1a\n": "PNG",
    b"\xff\xd8\xff": "JPEG",
    b"II*\0": "TIFF",
    b"MM\0*": "TIFF",
}
_LONGEST_HEADER = 1_000_000  # bytes of a Radiance header; the usual ones have some hundred
_LONGEST_RUN = 127  # of a Radiance picture
_PIXEL_BYTES = 40
_CHANNELS = {1: ("grey",), 3: ("red", "green", "blue")}


def read_environment(path: str | PathLike[str]) -> NDArray[np.float32]:
    """Read an equirectangular environment as linear radiance.

    Parameters: ``path``, a Radiance picture (.hdr, RGBE, flat or run-length encoded; exposures
    are divided out) or an OpenEXR file (.exr, half or float, RGB or Y alone, with the primaries
    of sRGB). An alpha channel is passed over where it is 1 everywhere. Of an EXR with several
    parts the first is read.

    Returns (height, width, 3) float32 with width = 2 * height, the top row first: linear RGB
    with the primaries of sRGB, 0 and more, in the file's own unit. Grey files give three equal
    channels.

    Raises BadInput for a file that is missing, truncated, damaged, of another format (PNG, JPEG
    and TIFF hold no radiance) or colour space; for a width that is not exactly twice the height,
    is below 16 or above 16384 pixels; for an EXR that holds a part of its picture only; and for
    transparent pixels, values that are not finite or negative (naming the first by column and
    row, from 0 at the top left) and a picture that is all black.
    """
    file = Path(path)
    start = first_bytes(file, _LONGEST_HEADER, _EXPECTED, LARGEST_PICTURE)
    if start.startswith(SIGNATURE):
        light = _radiance_picture(file, start)
    elif start.startswith(_EXR_SIGNATURE):
        light = _exr_picture(file)
    else:
        raise _no_radiance(file, start)
    _check_radiance(file, light)
    if light.shape[2] == 1:
        light = np.repeat(light, 3, axis=2)
    return np.ascontiguousarray(light)


def _no_radiance(file: Path, start: bytes) -> BadInput:
    for signature, name in _OTHER_SIGNATURES.items():
        if start.startswith(signature):
            return BadInput(file, "format", name, f"{_EXPECTED}, as radiance needs one of them")
    found = "unknown" if start else "unknown (the file is empty)"
    return BadInput(file, "format", found, _EXPECTED)


def _radiance_picture(file: Path, start: bytes) -> NDArray[np.float32]:
    try:
        header = radiance_header(file, start)
    except IndexError:
        raise _damaged(file, "Radiance") from None
    _check_size(file, header.width, header.height)
    _check_memory(file, header)
    return radiance_pixels(file, file.read_bytes())


def _exr_picture(file: Path) -> NDArray[np.float32]:
    import OpenEXR

    try:
        with OpenEXR.File(str(file), header_only=True) as header_file:
            header = header_file.parts[0].header
            # Copied: closing the file empties the header. Each is left, top, right, bottom.
            stored = np.array(header["dataWindow"], np.int64).ravel()
            whole = np.array(header["displayWindow"], np.int64).ravel()
    except Exception as error:  # RuntimeError, ValueError and others by what is broken
        raise _damaged(file, "EXR") from error
    if not np.array_equal(stored, whole):
        # Pixels outside the data window would have to be black, which no room is.
        raise BadInput(
            file,
            "data window",
            " ".join(map(str, stored)),
            f"the display window, {' '.join(map(str, whole))}",
        )
    _check_size(file, int(whole[2] - whole[0] + 1), int(whole[3] - whole[1] + 1))
    image = decode_image(file)
    if image.opaque is not None and not image.opaque.all():
        holes = image.opaque.size - np.count_nonzero(image.opaque)
        raise BadInput(file, "alpha", f"less than opaque in {holes} pixel(s)", "an opaque picture")
    return image.colours.astype(np.float32)


def _check_size(file: Path, width: int, height: int) -> None:
    found = f"{width} x {height} pixels"
    if width != 2 * height:
        raise BadInput(file, "size", found, "a width of exactly twice the height")
    if width < SMALLEST_WIDTH:
        smallest = f"at least {SMALLEST_WIDTH} x {SMALLEST_WIDTH // 2} pixels"
        raise BadInput(file, "size", found, smallest)
    if width > LARGEST_WIDTH:
        largest = f"at most {LARGEST_WIDTH} x {LARGEST_WIDTH // 2} pixels"
        raise BadInput(file, "size", found, largest)


def _check_memory(file: Path, header: RadianceHeader) -> None:
    pixels = header.width * header.height
    stored = file.stat().st_size - header.pixels_at
    if _LONGEST_RUN * stored < 2 * 4 * pixels:  # two bytes a run of one of four channels
        raise _damaged(file, "Radiance")
    found = f"{header.width} x {header.height} pixels"
    check_memory(file, "size", found, _PIXEL_BYTES * pixels, stored, MEMORY_PER_BYTE)


def _check_radiance(file: Path, light: NDArray[np.float32]) -> None:
    """A negative zero passes: it is 0."""
    for good, expected in ((np.isfinite(light), "a finite value"), (light >= 0, "0 or more")):
        if not good.all():
            row, column, channel = np.unravel_index(int(np.argmin(good)), good.shape)
            name = _CHANNELS[light.shape[2]][channel]
            value = f"{light[row, column, channel]}"
            raise BadInput(file, f"{name} at column {column}, row {row}", value, expected)
    if light.max() == 0:
        raise BadInput(file, "picture", "all black", "an environment with light in it")


def _damaged(file: Path, kind: str) -> BadInput:
    return BadInput(file, "content", "truncated or damaged", f"a complete {kind} file")
