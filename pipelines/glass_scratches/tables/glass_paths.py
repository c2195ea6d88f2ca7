"""Paths of light through walls of glass, in the cross-section: reflected and refracted, both sides.

A wall lies along the scratch, so what a direction has along it stays: its *lean* s, the component
along the scratch of the unit vector times the refractive index, is the same before and after any
number of walls (Snell's law). In the cross-section light then moves as in a plane, with the rest
k = sqrt(n² - s²) in place of n, and is reflected by Fresnel's equations for its angle in space. So
a table in the plane for each lean is exact for a groove in space.

Beams are counted by bins of phi on both sides of the surface: bins 0 to M - 1 outside, from the
normal towards v; bins M to 2 M - 1 inside the glass, from the inward normal towards v.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_edges
from pipelines.glass_scratches.tables.glass_radiosity import diffuse_reflectance
from pipelines.glass_scratches.tables.groove_walls import GrooveWalls
from pipelines.glass_scratches.tables.monte_carlo import PLACES
from pipelines.glass_scratches.tables.random_numbers import next_number

_BOUNCES = 10_000
_MOST_GROOVES = 100_000
_KEPT, _LOST = -1, -2


class GlassPaths(NamedTuple):
    """``leaving`` (2 M in, places, 2 M out) int64: paths by where they cross the opening and the
    bin that they leave into; ``kept`` (2 M in, places): that walls kept; ``rays`` a bin."""

    leaving: NDArray[np.int64]
    kept: NDArray[np.int64]
    rays: int


def shoot_glass_paths(
    walls: GrooveWalls,
    lean: float,
    *,
    bins: int,
    index: float,
    rays: int,
    albedo: float = 1.0,
    even: bool = False,
    seed: int = 0,
    incidence: NDArray[np.int64] | None = None,
) -> GlassPaths:
    """Follow ``rays`` paths from every bin (or from those of ``incidence``), of one lean s.

    From a lean of 1 on there is only the inside, where walls reflect all light. A path meets a
    wall, is kept there with probability 1 - albedo, else reflected or refracted at random by
    Fresnel's equations; with ``even`` walls scatter evenly instead, as `glass_radiosity` has it,
    and the lean says nothing. Places and sines of the incidence are stratified. The result depends
    on the seed alone. Raises ValueError for a lean that glass of this index does not have.
    """
    if not 0.0 <= lean < index:
        raise ValueError(
            f"lean is {lean:g}; expected 0 to less than the refractive index, {index:g}."
        )
    every = np.arange(2 * bins) if incidence is None else incidence
    chosen = every if lean < 1.0 else every[every >= bins]
    paths = GlassPaths(
        np.zeros((2 * bins, PLACES, 2 * bins), np.int64),
        np.zeros((2 * bins, PLACES), np.int64),
        rays,
    )
    optics = _Optics(
        np.sqrt(max(1.0 - lean * lean, 0.0)),
        np.sqrt(index * index - lean * lean),
        index,
        albedo,
        diffuse_reflectance(index) if even else -1.0,
    )
    _shoot(walls, optics, np.sin(bin_edges(bins)), chosen, seed, paths)
    return paths


class _Optics(NamedTuple):
    """k outside and inside, the glass's refractive index, the part of light that a wall does not
    keep, and that of light from the air which walls that scatter evenly give back (below 0: clear
    walls)."""

    outside: float
    inside: float
    glass: float
    albedo: float
    reflected: float


class _At(NamedTuple):
    """A path: the groove and the piece that it starts from (-1: none), whether in glass, its place
    in that groove, and its direction in the cross-section."""

    groove: int
    piece: int
    in_glass: bool
    x: float
    y: float
    dx: float
    dy: float


@njit(cache=True, nogil=True, parallel=True)
def _shoot(walls, optics, sines, chosen, seed, paths):  # type: ignore[no-untyped-def]
    for number in prange(len(chosen)):
        _shoot_from(walls, optics, sines, chosen[number], seed, paths)


@njit(cache=True, nogil=True)
def _shoot_from(walls, optics, sines, bin_in, seed, paths):  # type: ignore[no-untyped-def]
    state = np.uint64(seed) * np.uint64(0xD1342543DE82EF95) + np.uint64(bin_in + 1) * np.uint64(
        0xAF251AF3B0F025B5
    )
    state, shift = next_number(state)
    state, turn = next_number(state)
    leaving = paths.leaving[bin_in]
    places, bins, grooves = leaving.shape[0], len(sines) - 1, len(walls.x)
    in_glass = bin_in >= bins
    low = sines[bin_in % bins]
    width = sines[bin_in % bins + 1] - low
    for ray in range(paths.rays):
        # A lattice of places, over all grooves, and sines.
        across = (shift + (ray + 0.5) / paths.rays) % 1.0
        sine = low + width * ((turn + ray * 0.6180339887498949) % 1.0)
        cosine = np.sqrt(max(1.0 - sine * sine, 0.0))
        groove = min(int(across * grooves), grooves - 1)
        place = across * grooves - groove
        if in_glass:
            # Where the way to that place of the opening comes up under all walls.
            depth = -walls.lowest
            x = groove + place + depth * sine / max(cosine, 1e-12)
            start = np.floor(x)
            at = _At(int(start) % grooves, -1, True, x - start, -depth, -sine, cosine)
        else:
            at = _At(groove, -1, False, place, 0.0, -sine, -cosine)
        state, out = _follow(walls, optics, at, state, bins)
        part = min(int(place * places), places - 1)
        if out >= 0:
            leaving[part, out] += 1
        elif out == _KEPT:
            paths.kept[bin_in, part] += 1


@njit(cache=True, nogil=True)
def _follow(walls, optics, at, state, bins):  # type: ignore[no-untyped-def]
    """Random state, and the bin that a path leaves into, or _KEPT."""
    for _bounce in range(_BOUNCES):
        groove, piece, along = _hit(walls, at)
        if piece < 0:
            angle = np.arctan2(at.dx, abs(at.dy))
            left = min(max(int((angle / np.pi + 0.5) * bins), 0), bins - 1)
            return state, left + bins if at.in_glass else left
        if optics.albedo < 1.0:
            state, u = next_number(state)
            if u >= optics.albedo:
                return state, _KEPT
        tx, ty = walls.along_x[groove, piece], walls.along_y[groove, piece]
        sine = at.dx * tx + at.dy * ty
        reflected, behind = _at_wall(optics, at.in_glass, sine)
        state, u = next_number(state)
        through = u >= reflected
        if optics.reflected >= 0.0:
            state, u = next_number(state)
            sine = 2.0 * u - 1.0
        elif through:
            sine = behind
        # Air is on the left of a piece, where (-ty, tx) points.
        in_glass = at.in_glass != through
        up = np.sqrt(max(1.0 - sine * sine, 0.0)) * (-1.0 if in_glass else 1.0)
        x, y = walls.x[groove, piece] + along * tx, walls.y[groove, piece] + along * ty
        at = _At(groove, piece, in_glass, x, y, sine * tx - up * ty, sine * ty + up * tx)
    return state, _LOST


@njit(cache=True, nogil=True, inline="always")
def _at_wall(optics, in_glass, sine):  # type: ignore[no-untyped-def]
    """What a wall reflects of light with this sine to its normal, in the cross-section, and the
    sine behind it."""
    if optics.reflected >= 0.0:
        let_out = (1.0 - optics.reflected) / optics.glass**2
        return (1.0 - let_out if in_glass else optics.reflected), 0.0
    own, other, n_own, n_other = optics.outside, optics.inside, 1.0, optics.glass
    if in_glass:
        own, other, n_own, n_other = other, own, n_other, n_own
    rest = other * other - own * own * sine * sine
    if rest <= 0.0:
        return 1.0, 0.0
    arriving, leaving = own * np.sqrt(max(1.0 - sine * sine, 0.0)), np.sqrt(rest)
    s = (arriving - leaving) / (arriving + leaving)
    one, two = n_other * n_other * arriving, n_own * n_own * leaving
    p = (one - two) / (one + two)
    return 0.5 * (s * s + p * p), own * sine / other


@njit(cache=True, nogil=True)
def _hit(walls, at):  # type: ignore[no-untyped-def]
    """The groove and the piece that a path meets next, and how far along; piece -1 for none."""
    grooves = len(walls.x)
    if not at.in_glass:  # a groove's air ends at its own walls
        _, piece, along = _hit_in(walls, at, at.groove, 0.0, at.piece)
        return at.groove, piece, along
    # From groove to groove, each within its own width, until the path is below all of them.
    beside = 0
    step = 1 if at.dx > 0.0 else -1
    for _ in range(_MOST_GROOVES):
        groove = (at.groove + beside) % grooves
        skip = at.piece if beside == 0 else -1
        _, piece, along = _hit_in(walls, at, groove, float(beside), skip)
        if piece >= 0:
            return groove, piece, along
        if at.dx == 0.0:
            return at.groove, -1, 0.0
        border = float(beside + 1) if step > 0 else float(beside)
        height = at.y + at.dy * (border - at.x) / at.dx
        if height < walls.lowest or height > 0.0:
            return at.groove, -1, 0.0
        beside += step
    return at.groove, -1, 0.0


@njit(cache=True, nogil=True, inline="always")
def _hit_in(walls, at, groove, shift, skip):  # type: ignore[no-untyped-def]
    """Distance, piece and place of what a path meets first of a groove so far to the right."""
    nearest, found, where = np.inf, -1, 0.0
    sign = -1.0 if at.in_glass else 1.0
    for piece in range(walls.x.shape[1]):
        tx, ty = walls.along_x[groove, piece], walls.along_y[groove, piece]
        facing = at.dx * ty - at.dy * tx
        if piece == skip or sign * facing <= 0.0:
            continue
        ox, oy = walls.x[groove, piece] + shift - at.x, walls.y[groove, piece] - at.y
        distance = (ox * ty - oy * tx) / facing
        if distance < 0.0 or distance >= nearest:
            continue
        length = walls.length[groove, piece]
        along = (ox * at.dy - oy * at.dx) / facing
        # A hair more than the piece: no path slips through where two of them meet.
        slack = 1e-12
        if -slack <= along <= length + slack:
            nearest, found, where = distance, piece, min(max(along, 0.0), length)
    return nearest, found, where
