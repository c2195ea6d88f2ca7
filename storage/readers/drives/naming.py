"""Which camera took a photograph, and when, where only its file's name says so."""

from __future__ import annotations

import math
import re
from collections import Counter, defaultdict, deque
from collections.abc import Sequence

_DIGITS = re.compile(r"\d+")
_LONGEST = 18
"""Digits of a number that is one: more are an identifier."""
_MOST_NUMBERS = 8
"""Of a name, the last ones."""
_FEWEST_TOGETHER = 0.75
"""Times a photograph, where cameras took them together: half of the times have two at least."""


def cameras_and_times(names: Sequence[str]) -> list[tuple[str, float]]:
    """A camera's name and a time for each path of a photograph (folders by "/", any ending).

    Names that are alike but for their numbers belong together; of those numbers the one that takes
    most values is the time, and all others stay with the camera's name, folders included. Where
    cameras of one folder then hardly share a time, or names have no numbers, the photographs are
    one camera's and are counted in the order of their names.

    >>> cameras_and_times(["left/0001.png", "left/0002.png", "right/0001.png"])
    [('left', 1.0), ('left', 2.0), ('right', 1.0)]
    """
    stems = [_stem(name) for name in names]
    groups: dict[str, list[int]] = defaultdict(list)
    for row, stem in enumerate(stems):
        groups[_DIGITS.sub("#", stem)].append(row)
    found: list[tuple[str, float]] = [("", 0.0)] * len(names)
    for rows in groups.values():
        numbers = [list(deque(_DIGITS.finditer(stems[row]), _MOST_NUMBERS)) for row in rows]
        chosen = _changing(numbers, stems[rows[0]].rfind("/"))
        for row, matches in zip(rows, numbers, strict=True):
            found[row] = _camera_and_time(stems[row], matches, chosen)
    return _one_camera_a_folder(names, stems, found)


def by_number(name: str) -> list[tuple[bool, int, str]]:
    """What sorts names as people do: "b2" before "b10"."""
    parts = re.split(r"(\d+)", name)
    return [
        (False, int(part[:_LONGEST]), part) if part.isdecimal() else (True, 0, part)
        for part in parts
        if part
    ]


def _stem(name: str) -> str:
    folder, slash, last = name.replace("\\", "/").rpartition("/")
    folder = "/".join(part for part in folder.split("/") if part not in ("", "."))
    stem, dot, ending = last.rpartition(".")
    short = bool(dot and stem and ending.isalnum() and len(ending) <= 4)
    kept = stem if short and not ending.isdecimal() else last
    return f"{folder}/{kept}" if slash and folder else kept


def _changing(numbers: Sequence[Sequence[re.Match[str]]], folder_end: int) -> int | None:
    """Which number of the names takes most values; of equal ones the last. One in a folder's name
    counts only where the file's own has none."""
    places = range(len(numbers[0]))
    own = [place for place in places if numbers[0][place].start() > folder_end]
    best, most = None, 0
    for place in own or places:
        values = len({matches[place].group() for matches in numbers})
        if values >= most:
            best, most = place, values
    return best


def _camera_and_time(
    stem: str, matches: Sequence[re.Match[str]], chosen: int | None
) -> tuple[str, float]:
    if chosen is None:
        return stem, math.nan
    number = matches[chosen]
    left = stem[: number.start()] + stem[number.end() :]
    camera = "/".join(part.strip(" _-.") for part in left.split("/")).strip("/")
    return camera or "camera", float(number.group()[:_LONGEST])


def _one_camera_a_folder(
    names: Sequence[str], stems: Sequence[str], found: Sequence[tuple[str, float]]
) -> list[tuple[str, float]]:
    folders: dict[str, list[int]] = defaultdict(list)
    for row, stem in enumerate(stems):
        folders[stem.rpartition("/")[0]].append(row)
    told = list(found)
    for folder, rows in folders.items():
        cameras = Counter(found[row][0] for row in rows)
        times = {found[row][1] for row in rows}
        pairs = {found[row] for row in rows}
        together = len(cameras) == 1 or len(times) <= _FEWEST_TOGETHER * len(rows)
        numbered = all(time == time for time in times)
        if numbered and together and len(pairs) == len(rows):
            continue
        ordered = sorted(rows, key=lambda row: by_number(names[row]))
        for count, row in enumerate(ordered):
            told[row] = (folder or "camera", float(count))
    return told
