"""PNG files: 8 bits by Pillow, 16 bits by OpenCV, as Pillow cuts those down to 8.

OpenCV fills what is missing with grey and says nothing, so that Pillow sees first that the file is
complete. What the colours are is told by the first of the chunks `cICP`, `iCCP`, `sRGB` and `gAMA`
with `cHRM` (PNG, third edition, 4.3).
"""

from __future__ import annotations

import io
import math
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.pictures.code_points import CodePoints, in_srgb
from storage.readers.pictures.colour_spaces import SRGB
from storage.readers.pictures.decoded_image import Space, StoredPicture, by_code_points, damaged
from storage.readers.pictures.pillow_pictures import (
    animation_notes,
    as_alpha,
    load,
    orientation_of,
    stored_picture,
)
from storage.readers.pictures.srgb_curve import light_of_srgb

if TYPE_CHECKING:
    from PIL import Image

_END = b"IEND\xaeB`\x82"  # the last chunk's name and checksum, the same in every PNG
_SRGB_GAMMA = 0.45455


def read_png(file: Path) -> StoredPicture:
    """Read a PNG file as it is stored. Raises BadInput, and nearly anything for what is damaged."""
    from PIL import PngImagePlugin

    data, damage_notes = _without_damaged_extras(file, file.read_bytes())
    deep = data[24] == 16  # the header chunk's bit depth
    image = load(file, PngImagePlugin.PngImageFile, io.BytesIO(data), 8 if deep else 4)
    if _END not in data[-4096:] and _END not in data:
        raise damaged(file, "PNG")
    notes = (*damage_notes, *animation_notes(image))
    stored = _deep(file, data, image, notes) if deep else stored_picture(image, notes=notes)
    return _by_its_chunks(file, stored, data, image.info)


def _deep(file: Path, data: bytes, image: Image.Image, notes: tuple[str, ...]) -> StoredPicture:
    codes = _decode_with_opencv(file, data)
    alpha = None
    key = image.info.get("transparency")
    if codes.shape[2] == 4:
        alpha = as_alpha(codes[..., 3])
    elif key is not None:  # one colour that stands for a hole
        alpha = (codes != np.asarray(key, np.uint16)).any(axis=2).astype(np.float32)
    is_grey = data[25] in (0, 4)  # the header chunk's colour type
    colours = codes[..., : 1 if is_grey else 3]
    orientation, said = orientation_of(image)
    profile = image.info.get("icc_profile")
    space: Space = "grey" if is_grey else "RGB"
    return StoredPicture(colours, space, alpha, profile, orientation, (*notes, *said))


def _decode_with_opencv(file: Path, data: bytes) -> NDArray[Any]:
    """(height, width, channels), RGB(A) order, as stored."""
    import cv2

    values = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if values is None or values.dtype != np.uint16:
        raise damaged(file, "PNG")
    if values.ndim == 2:
        return values[..., None]
    return values[..., [2, 1, 0, 3][: values.shape[2]]]


def _by_its_chunks(file: Path, stored: StoredPicture, data: bytes, info: Any) -> StoredPicture:
    """Colours by the chunks that are no profile, as linear light where they say anything new."""
    cicp = _chunk(data, b"cICP")
    if cicp is not None:
        return by_code_points(file, stored, CodePoints(*cicp[:2]), is_full_range=cicp[3] == 1)
    gamma = info.get("gamma")
    if stored.profile or "srgb" in info or not gamma:
        return stored
    primaries = SRGB
    if "chromaticity" in info:  # white comes first
        primaries = (*info["chromaticity"][2:], *info["chromaticity"][:2])
    is_usual = math.isclose(gamma, _SRGB_GAMMA, rel_tol=0.02)
    if is_usual and np.allclose(primaries, SRGB, atol=2e-3):
        return stored
    full = np.iinfo(stored.values.dtype).max
    codes = np.arange(full + 1) / full
    light = (light_of_srgb(codes) if is_usual else codes ** (1 / gamma)).astype(np.float32)
    try:
        colours = np.minimum(in_srgb(light[stored.values], primaries), 1)
    except (ValueError, np.linalg.LinAlgError):
        raise BadInput(
            file, "cHRM chunk", f"{primaries}", "primaries that span colours, or none"
        ) from None
    note = f"The colours were converted to sRGB from the gamma {gamma:.5g}"
    if not np.allclose(primaries, SRGB, atol=2e-3):
        note += " and the primaries in the file"
    return stored._replace(values=colours, notes=(*stored.notes, f"{note}."))


def _without_damaged_extras(file: Path, data: bytes) -> tuple[bytes, tuple[str, ...]]:
    """The file without chunks that pixels do not need and whose checksums are wrong; libpng leaves
    them out, too, and Pillow would refuse the file. Raises BadInput for a chunk that goes on behind
    the file's end: OpenCV takes the memory that one announces."""
    kept, at, names = [data[:8]], 8, []
    while at + 12 <= len(data):
        end = at + 12 + int.from_bytes(data[at : at + 4], "big")
        if end > len(data):
            raise damaged(file, "PNG")
        if data[at + 4 : at + 8] == b"IEND":
            break
        is_extra = bool(data[at + 4] & 0x20)
        checksum = int.from_bytes(data[end - 4 : end], "big")
        if is_extra and zlib.crc32(data[at + 4 : end - 4]) != checksum:
            names.append(data[at + 4 : at + 8].decode("latin-1"))
        else:
            kept.append(data[at:end])
        at = end
    if not names:
        return data, ()
    note = f"Chunks with a wrong checksum were left out: {', '.join(names[:8])}."
    return b"".join([*kept, data[at:]]), (note,)


def _chunk(data: bytes, name: bytes) -> bytes | None:
    """What the first chunk of a name before the pixels holds."""
    at = 8
    while at + 8 <= len(data) and data[at + 4 : at + 8] != b"IDAT":
        length = int.from_bytes(data[at : at + 4], "big")
        if data[at + 4 : at + 8] == name:
            return data[at + 8 : at + 8 + length]
        at += length + 12
    return None
