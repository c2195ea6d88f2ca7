"""How large a picture may be, looked at before a pixel of it is decoded."""

from __future__ import annotations

from pathlib import Path

from storage.readers.bad_input import BadInput
from storage.readers.opening import check_memory

LARGEST_MEGAPIXELS = 400
LARGEST_PICTURE = 4 << 30
"""Bytes of a file."""
MEMORY_PER_BYTE = 500
"""Of a file: the best compressed photographs take as much, and what unfolds to more is none."""


def check_area(file: Path, width: int, height: int, pixel_bytes: int) -> None:
    """Raise BadInput for more than 400 megapixels, or more memory than the file stands for.

    ``pixel_bytes``: of one pixel with all its channels, as it is decoded.
    """
    found = f"{width} x {height} pixels"
    if width * height > LARGEST_MEGAPIXELS * 1_000_000:
        raise BadInput(file, "size", found, f"at most {LARGEST_MEGAPIXELS} megapixels")
    # Decoded, turned about and converted, then three floats and what is asked of each.
    needed = width * height * (3 * pixel_bytes + 20)
    check_memory(file, "size", found, needed, file.stat().st_size, MEMORY_PER_BYTE)
