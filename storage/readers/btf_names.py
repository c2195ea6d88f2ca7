"""Names of a BTF database's photographs to directions, and whether all of them are there.

UBO2003 and ATRIUM write ``tv030_pv030/00008 tl000 pl000 tv030 pv030.jpg``, UTIA writes
``tv000_pv000/tl000_pl000_tv000_pv000.png`` (btf.utia.cas.cz, "Data description"): theta and phi of
light and view in degrees. The index in front says nothing and is not used.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path, PurePosixPath
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput

BLANKS, UNDERSCORES = "blanks", "underscores"
EXAMPLES = "tl000 pl000 tv000 pv000.jpg or tl000_pl000_tv000_pv000.png"

_ANGLE = r"(\d{1,3}(?:\.\d+)?)"
_NAME = re.compile(
    rf"(?:.*[ _])?tl{_ANGLE}([ _])pl{_ANGLE}\2tv{_ANGLE}\2pv{_ANGLE}\.[a-z]\w*", re.IGNORECASE
)
_RINGS = ((0, 1), (15, 6), (30, 12), (45, 18), (60, 20), (75, 24))
"""Theta in degrees and number of azimuths of the directions that UBO2003, ATRIUM, UTIA share."""

_DOCUMENTS = frozenset(
    (".txt", ".md", ".xml", ".html", ".htm", ".pdf", ".rtf", ".doc", ".docx", ".nfo", ".url")
)
_DOCUMENT_NAMES = frozenset(("readme", "licence", "license", "copying", "notice", "authors"))
_LITTER = frozenset(("thumbs.db", "desktop.ini"))

Direction = tuple[float, float]


class PhotographName(NamedTuple):
    """Nominal directions in degrees (theta, phi), and what stands between the angles."""

    view: Direction
    light: Direction
    separator: str


class NamedPhotographs(NamedTuple):
    """Photographs in order: by view, then by light, theta before phi.

    ``names``: where each one is; ``light``, ``view``: (image, 2) float64, radians.
    """

    names: list[str]
    light: NDArray[np.float64]
    view: NDArray[np.float64]
    views: int
    lights_per_view: int
    separator: str


def photograph_name(name: str) -> PhotographName | None:
    """Directions from a photograph's name (folders in front are ignored); None without angles."""
    match = _NAME.fullmatch(PurePosixPath(name).name)
    if match is None:
        return None
    theta_light, separator, phi_light, theta_view, phi_view = match.groups()
    return PhotographName(
        view=(float(theta_view), float(phi_view)),
        light=(float(theta_light), float(phi_light)),
        separator=BLANKS if separator == " " else UNDERSCORES,
    )


def is_beside_the_point(name: str) -> bool:
    """Whether a file is litter of an operating system or a document to read."""
    path = PurePosixPath(name)
    last = path.name.lower()
    return (
        any(part.startswith((".", "__MACOSX")) for part in path.parts)
        or last in _LITTER
        or path.suffix.lower() in _DOCUMENTS
        or last in _DOCUMENT_NAMES
    )


def directions_of_81() -> list[Direction]:
    """The 81 directions of UBO2003, ATRIUM and UTIA in degrees, ring by ring."""
    return [
        (float(theta), 360.0 * step / count) for theta, count in _RINGS for step in range(count)
    ]


def ordered_photographs(path: Path, names: Iterable[str]) -> NamedPhotographs:
    """Sort a database's files by direction; documents and litter are left out.

    The lights must be the same for every view. Where every direction is one of the 81 and more
    than half of the 81 x 81 pairs are there, all 81 x 81 are expected; otherwise (a user's own
    set, a part of a database) every view seen with every light seen.

    Raises BadInput for names without angles, angles off the hemisphere, two files of one pair,
    a missing pair, and where no photograph is left.
    """
    found: dict[tuple[Direction, Direction], str] = {}
    separator = ""
    for name in names:
        if is_beside_the_point(name):
            continue
        angles = _checked_name(path, name, separator)
        separator = angles.separator
        pair = (angles.view, angles.light)
        if pair in found:
            raise BadInput(
                path / name,
                f"photograph {_pair(pair)}",
                f"in two files (also {found[pair]})",
                "one",
            )
        found[pair] = name
    if not found:
        raise BadInput(path, "content", "without photographs", f"files named {EXAMPLES}")
    views, lights = _expected_directions(found.keys())
    _check_complete(path, found, views, lights)
    pairs = sorted(found)
    radians = np.radians(np.array(pairs, dtype=np.float64))
    return NamedPhotographs(
        names=[found[pair] for pair in pairs],
        light=np.ascontiguousarray(radians[:, 1]),
        view=np.ascontiguousarray(radians[:, 0]),
        views=len(views),
        lights_per_view=len(lights),
        separator=separator,
    )


def _checked_name(path: Path, name: str, separator: str) -> PhotographName:
    angles = photograph_name(name)
    if angles is None:
        raise BadInput(path / name, "name", "without angles", f"a name like {EXAMPLES}")
    for tag, (theta, phi) in (("l", angles.light), ("v", angles.view)):
        if theta > 90:
            raise BadInput(path / name, f"t{tag}", f"{theta:g} degrees", "0 to 90 degrees")
        if phi >= 360:
            raise BadInput(path / name, f"p{tag}", f"{phi:g} degrees", "0 to below 360 degrees")
    if separator and angles.separator != separator:
        raise BadInput(path / name, "name", f"with {angles.separator}", f"{separator}, as before")
    return angles


def _expected_directions(
    pairs: Iterable[tuple[Direction, Direction]],
) -> tuple[list[Direction], list[Direction]]:
    """Views and lights, sorted."""
    seen = list(pairs)
    views, lights = {view for view, _ in seen}, {light for _, light in seen}
    table = directions_of_81()
    if views | lights <= set(table) and 2 * len(seen) > len(table) ** 2:
        return table, table
    return sorted(views), sorted(lights)


def _check_complete(
    path: Path,
    found: dict[tuple[Direction, Direction], str],
    views: Sequence[Direction],
    lights: Sequence[Direction],
) -> None:
    missing = len(views) * len(lights) - len(found)
    if not missing:
        return
    first = next((v, light) for v in views for light in lights if (v, light) not in found)
    raise BadInput(
        path,
        f"photograph {_pair(first)}",
        f"missing ({missing} missing in all)",
        f"every one of {len(views)} views x {len(lights)} lights",
    )


def _pair(pair: tuple[Direction, Direction]) -> str:
    (theta_view, phi_view), (theta_light, phi_light) = pair
    return f"tl={theta_light:g} pl={phi_light:g} tv={theta_view:g} pv={phi_view:g}"
