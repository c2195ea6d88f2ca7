"""JPEG 2000 files: 8 bits by Pillow, deeper ones by OpenJPEG itself, as Pillow cuts those down."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import numpy as np

from storage.readers.bad_input import BadInput
from storage.readers.pictures.decoded_image import StoredPicture
from storage.readers.pictures.picture_sizes import check_area
from storage.readers.pictures.pillow_pictures import as_alpha, load, stored_picture

_CODESTREAM = b"\xff\x4f\xff\x51"  # how one begins; its header (SIZ) follows


def read_jpeg2000(file: Path) -> StoredPicture:
    """Read a JPEG 2000 file as it is stored. Raises BadInput, and nearly anything for what is
    damaged."""
    from PIL import Jpeg2KImagePlugin

    data = file.read_bytes()
    at = data.index(_CODESTREAM)
    # What is decoded is as large as the codestream says, whatever the boxes around it say.
    right, bottom, left, top = struct.unpack_from(">4I", data, at + 8)
    check_area(file, right - left, bottom - top, 8)
    image = load(file, Jpeg2KImagePlugin.Jpeg2KImageFile, io.BytesIO(data), 8)
    depth, is_signed = (data[at + 42] & 0x7F) + 1, bool(data[at + 42] & 0x80)
    if is_signed or depth > 16:
        kind = f"{depth} bit{' signed' if is_signed else ''}"
        raise BadInput(file, "sample type", kind, "8 or 16 bits; save it as a 16-bit TIFF")
    return _deep(data, depth, stored_picture(image)) if depth > 8 else stored_picture(image)


def _deep(data: bytes, depth: int, stored: StoredPicture) -> StoredPicture:
    import imagecodecs

    codes = np.asarray(imagecodecs.jpeg2k_decode(data))
    most = (1 << depth) - 1
    whole = ((codes.astype(np.uint32) * 65535 + most // 2) // most).astype(np.uint16)
    whole = whole.reshape(*whole.shape[:2], -1)
    count = 3 if whole.shape[2] >= 3 else 1
    alpha = as_alpha(whole[..., count]) if whole.shape[2] > count else None
    return stored._replace(
        values=whole[..., :count], space="RGB" if count == 3 else "grey", alpha=alpha
    )
