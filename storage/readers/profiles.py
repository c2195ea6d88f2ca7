"""Cross-sections of scratches: CSV files of points.

Parsed here and not by numpy: the decimal commas of many a profilometer's export, the order of the
header's columns and the line number of what is wrong all matter.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.opening import LONGEST_NUMBER, check_file, unreadable

FEWEST_POINTS = 3
MOST_POINTS = 100_000

_LARGEST = 64 << 20  # bytes: 600 a point
_LONGEST_LINE = 100_000
_MOST_LINES = 5 * MOST_POINTS  # comments and blank lines among them

_EXPECTED = "a CSV file of points v, n in UTF-8"
_SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas"}
_COLUMN = re.compile(r"([vn])(?:[\s_/(\[]+([^\W\d_]+)\s*[)\]]?)?")
# Casefolding turns the micro sign into the Greek letter mu.
_MICROMETRES = frozenset(
    ["um", "\u03bcm", "micron", "microns", "micrometre", "micrometres", "micrometer", "micrometers"]
)


class _Layout(NamedTuple):
    """Cells in a line, and which of them are v and n."""

    cells: int
    v: int
    n: int


def read_profile(path: str | PathLike[str]) -> NDArray[np.float64]:
    """Read a scratch's cross-section as a chain of points.

    Parameters: ``path``, a text file in UTF-8 with one point a line: v (across the scratch) and n
    (height), in micrometres, separated by commas, semicolons or tabs. Where the separator is no
    comma, decimal commas are read too; a file uses commas or points, not both. A header may name
    the columns, ``v`` and ``n`` in either order, with a unit if it is the micrometre (``v [um]``,
    ``N_um``, ``v (µm)``); other columns are then passed over. Lines that begin with ``#`` are
    comments, except that one before the points which names v and n is a header, as
    ``numpy.savetxt`` writes it. Blank lines are passed over.

    Returns (points, 2) float64: v and n in micrometres, in the order of the file.

    Raises BadInput for a file that is missing, a directory, not text or empty; for a header that
    does not name v and n or has another unit; naming the line, for a wrong number of columns, for
    what is no finite number and for a point that repeats the one before; for fewer than 3 or more
    than 100 000 points; and for points that all lie on one height. Whether the chain crosses
    itself is not looked at.
    """
    file = Path(path)
    last = 0
    points: list[tuple[float, float]] = []
    for number, v, n in _rows(file):
        if points and points[-1] == (v, n):
            found = f"({v}, {n}), the same point as on line {last}"
            raise BadInput(file, f"line {number}", found, "another point than the one before")
        if len(points) == MOST_POINTS:
            raise BadInput(
                file, "number of points", f"more than {MOST_POINTS}", f"at most {MOST_POINTS}"
            )
        last = number
        points.append((v, n))
    if len(points) < FEWEST_POINTS:
        raise BadInput(file, "number of points", f"{len(points)}", f"at least {FEWEST_POINTS}")
    profile = np.array(points, np.float64)
    if (profile[:, 1] == profile[0, 1]).all():
        raise BadInput(file, "height n", f"{profile[0, 1]} at every point", "a profile with relief")
    return profile


def _rows(file: Path) -> Iterator[tuple[int, float, float]]:
    """Line number, v and n of each point."""
    layout = _Layout(2, 0, 1)
    separator = ""
    decimal = ""  # the mark of the first number that has one
    for number, line in _lines(file):
        if line.lstrip().startswith("#"):
            if not separator:
                layout = _commented_header(file, line) or layout
            continue
        if not separator:
            separator = next((mark for mark in _SEPARATORS if mark in line), ",")
            cells = _cells(line, separator)
            if not any(_is_number(cell.replace(",", ".")) for cell in cells):
                layout = _header(file, number, line, cells)
                continue
        cells = _cells(line, separator)
        if len(cells) != layout.cells:
            raise BadInput(
                file,
                f"number of columns on line {number}",
                f"{len(cells)}",
                f"{layout.cells} with {_SEPARATORS[separator]} between them",
            )
        point = []
        for name, cell in (("v", cells[layout.v]), ("n", cells[layout.n])):
            mark = "," if "," in cell else "." if "." in cell else decimal
            decimal = decimal or mark
            if mark != decimal:
                raise BadInput(
                    file,
                    f"{name} on line {number}",
                    f"'{cell[:60]}'",
                    f"a number with a '{decimal}' before its decimals, as on the lines before",
                )
            point.append(_finite(file, number, name, cell))
        yield number, point[0], point[1]


def _lines(file: Path) -> Iterator[tuple[int, str]]:
    """The lines that are not blank, with their numbers from 1; a byte order mark is left out."""
    check_file(file, _EXPECTED, _LARGEST)
    empty = True
    try:
        with file.open(encoding="utf-8-sig") as stream:
            for number, line in enumerate(stream, start=1):
                if number > _MOST_LINES:
                    expected = f"at most {_MOST_LINES}"
                    raise BadInput(file, "number of lines", f"more than {_MOST_LINES}", expected)
                if len(line) > _LONGEST_LINE:
                    found, expected = f"{len(line)} characters", f"at most {_LONGEST_LINE}"
                    raise BadInput(file, f"length of line {number}", found, expected)
                if "\0" in line:  # valid UTF-8, but the mark of a binary file or of UTF-16
                    raise BadInput(file, "content", "not text", _EXPECTED)
                if line.strip():
                    empty = False
                    yield number, line
    except UnicodeDecodeError:
        raise BadInput(file, "content", "not UTF-8 text", _EXPECTED) from None
    except OSError as error:
        raise unreadable(file, error, _EXPECTED) from error
    if empty:
        raise BadInput(file, "content", "empty", _EXPECTED)


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.split(separator)]


def _header(file: Path, number: int, line: str, cells: list[str]) -> _Layout:
    layout = _named(file, cells)
    if layout is None:
        found = f"'{line.strip()[:60]}'"
        raise BadInput(file, f"header on line {number}", found, "one column v and one column n")
    return layout


def _commented_header(file: Path, line: str) -> _Layout | None:
    """The layout that a comment gives: v and n swapped by ``# n, v`` would go unseen."""
    return _named(file, _cells(re.sub(r"[;\t]", ",", line.strip().lstrip("#")), ","))


def _named(file: Path, cells: list[str]) -> _Layout | None:
    """The layout by the names in a header's cells; None unless v and n are there, once each."""
    columns: dict[str, list[int]] = {"v": [], "n": []}
    units: dict[str, str] = {}
    for at, cell in enumerate(cells):
        match = _COLUMN.fullmatch(cell.casefold())
        if match:
            columns[match[1]].append(at)
            units[match[1]] = match[2] or "um"
    if len(columns["v"]) != 1 or len(columns["n"]) != 1:
        return None
    for name, unit in units.items():
        if unit not in _MICROMETRES:
            raise BadInput(file, f"unit of {name} in the header", f"'{unit[:60]}'", "um")
    return _Layout(len(cells), columns["v"][0], columns["n"][0])


def _is_number(word: str) -> bool:
    try:
        float(word[:LONGEST_NUMBER])
    except ValueError:
        return False
    return (
        len(word) <= LONGEST_NUMBER and "_" not in word
    )  # 1_000 is Python's way to write a thousand, nobody else's


def _finite(file: Path, number: int, name: str, cell: str) -> float:
    word = cell.replace(",", ".")
    field = f"{name} on line {number}"
    if not _is_number(word):
        raise BadInput(file, field, f"'{cell[:60]}'", "a number")
    value = float(word)
    if not math.isfinite(value):
        raise BadInput(file, field, f"'{cell[:60]}'", "a finite number")
    return value
