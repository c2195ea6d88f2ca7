"""Picture files to arrays of the values they hold, upright and complete.

Which library decodes what is decided by the file's own header, never by its name. Formats that are
known but not read are refused by their name.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from storage.readers.bad_input import BadInput
from storage.readers.opening import first_bytes
from storage.readers.pictures.avif_files import read_avif
from storage.readers.pictures.bmp_files import read_bmp
from storage.readers.pictures.decoded_image import (
    DecodedImage,
    StoredPicture,
    damaged,
    decoded,
    straight,
)
from storage.readers.pictures.exr_files import read_exr
from storage.readers.pictures.jpeg2000_files import read_jpeg2000
from storage.readers.pictures.jpeg_files import read_jpeg
from storage.readers.pictures.picture_sizes import LARGEST_PICTURE
from storage.readers.pictures.pillow_pictures import animation_notes, load, stored_picture
from storage.readers.pictures.png_files import read_png
from storage.readers.pictures.tiff_files import read_tiff

FORMATS = "a PNG, JPEG, TIFF, WebP, AVIF, BMP, GIF, JPEG 2000 or EXR photograph"
_EXPORT = "export it as a 16-bit TIFF, a PNG or a JPEG"


def _decode_webp(file: Path) -> StoredPicture:
    from PIL import WebPImagePlugin

    image = load(file, WebPImagePlugin.WebPImageFile, io.BytesIO(file.read_bytes()))
    return stored_picture(image, notes=animation_notes(image))


def _decode_gif(file: Path) -> StoredPicture:
    from PIL import GifImagePlugin

    with file.open("rb") as stream:
        image = load(file, GifImagePlugin.GifImageFile, stream)
        stored = stored_picture(image)
        return stored._replace(notes=animation_notes(image))  # looks at the second picture


class _Format(NamedTuple):
    """``begins``: at ``at`` of the file; ``decode``: None where it is known by name only."""

    name: str
    begins: tuple[bytes, ...]
    decode: Callable[[Path], StoredPicture] | None = None
    at: int = 0


_READ = (
    _Format("PNG", (b"\x89PNG\r\n\x1a\n",), read_png),
    _Format("JPEG", (b"\xff\xd8\xff",), read_jpeg),
    _Format("TIFF", (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"), read_tiff),
    _Format("WebP", (b"WEBP",), _decode_webp, 8),
    _Format("AVIF", (b"ftypavif", b"ftypavis"), read_avif, 4),
    _Format("GIF", (b"GIF87a", b"GIF89a"), _decode_gif),
    _Format("JPEG 2000", (b"\0\0\0\x0cjP  \r\n\x87\n", b"\xff\x4f\xff\x51"), read_jpeg2000),
    _Format("BMP", (b"BM",), read_bmp),
)
_REFUSED = (
    _Format("HEIC", tuple(b"ftyp" + brand for brand in (b"hei", b"hev", b"mif1", b"msf1")), at=4),
    _Format("a camera's raw file (CR3)", (b"ftypcrx ",), at=4),
    _Format("a film (MP4, MOV)", (b"ftyp",), at=4),
    _Format("a camera's raw file (RAF)", (b"FUJIFILMCCD-RAW",)),
    _Format("a camera's raw file (ORF)", (b"IIRO", b"IIRS", b"MMOR")),
    _Format("a camera's raw file (RW2)", (b"IIU\0",)),
    _Format("a camera's raw file (X3F)", (b"FOVb",)),
    _Format("a camera's raw file (MRW)", (b"\0MRM",)),
    _Format("a Photoshop document", (b"8BPS",)),
    _Format("a GIMP document", (b"gimp xcf",)),
    _Format("JPEG XL", (b"\xff\x0a", b"\0\0\0\x0cJXL \r\n\x87\n")),
    _Format("JPEG XR", (b"II\xbc",)),
    _Format("Radiance HDR", (b"#?",)),
    _Format("DPX", (b"SDPX", b"XPDS")),
    _Format("DDS", (b"DDS ",)),
    _Format("PDF", (b"%PDF",)),
    _Format("PNM or PFM", (b"P1", b"P2", b"P3", b"P4", b"P5", b"P6", b"P7", b"PF", b"Pf")),
    _Format("SVG or another text of XML", (b"<?xml", b"<svg")),
)


def decode_image(file: Path) -> DecodedImage:
    """Decode a picture file, whole and upright, its colours converted to sRGB.

    Of a file with several pictures the first is read. Raises BadInput where the file is missing, of
    another format, truncated, larger than 400 megapixels or in a colour space or sample type that
    cannot be read faithfully.
    """
    start = first_bytes(file, 64, FORMATS, LARGEST_PICTURE)
    if start.startswith(b"\x76\x2f\x31\x01"):
        return _guarded(file, "EXR", _decode_exr)
    if start[4:8] == b"ftyp" and b"avif" in start[8 : int.from_bytes(start[:4], "big")]:
        return _guarded(file, "AVIF", read_avif)
    for known in _READ:
        if known.decode is not None and start.startswith(known.begins, known.at):
            return _guarded(file, known.name, known.decode)
    for known in _REFUSED:
        if start.startswith(known.begins, known.at):
            raise BadInput(file, "format", known.name, f"{FORMATS}; {_EXPORT}")
    raise BadInput(file, "format", "unknown" if start else "unknown (the file is empty)", FORMATS)


def _guarded(
    file: Path, name: str, decode: Callable[[Path], StoredPicture | DecodedImage]
) -> DecodedImage:
    try:
        found = decode(file)
        return found if isinstance(found, DecodedImage) else decoded(found)
    except BadInput:
        raise
    except Exception as error:  # decoders of damaged data raise nearly anything
        raise damaged(file, name) from error


def _decode_exr(file: Path) -> DecodedImage:
    """Colours in an EXR are multiplied with its alpha."""
    picture = read_exr(file)
    if picture.alpha is None:
        return DecodedImage(picture.colours, None, picture.notes)
    alpha = np.clip(picture.alpha.astype(np.float32), 0, 1)
    colours = picture.colours
    if (alpha < 1).any():
        colours = straight(colours, alpha)
    return DecodedImage(colours, alpha, picture.notes)
