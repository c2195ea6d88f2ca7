"""The edge between visible and hidden directions, finer than the directions themselves.

The Delaunay triangulation of the directions says which are neighbours. Where two neighbours
differ, the edge of visibility crosses between them; a few more rays find where. A triangle with
differing corners is crossed on two of its sides: the arc between the crossings is a piece of the
edge, and all pieces together are closed loops; seen from the point, with the visible directions on
their right.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.geometry.rays import occluded
from pipelines.ssdf_lighting.distances.octahedral import delaunay_sides, texel_directions

if TYPE_CHECKING:
    from open3d.t.geometry import RaycastingScene

ROUNDS = 4
"""Rays along a pair of neighbours: each halves the place of the crossing, 1/32 of it is left."""


class VisibleEdge(NamedTuple):
    """Edges of visibility of P points.

    crossings: (M, 3) float32 unit vectors; arcs: (M, 2) int32, from crossing to crossing, each of
    which begins one arc and ends one. Both go point by point, those of point p from ``starts[p]``
    to ``starts[p + 1]``; starts: (P + 1,) int64.
    """

    crossings: NDArray[np.float32]
    arcs: NDArray[np.int32]
    starts: NDArray[np.int64]


def visible_edge(
    scene: RaycastingScene,
    origins: NDArray[np.float32],
    visible: NDArray[np.bool_],
    *,
    rounds: int = ROUNDS,
) -> VisibleEdge:
    """Edges of visibility seen from P origins (P, 3), of which ``visible`` (P, n * n) is known."""
    n = round(visible.shape[1] ** 0.5)
    sides = delaunay_sides(n)
    starts = _count_crossings(visible, sides.ends)
    seen, unseen, point = _differing(visible, sides.ends, starts)
    arcs = _arcs(visible, *sides, starts)
    directions = texel_directions(n).astype(np.float32)
    near, far = directions[seen], directions[unseen]
    begin = origins[point]
    for _ in range(rounds):
        middle = near + far
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        blocked = occluded(scene, begin, middle)[:, None]
        near, far = np.where(blocked, near, middle), np.where(blocked, middle, far)
    crossings = near + far
    crossings /= np.linalg.norm(crossings, axis=1, keepdims=True)
    return VisibleEdge(crossings, arcs, starts)


@njit(cache=True, nogil=True)
def _count_crossings(visible: NDArray[np.bool_], ends: NDArray[np.int32]) -> NDArray[np.int64]:
    starts = np.zeros(len(visible) + 1, np.int64)
    for p in range(len(visible)):
        count = 0
        for side in range(len(ends)):
            if visible[p, ends[side, 0]] != visible[p, ends[side, 1]]:
                count += 1
        starts[p + 1] = starts[p] + count
    return starts


@njit(cache=True, nogil=True)
def _differing(
    visible: NDArray[np.bool_], ends: NDArray[np.int32], starts: NDArray[np.int64]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Visible end, hidden end and point (M,) of every crossing."""
    seen = np.empty(starts[-1], np.int32)
    unseen = np.empty(starts[-1], np.int32)
    point = np.empty(starts[-1], np.int32)
    for p in range(len(visible)):
        place = starts[p]
        for side in range(len(ends)):
            first, second = ends[side]
            if visible[p, first] != visible[p, second]:
                if not visible[p, first]:
                    first, second = second, first
                seen[place], unseen[place], point[place] = first, second, p
                place += 1
    return seen, unseen, point


@njit(cache=True, nogil=True)
def _arcs(
    visible: NDArray[np.bool_],
    ends: NDArray[np.int32],
    triangles: NDArray[np.int32],
    of_triangle: NDArray[np.int32],
    starts: NDArray[np.int64],
) -> NDArray[np.int32]:
    """Around a triangle visibility ends once and begins once: from there to there goes its arc."""
    arcs = np.empty((starts[-1], 2), np.int32)
    number = np.empty(len(ends), np.int32)
    for p in range(len(visible)):
        crossing = starts[p]
        for side in range(len(ends)):
            if visible[p, ends[side, 0]] != visible[p, ends[side, 1]]:
                number[side] = crossing
                crossing += 1
        place = starts[p]
        for t in range(len(triangles)):
            seen = visible[p, triangles[t, 0]]
            if seen == visible[p, triangles[t, 1]] and seen == visible[p, triangles[t, 2]]:
                continue
            for corner in range(3):
                here = visible[p, triangles[t, corner]]
                if here != visible[p, triangles[t, (corner + 1) % 3]]:
                    arcs[place, 0 if here else 1] = number[of_triangle[t, corner]]
            place += 1
    return arcs
