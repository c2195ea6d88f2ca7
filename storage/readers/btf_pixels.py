"""One photograph of a BTF database to linear RGB.

OpenCV decodes JPEG and PNG (a little faster than Pillow, without holding Python's lock), after the
file's end has been seen: OpenCV before 5 fills what is missing and says nothing. Codes go through a
table. Orientation tags are not followed: these photographs are rectified.
"""

from __future__ import annotations

import functools
import io
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.btf_headers import Header
from storage.readers.btf_measured import Crop
from storage.readers.pictures.colour_profiles import without_profile
from storage.readers.pictures.colour_spaces import ColourSpace
from storage.readers.pictures.radiance_files import radiance_pixels
from storage.readers.pictures.srgb_curve import light_of_srgb


def colour_of(header: Header, space: ColourSpace) -> str:
    """How the values of such files become linear RGB, in one line."""
    if header.format == "HDR":
        return "Radiance RGBE, exposure divided out, taken as linear sRGB"
    if header.format != "EXR":
        bits = "16-bit" if header.pixels.startswith("16") else "8-bit"
        return f"{bits} sRGB decoded to linear RGB"
    depth = "half float" if header.pixels.startswith("half") else "32-bit float"
    if space.to_srgb is None:
        return f"{depth} linear RGB as stored"
    name = "CIE XYZ (D65)" if space.name == "CIE XYZ" else space.name
    return f"{depth} {name} converted to linear sRGB"


def linear_light(
    file: Path, data: bytes, header: Header, space: ColourSpace, crop: Crop
) -> tuple[NDArray[np.floating], tuple[str, ...]]:
    """Decode a photograph's file into (crop height, crop width, 3) linear RGB, and what is to be
    said.

    Raises BadInput where the content is truncated, damaged or not what the header said, and where
    pixels are transparent.
    """
    if header.format == "HDR":
        return _same_size(file, radiance_pixels(file, data), header)[crop.box], ()
    if header.format == "EXR":
        colours = exr_pixels(file, data, header)[crop.box]
        with np.errstate(over="ignore", invalid="ignore"):
            return space.converted(colours), ()
    return _light_of_codes(file, data, header, crop)


def exr_pixels(file: Path, data: bytes, header: Header) -> NDArray[Any]:
    """(height, width, 3) half or float, in the order of the header's planes."""
    import OpenEXR

    try:
        with OpenEXR.File(io.BytesIO(data), separate_channels=True, num_threads=0) as exr:
            channels = exr.channels()
            planes = [channels[name].pixels for name in header.planes]
        pixels = np.stack(planes, axis=-1)
    except Exception as error:  # RuntimeError, ValueError and others by what is broken
        raise _damaged(file, header) from error
    return _same_size(file, pixels, header)


def _light_of_codes(
    file: Path, data: bytes, header: Header, crop: Crop
) -> tuple[NDArray[np.floating], tuple[str, ...]]:
    import cv2

    complete = _complete_png if header.format == "PNG" else _complete_jpeg
    if not complete(data):
        raise _damaged(file, header)
    flags = cv2.IMREAD_COLOR_RGB | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION
    if header.has_alpha:
        flags = cv2.IMREAD_UNCHANGED
    try:
        codes = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except cv2.error:
        codes = None
    if codes is None or codes.dtype not in (np.uint8, np.uint16):
        raise _damaged(file, header)
    if header.has_alpha:
        codes = _opaque(file, codes, crop)
    codes = _same_size(file, codes, header)[crop.box]
    if header.has_profile:
        light, notes = without_profile(codes, _profile(file, data, header))
        if light.dtype == np.float32:
            return light, notes
        return _table(codes.dtype)[codes], notes
    if codes.dtype == np.uint8:
        return np.asarray(cv2.LUT(codes, _table(codes.dtype)), np.float32), ()
    return _table(codes.dtype)[codes], ()


def _opaque(file: Path, codes: NDArray[Any], crop: Crop) -> NDArray[Any]:
    """RGB of OpenCV's grey or BGR, with alpha or where it has dropped one that is opaque."""
    if codes.ndim == 2:
        codes = codes[..., None]
    channels = codes.shape[2]
    clear = float((codes[crop.box][..., -1] < np.iinfo(codes.dtype).max).mean())
    if channels in (2, 4) and clear > 0:
        raise BadInput(
            file,
            "alpha channel",
            f"not opaque at {clear:.1%} of the pixels",
            "opaque photographs: crop them, or save them without alpha",
        )
    if channels <= 2:
        return np.repeat(codes[..., :1], 3, axis=2)
    return np.ascontiguousarray(codes[..., 2::-1])


@functools.cache
def _table(dtype: np.dtype[Any]) -> NDArray[np.float32]:
    """Linear light of all codes (IEC 61966-2-1, 5.2)."""
    most = int(np.iinfo(dtype).max)
    return light_of_srgb(np.arange(most + 1) / most).astype(np.float32)


def _profile(file: Path, data: bytes, header: Header) -> bytes | None:
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data)) as image:
            found = image.info.get("icc_profile")
    except Exception as error:  # decoders of damaged data raise nearly anything
        raise _damaged(file, header) from error
    return found if isinstance(found, bytes) else None


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


def _same_size(file: Path, pixels: NDArray[Any], header: Header) -> NDArray[Any]:
    if pixels.shape != (header.height, header.width, 3):
        raise _damaged(file, header)
    return pixels


def _damaged(file: Path, header: Header) -> BadInput:
    return BadInput(file, "content", "truncated or damaged", f"a complete {header.format} file")
