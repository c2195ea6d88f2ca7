"""Textures of a glTF: which image, how it is wrapped, how it lies."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from storage.readers.materials.description import Map, Placing
from storage.readers.materials.gltf_values import Values
from storage.readers.materials.material import Wrap

_TRANSFORM = "KHR_texture_transform"
_OTHER_SOURCES = ("EXT_texture_webp", "EXT_texture_avif", "MSFT_texture_dds", "KHR_texture_basisu")
"""Where an extension names an image of another format. Of the last one the plain one is better."""
_WRAPS: dict[object, Wrap] = {33071: "clamp", 33648: "mirror", 10497: "repeat"}


class Textures:
    """The textures, samplers and images of a glTF's JSON."""

    def __init__(self, file: Path, document: dict[str, Any], image: Callable[[int], bytes]) -> None:
        self._file, self._document, self._image = file, document, image

    def map(self, values: Values, info: dict[str, Any], key: str) -> Map | None:
        """What a ``textureInfo`` stands for; None where it is empty, or, with a note, where it
        leads to no image."""
        if not info:
            return None
        texture = self._entry("textures", info.get("index"))
        source = None if texture is None else self._source(texture)
        if texture is None or source is None:
            values.say(f"its {key} is left out: the file has no such image")
            return None
        sampler = self._entry("samplers", texture.get("sampler")) or {}
        wraps = [_WRAPS.get(sampler.get(name, 10497)) for name in ("wrapS", "wrapT")]
        across, along = (wrap or "repeat" for wrap in wraps)
        image = self._entry("images", source) or {}
        name = image.get("name") or image.get("uri")
        embedded = not isinstance(name, str) or name[:5].lower() == "data:"
        shown = f"image {source}" if embedded else f"{name}"
        return Map(
            source,
            shown,
            lambda: self._image(source),
            self._placing(values, info),
            (across, along),
        )

    def _placing(self, values: Values, info: dict[str, Any]) -> Placing:
        """glTF counts v from the top: a turn by an angle there is one by minus it here."""
        number = info.get("texCoord", 0)
        transform = values.block(values.block(info, "extensions"), _TRANSFORM)
        number = transform.get("texCoord", number)
        known = type(number) is int and number >= 0
        if not transform:
            return Placing(number if known else 0)
        (x, y), (su, sv) = (self._pair(values, transform, key) for key in ("offset", "scale"))
        angle = values.number(transform, "rotation", 0.0, least=-1e6, most=1e6)
        c, s = math.cos(angle), math.sin(angle)
        # From the top: (u', t') = (c su u + s sv t + x, -s su u + c sv t + y), and t = 1 - v.
        return Placing(
            number if known else 0,
            (c * su, -s * sv, s * sv + x, s * su, c * sv, 1 - c * sv - y),
        )

    @staticmethod
    def _pair(values: Values, transform: dict[str, Any], key: str) -> tuple[float, float]:
        given = transform.get(key, [0.0, 0.0] if key == "offset" else [1.0, 1.0])
        pair = given if isinstance(given, list) and len(given) == 2 else [None, None]
        limits = {"least": -1e6, "most": 1e6}
        first, second = (values.number({key: value}, key, 0.0, **limits) for value in pair)
        return first, second

    def _source(self, texture: dict[str, Any]) -> int | None:
        """The image's number: of a format that is read, before one that may not be."""
        extensions = texture.get("extensions")
        blocks = extensions if isinstance(extensions, dict) else {}
        plain = [texture.get("source")]
        others = [
            block.get("source")
            for name in _OTHER_SOURCES
            if isinstance(block := blocks.get(name), dict)
        ]
        return next(
            (number for number in (*plain, *others) if self._entry("images", number) is not None),
            None,
        )

    def _entry(self, table: str, number: object) -> dict[str, Any] | None:
        entries = self._document.get(table)
        if not isinstance(entries, list) or type(number) is not int:
            return None
        entry = entries[number] if 0 <= number < len(entries) else None
        return entry if isinstance(entry, dict) else None
