"""What stands thin before the sky: outlines where the distances so far say that all is open.

d(ω) says that every direction nearer to ω than that sees the sky. A point of the mesh in such a
direction contradicts it. So of the mesh's edges that are outline, seen from a point, those parts
are looked for which lie in directions that some d says are open, by more than what the refined
edge leaves open anyway. No ray is cast: a point of the mesh hides the sky, whatever is in front.

The tree of the edges is gone through once a point, and the distances prune it: d changes by at
most an angle over that angle, so nothing is new in a node whose cone of directions is narrower
than its middle is deep in the dark.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.ssdf_lighting.distances.octahedral import texel_directions
from pipelines.ssdf_lighting.distances.outline_tree import OutlineTree
from pipelines.ssdf_lighting.distances.visible_edge import VisibleEdge

FloatArray = NDArray[np.float64]
Floats = NDArray[np.float32]
Texels = NDArray[np.int64]

_DEEP = 1.0 / 16.0
"""How deep in what is said to be open an outline has to lie, in sides of a texel: where it crosses
long sides, the refined edge is as far off."""
_STEP = 0.25
"""Between the places of an edge that are asked for, in sides of a texel."""
_PIECE = 4
"""Steps that one arc may take: short arcs are near to few directions."""
_QUICK = {"nsz", "contract", "reassoc"}


def thin_outlines(origins: Floats, distances: Floats, tree: OutlineTree) -> VisibleEdge:
    """Outlines seen from P origins (P, 3) in directions that ``distances`` (P, n²) say are open.

    As loops of two arcs each, there and back. The nearest hidden direction to an open one is on
    them, or on the edge that the distances know.
    """
    n = round(distances.shape[1] ** 0.5)
    starts = np.zeros(len(origins) + 1, np.int64)
    ends = _collect(origins.astype(np.float64), distances, texel_directions(n), tree, starts)
    there = np.arange(2 * len(ends), dtype=np.int32).reshape(-1, 2)
    arcs = np.stack([there, there[:, ::-1]], axis=1).reshape(-1, 2)
    return VisibleEdge(ends.reshape(-1, 3), arcs, 2 * starts)


@njit(cache=True, nogil=True, fastmath=_QUICK)
def _collect(
    origins: FloatArray,
    distances: Floats,
    ways: FloatArray,
    tree: OutlineTree,
    starts: NDArray[np.int64],
) -> Floats:
    """Ends (K, 2, 3) of arcs, point by point; those of point p begin at ``starts[p]``."""
    side = math.sqrt(4.0 * math.pi / len(ways))
    texels = np.empty(4, np.int64)
    found = np.empty((2 * len(ways), 2, 3), np.float32)
    count = 0
    for p in range(len(origins)):
        node = 0
        while node < len(tree.after):
            if _skipped(origins[p], distances[p], ways, tree, node, side * _DEEP, texels):
                node = tree.after[node]
                continue
            for edge in range(tree.first[node], tree.last[node]):
                if not _is_outline(origins[p], tree.ends[edge], tree.normals[edge]):
                    continue
                if count + len(ways) > len(found):  # more than one edge can need
                    found = np.concatenate((found, np.empty_like(found)))
                count = _add_pieces(
                    origins[p], tree.ends[edge], distances[p], ways, side, texels, found, count
                )
            node += 1
        starts[p + 1] = count
    return found[:count].copy()


@njit(cache=True, nogil=True, fastmath=_QUICK)
def _skipped(
    origin: FloatArray,
    distances: Floats,
    ways: FloatArray,
    tree: OutlineTree,
    node: int,
    deep: float,
    texels: Texels,
) -> bool:
    """Whether no edge below a node is outline and ``deep`` in what is said to be open."""
    middle, radius = tree.middle[node], tree.radius[node]
    x, y, z = middle[0] - origin[0], middle[1] - origin[1], middle[2] - origin[2]
    away = math.sqrt(x * x + y * y + z * z)
    if away <= radius:
        return False
    x, y, z = x / away, y / away, z / away
    reach = math.asin(radius / away)
    axis, spread = tree.axis[node], tree.spread[node]
    if spread + reach < 0.5 * math.pi:
        towards = -(x * axis[0] + y * axis[1] + z * axis[2])
        if abs(towards) > math.sin(spread + reach):  # all look here, or all away
            return True
    _taps(len(ways), x, y, z, texels)
    most = math.inf
    for texel in texels:
        most = min(most, distances[texel] + _apart(x, y, z, ways[texel]))
    return most + reach < deep


@njit(cache=True, nogil=True, fastmath=_QUICK)
def _is_outline(origin: FloatArray, ends: FloatArray, normals: FloatArray) -> bool:
    one, other = 0.0, 0.0
    for k in range(3):
        one += normals[0, k] * (origin[k] - ends[0, k])
        other += normals[1, k] * (origin[k] - ends[0, k])
    return one * other <= 0.0


@njit(cache=True, nogil=True, fastmath=_QUICK)
def _add_pieces(
    origin: FloatArray,
    ends: FloatArray,
    distances: Floats,
    ways: FloatArray,
    side: float,
    texels: Texels,
    found: Floats,
    count: int,
) -> int:
    """Adds to ``found`` the pieces of an edge that lie deep in what is said to be open."""
    a, b = ends[0] - origin, ends[1] - origin
    a /= math.sqrt((a * a).sum())
    b /= math.sqrt((b * b).sum())
    between = 2.0 * math.atan2(math.sqrt(((a - b) ** 2).sum()), math.sqrt(((a + b) ** 2).sum()))
    steps = max(1, math.ceil(between / (_STEP * side)))
    sine = math.sin(between)
    if steps > 1 and sine < 1e-9:  # the edge goes through the origin
        return count
    begun, was_open = -1, False
    here, begin = a, a
    for step in range(steps + 1):
        before = here
        if step == steps:
            here = b
        elif step > 0:
            back, on = (1.0 - step / steps) * between, step / steps * between
            here = a * (math.sin(back) / sine) + b * (math.sin(on) / sine)
        is_open = _said_open(here, distances, ways, texels) > _DEEP * side
        if step > 0 and (is_open or was_open):
            if begun < 0:
                begun, begin = step - 1, before
            if step - begun == _PIECE or step == steps or not is_open:
                for k in range(3):
                    found[count, 0, k] = begin[k]
                    found[count, 1, k] = here[k]
                count += 1
                begun = -1
        was_open = is_open
    return count


@njit(cache=True, nogil=True, fastmath=_QUICK)
def _said_open(way: FloatArray, distances: Floats, ways: FloatArray, texels: Texels) -> float:
    """The angle around a direction that the texels around it say is open, at least."""
    _taps(len(ways), way[0], way[1], way[2], texels)
    most = -math.inf
    for texel in texels:
        if distances[texel] > 0.0:
            apart = _apart(way[0], way[1], way[2], ways[texel])
            most = max(most, distances[texel] - apart)
    return most


@njit(cache=True, nogil=True, fastmath=_QUICK)
def _apart(x: float, y: float, z: float, way: FloatArray) -> float:
    """The angle between unit vectors of neighbouring texels: of the arc sine's series enough."""
    dx, dy, dz = x - way[0], y - way[1], z - way[2]
    square = dx * dx + dy * dy + dz * dz
    return math.sqrt(square) * (1.0 + square * (1.0 / 24.0 + square * (3.0 / 640.0)))


@njit(cache=True, nogil=True, fastmath=_QUICK)
def _taps(directions: int, x: float, y: float, z: float, texels: Texels) -> None:
    """The four texels around a unit vector: `octahedral.bilinear_taps`."""
    n = math.floor(math.sqrt(directions) + 0.5)
    scale = 1.0 / (abs(x) + abs(y) + abs(z))
    u, v = x * scale, y * scale
    if z < 0.0:
        u, v = math.copysign(1.0 - abs(v), u), math.copysign(1.0 - abs(u), v)
    left = math.floor((u + 1.0) * (0.5 * n) - 0.5)
    top = math.floor((v + 1.0) * (0.5 * n) - 0.5)
    for k in range(4):
        row, column = top + (k >> 1), left + (k & 1)
        if row < 0 or row >= n:
            row, column = min(max(row, 0), n - 1), n - 1 - column
        if column < 0 or column >= n:
            column, row = min(max(column, 0), n - 1), n - 1 - row
        texels[k] = row * n + column
