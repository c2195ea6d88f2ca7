"""What a photograph's header says, before anything of it is decoded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from storage.readers.bad_input import BadInput
from storage.readers.opening import first_bytes
from storage.readers.pictures.picture_sizes import LARGEST_PICTURE
from storage.readers.pictures.pillow_pictures import opened

PHOTOGRAPH = "a PNG, JPEG, WebP, AVIF or BMP photograph"
ENDINGS = (".png", ".jpg", ".jpeg", ".webp", ".avif", ".bmp")
"""As such photographs are named, in the order in which they are looked for."""


def photograph_size(file: Path) -> tuple[int, int]:
    """Width and height in pixels, by the header alone.

    Raises BadInput for a file that is missing, of another format or broken where its header is, and
    for a photograph that is to be turned.
    """
    # Imported when needed, as in the modules that decode.
    from PIL import (
        AvifImagePlugin,
        BmpImagePlugin,
        JpegImagePlugin,
        PngImagePlugin,
        WebPImagePlugin,
    )

    plugins: tuple[tuple[int, bytes, Any], ...] = (
        (0, b"\x89PNG\r\n\x1a\n", PngImagePlugin.PngImageFile),
        (0, b"\xff\xd8\xff", JpegImagePlugin.JpegImageFile),
        (8, b"WEBP", WebPImagePlugin.WebPImageFile),
        (4, b"ftypavi", AvifImagePlugin.AvifImageFile),
        (0, b"BM", BmpImagePlugin.BmpImageFile),
    )
    try:
        start = first_bytes(file, 16, PHOTOGRAPH, LARGEST_PICTURE, field="photograph")
        found = [plugin for at, begins, plugin in plugins if start.startswith(begins, at)]
        if not found:
            raise BadInput(file, "format", "unknown" if start else "empty", PHOTOGRAPH)
        with file.open("rb") as stream:
            image = opened(found[0], stream)
            # Asked of a PNG without EXIF before its pixels, Pillow would decode it.
            tags = image.getexif() if image.format != "PNG" or "exif" in image.info else {}
            orientation = tags.get(0x0112, 1)
    except BadInput:
        raise
    except Exception as error:  # decoders of damaged data raise nearly anything
        if isinstance(error, OSError) and error.strerror:  # the system's, not Pillow's
            raise BadInput(file, "file", f"unreadable ({error.strerror})", PHOTOGRAPH) from error
        raise BadInput(file, "content", "truncated or damaged", PHOTOGRAPH) from error
    if orientation in range(2, 9):
        # Tools differ in whether their poses are those of the picture before or after turning.
        raise BadInput(file, "orientation", f"tag {orientation}", "a photograph stored upright")
    return int(image.size[0]), int(image.size[1])


def check_size(file: Path, found: tuple[int, int], expected: tuple[int, int]) -> None:
    """Raise BadInput for a picture of another width and height than its camera has."""
    if found != expected:
        raise BadInput(
            file,
            "size",
            f"{found[0]} x {found[1]} pixels",
            f"{expected[0]} x {expected[1]} pixels as its camera's w and h",
        )
