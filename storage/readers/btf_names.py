"""Names of a BTF database's photographs to directions, and whether all of them are there.

UBO2003 and ATRIUM write ``tv030_pv030/00008 tl000 pl000 tv030 pv030.jpg``, UTIA writes
``tv000_pv000/tl000_pl000_tv000_pv000.png`` (btf.utia.cas.cz, "Data description"): theta and phi of
light and view in degrees. Others have the four in another order, with other separators, or the
view in the folder's name alone. The index in front says nothing and is not used.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path, PurePosixPath
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened

UBO2003, UTIA, OTHER = "UBO2003 / ATRIUM", "UTIA", "photographs"
EXAMPLES = "tl000 pl000 tv000 pv000.jpg or tl000_pl000_tv000_pv000.png"

_ANGLE = re.compile(
    r"(?<![a-z])(theta|phi|t|p)[ _-]?([livor])((?:[ _=:-]|(?=[\d.]))-?)(\d+(?:[.,]\d+)?)",
    re.IGNORECASE,
)
"""``tl15``, ``pl_7.5``, ``theta_i=30``, ``po-20``: light l or i, view v, o or r."""
_SUFFIX = re.compile(r"\.[a-z]\w*$", re.IGNORECASE)
_BLANKS = re.compile(r"(?:\d+ )?tl\d{3} pl\d{3} tv\d{3} pv\d{3}")
_UNDERSCORES = re.compile(r"tl\d{3}_pl\d{3}_tv\d{3}_pv\d{3}")
_RINGS = ((0, 1), (15, 6), (30, 12), (45, 18), (60, 20), (75, 24))
"""Theta in degrees and number of azimuths of the directions that UBO2003, ATRIUM, UTIA share."""

_PHOTOGRAPHS = frozenset(
    (".jpg", ".jpeg", ".jpe", ".jfif", ".png", ".exr", ".hdr", ".pic", ".rgbe")
)
_LITTER = frozenset(("thumbs.db", "desktop.ini", "@eadir", "__macosx"))
_NO_PHOTOGRAPHS = re.compile(r"preview|thumb|mask|icon", re.IGNORECASE)
_SHOWN = 3  # names of what was left out

Direction = tuple[float, float]
Pair = tuple[Direction, Direction]
"""View and light, as photographs are ordered."""


class PhotographName(NamedTuple):
    """Nominal directions in degrees, theta and phi, and whose names look so."""

    view: Direction
    light: Direction
    style: str


class NamedPhotographs(NamedTuple):
    """Photographs in order: by view, then by light, theta before phi.

    ``names``: where each one is; ``light``, ``view``: (image, 2) float64, radians. ``style``: whose
    names look so. ``notes``: sentences on what was left out.
    """

    names: list[str]
    light: NDArray[np.float64]
    view: NDArray[np.float64]
    views: int
    lights_per_view: int
    style: str
    notes: tuple[str, ...]


def photograph_name(name: str) -> PhotographName | None:
    """Directions from a photograph's name, and from its folders' where it has not all of them; None
    without all four angles, or with two of a kind that disagree.

    Negative angles and those of a turn and more are brought to theta from 0 and phi below 360.

    >>> photograph_name("tv30_pv0/img_TL7.5-PL-90.png")
    PhotographName(view=(30.0, 0.0), light=(7.5, 270.0), style='photographs')
    """
    path = PurePosixPath(name)
    stem = _SUFFIX.sub("", path.name)
    found: dict[str, float] = {}
    for part in (stem, *reversed(path.parts[:-1])):
        here = _angles(part)
        if here is None:
            return None
        found = here | found
        if len(found) == 4:
            break
    if len(found) < 4:
        return None
    style = OTHER
    if _BLANKS.fullmatch(stem):
        style = UBO2003
    elif _UNDERSCORES.fullmatch(stem):
        style = UTIA
    return PhotographName(
        _direction(found["theta v"], found["phi v"]),
        _direction(found["theta l"], found["phi l"]),
        style,
    )


def _angles(part: str) -> dict[str, float] | None:
    """Degrees by what they are of; None where two of a kind disagree."""
    matches = list(_ANGLE.finditer(part))
    # Hyphens that stand in front of every angle separate; else they are signs.
    hyphens = bool(matches) and all(match[3].endswith("-") for match in matches)
    found: dict[str, float] = {}
    for match in matches:
        kind = f"{'theta' if match[1][0] in 'tT' else 'phi'} {'l' if match[2] in 'liLI' else 'v'}"
        degrees = float(match[4][:12].replace(",", "."))
        if match[3].endswith("-") and not (hyphens and len(match[3]) == 1):
            degrees = -degrees
        if found.setdefault(kind, degrees) != degrees:
            return None
    return found


def _direction(theta: float, phi: float) -> Direction:
    return (-theta, (phi + 180) % 360) if theta < 0 else (theta, phi % 360)


def directions_of_81() -> list[Direction]:
    """The 81 directions of UBO2003, ATRIUM and UTIA in degrees, ring by ring."""
    return [
        (float(theta), 360.0 * step / count) for theta, count in _RINGS for step in range(count)
    ]


def is_litter(name: str) -> bool:
    """Whether an operating system has left a file there by itself."""
    parts = PurePosixPath(name.lower()).parts
    return any(part.startswith(".") or part in _LITTER for part in parts)


def ordered_photographs(
    path: Path, names: Iterable[str], are_equal: Callable[[str, str], bool]
) -> NamedPhotographs:
    """Sort a database's files by direction; what is no photograph of a pair is left out.

    The lights must be the same for every view. Where every direction is one of the 81 and more
    than half of the 81 x 81 pairs are there, all 81 x 81 are expected; otherwise (a user's own
    set, a part of a database) every view seen with every light seen. ``are_equal``: whether two
    files have the same content; asked of those of one pair, of which the first is taken.

    Raises BadInput for angles off the hemisphere, two different files of one pair, a missing pair,
    and where no photograph is left.
    """
    found: dict[Pair, str] = {}
    styles: set[str] = set()
    left_out: list[str] = []
    repeated: list[str] = []
    for name, angles in _photographs(names, left_out):
        for tag, (theta, _) in (("l", angles.light), ("v", angles.view)):
            if theta > 90:
                expected = "0 to 90 degrees: move what is below the surface out of the database"
                raise BadInput(path / name, f"t{tag}", f"{theta:g} degrees", expected)
        pair = (angles.view, angles.light)
        first = found.setdefault(pair, name)
        styles.add(angles.style)
        if first is name:
            continue
        if not are_equal(first, name):
            expected = f"one file a pair: move this or {shortened(first)} out of the database"
            raise BadInput(
                path / name, f"photograph {_pair(pair)}", "in two files that differ", expected
            )
        repeated.append(name)
    if not found:
        raise _without_photographs(path, left_out)
    views, lights = _expected_directions(found.keys())
    _check_complete(path, found, views, lights, left_out)
    pairs = sorted(found)
    radians = np.radians(np.array(pairs, dtype=np.float64))
    return NamedPhotographs(
        names=[found[pair] for pair in pairs],
        light=np.ascontiguousarray(radians[:, 1]),
        view=np.ascontiguousarray(radians[:, 0]),
        views=len(views),
        lights_per_view=len(lights),
        style=styles.pop() if len(styles) == 1 else OTHER,
        notes=_notes(left_out, repeated),
    )


def _without_photographs(path: Path, names: Sequence[str]) -> BadInput:
    expected = f"files named {EXAMPLES}"
    packed = [name for name in names if name.lower().endswith((".zip", ".rar", ".7z", ".gz"))]
    if packed:
        expected += f": unpack {_listed(packed)}"
    elif names:
        expected += f", found {_listed(names)}"
    return BadInput(path, "content", "without photographs", expected)


def _photographs(names: Iterable[str], left_out: list[str]) -> Iterator[tuple[str, PhotographName]]:
    """Photographs by their names; the others but litter go into ``left_out``."""
    for name in names:
        if is_litter(name):
            continue
        is_one = _SUFFIX.search(name) and PurePosixPath(name).suffix.lower() in _PHOTOGRAPHS
        angles = photograph_name(name) if is_one else None
        if angles is None or _NO_PHOTOGRAPHS.search(name):
            left_out.append(name)
        else:
            yield name, angles


def _notes(left_out: Sequence[str], repeated: Sequence[str]) -> tuple[str, ...]:
    notes = []
    if left_out:
        notes.append(f"{_files(left_out)} left out: no photographs of a pair.")
    if repeated:
        notes.append(f"{_files(repeated)} left out: copies of other photographs.")
    return tuple(notes)


def _files(names: Sequence[str]) -> str:
    many = len(names) != 1
    files, were = ("files", "were") if many else ("file", "was")
    return f"{len(names)} {files} ({_listed(names)}) {were}"


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(shortened(PurePosixPath(name).name, 40) for name in names[:_SHOWN])
    return shown + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")


def _expected_directions(pairs: Iterable[Pair]) -> tuple[list[Direction], list[Direction]]:
    """Views and lights, sorted."""
    seen = list(pairs)
    views, lights = {view for view, _ in seen}, {light for _, light in seen}
    table = directions_of_81()
    if views | lights <= set(table) and 2 * len(seen) > len(table) ** 2:
        return table, table
    return sorted(views), sorted(lights)


def _check_complete(
    path: Path,
    found: dict[Pair, str],
    views: Sequence[Direction],
    lights: Sequence[Direction],
    left_out: Sequence[str],
) -> None:
    missing = len(views) * len(lights) - len(found)
    if not missing:
        return
    first = next((v, light) for v in views for light in lights if (v, light) not in found)
    way_out = "unpack the database again, or leave only views that have all lights"
    if left_out:
        way_out += f"; {_listed(left_out)} had no angles in their names"
    raise BadInput(
        path,
        f"photograph {_pair(first)}",
        f"missing ({missing} missing in all)",
        f"every one of {len(views)} views x {len(lights)} lights: {way_out}",
    )


def _pair(pair: Pair) -> str:
    (theta_view, phi_view), (theta_light, phi_light) = pair
    return f"tl={theta_light:g} pl={phi_light:g} tv={theta_view:g} pv={phi_view:g}"
