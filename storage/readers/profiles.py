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
from storage.readers.profile_columns import positions_and_heights
from storage.readers.profile_records import record_of
from storage.readers.profile_tables import table_of
from storage.readers.profile_text import lines_of, text_of

FEWEST_POINTS = 3
MOST_POINTS = 100_000


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
    notes: tuple[str, ...]
    if record is not None:
        if len(record.heights) > MOST_POINTS:
            raise _too_many(file, len(record.heights))
        v = np.arange(len(record.heights), dtype=np.float64) * record.step
        n, notes = record.heights, record.notes
    else:
        table = table_of(file, lines_of(file, text))
        if len(table.rows) > MOST_POINTS:
            raise _too_many(file, len(table.rows))
        v, n, notes = positions_and_heights(file, table, step)
    if record is not None and step is not None:
        notes += ("The setting step was not used: the file has its own.",)
    return _checked(file, v, n, notes)


def _checked(
    file: Path, v: NDArray[np.float64], n: NDArray[np.float64], notes: tuple[str, ...]
) -> ProfileFile:
    measured = np.isfinite(v) & np.isfinite(n)
    points = np.stack([v, n], axis=-1)[measured]
    if not measured.all():
        dropped = int(np.sum(~measured))
        word = "point without a height was" if dropped == 1 else "points without a height were"
        notes += (f"{dropped} {word} dropped.",)
    if len(points) < FEWEST_POINTS:
        without = f", {np.sum(~measured)} more without a height" * bool((~measured).any())
        expected = f"at least {FEWEST_POINTS}, a line each"
        raise BadInput(file, "number of points", f"{len(points)}{without}", expected)
    at = np.flatnonzero(measured)
    is_gap = np.diff(at) > 1
    gaps = np.stack([v[at[:-1][is_gap]], v[at[1:][is_gap]]], axis=-1)
    repeated = (np.diff(points, axis=0) == 0).all(axis=1)
    if repeated.any():
        count = int(repeated.sum())
        word = "point that repeats" if count == 1 else "points that repeat"
        notes += (f"{count} {word} the one before {'was' if count == 1 else 'were'} dropped.",)
        points = points[np.concatenate([[True], ~repeated])]
    if (points[:, 1] == points[0, 1]).all():
        found = f"{points[0, 1]:g} µm at every point"
        raise BadInput(file, "height", found, "a profile with relief")
    if len(points) < FEWEST_POINTS:
        raise BadInput(
            file, "number of points", f"{len(points)} that differ", f"at least {FEWEST_POINTS}"
        )
    if not np.ptp(points[:, 0]) > 0:
        found = f"{points[0, 0]:g} µm at every point"
        raise BadInput(file, "position", found, "points beside each other")
    return ProfileFile(points, notes, gaps)


def _too_many(file: Path, count: int) -> BadInput:
    expected = f"at most {MOST_POINTS}: export the surroundings of the scratch alone"
    return BadInput(file, "number of points", f"{count}", expected)
