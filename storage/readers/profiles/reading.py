"""Cross-sections of scratches: text files of points as profilers, microscopes and spreadsheets
write them.

Parsed here and not by numpy: units, decimal commas, the order of a header's columns and the line
number of what is wrong all matter.
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.profiles.columns import positions_and_heights
from storage.readers.profiles.records import record_of
from storage.readers.profiles.tables import MOST_POINTS, table_of, too_many
from storage.readers.profiles.text import lines_of, text_of

__all__ = ["FEWEST_POINTS", "MOST_POINTS", "ProfileFile", "read_profile"]

FEWEST_POINTS = 3


class ProfileFile(NamedTuple):
    """A scratch's cross-section as a file has it.

    points: (n, 2) float64, v across and n up, micrometres, in the file's order. notes: sentences on
    what was mended or left out. gaps: (g, 2) float64, the v on both sides of where points without a
    height were dropped.
    """

    points: NDArray[np.float64]
    notes: tuple[str, ...]
    gaps: NDArray[np.float64]


def read_profile(path: str | PathLike[str], step: float | None = None) -> ProfileFile:
    """Read a scratch's cross-section as a chain of points.

    Parameters: ``path``, a text file (UTF-8, UTF-16, Windows' code page, Shift-JIS) with a point a
    line: across the scratch, and height. Cells stand between tabs, semicolons, commas or spaces;
    decimals have points or commas. A header, its lines commented out or not, may name the columns
    (v and n, x and z, distance and height, lateral and profile …) in any order, and units in or
    under the names or in what stands before; without any, two columns are v and n in micrometres.
    A single column, or the metrology formats SMD, PRF, SDF and PR, are evenly spaced heights.
    ``step``: the distance of a single column's points, micrometres; over what the file says.

    Points without a height are dropped, and those that repeat the one before.

    Raises BadInput for a file that is missing, a directory, not text or empty; for columns, units
    or distances that are not clear; naming the line, for what is no point or no finite number; for
    fewer than 3 or more than 100 000 points; and for points that all lie on one height. Whether
    the chain crosses itself is not looked at.
    """
    file = Path(path)
    text = text_of(file)
    record = record_of(file, text)
    if record is None:
        table = table_of(file, lines_of(file, text))
        return _checked(file, *positions_and_heights(file, table, step))
    count = len(record.heights)
    if count > MOST_POINTS:
        raise too_many(file, count)
    unused = ("The setting step was not used: the file has its own.",)
    notes = record.notes + (() if step is None else unused)
    return _checked(file, np.arange(count, dtype=np.float64) * record.step, record.heights, notes)


def _checked(
    file: Path, v: NDArray[np.float64], n: NDArray[np.float64], notes: tuple[str, ...]
) -> ProfileFile:
    """Drop points that are none or repeat the one before; refuse what is then no profile."""
    at = np.flatnonzero(np.isfinite(v) & np.isfinite(n))
    is_gap = np.diff(at) > 1
    gaps = np.stack([v[at[:-1][is_gap]], v[at[1:][is_gap]]], axis=-1)
    points = np.stack([v[at], n[at]], axis=-1)
    is_new = np.ones(len(at), np.bool_)
    is_new[1:] = (points[1:] != points[:-1]).any(axis=1)
    missing, repeated = len(v) - len(at), int(np.sum(~is_new))
    for count, one, several in (
        (missing, "point without a height was", "points without a height were"),
        (
            repeated,
            "point that repeats the one before was",
            "points that repeat the one before were",
        ),
    ):
        if count:
            notes += (f"{count} {one if count == 1 else several} dropped.",)
    points = points[is_new]
    if len(points) < FEWEST_POINTS:
        found = f"{len(points)}{f', {missing} more without a height' if missing else ''}"
        expected = f"at least {FEWEST_POINTS} that differ, a line of numbers each"
        raise BadInput(file, "number of points", found, expected)
    for column, axis, expected in (
        (1, "height", "a profile with relief"),
        (0, "position", "points beside each other"),
    ):
        if (points[:, column] == points[0, column]).all():
            raise BadInput(file, axis, f"{points[0, column]:g} µm at every point", expected)
    return ProfileFile(points, notes, gaps)
