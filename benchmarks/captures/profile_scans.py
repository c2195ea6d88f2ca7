"""Scans of millimetres with one scratch somewhere: rough, tilted, with gaps, full of points."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case
from pipelines.glass_scratches.tables.scans import Measured, measured_profile
from storage.readers.profiles import read_profile

Floats = NDArray[np.float64]

WIDTH, DEPTH, AT = 24.0, 6.0, 1234.0
"""Of the scratch in every scan, micrometres: a V with one wall twice as steep as the other, deepest
at AT."""
ROUGHNESS = 0.04


def groove(v: Floats) -> Floats:
    """Heights of the land with the scratch, without roughness."""
    left, right = WIDTH * 2 / 3, WIDTH / 3
    beside = np.where(v < AT, (AT - v) / left, (v - AT) / right)
    return DEPTH * np.minimum(beside - 1, 0.0)


def scan(points: int, length: float, tilt: float = 0.0, seed: int = 1) -> Floats:
    """A scan (points, 2) in micrometres; ``tilt``: micrometres of height a micrometre."""
    v = np.linspace(0, length, points) + max(0.0, AT - length / 2) * (length < AT)
    noise = ROUGHNESS * np.random.default_rng(seed).standard_normal(points)
    return np.stack([v, groove(v) + noise + tilt * v], axis=-1)


def read_scan(path: Path, level: bool = False) -> Measured:
    """The file and the scratch in it, as the product takes them; the notes of both."""
    read = read_profile(path)
    made = measured_profile(read.points, read.gaps, path.name, level=level)
    return made._replace(notes=(*read.notes, *made.notes))


def _is_scratch(made: Measured) -> bool:
    """Whether what was taken is the scratch, to within the roughness, from left to right."""
    points = made.points
    at = points[np.argmin(points[:, 1]), 0]
    beside = groove(points[:, 0] - at + AT)
    off = points[:, 1] - points[:, 1].min() - DEPTH - beside
    width = points[-1, 0] - points[0, 0]
    return bool(np.abs(off).max() < 0.5 and abs(np.median(off)) < 0.2 and 0.9 < width / WIDTH < 1.2)


def _write(rows: Floats, header: str = "x [um],z [um]") -> Callable[[Path], None]:
    return lambda path: np.savetxt(
        path, rows, "%.5f", delimiter=",", header=header, comments="", encoding="utf-8"
    )


def _with_gap(rows: Floats, low: float, high: float) -> Floats:
    rows = rows.copy()
    rows[(rows[:, 0] > low) & (rows[:, 0] < high), 1] = np.nan
    return rows


_LONG = scan(8001, 4000.0)
_MILLIMETRES = _LONG * [1e-3, 1e3]  # and nanometres
_TAKEN = r"largest groove was taken, from v = 12\d\d.* to 12\d\d.* of a scan of 4000 µm"

CASES = (
    Case("scan_of_4_mm.csv", "a scratch in a long scan", read_scan, "told", (_TAKEN,),
         _is_scratch, _write(_LONG)),
    Case("scan_mm_and_nm.csv", "a scratch in a long scan", read_scan, "told", (_TAKEN,),
         _is_scratch, _write(_MILLIMETRES, "Lateral (mm),Total Profile (nm)")),
    Case("scan_backwards.csv", "profiles from right to left", read_scan, "told", (_TAKEN,),
         _is_scratch, _write(_LONG[::-1])),
    Case("scan_tilted.csv", "tilted scans", functools.partial(read_scan, level=True), "told",
         (_TAKEN,), _is_scratch, _write(scan(8001, 4000.0, tilt=0.05))),
    Case("scan_dropouts.csv", "heights that are missing", read_scan, "told",
         (_TAKEN, "points without a height"), _is_scratch,
         _write(_with_gap(_LONG, 2000.0, 2100.0))),
    Case("scan_30000_points.csv", "more points than a table can use", read_scan, "told",
         (r"points 1024 were kept", "largest groove"), _is_scratch, _write(scan(30_000, 600.0))),
    Case("scan_120000_points.csv", "more points than a table can use", read_profile, "refused",
         ("export the surroundings of the scratch",), None,
         lambda path: path.write_text("x,z\n" + "1,2\n2,1\n" * 60_000)),
)  # fmt: skip
