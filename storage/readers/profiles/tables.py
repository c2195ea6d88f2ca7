"""The table of points in a text file: where it begins and ends, its separator and its header."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple

from storage.readers.bad_input import BadInput
from storage.readers.profiles.cells import SEPARATORS, cells_of, is_missing, number_of
from storage.readers.profiles.units import Column, column_of, micrometres

MOST_POINTS = 100_000

Line = tuple[int, str]
_Kind = Literal["row", "empty", "text"]

_COMMENT = re.compile(r"\s*(#|%|//|!|REM\b)\s*")
_BEGINS_AS_NUMBER = re.compile(r"[-+\u2212]?\.?(\d|inf)")
_OF_NUMBERS = frozenset("0123456789-+.,;eE \t")
_DATE = re.compile(r"\d+[./:-]\d+[./:-]\d+")
_SAMPLE = 1500  # lines that tell the separator
_SURE = 3  # rows one after the other are a table, not numbers among an instrument's settings
_MOST_COLUMNS = 200
_MOST_CELLS = 2_000_000
_PREAMBLE_LINES = 1000
_LONGEST_SAID = 1000  # characters: looking for words takes their square
_HEADER_LINES = 8
_LONGEST_NAME = 4  # words


class Table(NamedTuple):
    """A table of points as text.

    separator: between the cells; empty for a single column. columns: by the header, or None. rows:
    line numbers and cells. preamble: what stands before, comments and header included. further: the
    first rows of other tables behind it.
    """

    separator: str
    columns: tuple[Column, ...] | None
    width: int
    rows: list[tuple[int, list[str]]]
    preamble: list[str]
    further: list[tuple[int, list[str]]]


def too_many(file: Path, count: int) -> BadInput:
    """What to raise for more points than are taken."""
    expected = f"at most {MOST_POINTS}: export the surroundings of the scratch alone"
    return BadInput(file, "number of points", f"{count}", expected)


def table_of(file: Path, lines: Sequence[Line]) -> Table:
    """The first table of points among a file's lines.

    Raises BadInput where there is none, or one of too many points, where a header names other
    columns, and where a line in the middle is no point.
    """
    plain = [line for line in lines if not _COMMENT.match(line[1])]
    if len(plain) > MOST_POINTS + _PREAMBLE_LINES:  # at once; it takes a second to look at them
        raise too_many(file, len(plain))
    if len(plain) > _SURE and plain[0][1].strip() == str(len(plain) - 1):
        plain = plain[1:]  # it says how many points follow
    _check_cells(file, plain)
    separator = _separator(plain)
    split = [(number, split_cells(text, separator)) for number, text in plain]
    kinds = [_kind(cells) for _, cells in split]
    first = _first_row(kinds)
    if first is None:
        raise BadInput(
            file, "number of points", "0", "at least 3 that differ, a line of numbers each"
        )
    last = next((at for at in range(first, len(kinds)) if kinds[at] == "text"), len(kinds))
    rows = split[first:last]
    if len(rows) > MOST_POINTS:
        raise too_many(file, len(rows))
    count = Counter(len(cells) for _, cells in rows[:100]).most_common(1)[0][0]
    for at in {first - 1, last} & set(range(len(kinds))):
        only_numbers = at == last and not set(plain[at][1]) - _OF_NUMBERS
        if only_numbers or _is_broken(split[at][1], count):
            found, expected = f"'{plain[at][1].strip()}'", "numbers, as on the lines beside it"
            raise BadInput(file, f"line {split[at][0]}", found, expected)
    before = [line for line in lines if line[0] < rows[0][0] and len(line[1]) <= _LONGEST_SAID]
    before = before[-_PREAMBLE_LINES:]
    columns = _header(file, before, separator, count)
    if separator == "," and columns is not None and len(columns) == 1 < count:
        separator, count = "", 1  # what looked like separators are decimal commas
        rows = [(number, split_cells(text, "")) for number, text in plain[first:last]]
    starts = [
        split[at]
        for at in range(last, len(kinds))
        if kinds[at] == "row" and kinds[at - 1] == "text" and kinds[at + 1 : at + 2] == ["row"]
    ]
    width = max(count, len(columns or ()))
    if columns is not None:
        columns += (Column("", "other", None),) * (width - len(columns))
    return Table(separator, columns, width, rows, [text for _, text in before], starts)


def _check_cells(file: Path, lines: Sequence[Line]) -> None:
    """Refuse a matrix of heights at once: looking at each of its cells takes minutes."""
    total = wide = 0
    for _, text in lines:
        marks = max(text.count(separator) for separator in ("\t", ";", ","))
        cells = max(marks + 1, len(text.split()))
        total += cells
        wide += cells > _MOST_COLUMNS
    if total > _MOST_CELLS or wide > _SURE:
        raise BadInput(
            file,
            "number of cells",
            f"{total} in {len(lines)} lines",
            f"at most {_MOST_COLUMNS} in a line and {_MOST_CELLS} in all: of a measured area "
            "export one profile",
        )


def split_cells(line: str, separator: str) -> list[str]:
    """A line's cells; of a single column the line itself, without separators at its end."""
    return cells_of(line, separator) if separator else [line.strip().rstrip(";,\t ").strip('"')]


def _separator(lines: Sequence[Line]) -> str:
    """That which splits the most lines one after the other into numbers, and into nothing else."""
    best, longest = "", (0, 0)
    for separator in SEPARATORS:
        most = here = pure = 0
        for _, text in lines[:_SAMPLE]:
            cells = cells_of(text, separator)
            kind = _kind(cells)
            is_split = kind == "row" and sum(map(bool, cells)) > 1
            here = here + is_split if kind != "text" else 0
            pure += is_split and all(number_of(cell) is not None for cell in cells if cell)
            most = max(most, here)
        if (most, pure) > longest:
            best, longest = separator, (most, pure)
    return best if longest[0] else ""


def _kind(cells: Sequence[str]) -> _Kind:
    """A row has numbers, or marks of missing ones, in more than half of its cells."""
    missing = sum(is_missing(cell) for cell in cells)
    if missing == len(cells):
        return "empty"
    numbers = sum(number_of(cell) is not None for cell in cells)
    return "row" if numbers and 2 * (numbers + missing) > len(cells) else "text"


def _first_row(kinds: Sequence[_Kind]) -> int | None:
    """Where the first rows stand that are a table."""
    lone = start = None
    length = 0
    for at, kind in enumerate(kinds):
        if kind == "text":
            start, length = None, 0
        elif kind == "row":
            start = at if start is None else start
            lone = start if lone is None else lone
            length += 1
            if length == _SURE:
                return start
    return lone


def _is_broken(cells: Sequence[str], count: int) -> bool:
    """Whether a line beside rows is no row and begins as one: with a number, but for a date."""
    first = cells[0].casefold()
    return (
        len(cells) == count > 1
        and not is_missing(first)
        and _BEGINS_AS_NUMBER.match(first) is not None
        and _DATE.match(first) is None
    )


def _header(
    file: Path, before: Sequence[Line], separator: str, count: int
) -> tuple[Column, ...] | None:
    """The columns by the lines above them: names, and units beside or under them. Lines that are
    commented out count where no others name the columns."""
    units: list[str] | None = None
    unknown: Line | None = None
    near = before[-_HEADER_LINES:][::-1]
    for are_comments in (False, True):
        lines = [line for line in near if bool(_COMMENT.match(line[1])) == are_comments]
        for above, (number, text) in enumerate(lines):
            splits = _splits(_COMMENT.sub("", text, count=1), separator, count)
            under = next((cells for cells in splits if _are_units(cells)), None)
            if units is None and under is not None and len(under) == count:
                units = under
                continue
            named = _named(splits, separator, count, are_comments)
            if named is not None:
                return _with_units(named, units)
            is_next = above == (units is not None) and not are_comments
            if is_next and _may_be_names(text, split_cells(text, separator), count):
                unknown = number, text
    if unknown is not None:
        number, text = unknown
        raise BadInput(
            file,
            f"header on line {number}",
            f"'{text.strip()}'",
            "one column v (or x, distance, lateral) and one column n (or z, height, profile)",
        )
    return _with_units([Column("", "other", None)] * count, units) if units else None


def _named(
    splits: Sequence[Sequence[str]], separator: str, count: int, is_comment: bool
) -> list[Column] | None:
    """The columns, if one of the splits names those of points."""
    for cells in splits:
        named = [column_of(cell) for cell in cells]
        if is_comment and max(len(cell.split()) for cell in cells) > _LONGEST_NAME:
            continue  # prose
        if len(named) > 1 and _names_points(named, count):
            return named
        is_single = count == 1 or (separator == "," and named[0].unit is not None)
        if len(named) == 1 and named[0].role == "n" and is_single and not is_comment:
            return named
    return None


def _may_be_names(text: str, cells: Sequence[str], count: int) -> bool:
    """Whether a line above the points seems to name them, whatever it says."""
    is_setting = re.search(r"[:=\]]\s*$|[:=].*\d", text) is not None
    return (
        len(cells) == count > 1
        and not is_setting
        and _kind(cells) == "text"
        and all(number_of(cell) is None for cell in cells)
    )


def _splits(text: str, separator: str, count: int) -> list[list[str]]:
    """A header's cells, as many as the points have: it is not always split as they are. Last, as
    the points are but into more cells: those on the right may be empty."""
    splits = [cells_of(text, other) for other in dict.fromkeys([separator or ",", "\t", ";", ","])]
    splits += [
        [cell for cell in re.split(r"\s{2,}", text.strip()) if cell],
        # Words with their units in brackets behind them.
        re.findall(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?", text),
        [text.strip().rstrip(":")],
    ]
    wider = splits[:1] if separator not in ("", " ") and len(splits[0]) > count else []
    single = splits[-1:]  # of points whose decimal commas look like separators
    return [cells for cells in splits if len(cells) == count] + wider + single


def _are_units(cells: Sequence[str]) -> bool:
    given = [cell for cell in cells if cell]
    return bool(given) and all(
        micrometres(cell) is not None or re.fullmatch(r"[\[(].*[\])]", cell) for cell in given
    )


def _names_points(named: Sequence[Column], count: int) -> bool:
    """Whether there are a name of positions and one of heights; or of heights beside a counter."""
    roles = {column.role for column in named}
    if roles & {"v", "y"}:
        return "n" in roles or {"v", "y"} <= roles
    return "n" in roles and len(named) == count and all(column.name for column in named)


def _with_units(named: Sequence[Column], units: Sequence[str] | None) -> tuple[Column, ...]:
    under = list(units or ())[: len(named)]
    under += [""] * (len(named) - len(under))
    return tuple(
        column if column.unit or not unit else column._replace(unit=unit)
        for column, unit in zip(named, under, strict=True)
    )
