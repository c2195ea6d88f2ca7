"""AVIF files: 8 bits by Pillow, 10 and 12 bits by libavif, as Pillow cuts those down to 8.

What the colours are is told by a profile or by code points in a box of type `colr`, and HDR is
common here.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from storage.readers.pictures.code_points import CodePoints
from storage.readers.pictures.decoded_image import StoredPicture, by_code_points, damaged
from storage.readers.pictures.pillow_pictures import animation_notes, as_alpha, load, stored_picture

_GAIN_MAP = "Its gain map (HDR) was left out: the picture without it was read."


def read_avif(file: Path) -> StoredPicture:
    """Read an AVIF file as it is stored. Raises BadInput, and nearly anything for what is damaged.

    Of a sequence the first picture is read.
    """
    from PIL import AvifImagePlugin

    data = file.read_bytes()
    image = load(file, AvifImagePlugin.AvifImageFile, io.BytesIO(data), 8)
    notes = animation_notes(image)
    boxes = data[: 1 << 16]  # they stand before the pixels
    if b"tmap" in boxes:
        notes = (*notes, _GAIN_MAP)
    stored = stored_picture(image, notes=notes)
    depth = _depth(boxes)
    if depth > 8:
        stored = _deep(file, data, depth, stored)
    at = boxes.find(b"colrnclx")
    if stored.profile or at < 0:
        return stored
    # The range is of the planes that were stored; what was decoded has the full one.
    codes = boxes[at + 8 : at + 12]
    points = CodePoints(int.from_bytes(codes[:2], "big"), int.from_bytes(codes[2:], "big"))
    return by_code_points(file, stored, points)


def _depth(boxes: bytes) -> int:
    """Bits a sample, by the decoder's configuration (AV1-ISOBMFF, 2.3.3)."""
    at = boxes.find(b"av1C")
    if at < 0:
        return 8
    flags = boxes[at + 6]
    if not flags & 0x40:
        return 8
    return 12 if flags & 0x20 else 10


def _deep(file: Path, data: bytes, depth: int, stored: StoredPicture) -> StoredPicture:
    """The same picture with all its bits."""
    import imagecodecs

    codes = np.asarray(imagecodecs.avif_decode(data, index=0))
    if codes.dtype != np.uint16 or codes.shape[:2] != stored.values.shape[:2]:
        raise damaged(file, "AVIF")
    most = (1 << depth) - 1
    whole = ((codes.astype(np.uint32) * 65535 + most // 2) // most).astype(np.uint16)
    whole = whole.reshape(*whole.shape[:2], -1)
    alpha = as_alpha(whole[..., -1]) if stored.alpha is not None else None
    count = 3 if whole.shape[2] >= 3 else 1
    return stored._replace(
        values=whole[..., :count], space="RGB" if count == 3 else "grey", alpha=alpha
    )
