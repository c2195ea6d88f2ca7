"""A photograph laid over a body by example: overlapping patches, each turned along the lie.

Texture coordinates of a mesh have borders, and the hair on them runs anywhere. Here the surface is
covered by round patches that know nothing of borders. Each takes its piece of the photograph from
a place of its own, turned so that the photograph's hair lies along the surface's (after Praun et
al., "Lapped Textures", 2000); lengths along and across the lie are kept, so that hairs bend with it
and are equally wide everywhere. Patches share out the surface by weights that fade towards a
patch's rim, at most ``SLOTS`` of them at a place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.geometry.mesh_edges import edge_vertices

SLOTS = 3
"""Patches at a place."""
REACH = 1.5
"""Radius of a patch in distances between neighbouring patches' middles."""
_SHARPNESS = 4
"""Power of the nearness: the higher, the less patches mix, and the less a fourth one would have."""
_CANDIDATES = 12
"""Places in the photograph that are tried for a patch."""


class Piece(NamedTuple):
    """Where in the photograph pieces may come from."""

    places: NDArray[np.floating]
    """(n, 2): middles, in photograph widths from its lower left."""
    directions: NDArray[np.floating]
    """(n,): how the hair lies there, radians from the photograph's x towards its y (up)."""


class Laying(NamedTuple):
    """Patches on a mesh. Vertices are split where the patches at a place are others."""

    vertex: NDArray[np.int64]
    """(N,): the mesh's vertex that each is."""
    triangles: NDArray[np.int32]
    """(F, 3) of the N."""
    uvs: NDArray[np.float32]
    """(N, SLOTS, 2): places in the photograph, in widths, origin bottom left."""
    weights: NDArray[np.float32]
    """(N, SLOTS): of the patches, adding up to 1."""
    patches: NDArray[np.int64]
    """(F, SLOTS): which patches a triangle shows; -1 for none."""
    middles: NDArray[np.int64]
    """(P,): the vertex in the middle of each patch."""


def lay_patches(
    points: NDArray[np.floating],
    triangles: NDArray[np.integer],
    tangents: NDArray[np.floating],
    normals: NDArray[np.floating],
    piece: Piece,
    *,
    spacing: float,
    width: float,
    seed: int = 0,
) -> Laying:
    """Cover a mesh with patches of a photograph.

    points, normals, tangents (V, 3): positions without copies, the lie of the hair along them.
    triangles (F, 3). spacing: distance of neighbouring patches' middles; width: of the photograph
    as it lies on the surface; both in mesh units. Raises ValueError where they are not positive.
    """
    for name, value in (("spacing", spacing), ("width", width)):
        if not value > 0:
            raise ValueError(f"{name} is {value:g}; expected a positive length.")
    random = np.random.default_rng(seed)
    around = _Neighbours.of(points, triangles, tangents, normals)
    middles = _spread_out(around, spacing)
    distance, place = _charts(around, middles, REACH * spacing)
    where = _places(middles, distance, piece, random)
    weights = _weights(distance, REACH * spacing)
    return _split(triangles.astype(np.int64), weights, place / width, where, piece, middles)


# ---- the surface -----------------------------------------------------------------------------


class _Neighbours(NamedTuple):
    """Edges out of each vertex: those of vertex v are first[v] to first[v + 1]."""

    first: NDArray[np.int64]
    to: NDArray[np.int64]
    length: NDArray[np.float64]
    step: NDArray[np.float64]
    """(2 E, 2): along the lie, and across it, to the left."""

    @classmethod
    def of(
        cls,
        points: NDArray[np.floating],
        triangles: NDArray[np.integer],
        tangents: NDArray[np.floating],
        normals: NDArray[np.floating],
    ) -> _Neighbours:
        edges = edge_vertices(triangles)
        begin = np.concatenate([edges[:, 0], edges[:, 1]])
        end = np.concatenate([edges[:, 1], edges[:, 0]])
        order = np.argsort(begin, kind="stable")
        begin, end = begin[order], end[order]
        way = points[end] - points[begin]
        length = np.linalg.norm(way, axis=1)
        left = np.cross(normals, tangents)
        step = np.stack(
            [
                np.einsum("ei,ei->e", way, (axis[begin] + axis[end]) / 2)
                for axis in (tangents, left)
            ],
            axis=-1,
        )
        flat = np.linalg.norm(step, axis=1, keepdims=True)
        step *= length[:, None] / np.maximum(flat, 1e-30)
        first = np.searchsorted(begin, np.arange(len(points) + 1))
        return cls(first.astype(np.int64), end.astype(np.int64), length, step)


def _spread_out(around: _Neighbours, spacing: float) -> NDArray[np.int64]:
    """Vertices about so far apart along the surface that all others are nearer to one: each next
    one is the farthest from those before."""
    count = len(around.first) - 1
    nearest = np.full(count, np.inf)
    middles: list[int] = []
    following = 0
    while len(middles) < count:
        middles.append(following)
        np.minimum(nearest, _distances(around, following, np.inf), out=nearest)
        following = int(np.argmax(np.where(np.isinf(nearest), 1e300, nearest)))
        if nearest[following] <= 0.75 * spacing:
            break
    return np.array(middles)


def _distances(around: _Neighbours, start: int, farthest: float) -> NDArray[np.float64]:
    """Distance (V,) of each vertex along edges; inf beyond ``farthest``."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    count = len(around.first) - 1
    graph = csr_array((around.length, around.to, around.first), shape=(count, count))
    found: NDArray[np.float64] = dijkstra(graph, indices=start, limit=farthest)
    return found


def _charts(
    around: _Neighbours, middles: NDArray[np.int64], radius: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distance (P, V) of each vertex from each middle in its chart, inf beyond the radius, and the
    place (P, V, 2) there: lengths along and across the lie."""
    count = len(around.first) - 1
    place = np.zeros((len(middles), count, 2))
    for number, middle in enumerate(middles):
        far = _distances(around, middle, 1.5 * radius)
        (inside,) = np.nonzero(np.isfinite(far))
        order = inside[np.argsort(far[inside], kind="stable")]
        _follow(order, far, around.first, around.to, around.length, around.step, place[number])
        place[number, ~np.isfinite(far)] = np.inf
    distance = np.hypot(place[..., 0], place[..., 1])
    distance[distance > radius] = np.inf
    return distance, place


@njit(cache=True, nogil=True)
def _follow(
    order: NDArray[np.int64],
    far: NDArray[np.float64],
    first: NDArray[np.int64],
    to: NDArray[np.int64],
    length: NDArray[np.float64],
    step: NDArray[np.float64],
    place: NDArray[np.float64],
) -> None:
    """Fill places in the order of distance: the mean of what the neighbours before say."""
    for position in range(1, len(order)):
        vertex = order[position]
        x, y, total = 0.0, 0.0, 0.0
        for edge in range(first[vertex], first[vertex + 1]):
            before = to[edge]
            if far[before] < far[vertex]:
                weight = 1.0 / (far[before] + length[edge] - far[vertex] + 0.1 * length[edge])
                x += weight * (place[before, 0] - step[edge, 0])
                y += weight * (place[before, 1] - step[edge, 1])
                total += weight
        place[vertex, 0], place[vertex, 1] = x / total, y / total


# ---- patches ---------------------------------------------------------------------------------


def _places(
    middles: NDArray[np.int64],
    distance: NDArray[np.float64],
    piece: Piece,
    random: np.random.Generator,
) -> NDArray[np.int64]:
    """Which piece (P,) each patch takes: of some, that farthest from its neighbours' and least
    used: what is near looks different."""
    chosen = np.full(len(middles), -1)
    near = np.isfinite(distance[:, middles])
    for patch in range(len(middles)):
        candidates = random.integers(0, len(piece.places), _CANDIDATES)
        others = chosen[(near[patch] | near[:, patch]) & (chosen >= 0)]
        if len(others) == 0:
            chosen[patch] = candidates[0]
            continue
        apart = piece.places[candidates][:, None] - piece.places[others][None]
        chosen[patch] = candidates[np.argmax(np.linalg.norm(apart, axis=-1).min(axis=1))]
    return chosen


def _weights(distance: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """(P, V): fading from 1 in a patch's middle to 0 at its rim, but for all beside the nearest
    ``SLOTS`` at a vertex; adding up to 1."""
    nearness = np.where(np.isfinite(distance), 1.0 - distance / radius, 0.0)
    fading = nearness**_SHARPNESS
    if len(fading) > SLOTS:
        # Less the first that has no slot: no weight jumps where the order changes.
        fading = np.maximum(fading - np.sort(fading, axis=0)[-SLOTS - 1], 0.0)
    total = fading.sum(axis=0)
    nearest = np.argmin(distance, axis=0)
    alone = total <= 1e-9
    fading[:, alone] = 0.0
    fading[nearest[alone], np.flatnonzero(alone)] = 1.0
    weights: NDArray[np.float64] = fading / np.where(alone, 1.0, total)
    return weights


def _split(
    triangles: NDArray[np.int64],
    weights: NDArray[np.float64],
    place: NDArray[np.float64],
    where: NDArray[np.int64],
    piece: Piece,
    middles: NDArray[np.int64],
) -> Laying:
    """Vertices with the coordinates of their triangle's patches; shared where these are the same.

    A triangle shows the patches that weigh most on its corners.
    """
    of_triangle = weights[:, triangles].sum(axis=2)
    slots = min(SLOTS, len(weights))
    shown = np.sort(np.argsort(-of_triangle, axis=0, kind="stable")[:slots].T, axis=1)
    shown = np.pad(shown, ((0, 0), (0, SLOTS - slots)), constant_values=-1)
    is_shown = (shown >= 0) & (np.take_along_axis(of_triangle.T, shown, axis=1) > 0)
    shown = np.where(is_shown, shown, -1)
    corners = np.concatenate([triangles.reshape(-1, 1), np.repeat(shown, 3, axis=0)], axis=1)
    found, number = np.unique(corners, axis=0, return_inverse=True)
    vertex, patch = found[:, 0], found[:, 1:]
    there = np.maximum(patch, 0)
    share = np.where(patch >= 0, weights[there, vertex[:, None]], 0.0)
    total = share.sum(axis=1, keepdims=True)
    at = place[there, vertex[:, None]]
    at = np.where((patch >= 0)[..., None] & np.isfinite(at), at, 0.0)
    angle = piece.directions[where[there]]
    cosine, sine = np.cos(angle), np.sin(angle)
    turned = np.stack(
        [cosine * at[..., 0] - sine * at[..., 1], sine * at[..., 0] + cosine * at[..., 1]], axis=-1
    )
    uvs = piece.places[where[there]] + turned
    return Laying(
        vertex,
        number.reshape(-1, 3).astype(np.int32),
        uvs.astype(np.float32),
        (share / np.where(total > 0, total, 1.0)).astype(np.float32),
        shown,
        middles,
    )
