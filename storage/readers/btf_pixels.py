"""One photograph of a BTF database to linear RGB.

OpenCV decodes JPEG and PNG (a little faster than Pillow, without holding Python's lock), after the
file's end has been seen: OpenCV before 5 fills what is missing and says nothing. 8-bit codes go
through a table of 256 values. Orientation tags are not followed: these photographs are rectified.
"""

from __future__ import annotations

import io
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.btf_headers import Header
from storage.readers.btf_measured import Crop
from storage.readers.radiance_files import radiance_pixels

_RGB_OF_XYZ = np.array(
    [
        [3.2409699419045226, -1.5373831775700940, -0.4986107602930034],
        [-0.9692436362808796, 1.8759675015077202, 0.0415550574071756],
        [0.0556300796969937, -0.2039769588889765, 1.0569715142428786],
    ]
)
"""The inverse of IEC 61966-2-1's matrix at full precision: from its primaries and D65 white."""


def colour_of(header: Header) -> str:
    """How the values of such files become linear RGB, in one line."""
    if header.format == "EXR":
        depth = "half float" if header.pixels.startswith("half") else "32-bit float"
        if header.pixels.endswith("XYZ"):
            return f"{depth} CIE XYZ (D65) converted to linear sRGB"
        return f"{depth} linear RGB as stored"
    if header.format == "HDR":
        return "Radiance RGBE, exposure divided out, taken as linear sRGB"
    return "8-bit sRGB decoded to linear RGB"


def linear_light_into(
    light: NDArray[np.float32], file: Path, data: bytes, header: Header, crop: Crop
) -> None:
    """Decode a photograph's file into (crop height, crop width, 3) float32 linear RGB.

    Raises BadInput where the content is truncated, damaged or not what the header said, and where
    a float is not finite or a CIE XYZ value is negative.
    """
    if header.format in ("JPEG", "PNG"):
        _eight_bits_into(light, file, data, header, crop)
        return
    if header.format == "HDR":
        colours = _same_size(file, radiance_pixels(file, data), header)[crop.box]
        _check(file, colours, np.isfinite(colours), "a finite value", crop)
        light[:] = colours
        return
    colours = _same_size(file, _exr_pixels(file, data, header), header)[crop.box]
    _check(file, colours, np.isfinite(colours), "a finite value", crop)
    if header.pixels.endswith("XYZ"):
        _check(file, colours, colours >= 0, "0 or more", crop)
        light[:] = colours @ _RGB_OF_XYZ.T
    else:
        light[:] = colours


def _eight_bits_into(
    light: NDArray[np.float32], file: Path, data: bytes, header: Header, crop: Crop
) -> None:
    import cv2

    complete = _complete_png if header.format == "PNG" else _complete_jpeg
    if not complete(data):
        raise _damaged(file, header)
    try:
        codes = cv2.imdecode(
            np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION
        )
    except cv2.error:
        codes = None
    if codes is None or codes.dtype != np.uint8:
        raise _damaged(file, header)
    cv2.LUT(_same_size(file, codes, header)[crop.box], _SRGB_CURVE, light)


def _srgb_curve() -> NDArray[np.float32]:
    """Linear light of the 256 codes (IEC 61966-2-1, 5.2)."""
    encoded = np.arange(256) / 255
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return linear.astype(np.float32)


_SRGB_CURVE = _srgb_curve()


def _complete_jpeg(data: bytes) -> bool:
    """Ends in the end marker, padding aside; what ends otherwise is Pillow's to judge."""
    if data.rstrip(b"\0\r\n ").endswith(b"\xff\xd9"):
        return True
    from PIL import JpegImagePlugin

    try:
        JpegImagePlugin.JpegImageFile(io.BytesIO(data)).load()
    except Exception:  # decoders of damaged data raise nearly anything
        return False
    return True


def _complete_png(data: bytes) -> bool:
    """Every chunk up to the last one is there and has its checksum."""
    at = 8
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        end = at + 8 + length
        if end + 4 > len(data):
            return False
        if zlib.crc32(data[at + 4 : end]) != int.from_bytes(data[end : end + 4], "big"):
            return False
        if data[at + 4 : at + 8] == b"IEND":
            return True
        at = end + 4
    return False


def _exr_pixels(file: Path, data: bytes, header: Header) -> NDArray[Any]:
    """(y, x, 3) half or float, in the order of the header's planes."""
    import OpenEXR

    try:
        with OpenEXR.File(io.BytesIO(data), separate_channels=True, num_threads=0) as exr:
            channels = exr.channels()
            planes = [channels[name].pixels for name in header.planes]
        return np.stack(planes, axis=-1)
    except Exception as error:  # RuntimeError, ValueError and others by what is broken
        raise _damaged(file, header) from error


def _same_size(file: Path, pixels: NDArray[Any], header: Header) -> NDArray[Any]:
    if pixels.shape != (header.height, header.width, 3):
        raise _damaged(file, header)
    return pixels


def _check(
    file: Path, colours: NDArray[Any], good: NDArray[np.bool_], expected: str, crop: Crop
) -> None:
    if good.all():
        return
    row, column, channel = np.argwhere(~good)[0]
    raise BadInput(
        file,
        f"pixel value at column {crop.left + column}, row {crop.top + row}",
        f"{colours[row, column, channel]}",
        expected,
    )


def _damaged(file: Path, header: Header) -> BadInput:
    return BadInput(file, "content", "truncated or damaged", f"a complete {header.format} file")
