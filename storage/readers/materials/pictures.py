"""Pictures on surfaces: decoded, and averaged down to a size that many of them may have."""

from __future__ import annotations

import io
from collections.abc import Hashable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.materials.description import Map
from storage.readers.pictures.srgb_curve import light_of_srgb, srgb_of_light

MOST_TEXELS = 32 << 20
"""Of all textures of a scene."""
LARGEST_SIDE = 2048
_MOST_PIXELS = 16384 * 16384
_MANY_SCANS = 100
_FORMATS = ("PNG", "JPEG", "WEBP", "AVIF", "BMP", "TIFF", "GIF", "DDS", "PPM", "TGA")
"""Targa last: it has no mark of its own."""


def side_for(count: int) -> int:
    """Texels a side at most, of each of ``count`` pictures."""
    side = LARGEST_SIDE
    while side > 64 and count * side * side > MOST_TEXELS:
        side //= 2
    return side


class Pictures:
    """Decodes each picture once. ``side``: texels a side at most; ``notes``: what became of them.

    As glTF 2.0 has it, colour profiles and gammas of the files are not looked at: colours are sRGB
    codes, data are data.
    """

    def __init__(self, side: int) -> None:
        self.notes: list[str] = []
        self._side = side
        self._decoded: dict[Hashable, NDArray[np.uint8] | None] = {}
        self._averaged: dict[Hashable, None] = {}

    def texels(self, given: Map, *, srgb: bool) -> NDArray[np.uint8] | None:
        """Codes (H, W, 4) uint8 of a picture, the top row first; None, and a note, for one that is
        missing or cannot be read. ``srgb``: colours, averaged in linear light."""
        key = (given.key, srgb)
        if key not in self._decoded:
            self._decoded[key] = self._read(given, srgb)
        return self._decoded[key]

    def said(self) -> list[str]:
        """The notes, and how many pictures were averaged down."""
        if not self._averaged:
            return self.notes
        count = len(self._averaged)
        things = "1 texture is" if count == 1 else f"{count} textures are"
        return [*self.notes, f"{things} averaged down to {self._side} texels a side."]

    def _read(self, given: Map, srgb: bool) -> NDArray[np.uint8] | None:
        name = shortened(given.shown)
        try:
            codes = _decoded(given.opened())
        except BadInput as error:
            self._say(f"Texture {name} is left out: {error.field} is {error.found}.")
            return None
        except Exception as error:  # decoders of damaged data raise nearly anything
            reason = str(error) if isinstance(error, _UnreadableError) else "it is damaged"
            self._say(f"Texture {name} is left out: {reason}.")
            return None
        if max(codes.shape[:2]) > self._side:
            self._averaged[given.key] = None
            codes = _smaller(codes, self._side, srgb)
        return codes

    def _say(self, note: str) -> None:
        if note not in self.notes:
            self.notes.append(note)


class _UnreadableError(ValueError):
    """Why, in words."""


def _decoded(data: bytes) -> NDArray[np.uint8]:
    image = _opened(data)
    width, height = image.size
    if width * height > _MOST_PIXELS:
        raise _UnreadableError(f"{width} x {height} pixels are too many")
    if image.format == "JPEG" and data.count(b"\xff\xda") > _MANY_SCANS:
        raise _UnreadableError(f"it has more than {_MANY_SCANS} scans")
    image.load()
    if image.mode in ("I;16", "I;16B", "I;16L", "I"):
        grey = (np.asarray(image).astype(np.int64).clip(0, 65535) / 257).round().astype(np.uint8)
        return np.dstack([grey, grey, grey, np.full_like(grey, 255)])
    if image.mode == "F":
        raise _UnreadableError("it holds floats")
    return np.array(image.convert("RGBA"))


def _opened(data: bytes) -> Any:
    """Through the format's own class: ``Image.open`` has a limit of its own for the process."""
    from PIL import Image

    Image.init()
    for name in _FORMATS:
        factory, accept = Image.OPEN.get(name, (None, None))
        if factory is None:
            continue
        accepted = accept(data[:16]) if accept is not None else _is_targa(data)
        if accepted is True or (accepted and not isinstance(accepted, str)):
            return factory(io.BytesIO(data), "")
    if data[:7] == b"\xabKTX 20":
        raise _UnreadableError("it is KTX 2, which is not read: convert it to PNG")
    raise _UnreadableError("its format is not read: convert it to PNG")


def _is_targa(data: bytes) -> bool:
    return len(data) > 18 and data[1] in (0, 1) and data[2] in (1, 2, 3, 9, 10, 11)


def _smaller(codes: NDArray[np.uint8], side: int, srgb: bool) -> NDArray[np.uint8]:
    """Averaged so that the longer side has ``side`` texels; colours in linear light."""
    import cv2

    height, width = codes.shape[:2]
    scale = side / max(height, width)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    light = np.empty(codes.shape, np.float32)
    plain = np.arange(256, dtype=np.float32) / 255
    light[..., :3] = (light_of_srgb(plain) if srgb else plain)[codes[..., :3]]
    light[..., 3] = plain[codes[..., 3]]
    averaged: NDArray[Any] = cv2.resize(light, size, interpolation=cv2.INTER_AREA)
    averaged = averaged.reshape(size[1], size[0], 4)
    if srgb:
        averaged[..., :3] = srgb_of_light(averaged[..., :3])
    return np.rint(averaged.clip(0, 1) * 255).astype(np.uint8)
