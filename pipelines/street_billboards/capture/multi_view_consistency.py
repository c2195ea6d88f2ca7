"""Multi-view consistency: what other views' depth maps and photographs say of one view's pixels.

Geometric: the same depth where a point is projected, and nothing looks through it. Photometric: it
looks alike there as well. A lens is (fx, fy, cx, cy) in pixels. Depths are metres along a camera's
axis; nan: unknown, inf: sky.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Map = NDArray[np.float32]
Point = tuple[float, float, float]

_SURE = 2.0
"""Standard deviations within which two depths are one."""
_FLOOR = 0.005
"""Of the depth: what poses and pixels leave open, however sure."""
_MOST_APART = 0.06
"""Of the depth: farther apart they are two surfaces, however unsure."""
_ENOUGH = 6
"""Depth maps that agree, after which no more are asked."""
_LEAST_VARIANCE = 1e-4
"""m²: photographs that overlap share their errors, a mean of many is no surer than a centimetre."""
_CLOSE = 0.5
"""Metres before a camera that it does not see."""

_PATCH = 2
"""Pixels that patches reach to each side."""
_APART = 5
"""Pixels between those that are compared."""
_FARTHEST = 20.0
_LEAST_TEXTURE = 25.0
"""Variance of a patch in grey levels, below which it looks like any other."""
_ALIKE = 0.6
"""Correlation of patches that look alike."""


class DepthView(NamedTuple):
    """The view whose pixels are asked about."""

    depth: Map
    """(h, w)."""
    deviation: Map
    """(h, w), standard deviation, m."""
    lens: FloatArray
    """(4,)."""
    to_world: FloatArray
    """(4, 4)."""


class OtherDepthViews(NamedTuple):
    """The k views that are asked, those first that know most."""

    depth: Map
    """(k, h, w)."""
    deviation: Map
    """(k, h, w), standard deviation, m."""
    lens: FloatArray
    """(k, 4)."""
    from_world: FloatArray
    """(k, 4, 4)."""


class GreyView(NamedTuple):
    """The view whose patches are compared."""

    depth: Map
    """(h, w)."""
    grey: Map
    """(h, w), 0 to 255."""
    lens: FloatArray
    """(4,)."""
    to_world: FloatArray
    """(4, 4)."""


class OtherGreyViews(NamedTuple):
    """The k views that they are compared with; or one of them, without the first axis."""

    depth: Map
    """(k, h, w)."""
    grey: Map
    """(k, h, w), 0 to 255."""
    lens: FloatArray
    """(k, 4)."""
    from_world: FloatArray
    """(k, 4, 4)."""


# ---- geometric -------------------------------------------------------------------------------


@njit(cache=True, nogil=True)
def geometric_consistency(
    view: DepthView, others: OtherDepthViews, least_support: int, farthest: float, step: int
) -> tuple[FloatArray, Map, Map]:
    """Positions (r, c, 3), normals (r, c, 3), inverse variances (r, c) of every step-th pixel.

    Weight 0: deeper than ``farthest``, fewer than ``least_support`` of the others agree, or more
    than half as many look through it. Along its ray, a point lies at the mean of all that agree, by
    inverse variance.
    """
    depth, deviation = view.depth, view.deviation
    height, width = depth.shape
    rows, columns = (height + step - 1) // step, (width + step - 1) // step
    found = np.zeros((rows, columns, 3))
    normals = np.zeros((rows, columns, 3), np.float32)
    weight = np.zeros((rows, columns), np.float32)
    for row in range(rows):
        for column in range(columns):
            y, x = row * step, column * step
            z = np.float64(depth[y, x])
            if not z <= farthest:
                continue
            here, way = _ray(view, x, y, z)
            variance = np.float64(deviation[y, x]) ** 2
            agree, through, moved, certain = _votes(here, way, variance, others)
            if agree < least_support or 2 * through > agree:
                continue
            moved /= certain
            for axis in range(3):
                found[row, column, axis] = here[axis] + way[axis] * moved
            weight[row, column] = 1 / (1 / certain + _LEAST_VARIANCE)
            _set_normal(normals[row, column], view, x, y)
    return found, normals, weight


@njit(cache=True, nogil=True)
def confirmed_depth(
    view: DepthView, others: OtherDepthViews, least_support: int
) -> tuple[Map, Map]:
    """Depth (h, w) of a view where others confirm it, and its deviation (h, w); nan elsewhere.

    Left out as in ``geometric_consistency``; the depth is the mean of all that agree.
    """
    depth, deviation = view.depth, view.deviation
    found, spread = np.full(depth.shape, np.nan, np.float32), np.full_like(depth, np.nan)
    for y in range(depth.shape[0]):
        for x in range(depth.shape[1]):
            z = np.float64(depth[y, x])
            if not np.isfinite(z):
                continue
            here, way = _ray(view, x, y, z)
            variance = np.float64(deviation[y, x]) ** 2
            agree, through, moved, certain = _votes(here, way, variance, others)
            if agree < least_support or 2 * through > agree:
                continue
            found[y, x] = z + moved / certain
            spread[y, x] = deviation[y, x]
    return found, spread


@njit(cache=True, nogil=True)
def _ray(view: DepthView, x: int, y: int, z: float) -> tuple[Point, Point]:
    """The pixel's point at depth z, and what a metre of depth adds to it."""
    lens, pose = view.lens, view.to_world
    across, down = (x - lens[2]) / lens[0], (y - lens[3]) / lens[1]
    way_x = pose[0, 0] * across + pose[0, 1] * down + pose[0, 2]
    way_y = pose[1, 0] * across + pose[1, 1] * down + pose[1, 2]
    way_z = pose[2, 0] * across + pose[2, 1] * down + pose[2, 2]
    here = pose[0, 3] + way_x * z, pose[1, 3] + way_y * z, pose[2, 3] + way_z * z
    return here, (way_x, way_y, way_z)


@njit(cache=True, nogil=True)
def _votes(
    here: Point, way: Point, variance: float, others: OtherDepthViews
) -> tuple[int, int, float, float]:
    """How many views have the point, and look through it; where those that have it put it.

    Along the ray, in metres of depth: the sum of offsets by inverse variance, and of these.
    """
    depths, deviations, lenses, from_world = others
    here_x, here_y, here_z = here
    way_x, way_y, way_z = way
    certain = 1 / variance
    moved = 0.0
    agree = through = 0
    for k in range(len(depths)):
        m = from_world[k]
        seen_z = m[2, 0] * here_x + m[2, 1] * here_y + m[2, 2] * here_z + m[2, 3]
        if seen_z < _CLOSE:
            continue
        seen_x = m[0, 0] * here_x + m[0, 1] * here_y + m[0, 2] * here_z + m[0, 3]
        seen_y = m[1, 0] * here_x + m[1, 1] * here_y + m[1, 2] * here_z + m[1, 3]
        u = seen_x / seen_z * lenses[k, 0] + lenses[k, 2]
        v = seen_y / seen_z * lenses[k, 1] + lenses[k, 3]
        most = _MOST_APART * seen_z
        measured, spread = _depth_at(depths[k], deviations[k], u, v, seen_z, most)
        if np.isnan(measured):
            continue
        slope = m[2, 0] * way_x + m[2, 1] * way_y + m[2, 2] * way_z
        apart = measured - seen_z
        unsure = np.sqrt(spread**2 + variance * slope**2)
        if abs(apart) <= min(_SURE * unsure + _FLOOR * seen_z, most):
            agree += 1
            # A view across the ray tells little of where along it.
            if abs(slope) > 0.5:
                share = (slope / spread) ** 2
                certain += share
                moved += share * apart / slope
            if agree >= _ENOUGH and through <= 1:
                break
        elif apart > 0:
            through += 1
    return agree, through, moved, certain


@njit(cache=True, nogil=True)
def _depth_at(
    depth: Map, deviation: Map, u: float, v: float, expected: float, tolerance: float
) -> tuple[float, float]:
    """Depth of a view at (u, v), interpolated where its four pixels are one surface, and spread.

    At a step between two surfaces, the one nearer to what is expected; nan: unknown, inf: sky.
    """
    height, width = depth.shape
    if not (u >= 0 and v >= 0 and u < width - 1 and v < height - 1):
        return np.nan, np.nan
    x, y = int(u), int(v)
    a, b = u - x, v - y
    d00, d01 = depth[y, x], depth[y, x + 1]
    d10, d11 = depth[y + 1, x], depth[y + 1, x + 1]
    least, most = min(min(d00, d01), min(d10, d11)), max(max(d00, d01), max(d10, d11))
    # nan compares as it likes in min and max: all four have to be known.
    if most - least <= tolerance and np.isfinite(d00 + d01 + d10 + d11):
        measured = (d00 * (1 - a) + d01 * a) * (1 - b) + (d10 * (1 - a) + d11 * a) * b
        return measured, deviation[y + int(b > 0.5), x + int(a > 0.5)]
    best, spread, nearest = np.nan, np.nan, np.inf
    for j in range(2):
        for i in range(2):
            d = depth[y + j, x + i]
            if abs(d - expected) < nearest:
                nearest = abs(d - expected)
                best, spread = d, deviation[y + j, x + i]
            elif d == np.inf and nearest == np.inf:
                best = np.inf
    return best, spread


@njit(cache=True, nogil=True)
def _set_normal(normal: Map, view: DepthView, x: int, y: int) -> None:
    """The depth map's normal at a pixel, from differences as far as its surface goes, at most 3."""
    depth, lens, pose = view.depth, view.lens, view.to_world
    height, width = depth.shape
    z = np.float64(depth[y, x])
    slope_x = slope_y = 0.0
    for axis in range(2):
        low = high = z
        span = 0
        for sign in (-1, 1):
            for r in range(3, 0, -1):
                i, j = (x + sign * r, y) if axis == 0 else (x, y + sign * r)
                if i < 0 or j < 0 or i >= width or j >= height:
                    continue
                d = np.float64(depth[j, i])
                if abs(d - z) <= 0.02 * z * r:
                    span += r
                    if sign < 0:
                        low = d
                    else:
                        high = d
                    break
        if span == 0:
            return
        if axis == 0:
            slope_x = (high - low) / span
        else:
            slope_y = (high - low) / span
    # On a plane n . p = 1 the inverse depth is n . (x', y', 1), linear in the pixel.
    n0, n1 = -slope_x / z**2 * lens[0], -slope_y / z**2 * lens[1]
    n2 = 1 / z - n0 * (x - lens[2]) / lens[0] - n1 * (y - lens[3]) / lens[1]
    length = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    for i in range(3):
        normal[i] = -(pose[i, 0] * n0 + pose[i, 1] * n1 + pose[i, 2] * n2) / length


# ---- photometric -----------------------------------------------------------------------------


@njit(cache=True, nogil=True)
def photometric_consistency(view: GreyView, others: OtherGreyViews) -> tuple[int, int]:
    """Of pairs of a textured pixel and a view that should see it: how many, how many confirm it.

    They do if the depth is the same within 4 % and the 5 x 5 pixels, each projected at its own
    depth, correlate. Depth alone would not do: a road and walls along the drive stay where they are
    when the focal length or the way driven is wrong, only what is painted on them slides.
    """
    height, width = view.depth.shape
    asked = agree = 0
    for y in range(_PATCH, height - _PATCH, _APART):
        for x in range(_PATCH, width - _PATCH, _APART):
            z = view.depth[y, x]
            if not z <= _FARTHEST:
                continue
            patch = view.grey[y - _PATCH : y + _PATCH + 1, x - _PATCH : x + _PATCH + 1]
            if patch.var() < _LEAST_TEXTURE:
                continue
            for k in range(len(others.depth)):
                other = OtherGreyViews(
                    others.depth[k], others.grey[k], others.lens[k], others.from_world[k]
                )
                measured, expected, correlation = _patches_compared(view, other, x, y)
                # Without a depth, or behind something, the view says nothing.
                if not measured >= 0.9 * expected:
                    continue
                asked += 1
                if abs(measured - expected) <= 0.04 * expected and correlation > _ALIKE:
                    agree += 1
    return asked, agree


@njit(cache=True, nogil=True)
def _patches_compared(
    view: GreyView, other: OtherGreyViews, x: int, y: int
) -> tuple[float, float, float]:
    """A view's depth where it should see a pixel, the depth expected there, patches' correlation.

    nan for a depth that it does not know, or a patch not wholly in the picture.
    """
    depth, lens, pose, m = view.depth, view.lens, view.to_world, other.from_world
    height, width = other.grey.shape
    z = depth[y, x]
    measured = expected = np.nan
    n = 0
    sum_a = sum_b = sum_aa = sum_bb = sum_ab = 0.0
    for j in range(-_PATCH, _PATCH + 1):
        for i in range(-_PATCH, _PATCH + 1):
            d = np.float64(depth[y + j, x + i])
            if not abs(d - z) <= 0.05 * z:
                d = np.float64(z)
            a, b = (x + i - lens[2]) / lens[0] * d, (y + j - lens[3]) / lens[1] * d
            p0 = pose[0, 0] * a + pose[0, 1] * b + pose[0, 2] * d + pose[0, 3]
            p1 = pose[1, 0] * a + pose[1, 1] * b + pose[1, 2] * d + pose[1, 3]
            p2 = pose[2, 0] * a + pose[2, 1] * b + pose[2, 2] * d + pose[2, 3]
            w = m[2, 0] * p0 + m[2, 1] * p1 + m[2, 2] * p2 + m[2, 3]
            if w < _CLOSE:
                return np.nan, w, 0.0
            u = (m[0, 0] * p0 + m[0, 1] * p1 + m[0, 2] * p2 + m[0, 3]) / w
            v = (m[1, 0] * p0 + m[1, 1] * p1 + m[1, 2] * p2 + m[1, 3]) / w
            u = u * other.lens[0] + other.lens[2]
            v = v * other.lens[1] + other.lens[3]
            if not (u >= 0 and v >= 0 and u < width - 1 and v < height - 1):
                return np.nan, w, 0.0
            g, h = int(u), int(v)
            s, t = u - g, v - h
            top = other.grey[h, g] * (1 - s) + other.grey[h, g + 1] * s
            low = other.grey[h + 1, g] * (1 - s) + other.grey[h + 1, g + 1] * s
            theirs = top * (1 - t) + low * t
            ours = np.float64(view.grey[y + j, x + i])
            if i == 0 and j == 0:
                expected = w
                measured = np.float64(other.depth[int(v + 0.5), int(u + 0.5)])
            n += 1
            sum_a += ours
            sum_b += theirs
            sum_aa += ours * ours
            sum_bb += theirs * theirs
            sum_ab += ours * theirs
    both = sum_ab - sum_a * sum_b / n
    square = (sum_aa - sum_a * sum_a / n) * (sum_bb - sum_b * sum_b / n)
    return measured, expected, both / np.sqrt(max(square, 1e-9))
