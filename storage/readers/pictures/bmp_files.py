"""BMP files, by Pillow, with what it leaves out: profiles, and alpha that is not used."""

from __future__ import annotations

import io
from pathlib import Path

from storage.readers.pictures.decoded_image import StoredPicture
from storage.readers.pictures.pillow_pictures import load, stored_picture

_V5_HEADER = 124  # bytes
_EMBEDDED = b"DEBM"  # the colour space's code where a profile is in the file


def read_bmp(file: Path) -> StoredPicture:
    """Read a BMP file as it is stored. Raises BadInput, and nearly anything for what is damaged."""
    from PIL import BmpImagePlugin

    data = file.read_bytes()
    stored = stored_picture(load(file, BmpImagePlugin.BmpImageFile, io.BytesIO(data)))
    if int.from_bytes(data[14:18], "little") == _V5_HEADER and data[70:74] == _EMBEDDED:
        begin = 14 + int.from_bytes(data[126:130], "little")
        stored = stored._replace(profile=data[begin:][: int.from_bytes(data[130:134], "little")])
    if stored.alpha is not None and not stored.alpha.any():  # a byte that nobody filled in
        stored = stored._replace(alpha=None)
    return stored
