"""Signed distances on the sphere to the edge of visibility: d(ω) of the paper's Eq. 1.

Two readings of the edge. To the *samples*, as the paper has it: the angle to the nearest direction
of the other visibility. To the *arcs* of the refined edge, which lies between the samples.

Both are exact. A nearest sample of the other kind always has a Delaunay neighbour of one's own
kind (walking from it towards one's own direction, the first step already is one's own kind, or a
nearer one would have been found), so only such samples are looked at. And whole tiles of
directions leave out what is farther from their middle than their radius allows.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.ssdf_lighting.distances.octahedral import delaunay_sides, texel_directions
from pipelines.ssdf_lighting.distances.visible_edge import VisibleEdge

_TILE = 4
_FAR = 16.0  # squared chords are at most 4
_STEEP = 3.0  # squared chords from which on the angle is measured from the antipode
_BETWEEN = np.float32(3e-7)
"""A direction is taken to lie beside an arc from here on: less is rounding. All that is given up is
the arc instead of its end, at a difference below this."""


class _Tiles(NamedTuple):
    """Directions tile by tile. ``order`` (n²,) int32 direction numbers; ``ways`` (3, n²) float32;
    ``middles`` (tiles, 3) float32; ``radii`` (tiles,) float32, radians."""

    order: NDArray[np.int32]
    ways: NDArray[np.float32]
    middles: NDArray[np.float32]
    radii: NDArray[np.float32]


@functools.lru_cache(maxsize=4)
def _tiles(n: int) -> _Tiles:
    side = _TILE if n % _TILE == 0 else 2
    numbers = np.arange(n * n, dtype=np.int32).reshape(n // side, side, n // side, side)
    order = numbers.transpose(0, 2, 1, 3).reshape(-1, side * side)
    ways = texel_directions(n)[order]
    middles = ways.sum(axis=1)
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    cosines = np.einsum("tkc,tc->tk", ways, middles).min(axis=1)
    return _Tiles(
        order.ravel(),
        np.ascontiguousarray(ways.reshape(-1, 3).T, dtype=np.float32),
        middles.astype(np.float32),
        (np.arccos(cosines) + 1e-4).astype(np.float32),
    )


def distances_to_samples(visible: NDArray[np.bool_]) -> NDArray[np.float32]:
    """d (P, n²) float32, radians: angle to the nearest direction of the other visibility.

    ``visible`` (P, n²). Positive where visible; NO_EDGE, with its sign, where all are alike.
    """
    n = round(visible.shape[1] ** 0.5)
    distances = np.empty(visible.shape, np.float32)
    ends = delaunay_sides(n).ends
    _to_samples(visible, ends, _tiles(n), texel_directions(n).astype(np.float32), distances)
    return distances


def distances_to_arcs(visible: NDArray[np.bool_], edge: VisibleEdge) -> NDArray[np.float32]:
    """d (P, n²) float32, radians: angle to the nearest point on the arcs of the edge.

    ``visible`` (P, n²) gives the sign; NO_EDGE where a point has no edge.
    """
    distances = np.empty(visible.shape, np.float32)
    _to_arcs(visible, edge, _tiles(round(visible.shape[1] ** 0.5)), distances)
    return distances


@njit(cache=True, nogil=True)
def _borders(
    visible: NDArray[np.bool_],
    ends: NDArray[np.int32],
    directions: NDArray[np.float32],
    borders: NDArray[np.float32],
    border_seen: NDArray[np.bool_],
    marked: NDArray[np.bool_],
) -> int:
    """Directions with a neighbour of the other kind: fills ``borders``, ``border_seen``."""
    marked[:] = False
    for side in range(len(ends)):
        if visible[ends[side, 0]] != visible[ends[side, 1]]:
            marked[ends[side, 0]] = True
            marked[ends[side, 1]] = True
    count = 0
    for direction in range(len(marked)):
        if marked[direction]:
            borders[count] = directions[direction]
            border_seen[count] = visible[direction]
            count += 1
    return count


@njit(cache=True, nogil=True, fastmath={"nsz", "contract", "reassoc", "nnan"})
def _candidates(
    middle: NDArray[np.float32],
    reach: float,
    points: NDArray[np.float32],
    closeness: NDArray[np.float32],
    found: NDArray[np.int32],
) -> int:
    """Numbers of those points (M, 3) that may be nearest to something within the tile: no farther
    from its middle than the nearest point and ``reach``."""
    best = np.float32(-2.0)
    for k in range(len(points)):
        near = middle[0] * points[k, 0] + middle[1] * points[k, 1] + middle[2] * points[k, 2]
        closeness[k] = near
        best = max(best, near)
    farthest = math.acos(min(max(best, np.float32(-1.0)), np.float32(1.0))) + reach
    least = np.float32(-2.0) if farthest >= math.pi else np.float32(math.cos(farthest) - 1e-6)
    count = 0
    for k in range(len(points)):
        if closeness[k] >= least:
            found[count] = k
            count += 1
    return count


@njit(cache=True, nogil=True, fastmath={"nsz", "contract", "reassoc", "nnan"})
def _beyond(
    x: float,
    y: float,
    z: float,
    points: NDArray[np.float32],
    found: NDArray[np.int32],
    count: int,
) -> float:
    """Angle to the nearest of the found points (M, 3 or more), which are all on the far side:
    near pi a chord hardly changes with its angle, so the antipodes' angles are measured."""
    farthest = np.float32(0.0)
    for number in range(count):
        k = found[number]
        sx, sy, sz = x + points[k, 0], y + points[k, 1], z + points[k, 2]
        farthest = max(farthest, sx * sx + sy * sy + sz * sz)
    return math.pi - 2.0 * math.asin(min(1.0, 0.5 * math.sqrt(farthest)))


@njit(cache=True, nogil=True, fastmath={"nsz", "contract", "reassoc", "nnan"})
def _to_samples(
    visible: NDArray[np.bool_],
    ends: NDArray[np.int32],
    tiles: _Tiles,
    directions: NDArray[np.float32],
    distances: NDArray[np.float32],
) -> None:
    order, ways, middles, radii = tiles
    count = len(order)
    size = count // len(middles)
    marked = np.empty(count, np.bool_)
    borders = np.empty((count, 3), np.float32)
    border_seen = np.empty(count, np.bool_)
    split = np.empty((count, 3), np.float32)
    closeness = np.empty(count, np.float32)
    found = np.empty(count, np.int32)
    nearest = np.empty(size, np.float32)
    for p in range(len(visible)):
        borderline = _borders(visible[p], ends, directions, borders, border_seen, marked)
        for kind in (False, True):
            others = 0
            for k in range(borderline):
                if border_seen[k] != kind:
                    split[others] = borders[k]
                    others += 1
            for tile in range(len(middles)):
                first = tile * size
                wanted = False
                for k in range(size):
                    wanted = wanted or visible[p, order[first + k]] == kind
                if not wanted:
                    continue
                nearest[:] = np.float32(_FAR)
                near = 0
                if others:
                    near = _candidates(
                        middles[tile], 2.0 * radii[tile], split[:others], closeness, found
                    )
                    for number in range(near):
                        x, y, z = split[found[number]]
                        for k in range(size):
                            dx = ways[0, first + k] - x
                            dy = ways[1, first + k] - y
                            dz = ways[2, first + k] - z
                            nearest[k] = min(nearest[k], dx * dx + dy * dy + dz * dz)
                for k in range(size):
                    direction = order[first + k]
                    if visible[p, direction] == kind:
                        angle = math.pi
                        if nearest[k] < _STEEP:
                            angle = 2.0 * math.asin(0.5 * math.sqrt(nearest[k]))
                        elif nearest[k] < _FAR:
                            x, y, z = ways[0, first + k], ways[1, first + k], ways[2, first + k]
                            angle = _beyond(x, y, z, split, found, near)
                        distances[p, direction] = angle if kind else -angle


@njit(cache=True, nogil=True, fastmath={"nsz", "contract", "reassoc", "nnan"})
def _to_arcs(
    visible: NDArray[np.bool_],
    edge: VisibleEdge,
    tiles: _Tiles,
    distances: NDArray[np.float32],
) -> None:
    crossings, arcs, starts = edge
    order, ways, middles, radii = tiles
    most = 1
    for p in range(len(visible)):
        most = max(most, starts[p + 1] - starts[p])
    size = len(order) // len(middles)
    planes = np.empty((most, 12), np.float32)
    halfway = np.empty((most, 3), np.float32)
    closeness = np.empty(most, np.float32)
    found = np.empty(most, np.int32)
    to_plane = np.empty(size, np.float32)
    to_point = np.empty(size, np.float32)
    for p in range(len(visible)):
        count = starts[p + 1] - starts[p]
        if count == 0:
            for direction in range(visible.shape[1]):
                distances[p, direction] = math.pi if visible[p, direction] else -math.pi
            continue
        longest = _planes(crossings, arcs[starts[p] : starts[p + 1]], planes, halfway)
        for tile in range(len(middles)):
            first = tile * size
            near = _candidates(
                middles[tile], 2.0 * radii[tile] + longest, halfway[:count], closeness, found
            )
            to_plane[:] = np.float32(_FAR)
            to_point[:] = np.float32(_FAR)
            for number in range(near):
                plane = planes[found[number]]
                ax, ay, az = plane[0], plane[1], plane[2]
                nx, ny, nz = plane[3], plane[4], plane[5]
                bx, by, bz = plane[6], plane[7], plane[8]
                ex, ey, ez = plane[9], plane[10], plane[11]
                for k in range(size):
                    x, y, z = ways[0, first + k], ways[1, first + k], ways[2, first + k]
                    off = x * nx + y * ny + z * nz
                    after = x * bx + y * by + z * bz
                    before = x * ex + y * ey + z * ez
                    dx, dy, dz = x - ax, y - ay, z - az
                    square = off * off if min(after, before) > _BETWEEN else np.float32(_FAR)
                    to_plane[k] = min(to_plane[k], square)
                    to_point[k] = min(to_point[k], dx * dx + dy * dy + dz * dz)
            for k in range(size):
                direction = order[first + k]
                if to_point[k] < _STEEP:
                    angle = 2.0 * math.asin(0.5 * math.sqrt(to_point[k]))
                else:
                    x, y, z = ways[0, first + k], ways[1, first + k], ways[2, first + k]
                    angle = _beyond(x, y, z, planes, found, near)
                if to_plane[k] <= 1.0:
                    angle = min(angle, math.asin(math.sqrt(to_plane[k])))
                distances[p, direction] = angle if visible[p, direction] else -angle


@njit(cache=True, nogil=True)
def _planes(
    crossings: NDArray[np.float32],
    arcs: NDArray[np.int32],
    planes: NDArray[np.float32],
    halfway: NDArray[np.float32],
) -> float:
    """Of each arc a-b: a, the unit normal n of its plane, n x a and b x n, between whose planes
    it lies; its middle. Returns half the length of the longest. Its other end b is the first end
    of the arc that follows in the loop."""
    longest = 0.0
    for k in range(len(arcs)):
        a = crossings[arcs[k, 0]]
        b = crossings[arcs[k, 1]]
        nx = np.float64(a[1]) * b[2] - np.float64(a[2]) * b[1]
        ny = np.float64(a[2]) * b[0] - np.float64(a[0]) * b[2]
        nz = np.float64(a[0]) * b[1] - np.float64(a[1]) * b[0]
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        scale = 1.0 / length if length > 0.0 else 0.0
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        planes[k, 0:3] = a
        planes[k, 3], planes[k, 4], planes[k, 5] = nx, ny, nz
        planes[k, 6] = ny * a[2] - nz * a[1]
        planes[k, 7] = nz * a[0] - nx * a[2]
        planes[k, 8] = nx * a[1] - ny * a[0]
        planes[k, 9] = b[1] * nz - b[2] * ny
        planes[k, 10] = b[2] * nx - b[0] * nz
        planes[k, 11] = b[0] * ny - b[1] * nx
        x, y, z = np.float64(a[0]) + b[0], np.float64(a[1]) + b[1], np.float64(a[2]) + b[2]
        norm = math.sqrt(x * x + y * y + z * z)
        halfway[k, 0], halfway[k, 1], halfway[k, 2] = x / norm, y / norm, z / norm
        longest = max(longest, 0.5 * math.atan2(length, 0.5 * norm * norm - 1.0))
    return longest
