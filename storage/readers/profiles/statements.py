"""What an instrument says before its points: units, and the distance of evenly spaced ones."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple

from storage.readers.bad_input import BadInput
from storage.readers.profiles.cells import number_of
from storage.readers.profiles.units import column_of, micrometres, role_of, set_of

Axis = Literal["v", "n"]

_UNIT_KEY = re.compile(
    r"([^,;:=\t]*?)(?:units?|einheit(?:en)?|unités?|unidad|単位)\b\W*([^\s,;:=\])]+)", re.IGNORECASE
)
_IN_UNIT = re.compile(r"([^,;:=\t]*?)\bin\s+([^\W\d_]+)", re.IGNORECASE)
# Not where a number follows: "Scan length [mm]: 2" is a setting.
_AXIS_UNIT = re.compile(r"(\w+)\s*[\[(]\s*([^\W\d_]+)\s*[\])](?!\s*[,;:=]*\s*[-+\d])")
_STEP = re.compile(
    r"\W*(?P<key>[^:=,;\t\d]*?(?:step|spacing|pitch|increment|interval|delta ?x|\bdx|\u03b4x"
    r"|resolution|schrittweite|punktabstand|auflösung|ピッチ|間隔)[^:=,;\t\d]*?)"
    r"[\s:=,;]+(?P<value>[-+]?[\d.,]+(?:e[-+]?\d+)?)[\s,;]*(?P<unit>[^\s,;/]*)"
)
_NO_STEP = set_of(
    "y z height vertical velocity speed time force row rows angle scan number gray grey"
)


class Step(NamedTuple):
    """A distance of points as it is written; its unit, where one is given, in micrometres."""

    value: float
    unit: float | None


def stated_units(file: Path, preamble: Sequence[str]) -> dict[Axis, str]:
    """The units that the lines before the points give to an axis, or to both.

    Raises BadInput where they give two.
    """
    of_axis: dict[Axis, set[str]] = {"v": set(), "n": set()}
    of_all: set[str] = set()
    for line in preamble:
        for pattern in (_UNIT_KEY, _IN_UNIT, _AXIS_UNIT):
            for who, unit in pattern.findall(line):
                role = role_of(who)
                is_length = micrometres(unit) is not None
                if role in ("v", "n") and (is_length or pattern is _UNIT_KEY):
                    of_axis["v" if role == "v" else "n"].add(unit)
                elif is_length and pattern is not _AXIS_UNIT and len(unit) > 1:
                    of_all.add(unit)
    stated: dict[Axis, str] = {}
    for axis, units in of_axis.items():
        found = units or of_all
        if len({micrometres(unit) for unit in found}) > 1:
            words = " and ".join(sorted(found))
            expected = f"one: name the columns and their units in a header, v [{min(found)}]"
            raise BadInput(file, f"unit of {axis}", words, expected)
        if found:
            stated[axis] = min(found)
    return stated


def stated_step(file: Path, preamble: Sequence[str]) -> Step | None:
    """The distance of evenly spaced points, if the lines before them have it.

    Raises BadInput where they have two.
    """
    steps = set()
    for line in preamble:
        match = _STEP.match(line.casefold())
        if match is None:
            continue
        key = column_of(match["key"])
        value = number_of(match["value"].rstrip(".,"))
        if not value or _NO_STEP & set(re.findall(r"[^\W\d_]+", match["key"])):
            continue
        word = key.unit or match["unit"].strip("[]()")
        unit = micrometres(word)
        if unit is not None or not word:
            steps.add(Step(value, unit))
    if len({step.value * (step.unit or 1.0) for step in steps}) > 1:
        found = " and ".join(f"{step.value:g}" for step in sorted(steps))
        raise BadInput(file, "distance of points", found, "one: give it as the setting step, in µm")
    return next(iter(steps), None)
