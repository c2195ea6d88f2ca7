"""GPX: where a receiver was, and when (GPX 1.0 and 1.1, topografix.com/gpx.asp)."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from os import PathLike
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.opening import whole_file

_GPX = "a GPX track: <trkpt lat lon> with <time>"
_LARGEST = 256 << 20
_FEWEST = 2


class GpxTrack(NamedTuple):
    """n places in the order of their times.

    times: (n,) float64, rising, seconds since 1970 in UTC.
    places: (n, 3) float64, degrees north, degrees east, metres above the sea (nan: not said).
    """

    times: NDArray[np.float64]
    places: NDArray[np.float64]


def read_gpx(path: str | PathLike[str]) -> GpxTrack:
    """All track points with a time, of all tracks.

    Raises BadInput for a file that is missing, no XML, no GPX or of more than 256 MiB, for
    coordinates that are none, and for fewer than two points with a time.
    """
    file = Path(path)
    data = whole_file(file, _GPX, _LARGEST)
    if b"<!DOCTYPE" in data[:4096] or b"<!ENTITY" in data[:4096]:
        raise BadInput(file, "content", "XML with definitions of its own", _GPX)
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise BadInput(file, "XML", f"broken in line {error.position[0]}", _GPX) from error
    if _name(root) != "gpx":
        raise BadInput(file, "format", f"<{_name(root)}>", _GPX)
    rows: dict[float, tuple[float, float, float]] = {}
    for point in root.iter():
        if _name(point) == "trkpt":
            inside = {_name(part): (part.text or "").strip() for part in point}
            when = _seconds(inside.get("time", ""))
            if when is not None:
                rows[when] = _place(file, point, inside.get("ele"))
    if len(rows) < _FEWEST:
        raise BadInput(file, "number of points with a time", f"{len(rows)}", "at least 2")
    times = np.array(sorted(rows))
    return GpxTrack(times, np.array([rows[when] for when in times]))


def places_at(track: GpxTrack, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places (k, 3) at times (k,), between neighbouring points along a straight line; nan outside
    of the track.

    >>> track = GpxTrack(np.array([0.0, 2.0]), np.array([[1.0, 2.0, 3.0], [3.0, 4.0, 5.0]]))
    >>> places_at(track, np.array([1.0, 3.0])).tolist()
    [[2.0, 3.0, 4.0], [nan, nan, nan]]
    """
    columns = [
        np.interp(times, track.times, column, left=np.nan, right=np.nan)
        for column in track.places.T
    ]
    return np.stack(columns, axis=1)


def _name(element: ElementTree.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _seconds(text: str) -> float | None:
    try:
        when = datetime.fromisoformat(text)
        return (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        return None


def _place(
    file: Path, point: ElementTree.Element, height: str | None
) -> tuple[float, float, float]:
    values = []
    for name, largest in (("lat", 90.0), ("lon", 180.0)):
        found = point.get(name, "missing")
        try:
            value = float(found)
        except ValueError:
            value = math.nan
        if not abs(value) <= largest:
            expected = f"degrees from {-largest:g} to {largest:g}"
            raise BadInput(file, f"{name} of a track point", found, expected)
        values.append(value)
    try:
        above = float(height) if height else math.nan
    except ValueError:
        above = math.nan
    return values[0], values[1], above if math.isfinite(above) else math.nan
