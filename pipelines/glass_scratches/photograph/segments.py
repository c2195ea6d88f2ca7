"""Scratches of a photograph: points of lines joined to arcs, and how wide and strong each is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, uniform_filter1d
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pipelines.glass_scratches.photograph.ridges import (
    DIRECTIONS,
    SURE,
    FloatArray,
    Ridges,
    find_ridges,
    is_dark,
)

_REACH = 2.3
"""Points of one chain are no farther apart, in pixels and steps of direction."""
_SHORTEST = 12.0
"""Pixels: what is shorter tells no direction."""
_SLENDER = 4.0
"""Least length over width."""
_LOPSIDED = 0.5
"""Of a scratch's contrast: what both sides may differ by. An edge's differ by more."""
_PROFILE = 16
"""Pixels of a cross-section, to each side."""
_STEP = 0.25
_MOST_POINTS = 0.4
"""Points of lines over pixels: thin scratches over an eighth of the area make 0.14."""
_FILLED = 0.6
"""Least share of a scratch's length that has points."""
_WEAK = 0.3
"""Of a scratch's best answer: beyond its ends filters, being long, still see it, but weaker."""
_END = 0.4
"""Of its usual contrast: where a scratch ends."""
_FITS = 25
"""Most fits of one scratch, each of what the one before reaches."""
_SHARED = 0.4
"""Most of a scratch that may lie on stronger ones."""


class Segments(NamedTuple):
    """Scratches, n in all; pixels, x to the right and y downwards.

    centre: (n, 2) middle, on the arc. angle: (n,) in [0, pi), radians from x towards *up*, at the
    middle. length, width: (n,) pixels; the width is that of a bar with the same peak and area of
    contrast, so it holds the photograph's blur. contrast: (n,) at the peak, mean along it.
    turn: (n,) radians from end to end, positive to the left.
    """

    centre: NDArray[np.float64]
    angle: NDArray[np.float64]
    length: NDArray[np.float64]
    width: NDArray[np.float64]
    contrast: NDArray[np.float64]
    turn: NDArray[np.float64]

    def chosen(self, rows: NDArray[np.generic]) -> Segments:
        """Those of a mask or of row numbers."""
        return Segments(*(column[rows] for column in self))


class Found(NamedTuple):
    """The scratches, and whether they are darker than their ground."""

    segments: Segments
    dark: bool


class _Arc(NamedTuple):
    """A parabola v = bow u² about a middle, u along the angle, from -half to half."""

    centre: NDArray[np.float64]
    angle: float  # image: x to the right, y downwards
    half: float
    bow: float

    def points(self, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        """x, y (..., 2) at u along and v beside it."""
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        aside = self.bow * u * u + v
        return self.centre + np.stack([cosine * u - sine * aside, sine * u + cosine * aside], -1)


def find_segments(contrast: FloatArray) -> Found:
    """The scratches of a picture (y, x) of contrasts (``ridges.line_contrast``), strongest first.

    All are taken to be bright, or all dark, whichever there is more of: one light shows them.
    Raises ValueError for lines nearly everywhere.
    """
    dark = is_dark(contrast)
    ridges = find_ridges(contrast, dark=dark)
    if len(ridges.angle) > _MOST_POINTS * contrast.size:
        raise ValueError("lines nearly everywhere, more a texture")
    shown = -contrast if dark else contrast
    arcs = [arc for chain in _chains(ridges) for arc in _arcs(ridges, chain)]
    measured = [one for arc in arcs if (one := _measured(shown, arc)) is not None]
    # The strongest first; what lies on one already taken is its double, or a mark of a crossing.
    rows: list[tuple[float, ...]] = []
    taken = np.zeros(contrast.shape, bool)
    for arc, row in sorted(measured, key=lambda one: -one[1][3] * one[1][4] * one[1][5]):
        if taken[_cells(arc, 0.0, taken.shape)].mean() <= _SHARED:
            taken[_cells(arc, 0.5 * row[4] + 1.5, taken.shape)] = True
            rows.append(row)
    columns = np.array(rows, np.float64).reshape(-1, 7).T
    return Found(Segments(columns[:2].T, *columns[2:]), dark)


def _chains(ridges: Ridges) -> list[NDArray[np.intp]]:
    """Rows of the points of each chain that is sure somewhere."""
    count = len(ridges.angle)
    if count == 0:
        return []
    steps = np.mod(ridges.angle * (DIRECTIONS / np.pi), DIRECTIONS)
    tree = cKDTree(np.column_stack([ridges.place, steps]), boxsize=(0, 0, DIRECTIONS))
    pairs = tree.query_pairs(_REACH, output_type="ndarray")
    ones = np.ones(len(pairs), np.int8)
    graph = coo_matrix((ones, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    order = np.argsort(label, kind="stable")
    chains = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return [c for c in chains if len(c) >= _SHORTEST / 2 and ridges.score[c].max() >= SURE]


def _arcs(ridges: Ridges, chain: NDArray[np.intp]) -> list[_Arc]:
    """Arcs of a chain: the one along its best point, then what is left of it beside that one."""
    found = []
    tree = cKDTree(ridges.place[chain])
    left = np.ones(len(chain), bool)
    for seed in np.argsort(-ridges.score[chain], kind="stable"):
        if ridges.score[chain[seed]] < SURE:
            break
        if left[seed]:
            arc, on = _arc(ridges, chain, tree, left, int(seed))
            left[on] = False
            if arc is not None:
                found.append(arc)
    return found


def _arc(
    ridges: Ridges, chain: NDArray[np.intp], tree: cKDTree, left: NDArray[np.bool_], seed: int
) -> tuple[_Arc | None, NDArray[np.intp]]:
    """The arc through a point of a chain, of those that are left, and which of them lie on it."""
    best = chain[seed]
    centre, angle, bow = ridges.place[best], -float(ridges.angle[best]), 0.0
    reach, low, high = 4.0 * _SHORTEST, 0.0, 0.0
    on, along = np.array([seed]), np.zeros(1)
    for _ in range(_FITS):
        near = np.array(tree.query_ball_point(centre, reach))
        near = near[left[near] & (ridges.answer[chain[near]] > _WEAK * ridges.answer[best])]
        rows = chain[near]
        cosine, sine = np.cos(angle), np.sin(angle)
        away = ridges.place[rows] - centre
        along, aside = away @ (cosine, sine), away @ (-sine, cosine)
        turned = np.abs(_axial(ridges.angle[rows] + angle + np.arctan(2 * bow * along)))
        is_on = (np.abs(aside - bow * along**2) < 1.5 + ridges.half_width[rows]) & (turned < 0.35)
        low, high = _run(along, is_on, 0.0)
        is_on &= (along >= low) & (along <= high)
        before, on, along, aside = on, near[is_on], along[is_on], aside[is_on]
        if len(on) < 4 or np.array_equal(before, on):
            break
        degree = 2 if high - low > 3 * _SHORTEST else 1
        weight = np.sqrt(ridges.score[chain[on]].astype(np.float64))
        fit = polynomial.polyfit(along, aside, degree, w=weight)
        # From the middle anew: the parabola's tangent there is the direction.
        middle = 0.5 * (low + high)
        height, slope = (
            polynomial.polyval(middle, fit),
            polynomial.polyval(middle, fit[1:] * np.arange(1, degree + 1)),
        )
        centre = centre + middle * np.array([cosine, sine]) + height * np.array([-sine, cosine])
        angle += float(np.arctan(slope))
        bow = float(fit[2]) if degree == 2 else 0.0
        reach = 0.75 * (high - low) + 4.0 * _SHORTEST
    length = high - low
    good = length >= _SHORTEST and len(np.unique(np.round(along))) >= _FILLED * length
    return (_Arc(centre, angle, 0.5 * length, bow) if good else None), np.append(on, seed)


def _run(along: NDArray[np.float64], on: NDArray[np.bool_], start: float) -> tuple[float, float]:
    """The stretch of points without a gap that holds, or is nearest to, a start."""
    places = np.sort(along[on])
    if len(places) == 0:
        return 0.0, 0.0
    stretches = np.split(places, np.flatnonzero(np.diff(places) > 2 * _REACH) + 1)
    nearest = min(stretches, key=lambda s: max(s[0] - start, start - s[-1], 0.0))
    return float(nearest[0]), float(nearest[-1])


def _axial(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Differences of directions, in [-pi / 2, pi / 2)."""
    return np.mod(angle + np.pi / 2, np.pi) - np.pi / 2


def _measured(contrast: FloatArray, arc: _Arc) -> tuple[_Arc, tuple[float, ...]] | None:
    """A scratch to its ends and its row of ``Segments``; None for what is no scratch."""
    across = np.arange(-_PROFILE, _PROFILE + _STEP / 2, _STEP)
    section = _section(contrast, arc, across)
    told = _peak_and_width(section)
    if told is None:
        return None
    # Ends: where the contrast along its middle, averaged over 5 pixels, falls.
    band = np.abs(across) <= max(0.25 * told[1], 0.5)
    line = uniform_filter1d(section[:, band].mean(axis=1), 5, mode="nearest")
    usual = np.flatnonzero(line > _END * np.median(line))
    if len(usual) == 0:
        return None
    along = np.linspace(-arc.half, arc.half, len(line))
    ended = _between(arc, float(along[usual[0]]), float(along[usual[-1]]))
    told = _peak_and_width(_section(contrast, ended, across))
    length = 2.0 * ended.half + 1.0
    if told is None or length < max(_SLENDER * told[1], _SHORTEST):
        return None
    turn = -2.0 * np.arctan(2.0 * ended.bow * ended.half)
    angle = float(np.mod(-ended.angle, np.pi))
    return ended, (*ended.centre, angle, length, told[1], told[0], float(turn))


def _section(contrast: FloatArray, arc: _Arc, v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Contrast (u, v) along and across an arc, a row a pixel of its length."""
    u = np.linspace(-arc.half, arc.half, max(round(2 * arc.half) + 1, 2))
    at = arc.points(u[:, None], v[None])
    where = [at[..., 1] - 0.5, at[..., 0] - 0.5]
    return np.asarray(map_coordinates(contrast, where, np.float64, order=1, mode="nearest"))


def _between(arc: _Arc, low: float, high: float) -> _Arc:
    """The part of an arc from one place along it to another."""
    middle = 0.5 * (low + high)
    centre = arc.points(np.array(middle), np.array(0.0))
    return _Arc(centre, arc.angle + np.arctan(2 * arc.bow * middle), 0.5 * (high - low), arc.bow)


def _peak_and_width(section: NDArray[np.float64]) -> tuple[float, float] | None:
    """Contrast and width of the mean cross-section; None where it is no line's."""
    # Other scratches cross here and there: the mean without the ends of what is found.
    ordered = np.sort(section, axis=0)
    cut = len(ordered) // 6
    mean = ordered[cut : len(ordered) - cut].mean(axis=0)
    middle, near = len(mean) // 2, round(2.0 / _STEP)
    peak_at = middle - near + int(np.argmax(mean[middle - near : middle + near + 1]))
    first, last = _feet(mean, peak_at)
    left, right = float(mean[first]), float(mean[last])
    ground = 0.5 * (left + right)
    peak = float(mean[peak_at]) - ground
    if peak <= 0.0 or abs(left - right) > _LOPSIDED * peak:
        return None
    return peak, float(np.clip(mean[first : last + 1] - ground, 0.0, None).sum()) * _STEP / peak


def _feet(mean: NDArray[np.float64], peak_at: int) -> tuple[int, int]:
    """Where a cross-section has come down to its ground: its lowest places before it rises."""
    half = 0.5 * (mean[peak_at] + np.median(mean))
    feet = []
    for way in (-1, 1):
        k = peak_at
        while 0 < k < len(mean) - 1 and (mean[k] > half or mean[k + way] < mean[k]):
            k += way
        feet.append(k)
    return feet[0], feet[1]


def _cells(arc: _Arc, half_width: float, shape: tuple[int, ...]) -> tuple[NDArray[np.intp], ...]:
    """Rows and columns of the pixels along an arc, twice as fine as pixels are."""
    u = np.arange(-arc.half, arc.half + 0.25, 0.5)
    v = np.arange(-half_width, half_width + 0.25, 0.5)
    at = np.floor(arc.points(u[:, None], v[None])).astype(np.intp)
    return (
        np.clip(at[..., 1], 0, shape[0] - 1).ravel(),
        np.clip(at[..., 0], 0, shape[1] - 1).ravel(),
    )
