"""Profiles in the text formats of metrology: evenly spaced heights under a header of their own.

ISO 5436-2 (SMD), Taylor Hobson's PRF, ISO 25178-71 (``aBCR``, SDF) and the PTB's PR.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.profiles.cells import is_missing, number_of
from storage.readers.profiles.units import micrometres

_LARGEST_SCALE = 1e9  # micrometres a count
_TABLE = "columns of positions and heights: export as a table of text"


class Record(NamedTuple):
    """Heights (n,), nan where none was measured, and their distance, micrometres; what is left."""

    heights: NDArray[np.float64]
    step: float
    notes: tuple[str, ...]


def record_of(file: Path, text: str) -> Record | None:
    """The profile in one of the formats; None for a text in none of them.

    Raises BadInput for one that is damaged or holds what is no profile.
    """
    first = text[:400].lstrip("\ufeff \r\n")
    for mark, read in _FORMATS:
        if re.match(mark, first):
            return read(file, text)
    return None


def _smd(file: Path, text: str) -> Record:
    records = [record.replace("\0", " ").split("\n") for record in text.split("\x03")]
    axes = {words[0]: words[1:] for line in records[0] if (words := line.split())}
    if len(records) < 3 or axes.get("CX", [])[:1] != ["I"] or "CZ" not in axes:
        raise BadInput(file, "axis CX", "not incremental", f"a profile of even steps, or {_TABLE}")
    step = _size(file, "CX", [*axes["CX"][1:4], *axes["CX"][5:6]])
    height = _size(file, "CZ", axes["CZ"][1:4])
    return Record(_heights(file, records[2], height), step, ())


def _prf(file: Path, text: str) -> Record:
    records = [record.split("\n") for record in re.split(r"\bEOR\b[^\n]*\n?", text)]
    if len(records) < 3:
        raise BadInput(file, "records", f"{len(records)}", f"three that end with EOR, or {_TABLE}")
    words = [line.split() for record in records[:2] for line in record]
    axes = {line[0]: line[1:] for line in words if line}
    if axes.get("SPACING", [])[:1] != ["CX"] or not {"CX", "CZ"} <= set(axes):
        raise BadInput(file, "spacing of CX", "missing", f"a line SPACING CX, or {_TABLE}")
    step = _size(file, "CX", [*axes["CX"][1:4], *axes["SPACING"][1:2]])
    height = _size(file, "CZ", axes["CZ"][1:4])
    return Record(_heights(file, records[2], height), step, ())


def _bcr(file: Path, text: str) -> Record:
    parts = re.split(r"^\s*\*.*$", text, flags=re.MULTILINE)
    fields = {
        key.strip().casefold(): value.strip()
        for key, mark, value in (line.partition("=") for line in parts[0].splitlines())
        if mark
    }
    if len(parts) < 2:
        raise BadInput(file, "data", "missing", "heights behind a line with an asterisk")
    count, profiles = (_field(file, fields, name) for name in ("numpoints", "numprofiles"))
    step, height = (
        _sane(file, f"field {name}", _field(file, fields, name) * 1e6, fields[name])
        for name in ("xscale", "zscale")
    )
    heights = _heights(file, parts[1].splitlines(), height)
    if count < 1 or len(heights) < count:
        raise BadInput(file, "number of heights", f"{len(heights)}", f"NumPoints, {count:.0f}")
    others = f"The file holds {profiles:.0f} profiles: the first was read."
    return Record(heights[: int(count)], step, (others,) if profiles > 1 else ())


def _pr(file: Path, text: str) -> Record:
    """The PTB's, in German or English: points per millimetre, heights in micrometres."""
    lines = text.split("\n")
    density = re.search(r"X-(?:Aufl\S*|resolution)\s*[=:]?\s*([\d.eE+-]+)", lines[1])
    value = number_of(density[1]) if density else None
    if not value:
        raise BadInput(file, "X-resolution on line 2", "missing", f"points a mm, or {_TABLE}")
    step = _sane(file, "X-resolution on line 2", 1000.0 / value, f"{value:g}")
    return Record(_heights(file, lines[2:], 1.0), step, ())


def _field(file: Path, fields: dict[str, str], name: str) -> float:
    value = number_of(fields.get(name, ""))
    if value is None:
        raise BadInput(file, f"field {name}", f"'{fields.get(name, '')}'", "a number")
    return value


def _size(file: Path, axis: str, words: Sequence[str]) -> float:
    """Micrometres of an axis' count: points, unit, scale and, for steps, the increment."""
    numbers = [number_of(word) for word in words[2:]]
    unit = micrometres(words[1]) if len(words) > 1 else None
    if unit is None:
        found = f"'{' '.join(words[1:2])}'"
        raise BadInput(file, f"unit of {axis}", found, "a unit of length (mm, um, nm …)")
    size = unit * math.prod(number or math.nan for number in numbers or [None])
    return _sane(file, f"scale of {axis}", size, " ".join(words[2:]))


def _sane(file: Path, field: str, size: float, found: str) -> float:
    if not 1 / _LARGEST_SCALE <= size <= _LARGEST_SCALE:
        raise BadInput(file, field, f"'{found}'", "numbers that make a length of a count")
    return size


def _heights(file: Path, lines: Sequence[str], scale: float) -> NDArray[np.float64]:
    words = [word for line in lines for word in line.replace(",", ".").split()]
    heights = [np.nan if is_missing(word) else number_of(word) for word in words]
    for word, height in zip(words, heights, strict=True):
        if height is None:
            raise BadInput(file, "height", f"'{word}'", "a number")
    with np.errstate(over="ignore"):  # what is infinite is missing
        return np.array(heights, np.float64) * scale


_FORMATS: tuple[tuple[str, Callable[[Path, str], Record]], ...] = (
    (r"ISO 5436", _smd),
    (r"\d+\s+\d+\s*\r?\n\S+\s+\S+\s+PRF\b", _prf),
    (r"aBCR", _bcr),
    (r"Profil[^\n]*\nX-(?:Ma|len)", _pr),
)
