"""Numbers in the cells of a table, however a country or an instrument writes them."""

from __future__ import annotations

import csv
import re

from storage.readers.opening import LONGEST_NUMBER

SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "spaces"}

_MISSING = frozenset(
    ["", "nan", "-nan", "bad", "n/a", "na", "#n/a", "null", "none", "invalid", "no data", "nodata",
     "1.#qnan", "-1.#ind", "void"]
)  # fmt: skip
_RULE = re.compile(r"[*\-_=.?]{2,}|\*|-")
# Groups of three digits with marks between them, and another mark before the decimals.
_GROUPED = re.compile(r"[+-]?\d{1,3}(?:([.,'’\u00a0\u202f ])\d{3})+(?:(?!\1)[.,]\d*)?")


def cells_of(line: str, separator: str) -> list[str]:
    """A line's cells without their quotes; empty ones at its end are left out, but for a second."""
    if separator == " ":
        cells = line.split()
    elif '"' in line:
        try:
            cells = next(csv.reader([line.strip("\r\n")], delimiter=separator), [])
        except csv.Error:
            cells = line.split(separator)
    else:
        cells = line.split(separator)
    cells = [cell.strip().strip('"').strip() for cell in cells]
    while len(cells) > 2 and not cells[-1]:
        cells.pop()
    return cells


def is_missing(cell: str) -> bool:
    """Whether a cell says that nothing was measured there: ``***``, ``NaN``, ``BAD``, empty."""
    return cell.casefold() in _MISSING or _RULE.fullmatch(cell) is not None


def number_of(cell: str, decimal: str = "") -> float | None:
    """The finite number in a cell; None where there is none.

    ``decimal``: the mark that the file's decimals have, or empty where none was seen: then either
    is read.
    """
    word = cell.replace("\u2212", "-")
    if len(word) > LONGEST_NUMBER or "_" in word:  # 1_000 is Python's alone
        return None
    if decimal_mark(word) not in ("", decimal or decimal_mark(word)):
        return None
    grouped = _GROUPED.fullmatch(word)
    if grouped and (grouped[1] not in ".," or len(set(re.findall("[.,]", word))) == 2):
        word = word.replace(grouped[1], "")
    word = word.replace(",", ".").replace("D", "E")
    try:
        value = float(word)
    except ValueError:
        return None
    return value if abs(value) < float("inf") else None


def decimal_mark(cell: str) -> str:
    """The last point or comma in a cell; empty where there is neither."""
    marks = re.findall("[.,]", cell)
    return marks[-1] if marks else ""
