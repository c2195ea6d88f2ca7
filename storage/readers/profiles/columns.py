"""From a table of text to positions and heights in micrometres."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.profiles.cells import SEPARATORS, decimal_mark, is_missing, number_of
from storage.readers.profiles.statements import Axis, stated_step, stated_units
from storage.readers.profiles.tables import Table
from storage.readers.profiles.units import DEPTHS, Column, micrometres, set_of

Floats = NDArray[np.float64]

_ALONG = set_of("distance dist lateral path weg abstand strecke 距離")
_SHOWN = 5  # names of columns in a note
_NEAR = 10.0  # steps: what begins so close behind the end is not another profile
_STEP_WAY_OUT = "the distance of the points as the setting step, in µm, or a column of positions"
_NAMES_WAY_OUT = "a header that names two columns, v (or x, distance) and n (or z, height)"


class _Choice(NamedTuple):
    """Which columns are positions (None: evenly spaced) and heights, and those left."""

    v: int | None
    n: int
    unused: tuple[str, ...]


def positions_and_heights(
    file: Path, table: Table, step: float | None
) -> tuple[Floats, Floats, tuple[str, ...]]:
    """Positions (n,) and heights (n,), micrometres, nan where none is given; and notes.

    Raises BadInput for columns, units or distances that are not clear, and for what is no number.
    """
    stated = stated_units(file, table.preamble)
    choice = _choose(file, table)
    columns = table.columns or (Column("", "other", None),) * table.width
    notes = []
    if choice.unused:
        shown = ", ".join(f"'{shortened(name, 30)}'" for name in choice.unused[:_SHOWN])
        more = f" and {len(choice.unused) - _SHOWN} more" * (len(choice.unused) > _SHOWN)
        which = "columns {} were" if len(choice.unused) > 1 else "column {} was"
        notes.append(f"The {which.format(shown + more)} not used.")
    used: tuple[tuple[Axis, int | None], ...] = (("v", choice.v), ("n", choice.n))
    names = {axis: columns[at].name or axis for axis, at in used if at is not None}
    units = {axis: columns[at].unit or stated.get(axis) for axis, at in used if at is not None}
    v, n = _numbers(file, table, [(names.get(axis, axis), at) for axis, at in used])
    sizes = _sizes(file, names, units)
    with np.errstate(over="ignore"):  # what is infinite is missing
        n *= sizes["n"]
        v *= sizes.get("v", 1.0)
    if choice.v is None:
        v = np.arange(len(n), dtype=np.float64) * _step(file, table, step, units["n"])
    elif step is not None:
        notes.append("The setting step was not used: the file has its own positions.")
    name = columns[choice.n].name
    if DEPTHS & set(re.findall(r"[^\W\d_]+", name.casefold())) and _is_downwards(n):
        notes.append(f"The column '{shortened(name, 30)}' counts downwards and was turned over.")
        n = 0 - n
    notes += _further(file, table, choice, v / sizes["v"] if choice.v is not None else None)
    return v, n, tuple(notes)


def _choose(file: Path, table: Table) -> _Choice:
    columns = table.columns
    if columns is None or not any(column.name for column in columns):
        if table.width > 2:
            words = f"{table.width} without names"
            expected = f"{_NAMES_WAY_OUT}; of a measured area export one profile"
            raise BadInput(file, "number of columns", words, expected)
        return _Choice(0 if table.width == 2 else None, table.width - 1, ())
    of = {role: [i for i, c in enumerate(columns) if c.role == role] for role in ("v", "n", "y")}
    along = [i for i in of["v"] if _ALONG & set(re.findall(r"[^\W\d_]+", columns[i].name.lower()))]
    v = next(iter(along or of["v"]), None)
    if v is not None and of["n"] and of["y"] and not along:
        v = _across(file, table, v, of["y"][0])
    elif v is None and of["n"]:
        v = next(iter(of["y"]), None)
    heights = of["n"] or of["y"]
    n = next((i for i in heights if v is not None and i > v), heights[0])
    unused = tuple(
        column.name for i, column in enumerate(columns) if i not in (v, n) and column.name
    )
    return _Choice(v, n, unused)


def _across(file: Path, table: Table, x: int, y: int) -> int:
    """Of x and y, beside z, the one along the profile: the other has one value."""
    seen: dict[int, set[str]] = {
        at: {cells[at] for _, cells in table.rows if at < len(cells)} for at in (x, y)
    }
    for along, other in ((x, y), (y, x)):
        if len(seen[other]) == 1:
            return along
    expected = "one of them constant, or a column of distances along the profile"
    raise BadInput(file, "columns x and y", "both changing", expected)


def _numbers(file: Path, table: Table, used: list[tuple[str, int | None]]) -> tuple[Floats, Floats]:
    """The columns' numbers, each (n,); nan where one is missing. A column that is None is zero."""
    width = max(at for _, at in used if at is not None) + 1
    found = np.zeros((len(table.rows), 2))
    decimal = ""  # the mark of the first number that has one
    for row, (line, cells) in enumerate(table.rows):
        too_few = len(cells) < width and (table.separator == " " or len(cells) < min(width, 2))
        if len(cells) > table.width or too_few:
            between = SEPARATORS.get(table.separator, "nothing")
            raise BadInput(
                file,
                f"number of columns on line {line}",
                f"{len(cells)}",
                f"{table.width} with {between} between them, as on the other lines",
            )
        for column, (name, at) in enumerate(used):
            cell = cells[at] if at is not None and at < len(cells) else ""
            if at is None:
                continue
            if is_missing(cell):
                found[row, column] = np.nan
                continue
            decimal = decimal or decimal_mark(cell)
            value = number_of(cell, decimal)
            if value is None:
                raise BadInput(file, f"{name} on line {line}", f"'{cell}'", _wanted(cell, decimal))
            found[row, column] = value
    return found[:, 0], found[:, 1]


def _wanted(cell: str, decimal: str) -> str:
    if number_of(cell) is None:
        return "a finite number, without marks between its thousands"
    return f"a number with a '{decimal}' before its decimals, as on the lines before"


def _sizes(file: Path, names: dict[Axis, str], units: dict[Axis, str | None]) -> dict[Axis, float]:
    """Micrometres of each axis' unit; without any, both are micrometres."""
    sizes: dict[Axis, float] = {}
    for axis, unit in units.items():
        size = micrometres(unit) if unit is not None else None
        if unit is not None and size is None:
            what = f"unit of {shortened(names[axis], 30)}"
            raise BadInput(file, what, f"'{unit}'", "a unit of length (nm, um, mm …)")
        if size is not None:
            sizes[axis] = size
    for axis in units:
        if axis not in sizes and any(size != 1.0 for size in sizes.values()):
            given = next(unit for unit in units.values() if unit)
            expected = (
                f"one in the header, such as {names[axis]} [{given}]: the other axis has {given}"
            )
            raise BadInput(file, f"unit of {names[axis]}", "missing", expected)
    return {axis: sizes.get(axis, 1.0) for axis in units}


def _step(file: Path, table: Table, step: float | None, unit: str | None) -> float:
    """The distance of evenly spaced points in micrometres."""
    if step is not None:
        return step
    stated = stated_step(file, table.preamble)
    if stated is None:
        raise BadInput(file, "positions", "missing: heights alone", _STEP_WAY_OUT)
    size = stated.unit
    if size is None and (unit is None or micrometres(unit) == 1.0):
        size = 1.0
    if size is None or stated.value < 0:
        raise BadInput(file, "unit of the points' distance", "missing", _STEP_WAY_OUT)
    return stated.value * size


def _is_downwards(n: Floats) -> bool:
    middle = np.nanmedian(n) if np.isfinite(n).any() else 0.0
    return bool(np.nanmax(n, initial=-np.inf) - middle > middle - np.nanmin(n, initial=np.inf))


def _further(file: Path, table: Table, choice: _Choice, v: Floats | None) -> list[str]:
    """A note on other tables behind the first; a refusal where they are its own end."""
    if not table.further:
        return []
    line, cells = table.further[0]
    if choice.v is not None and v is not None and choice.v < len(cells):
        first = number_of(cells[choice.v])
        known = v[np.isfinite(v)]
        step = float(np.median(np.diff(known))) if len(known) > 1 else 0.0
        if first is not None and step and 0 < (first - known[-1]) / step <= _NEAR:
            expected = "points until the end, or a position that begins anew"
            raise BadInput(file, f"line before {line}", "no point", expected)
    count = len(table.further)
    what = "another table" if count == 1 else f"{count} other tables"
    where = f"on line {line}" if count == 1 else f"from line {line} on"
    return [f"The first table was read; {what} {where} {'was' if count == 1 else 'were'} not."]
