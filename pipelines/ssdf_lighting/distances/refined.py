"""Distances to the refined edge of visibility, small holes and thin parts included.

Directions miss what is smaller than their texels. A gap between two surfaces, or between facets at
the surface's own horizon, through which a little sky shows, is rare, but distances are then wrong
over a wide dark region. So inside dark regions every texel is asked again, at four places; a place
that sees the sky gets a small loop of its own. What is thin before the sky (poles, wires, leaves)
is found by the mesh's own edges instead: see `thin_parts`.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.geometry.rays import build_scene, occluded
from pipelines.ssdf_lighting.distances.octahedral import (
    delaunay_sides,
    directions_of,
    square_of,
    texel_directions,
)
from pipelines.ssdf_lighting.distances.outline_tree import OutlineTree, outline_tree
from pipelines.ssdf_lighting.distances.signed_distance import distances_to_arcs
from pipelines.ssdf_lighting.distances.thin_parts import thin_outlines
from pipelines.ssdf_lighting.distances.visibility import RayOrigins, scene_visibility, unpacked
from pipelines.ssdf_lighting.distances.visible_edge import VisibleEdge, visible_edge

if TYPE_CHECKING:
    from open3d.t.geometry import RaycastingScene

_BELOW = 0.2
"""Sine of the angle below the tangent plane down to which facets may leave a view."""
_LOOP = 0.2
"""Radius of the loop around a hole, in sides of a texel."""


class Occluders(NamedTuple):
    """What hides the sky: for rays, and its edges that can be outline."""

    rays: RaycastingScene
    outlines: OutlineTree


def occluders(vertices: NDArray[np.float64], triangles: NDArray[np.integer]) -> Occluders:
    """Of a mesh: vertices (V, 3), triangles (F, 3). Raises ValueError as `rays.build_scene`."""
    return Occluders(build_scene(vertices, triangles), outline_tree(vertices, triangles))


def refined_distances(
    around: Occluders,
    origins: RayOrigins,
    normals: NDArray[np.floating],
    visible: NDArray[np.bool_],
) -> NDArray[np.float32]:
    """d (P, n²) float32, radians, of P points whose ``visible`` (P, n²) is known.

    ``normals`` (P, 3): far below the surface's own horizon no holes are looked for. The signs are
    those of ``visible``; where thin parts stand between the directions, d is the angle to them.
    """
    distances = crossing_distances(around.rays, origins, normals, visible)
    thin = thin_outlines(origins.points, distances, around.outlines)
    some = np.flatnonzero(np.diff(thin.starts))
    if len(some):
        starts = np.append(thin.starts[some], thin.starts[-1])
        seen = visible[some]
        to_thin = distances_to_arcs(seen, thin._replace(starts=starts))
        distances[some] = np.where(seen, np.minimum(distances[some], to_thin), distances[some])
    return distances


def crossing_distances(
    rays: RaycastingScene,
    origins: RayOrigins,
    normals: NDArray[np.floating],
    visible: NDArray[np.bool_],
) -> NDArray[np.float32]:
    """The same without thin parts: to where the edge crosses between two directions of different
    visibility, and to holes in the dark."""
    edge = visible_edge(rays, origins.points, visible)
    point, way = _holes(rays, origins, normals, visible)
    return distances_to_arcs(visible, _with_loops(edge, point, way, visible.shape[1]))


def scene_distances(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.integer],
    normals: NDArray[np.float64],
    n: int,
) -> NDArray[np.float32]:
    """d (V, n²) float32, radians, of all vertices (V, 3) in n x n directions: the SSDF matrix.

    normals (V, 3) unit; triangles (F, 3). All of it lies in memory; the graph goes by blocks.
    """
    seen = scene_visibility(vertices, triangles, normals, n)
    visible = unpacked(seen.visible, n * n)
    return refined_distances(occluders(vertices, triangles), seen.origins, normals, visible)


@functools.lru_cache(maxsize=4)
def _quarters(n: int) -> NDArray[np.float32]:
    """Unit vectors (n², 4, 3) to the middles of the texels' quarters."""
    middles = square_of(texel_directions(n))
    steps = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]]) * (0.5 / n)
    return directions_of(middles[:, None] + steps).astype(np.float32)


def _holes(
    scene: RaycastingScene,
    origins: RayOrigins,
    normals: NDArray[np.floating],
    visible: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Points (H,), ascending, and directions (H, 3) that see the sky where all around is hidden."""
    n = round(visible.shape[1] ** 0.5)
    inner = _inner(visible, delaunay_sides(n).ends) & ~visible
    inner &= normals @ texel_directions(n).T > -_BELOW
    inner &= ~origins.sealed[:, None]
    point, texel = np.nonzero(inner)
    ways = _quarters(n)[texel].reshape(-1, 3)
    point = np.repeat(point, 4)
    seen = ~occluded(scene, origins.points[point], ways)
    return point[seen], ways[seen]


@njit(cache=True, nogil=True)
def _inner(visible: NDArray[np.bool_], ends: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Directions (P, D) all of whose Delaunay neighbours have the same visibility."""
    inner = np.ones(visible.shape, np.bool_)
    for p in range(len(visible)):
        for side in range(len(ends)):
            first, second = ends[side]
            if visible[p, first] != visible[p, second]:
                inner[p, first] = False
                inner[p, second] = False
    return inner


def _with_loops(
    edge: VisibleEdge, point: NDArray[np.int64], way: NDArray[np.float32], directions: int
) -> VisibleEdge:
    """The edge with a loop of three arcs around each way (H, 3) of a point (H,)."""
    if not len(point):
        return edge
    radius = _LOOP * np.sqrt(4.0 * np.pi / directions)
    upright = np.where(np.abs(way[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    one = np.cross(way, upright)
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    other = np.cross(way, one)
    angles = np.arange(3) * (2.0 * np.pi / 3.0)
    around = np.cos(angles)[:, None] * one[:, None] + np.sin(angles)[:, None] * other[:, None]
    corners = way[:, None] + radius * around
    corners /= np.linalg.norm(corners, axis=2, keepdims=True)
    added = 3 * np.bincount(point, minlength=len(edge.starts) - 1)
    shift = np.concatenate([[0], np.cumsum(added)])
    starts = edge.starts + shift
    # Where the old and the new ones of each point go: the old ones first.
    owner = np.repeat(np.arange(len(added)), np.diff(edge.starts))
    old = np.arange(len(edge.crossings)) + shift[owner]
    place = np.repeat(3 * (np.arange(len(point)) - np.searchsorted(point, point)), 3)
    new = (starts[1:] - added)[np.repeat(point, 3)] + place + np.tile(np.arange(3), len(point))
    crossings = np.empty((starts[-1], 3), np.float32)
    arcs = np.empty((starts[-1], 2), np.int32)
    crossings[old], crossings[new] = edge.crossings, corners.reshape(-1, 3)
    arcs[old] = edge.arcs + shift[owner][:, None]
    arcs[new, 0] = new
    arcs[new, 1] = new.reshape(-1, 3)[:, [1, 2, 0]].ravel()
    return VisibleEdge(crossings, arcs, starts)
