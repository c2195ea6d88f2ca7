"""Which directions each vertex sees the sky in: V(ω) of the paper's Eq. 1.

Rays start a little off the surface. How little is a matter of the triangles around the vertex:
too far and they leak through a thin gap or see under the horizon, too near and rounding makes
them hit the surface they start from. Where another surface touches the vertex, the side that is
still free is taken, and where none is, the vertex is sealed and sees nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.mesh_edges import connected_components, edge_vertices, mesh_edges
from pipelines.geometry.rays import build_scene, first_hits, occluded
from pipelines.ssdf_lighting.distances.octahedral import texel_directions

if TYPE_CHECKING:
    from open3d.t.geometry import RaycastingScene

FloatArray = NDArray[np.float64]

LIFT = 1e-4
"""Height of the rays' origins, in mean lengths of the edges at the vertex."""
_LEAST_LIFT = 3e-6
"""In extents of the scene, whose positions are single precision: some fifty of their steps."""
_LITTLE_SKY = 0.05
"""Share of the directions up to which a vertex may be buried."""
_ENOUGH = 256
"""Rays from a vertex that tell whether it is buried."""
_CLEARANCE = 0.15
"""Room around a ray's origin, in its height."""
_MOST_PIECES = 256
"""Geometries that the surfaces are told apart by."""
_BLOCK = 256
"""Vertices whose rays are in memory together."""


class RayOrigins(NamedTuple):
    """Where the rays of each vertex start: ``points`` (V, 3) float32; ``sealed`` (V,) bool, the
    vertices that other surfaces cover on all sides."""

    points: NDArray[np.float32]
    sealed: NDArray[np.bool_]


def ray_origins(
    scene: RaycastingScene,
    vertices: FloatArray,
    triangles: NDArray[np.integer],
    normals: FloatArray,
) -> RayOrigins:
    """Origins just off the surface, on its outer side.

    vertices (V, 3); triangles (F, 3); normals (V, 3) unit; ``scene`` holds
    the same triangles in the same order. A first choice lies above the vertex along its normal.
    Where something else is in between or touches, points above each triangle at the vertex are
    tried, moved a little into the triangle. Half of the height is used where another surface is
    nearer than that.
    """
    lift = _lifts(vertices, triangles)
    # Doubled vertices, along creases, have the same triangles around them.
    place = np.unique(vertices, axis=0, return_inverse=True)[1].reshape(-1)
    welded = place[triangles]
    pieces = _pieces(scene, vertices, triangles)
    points, free = _lifted(pieces, welded, vertices, place, normals, lift)
    corners = triangles.ravel().astype(np.int64)
    trouble = np.flatnonzero(~free[corners])
    sealed = ~free
    if len(trouble):
        face, vertex = trouble // 3, corners[trouble]
        a, b, c = vertices[triangles[face]].transpose(1, 0, 2)
        face_normal = np.cross(b - a, c - a)
        face_normal /= np.linalg.norm(face_normal, axis=1, keepdims=True)
        inward = (a + b + c) / 3.0 - vertices[vertex]
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        start = vertices[vertex] + 4.0 * lift[vertex, None] * inward
        there, found = _lifted(pieces, welded, start, place[vertex], face_normal, lift[vertex])
        free_ones = np.flatnonzero(found)[::-1]
        # Where surfaces cross, one side may be inside the other body.
        inside = _from_behind(scene, vertices, triangles, there[free_ones], face_normal[free_ones])
        # The last write wins: the first triangle outside, or else the first.
        chosen = free_ones[np.argsort(~inside, kind="stable")]
        points[vertex[chosen]] = there[chosen]
        sealed[vertex[chosen]] = False
    return RayOrigins(points.astype(np.float32), sealed)


def visible_directions(
    scene: RaycastingScene, origins: RayOrigins, directions: FloatArray
) -> NDArray[np.bool_]:
    """V (P, D): whether the ray from each of P origins in each of D directions (D, 3) is free."""
    count, ways = len(origins.points), directions.astype(np.float32)
    blocked = occluded(
        scene, np.repeat(origins.points, len(ways), axis=0), np.tile(ways, (count, 1))
    )
    return ~blocked.reshape(count, -1) & ~origins.sealed[:, None]


class SceneVisibility(NamedTuple):
    """What is stored of each of V vertices: of a buried one what its stand-in sees.

    visible: (V, bytes) uint8, a bit a direction, the first direction in a byte's highest bit.
    origins: where the rays started. stored: (V,) int64, the vertex that each row is of.
    sealed: number of the vertices that other surfaces cover on all sides.
    """

    visible: NDArray[np.uint8]
    origins: RayOrigins
    stored: NDArray[np.int64]
    sealed: int

    @property
    def buried(self) -> int:
        """Number of the vertices that have a stand-in."""
        return int((self.stored != np.arange(len(self.stored))).sum())


def scene_visibility(
    vertices: FloatArray,
    triangles: NDArray[np.integer],
    normals: FloatArray,
    n: int,
    progress: Callable[[float], None] = lambda fraction: None,
) -> SceneVisibility:
    """Cast rays from vertices (V, 3) in n x n directions, block by block; normals (V, 3) unit."""
    scene = build_scene(vertices, triangles)
    origins = ray_origins(scene, vertices, triangles, normals)
    directions = texel_directions(n)
    bits = np.empty((len(vertices), (n * n + 7) // 8), np.uint8)
    share = np.empty(len(bits))
    for first in range(0, len(bits), _BLOCK):
        block = slice(first, first + _BLOCK)
        some = RayOrigins(origins.points[block], origins.sealed[block])
        seen = visible_directions(scene, some, directions)
        bits[block], share[block] = np.packbits(seen, axis=1), seen.mean(axis=1)
        progress(first / len(bits))
    stored = stand_ins_for_buried(scene, vertices, triangles, normals, origins, share, directions)
    return SceneVisibility(
        bits[stored],
        RayOrigins(origins.points[stored], origins.sealed[stored]),
        stored,
        int(origins.sealed.sum()),
    )


def unpacked(visible: NDArray[np.uint8], directions: int) -> NDArray[np.bool_]:
    """Visibility (V, directions) of bits (V, bytes).

    >>> unpacked(np.array([[0b10110000]], np.uint8), 4).tolist()
    [[True, False, True, True]]
    """
    return np.unpackbits(visible, axis=1)[:, :directions].astype(bool)


def stand_ins_for_buried(
    scene: RaycastingScene,
    vertices: FloatArray,
    triangles: NDArray[np.integer],
    normals: FloatArray,
    origins: RayOrigins,
    visible_share: FloatArray,
    directions: FloatArray,
) -> NDArray[np.int64]:
    """For each vertex the one whose visibility is stored for it: itself, but for the *buried* ones.

    Where objects stand on each other or run into each other, some vertices lie inside or in the
    gap. Nobody sees them, but triangles reach from them into the open, and distances are
    interpolated there: black at the buried end would spread a whole triangle far. They take what
    the nearest vertex along the surface has. Buried is a vertex that is sealed, or sees next to no
    sky and either mostly looks at surfaces from behind, so that it is inside something, or has
    something straight above it, nearer than the length of its edges.

    visible_share: (V,) of ``directions`` (D, 3).
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    dark = np.flatnonzero(visible_share < _LITTLE_SKY)
    buried = origins.sealed.copy()
    some = np.random.default_rng(0).permutation(directions)[:_ENOUGH]
    for vertex in dark:
        upper = some[some @ normals[vertex] > 0.0]
        from_behind = _from_behind(scene, vertices, triangles, origins.points[vertex], upper)
        buried[vertex] |= int(from_behind.sum()) * 2 > len(upper)
    sees_none = np.flatnonzero(visible_share == 0.0)
    above = first_hits(scene, origins.points[sees_none], normals[sees_none]).distance
    buried[sees_none[above < _mean_edges(vertices, triangles)[sees_none]]] = True
    number = np.arange(len(vertices))
    if not buried.any() or buried.all():
        return number
    sides = edge_vertices(triangles)
    lengths = np.linalg.norm(vertices[sides[:, 0]] - vertices[sides[:, 1]], axis=1)
    size = (len(vertices), len(vertices))
    graph = coo_array((lengths, (sides[:, 0], sides[:, 1])), shape=size).tocsr()
    far, _, nearest = dijkstra(
        graph,
        directed=False,
        indices=np.flatnonzero(~buried),
        min_only=True,
        return_predecessors=True,
    )
    return np.where(buried & np.isfinite(far), nearest, number)


def _from_behind(
    scene: RaycastingScene,
    vertices: FloatArray,
    triangles: NDArray[np.integer],
    starts: NDArray[np.floating],
    ways: FloatArray,
) -> NDArray[np.bool_]:
    """Whether rays from ``starts`` (3,) or (N, 3) along ``ways`` (N, 3) meet a surface's back."""
    met = first_hits(scene, starts, ways).triangle
    a, b, c = vertices[triangles[met]].transpose(1, 0, 2)
    facing: NDArray[np.bool_] = np.einsum("ki,ki->k", np.cross(b - a, c - a), ways) > 0.0
    return facing & (met >= 0)


def _mean_edges(vertices: FloatArray, triangles: NDArray[np.integer]) -> FloatArray:
    following = np.roll(triangles, -1, axis=1)
    edges = np.linalg.norm(vertices[triangles] - vertices[following], axis=2)
    sums, counts = np.zeros(len(vertices)), np.zeros(len(vertices))
    for corner in (triangles, following):
        np.add.at(sums, corner, edges)
        np.add.at(counts, corner, 1.0)
    return sums / np.maximum(counts, 1.0)


def _lifts(vertices: FloatArray, triangles: NDArray[np.integer]) -> FloatArray:
    extent = np.linalg.norm(np.ptp(vertices, axis=0))
    lifts: FloatArray = np.maximum(LIFT * _mean_edges(vertices, triangles), _LEAST_LIFT * extent)
    return lifts


class _Pieces(NamedTuple):
    """A scene of several geometries. Primitive k of geometry g is the triangle
    ``order[start[g] + k]``."""

    scene: RaycastingScene
    order: NDArray[np.int64]
    start: NDArray[np.int64]


def _pieces(
    scene: RaycastingScene, vertices: FloatArray, triangles: NDArray[np.integer]
) -> _Pieces:
    """A geometry for each piece that hangs together by edges.

    Where surfaces touch, rays meet both at one distance, and of what is met at one distance Open3D
    lists but one primitive a geometry.
    """
    import open3d as o3d

    piece = connected_components(
        mesh_edges(triangles.astype(np.int64)).pairs() // 3, len(triangles)
    )
    piece %= _MOST_PIECES
    order = np.argsort(piece, kind="stable")
    counts = np.bincount(piece)
    start = np.cumsum(counts) - counts
    if len(counts) > 1:
        scene = o3d.t.geometry.RaycastingScene()
        positions = o3d.core.Tensor.from_numpy(vertices.astype(np.float32))
        for some in np.split(triangles[order].astype(np.uint32), start[1:]):
            scene.add_triangles(positions, o3d.core.Tensor.from_numpy(some))
    return _Pieces(scene, order, start)


def _lifted(
    pieces: _Pieces,
    triangles: NDArray[np.integer],
    starts: FloatArray,
    vertex: NDArray[np.integer],
    normals: FloatArray,
    lift: FloatArray,
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Points above surface points ``starts`` of vertices, and whether nothing else is between.

    What the way up meets is looked for from a little below to twice the height: what touches the
    surface would be missed by a ray that starts on it.
    """
    import open3d as o3d

    below = starts - 0.25 * lift[:, None] * normals
    rays = np.concatenate([below, normals], axis=1).astype(np.float32)
    met = pieces.scene.list_intersections(o3d.core.Tensor.from_numpy(rays))
    splits, height = met["ray_splits"].numpy().astype(np.int64), met["t_hit"].numpy()
    begin = pieces.start[met["geometry_ids"].numpy()]
    triangle = pieces.order[begin + met["primitive_ids"].numpy()]
    ray = np.repeat(np.arange(len(starts)), np.diff(splits))
    own = (triangles[triangle] == vertex[ray, None]).any(axis=1)
    height = height - 0.25 * lift[ray]
    other = ~own & (height < 2.0 * lift[ray])
    touching = np.zeros(len(starts), bool)
    touching[ray[other & (height <= 0.1 * lift[ray])]] = True
    nearest = 2.0 * lift
    np.minimum.at(nearest, ray[other], height[other])
    above = 0.5 * np.maximum(nearest, 0.0)
    points = starts + above[:, None] * normals
    # A surface that the way up lies in is not met by it.
    around = pieces.scene.compute_distance(o3d.core.Tensor.from_numpy(points.astype(np.float32)))
    return points, ~touching & (around.numpy() > _CLEARANCE * above)
