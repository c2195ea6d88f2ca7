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
from numpy.typing import NDArray

from pipelines.geometry.mesh_edges import edge_vertices
from pipelines.geometry.meshes import joined_vertices

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


class Patches(NamedTuple):
    """Which patches a mesh has."""

    middles: NDArray[np.int64]
    """(P,): the vertex in the middle of each."""
    places: NDArray[np.floating]
    """(P, 2): what of the photograph is there, in widths, origin bottom left."""
    directions: NDArray[np.floating]
    """(P,): how the hair lies there, radians from the photograph's x towards its y (up)."""


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


class Body(NamedTuple):
    """What patches are laid over. Copies of a vertex count as one."""

    points: NDArray[np.floating]
    """(V, 3), mesh units."""
    triangles: NDArray[np.integer]
    """(F, 3)."""
    tangents: NDArray[np.floating]
    """(V, 3): unit vectors along the lie of the hair."""
    normals: NDArray[np.floating]
    """(V, 3)."""


def choose_patches(body: Body, piece: Piece, *, spacing: float, seed: int = 0) -> Patches:
    """Cover a body with patches of a photograph, each of a piece that its neighbours have not.

    spacing: distance of neighbouring patches' middles, mesh units. Raises ValueError where it is
    not positive.
    """
    _require_lengths(spacing=spacing)
    random = np.random.default_rng(seed)
    joined = _Joined.of(body)
    middles = _spread_out(joined.around, spacing)
    charts = _charts(joined.around, middles, REACH * spacing)
    where = _places(middles, charts, piece, random)
    return Patches(joined.first[middles], piece.places[where], piece.directions[where])


def lay(body: Body, patches: Patches, *, spacing: float, width: float) -> Laying:
    """Lay chosen patches over their body, at the spacing that they were chosen for.

    width: of the photograph as it lies on the surface, mesh units. Packages hold the patches, and
    readers do this. Raises ValueError for lengths that are not positive.
    """
    _require_lengths(spacing=spacing, width=width)
    joined = _Joined.of(body)
    corners = joined.position[body.triangles]
    charts = _charts(joined.around, joined.position[patches.middles], REACH * spacing)
    shown = _shown(corners, charts)
    vertex, split, uvs, weights = _split(corners, shown, charts, patches, width)
    return Laying(joined.first[vertex], split, uvs, weights, shown)


def _require_lengths(**lengths: float) -> None:
    for name, value in lengths.items():
        if not value > 0:
            raise ValueError(f"{name} is {value:g}; expected a positive length.")


def least_spacing(points: NDArray[np.floating], triangles: NDArray[np.integer]) -> float:
    """How far apart patches' middles must be for a patch to hold most triangles about its own."""
    edges = edge_vertices(triangles)
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    return 1.2 * float(np.quantile(lengths, 0.9))


# ---- the surface -----------------------------------------------------------------------------


class _Joined(NamedTuple):
    """A body without copies of vertices."""

    first: NDArray[np.int64]
    """(P,): the body's vertex that each position has first."""
    position: NDArray[np.int64]
    """(V,)."""
    around: _Neighbours

    @classmethod
    def of(cls, body: Body) -> _Joined:
        points, tangents, normals = (
            each.astype(np.float64) for each in (body.points, body.tangents, body.normals)
        )
        first, position = joined_vertices(points, normals)
        corners = position[body.triangles]
        apart = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
        around = _Neighbours.of(points[first], apart, tangents[first], normals[first])
        return cls(first, position, around)


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


class _Charts(NamedTuple):
    """What each patch covers, row by row, sorted by vertex and patch."""

    vertex: NDArray[np.int64]
    patch: NDArray[np.int64]
    place: NDArray[np.float64]
    """(M, 2): lengths along and across the lie from the patch's middle."""
    weight: NDArray[np.float64]
    """At most ``SLOTS`` at a vertex are above 0."""
    patches: int

    def rows(
        self, vertex: NDArray[np.int64], patch: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """The row of each pair, and whether there is one."""
        keys = self.vertex * self.patches + self.patch
        wanted = vertex * self.patches + patch
        row = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        return row, (keys[row] == wanted) & (patch >= 0)


def _charts(around: _Neighbours, middles: NDArray[np.int64], radius: float) -> _Charts:
    """Charts of all vertices within 1.5 radii of each middle along the surface."""
    from pipelines.photo_fur.chart_kernel import follow  # numba, which not every user needs

    count = len(around.first) - 1
    parts = []
    for number, middle in enumerate(middles):
        far = _distances(around, middle, 1.5 * radius)
        (inside,) = np.nonzero(np.isfinite(far))
        order = inside[np.argsort(far[inside], kind="stable")]
        place = np.zeros((count, 2))
        follow(order, far, around.first, around.to, around.length, around.step, place)
        parts.append((inside, np.full(len(inside), number), place[inside]))
    vertex, patch, place = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.lexsort((patch, vertex))
    vertex, patch, place = vertex[order], patch[order], place[order]
    weight = _weights(vertex, np.hypot(*place.T) / radius, count)
    return _Charts(vertex, patch, place, weight, len(middles))


def _weights(
    vertex: NDArray[np.int64], distance: NDArray[np.float64], count: int
) -> NDArray[np.float64]:
    """Fading from 1 in a patch's middle to 0 at its rim, distance 1, but for all beside the nearest
    ``SLOTS`` at a vertex; adding up to 1 at each."""
    fading = np.maximum(1.0 - distance, 0.0) ** _SHARPNESS
    order = np.lexsort((distance, vertex))
    first = np.searchsorted(vertex, np.arange(count))
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order)) - first[vertex[order]]
    # Less the first that has no slot: no weight jumps where the order changes.
    without = np.zeros(count)
    without[vertex[rank == SLOTS]] = fading[rank == SLOTS]
    fading = np.maximum(fading - without[vertex], 0.0)
    total = np.bincount(vertex, fading, count)
    alone = total[vertex] <= 1e-12
    fading = np.where(alone, (rank == 0).astype(np.float64), fading)
    weights: NDArray[np.float64] = fading / np.where(alone, 1.0, total[vertex])
    return weights


# ---- patches ---------------------------------------------------------------------------------


def _places(
    middles: NDArray[np.int64],
    charts: _Charts,
    piece: Piece,
    random: np.random.Generator,
) -> NDArray[np.int64]:
    """Which piece (P,) each patch takes: of some, that farthest from its neighbours'."""
    number = np.full(int(charts.vertex.max()) + 1, -1)
    number[middles] = np.arange(len(middles))
    beside = number[charts.vertex]
    one, other = charts.patch[beside >= 0], beside[beside >= 0]
    chosen = np.full(len(middles), -1)
    for patch in range(len(middles)):
        candidates = random.integers(0, len(piece.places), _CANDIDATES)
        near = np.concatenate([other[one == patch], one[other == patch]])
        taken = chosen[near][chosen[near] >= 0]
        if len(taken) == 0:
            chosen[patch] = candidates[0]
            continue
        apart = piece.places[candidates][:, None] - piece.places[taken][None]
        chosen[patch] = candidates[np.argmax(np.linalg.norm(apart, axis=-1).min(axis=1))]
    return chosen


def _shown(triangles: NDArray[np.int64], charts: _Charts) -> NDArray[np.int64]:
    """The patches (F, SLOTS) that weigh most on a triangle's corners, ascending; -1 for none."""
    (heavy,) = np.nonzero(charts.weight > 0)
    vertex = charts.vertex[heavy]
    slot = np.arange(len(heavy)) - np.searchsorted(vertex, vertex)
    patch = np.full((int(triangles.max()) + 1, SLOTS), -1)
    weight = np.zeros(patch.shape)
    patch[vertex, slot], weight[vertex, slot] = charts.patch[heavy], charts.weight[heavy]
    candidates, weights = patch[triangles].reshape(-1, 3 * SLOTS), weight[triangles]
    weights = weights.reshape(candidates.shape)
    same = candidates[:, :, None] == candidates[:, None, :]
    total = np.einsum("fij,fj->fi", same, weights)
    is_first = ~(same & np.tri(3 * SLOTS, k=-1, dtype=bool)).any(axis=2) & (candidates >= 0)
    total = np.where(is_first, total, -1.0)
    best = np.argsort(-total, axis=1, kind="stable")[:, :SLOTS]
    found = np.where(
        np.take_along_axis(total, best, axis=1) > 0,
        np.take_along_axis(candidates, best, axis=1),
        -1,
    )
    ordered: NDArray[np.int64] = np.sort(np.where(found < 0, charts.patches, found), axis=1)
    return np.where(ordered == charts.patches, -1, ordered)


def _split(
    triangles: NDArray[np.int64],
    shown: NDArray[np.int64],
    charts: _Charts,
    patches: Patches,
    width: float,
) -> tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.float32], NDArray[np.float32]]:
    """Vertices with the coordinates of their triangle's patches, shared where these are the same:
    vertex, triangles, coordinates and weights as of `Laying`."""
    corners = np.concatenate([triangles.reshape(-1, 1), np.repeat(shown, 3, axis=0)], axis=1)
    found, number = np.unique(corners, axis=0, return_inverse=True)
    vertex, patch = found[:, 0], found[:, 1:]
    row, is_there = charts.rows(np.repeat(vertex[:, None], SLOTS, axis=1), patch)
    share = np.where(is_there, charts.weight[row], 0.0)
    total = share.sum(axis=1, keepdims=True)
    at = np.where(is_there[..., None], charts.place[row], 0.0) / width
    angle = patches.directions[patch]
    cosine, sine = np.cos(angle), np.sin(angle)
    turned = np.stack(
        [cosine * at[..., 0] - sine * at[..., 1], sine * at[..., 0] + cosine * at[..., 1]], axis=-1
    )
    return (
        vertex,
        number.reshape(-1, 3).astype(np.int32),
        (patches.places[patch] + turned).astype(np.float32),
        (share / np.where(total > 0, total, 1.0)).astype(np.float32),
    )
