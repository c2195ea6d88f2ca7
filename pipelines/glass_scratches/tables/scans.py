"""The scratch in a measured scan, which may be millimetres long, rough, tilted and full of points.

Roughness stays: it is part of the walls. Only what lies beside the scratch is cut off, the tilt
where that is asked for, and points beyond those that the tables can use.
"""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.profiles import cut_profile

Floats = NDArray[np.float64]

FLATTEST, DEEPEST = 1e-3, 20.0
"""Depths of scratches over their widths, beyond which a unit was misread."""

_MOST_POINTS = 1024  # the exact table takes their third power: half a second
_MOST_MISSING = 0.1  # of the opening
_MOST_TILT = 0.1  # of the depth, across the scratch, before it is worth a word
_MAD = 1.4826  # deviation of a normal distribution over its median absolute deviation
_CREST = 5.0  # deviations above the land that roughness does not reach
_REACHED = 0.005  # of the depth: a groove's edge may be as soft
_LEAST_CREST = 0.02  # of the depth: where the land has no roughness


class Measured(NamedTuple):
    """``points`` (P, 2) as :func:`cut_profile` gives them; ``notes``: what was done, sentences."""

    points: Floats
    notes: tuple[str, ...]


def measured_profile(scan: Floats, gaps: Floats, name: str, *, level: bool = False) -> Measured:
    """The cross-section of the scratch in a scan (P, 2) of v and n, micrometres.

    ``gaps`` (G, 2): from which v to which one heights are missing. ``level``: the line through the
    land beside the scratch is subtracted first.

    Raises ValueError, with ``name`` in it, as :func:`cut_profile`; for heights that are missing
    across a tenth of the scratch; and for a depth that is no scratch's.
    """
    notes = []
    if level:
        scan = scan - np.stack([np.zeros(len(scan)), land_line(scan)], axis=-1)
    first, last = surroundings(scan)
    if last - first + 1 < len(scan):
        ends = np.sort(scan[[first, last], 0])
        whole = np.ptp(scan[:, 0])
        notes.append(
            f"The largest groove was taken, from v = {ends[0]:.6g} to {ends[1]:.6g} µm of a scan "
            f"of {whole:.6g} µm."
        )
    kept, tolerance = thinned(scan[first : last + 1], _MOST_POINTS)
    if tolerance > 0:
        notes.append(
            f"Of {last - first + 1} points {len(kept)} were kept, which draw the others to within "
            f"{tolerance:.2g} µm."
        )
    points = cut_profile(kept, name)
    _check_scratch(points, kept, gaps, name)
    if last - first + 1 < len(scan) and not level:
        line = land_line(scan)
        tilt, depth = abs(line[last] - line[first]), -points[:, 1].min()
        if tilt > _MOST_TILT * depth:
            notes.append(
                f"The land rises by {tilt:.3g} µm across a scratch of {depth:.3g} µm: the setting "
                "level removes such a tilt."
            )
    return Measured(points, tuple(notes))


def _check_scratch(points: Floats, kept: Floats, gaps: Floats, name: str) -> None:
    """Raise ValueError for a scratch with missing heights, or of a shape that none has.

    ``points`` is what was cut out of ``kept``, moved."""
    width, depth = points[-1, 0] - points[0, 0], -points[:, 1].min()
    moved = kept[np.argmin(kept[:, 1]), 0] - points[np.argmin(points[:, 1]), 0]
    inside = np.clip(np.sort(gaps, axis=1) - moved, points[0, 0], points[-1, 0])
    missing = float(np.sum(inside[:, 1] - inside[:, 0]))
    if missing > _MOST_MISSING * width:
        raise ValueError(
            f"{name}: heights are missing across {missing:.3g} of the scratch's {width:.3g} µm; "
            "expected them: interpolate in the instrument's software."
        )
    if not FLATTEST <= depth / width <= DEEPEST:
        raise ValueError(
            f"{name}: the scratch is {width:.3g} µm wide and {depth:.3g} µm deep; expected a depth "
            f"of {FLATTEST:g} to {DEEPEST:g} widths: name the units in the header, v [um], n [nm]."
        )


def land_line(scan: Floats) -> Floats:
    """Heights (P,) of the straight line through the land of a scan (P, 2): least squares over the
    points that lie near it, found from the medians of its first and last third."""
    v, n = scan[:, 0], scan[:, 1]
    order = np.argsort(v, kind="stable")
    third = max(1, len(v) // 3)
    left, right = order[:third], order[-third:]
    across = np.median(v[right]) - np.median(v[left])
    slope = (np.median(n[right]) - np.median(n[left])) / across if across > 0 else 0.0
    line = slope * v
    for _ in range(20):
        residual = n - line
        middle = np.median(residual)
        near = np.abs(residual - middle) <= 3 * _MAD * np.median(np.abs(residual - middle))
        centre = v[near].mean()
        spread = float(((v[near] - centre) ** 2).sum())
        slope = float(((v[near] - centre) * n[near]).sum()) / spread if spread > 0 else 0.0
        fitted = n[near].mean() + slope * (v - centre)
        if np.allclose(fitted, line, rtol=0.0, atol=1e-12 * max(np.ptp(n), 1e-300)):
            break
        line = fitted
    return np.asarray(line, np.float64)


def surroundings(scan: Floats) -> tuple[int, int]:
    """First and last point of the part of a scan (P, 2) that has its largest groove.

    That is the groove up to the land, or up to the crests where borders beside it rise over the
    land's roughness. A scan that hardly goes beyond is kept whole.
    """
    whole = 0, len(scan) - 1
    v, n = scan[:, 0], scan[:, 1] - land_line(scan)
    land = float(np.median(n))
    noise = _MAD * float(np.median(np.abs(n - land)))
    below = np.concatenate([[False], n < land - 3 * noise, [False]])
    edges = np.flatnonzero(np.diff(below.astype(np.int8)))
    if not len(edges):
        return whole
    area = np.concatenate([[0.0], np.cumsum((land - n) * np.abs(np.gradient(v)))])
    starts, stops = edges[::2], edges[1::2]
    groove = int(np.argmax(area[stops] - area[starts]))
    deepest = starts[groove] + int(np.argmin(n[starts[groove] : stops[groove]]))
    reached = land - _REACHED * (land - n[deepest])
    left, right = np.flatnonzero(n[:deepest] >= reached), np.flatnonzero(n[deepest:] >= reached)
    if not len(left) or not len(right):
        return whole
    first, last = int(left[-1]), deepest + int(right[0])
    low, high = sorted((v[first], v[last]))
    width = high - low
    if width <= 0 or (v.min() >= low - width and v.max() <= high + width):
        return whole
    beside = (v < low - width) | (v > high + width)
    land = float(np.median(n[beside]))
    noise = _MAD * float(np.median(np.abs(n[beside] - land)))
    least = land + max(_CREST * noise, _LEAST_CREST * (land - n[deepest]))
    for outwards, end in ((-1, first), (1, last)):
        side = np.arange(end, whole[1] + 1 if outwards > 0 else -1, outwards)
        side = side[np.abs(v[side] - v[end]) <= width]
        crest = int(side[np.argmax(n[side])])
        if n[crest] > least:
            first, last = (crest, last) if outwards < 0 else (first, crest)
    return first, last


def thinned(points: Floats, most: int) -> tuple[Floats, float]:
    """At most ``most`` of the points (P, 2), ends included, that draw the polyline best, each the
    farthest from those before; and how far the farthest of the others lies off."""
    if len(points) <= most:
        return points, 0.0
    kept = [0, len(points) - 1]
    pieces = [_farthest(points, 0, len(points) - 1)]
    while len(kept) < most and pieces[0][0] < 0:
        _, at, first, last = heapq.heappop(pieces)
        kept.append(at)
        for piece in (_farthest(points, first, at), _farthest(points, at, last)):
            heapq.heappush(pieces, piece)
    return points[np.sort(kept)], -pieces[0][0]


def _farthest(points: Floats, first: int, last: int) -> tuple[float, int, int, int]:
    """Minus the distance from a chord, and which point has it."""
    if last - first < 2:
        return 0.0, first, first, last
    chord = points[last] - points[first]
    offset = points[first + 1 : last] - points[first]
    length = float(np.hypot(*chord))
    if length > 0:
        distance = np.abs(offset[:, 0] * chord[1] - offset[:, 1] * chord[0]) / length
    else:
        distance = np.hypot(offset[:, 0], offset[:, 1])
    at = int(np.argmax(distance))
    return -float(distance[at]), first + 1 + at, first, last
