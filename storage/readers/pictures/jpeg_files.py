"""JPEG files, and what else phones put into them: gain maps, depth maps, films."""

from __future__ import annotations

import io
import math
import struct
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from storage.readers.bad_input import BadInput
from storage.readers.pictures.code_points import in_srgb
from storage.readers.pictures.decoded_image import StoredPicture
from storage.readers.pictures.pillow_pictures import load, opened, stored_picture

_MANY_SCANS = 64  # of a JPEG, each of which takes as long as all of the picture; 10 are usual
_MOST_SCANNED = 1_000_000_000  # pixels, which take some seconds
_FRAMES = frozenset({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC})  # markers of a frame's header
_READ_FRAMES = (0xC0, 0xC1, 0xC2, 0xC9, 0xCA)  # baseline, extended, progressive; by either coder
_INTEROPERABILITY = 0xA005
_ADOBE_RGB = (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290)
_LEFT_OUT = (
    (b"hdrgm:Version", "Its gain map (HDR) was left out: the standard picture was read."),
    (b"HDRGainMap", "Its gain map (HDR) was left out: the standard picture was read."),
    (b"GDepth:", "Its depth map was left out."),
    (b"GCamera:MotionPhoto", "Its film was left out."),
    (b"GCamera:MicroVideo", "Its film was left out."),
)


def read_jpeg(file: Path) -> StoredPicture:
    """Read a JPEG file as it is stored. Raises BadInput, and nearly anything for what is damaged.

    Pillow turns inks about, as Photoshop and most others write those of a JPEG: 0 is none.
    """
    from PIL import JpegImagePlugin

    data = file.read_bytes()
    _check_frame(file, data)
    size = opened(JpegImagePlugin.JpegImageFile, io.BytesIO(data)).size
    scans = data.count(b"\xff\xda")  # and some by chance, in a film behind the photograph
    if scans > _MANY_SCANS and scans * math.prod(size) > _MOST_SCANNED:
        raise BadInput(file, "number of scans", f"{scans}", f"at most {_MANY_SCANS}; save it again")
    image = load(file, JpegImagePlugin.JpegImageFile, io.BytesIO(data))
    said = dict.fromkeys(note for mark, note in _LEFT_OUT if mark in data)
    stored = stored_picture(image, notes=(*said, *([] if said else _more_pictures(image))))
    return _from_adobe_rgb(stored) if _is_adobe_rgb(image) else stored


def _is_adobe_rgb(image: Any) -> bool:
    """Whether a camera that wrote no profile has said so in EXIF (DCF 2.0, the optional colour
    space): the interoperability index."""
    if image.mode != "RGB" or image.info.get("icc_profile"):
        return False
    try:
        return bool(image.getexif().get_ifd(_INTEROPERABILITY).get(1) == "R03")
    except Exception:  # SyntaxError, struct.error and others by what is broken
        return False


def _from_adobe_rgb(stored: StoredPicture) -> StoredPicture:
    light = (np.arange(256) / 255) ** (563 / 256)
    colours = np.minimum(in_srgb(light.astype(np.float32)[stored.values], _ADOBE_RGB), 1)
    note = "The colours were converted to sRGB from Adobe RGB, which the EXIF block names."
    return stored._replace(values=colours, notes=(*stored.notes, note))


class Frame(NamedTuple):
    """What a frame's header says: its marker, bits a sample, pixels."""

    marker: int
    bits: int
    height: int
    width: int


def frame_of(data: bytes) -> Frame | None:
    """The header of a JPEG's first frame; None where there is none."""
    at = 2
    while at + 9 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if marker in _FRAMES:
            return Frame(marker, *struct.unpack_from(">BHH", data, at + 4))
        at += 1 if marker == 0xFF else 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return None


def _check_frame(file: Path, data: bytes) -> None:
    """Raise BadInput for what Pillow would only call broken: 12 bits, lossless."""
    frame = frame_of(data)
    way_out = "a usual JPEG of 8 bits, or a 16-bit TIFF"
    if frame and frame.bits == 12:
        raise BadInput(file, "sample type", "12 bit", way_out)
    if frame and frame.marker not in _READ_FRAMES:
        raise BadInput(file, "coding", f"lossless or hierarchical (0x{frame.marker:X})", way_out)


def _more_pictures(image: Any) -> list[str]:
    """What is to be said of the pictures behind the first one (CIPA DC-007), but for previews."""
    try:
        entries = image._getmp()[0xB002][1:]
        kinds = [entry["Attribute"]["MPType"] for entry in entries]
    except Exception:  # TypeError where there is no list; others, by what is broken
        return []
    count = sum(not kind.startswith("Large Thumbnail") for kind in kinds)
    if count == 0:
        return []
    what = "1 more picture" if count == 1 else f"{count} more pictures"
    return [f"The file holds {what} (another view, a gain or depth map), which was left out."]
