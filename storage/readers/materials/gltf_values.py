"""Numbers of a glTF's material: there or by default, in their range or held within it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from storage.readers.bad_input import BadInput, shortened
from storage.readers.materials.description import held
from storage.readers.materials.material import Colour


class Values:
    """Of the material ``name``; what is to be said is appended to ``notes``."""

    def __init__(self, file: Path, name: str, notes: list[str]) -> None:
        self.name = name
        self._file, self._notes = file, notes

    def say(self, what: str) -> None:
        """A note on this material."""
        self._notes.append(f"Material '{shortened(self.name)}': {what}.")

    def block(self, entry: dict[str, Any], key: str) -> dict[str, Any]:
        """An object of an object, empty where there is none; raises BadInput for another thing."""
        found = entry.get(key, {})
        if not isinstance(found, dict):
            raise self._wrong(key, found, "an object")
        return found

    def number(
        self,
        entry: dict[str, Any],
        key: str,
        missing: float,
        *,
        least: float = 0.0,
        most: float = 1.0,
    ) -> float:
        """A factor; raises BadInput for what is no finite number."""
        value = entry.get(key, missing)
        if not _is_number(value):
            raise self._wrong(key, value, f"a number from {least:g} to {most:g}")
        if least < 0:
            return min(max(float(value), least), most)
        return held(
            [float(value)], f"{key} of material '{shortened(self.name)}'", self._notes, most
        )[0]

    def colour(
        self,
        entry: dict[str, Any],
        key: str,
        count: int,
        *,
        missing: float = 1.0,
        most: float = 1.0,
    ) -> Colour:
        """Red, green and blue of ``count`` numbers; raises BadInput for others."""
        value = entry.get(key, [missing] * count)
        if not (isinstance(value, list) and len(value) == count and all(map(_is_number, value))):
            words = {3: "three", 4: "four"}[count]
            raise self._wrong(key, value, f"{words} numbers from 0 to {most:g}")
        numbers = [float(number) for number in value]
        what = f"{key} of material '{shortened(self.name)}'"
        red, green, blue, *_ = held(numbers, what, self._notes, most)
        return red, green, blue

    def _wrong(self, key: str, found: object, expected: str) -> BadInput:
        field = f"{key} of material '{shortened(self.name)}'"
        return BadInput(self._file, field, f"{found}"[:60], expected)


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return math.isfinite(value) and abs(value) < 1e30
