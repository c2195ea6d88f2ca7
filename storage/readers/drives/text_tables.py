"""Numbers in lines of text, as KITTI, COLMAP and their users' spreadsheets write them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.opening import number, whole_file

LARGEST_TABLE = 16 << 20
"""Bytes: of some hundred thousand poses."""

_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")


class Table:
    """A file's lines, and what is to be said of how their numbers were read."""

    def __init__(self, file: Path, expected: str) -> None:
        text = whole_file(file, expected, LARGEST_TABLE).decode("utf-8-sig", errors="replace")
        self.file = file
        self.lines = [line.strip() for line in text.splitlines()]
        self._commas: dict[str, None] = {}

    @property
    def notes(self) -> list[str]:
        """What was done to commas."""
        return [f"{self.file.name}: commas were read as {how}." for how in self._commas]

    def numbers(self, row: int, words: str, count: int) -> NDArray[np.float64]:
        """So many finite numbers, apart by spaces or commas; or with decimal commas.

        Raises BadInput with the line (from 1 on) for another count, and for what is no number.
        """
        parts = words.split()
        if "," in words:
            if len(parts) == count and all(_DECIMAL_COMMA.fullmatch(part) for part in parts):
                self._commas["decimal points"] = None
                parts = [part.replace(",", ".") for part in parts]
            else:
                self._commas["spaces"] = None
                parts = words.replace(",", " ").split()
        if len(parts) != count:
            raise BadInput(
                self.file, f"line {row + 1}", f"{len(parts)} numbers", f"{count} numbers"
            )
        return finite_numbers(self.file, f"line {row + 1}", parts)

    def labelled(self) -> dict[str, tuple[int, str]]:
        """Lines of the form ``label: words`` by label, with their row."""
        found = {}
        for row, line in enumerate(self.lines):
            label, colon, words = line.partition(":")
            if colon and label.strip():
                found[label.strip()] = (row, words.strip())
        return found


def finite_numbers(file: Path, field: str, words: Sequence[str]) -> NDArray[np.float64]:
    """Words as numbers; raises BadInput for one that is none or not finite."""
    values = np.empty(len(words))
    for column, word in enumerate(words):
        try:
            values[column] = number(word)
        except ValueError:
            raise BadInput(file, field, f'"{word}" among its numbers', "numbers") from None
    if not np.isfinite(values).all():
        raise BadInput(file, field, "not finite", "finite numbers")
    return values
