"""Rays against triangle meshes: first hits and visibility by Open3D's RaycastingScene (Embree).

Conventions: a ray is the set of points ``origin + t * direction`` with t >= 0. Directions need
not be unit vectors; every distance is in units of the direction's length. Both sides of a
triangle are hit. Open3D and Embree compute in float32: an origin that lies on a surface has to
be moved off it by the caller, who knows the scale of the scene.

Each ray's answer depends on nothing but the scene and that ray, not on the threads that trace.
Open3D 0.20 builds the tree in one thread (seen: CPU time equals wall time, whatever ``nthreads``),
so equal meshes give equal bits, exact ties (rays through shared edges) included.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from open3d.core import Tensor
    from open3d.t.geometry import RaycastingScene

# Rays handed to Embree at once: 6 MB of rays, enough to keep all threads busy.
RAYS_PER_BLOCK = 1 << 18


class FirstHits(NamedTuple):
    """What N rays meet first.

    distance: (N,) float32, in lengths of the ray's direction; inf where nothing is hit.
    triangle: (N,) int64, row of the scene's triangle array; -1 where nothing is hit.
    barycentric: (N, 3) float32, weights of the triangle's three vertices at the hit point, in
        the order of that row; zero where nothing is hit.
    """

    distance: NDArray[np.float32]
    triangle: NDArray[np.int64]
    barycentric: NDArray[np.float32]


def build_scene(vertices: ArrayLike, triangles: ArrayLike) -> RaycastingScene:
    """Build the ray-casting scene of one triangle mesh.

    vertices: (V, 3) positions; stored as float32.
    triangles: (F, 3) integer rows of ``vertices``.

    The scene cannot be pickled: build one in each process.
    Raises ValueError for wrong shapes, positions that are not finite and indices out of range
    (Embree itself would read past the array).
    """
    import open3d as o3d  # takes seconds, and not every user of this package casts rays

    positions = np.ascontiguousarray(vertices, dtype=np.float32)
    corners = np.asarray(triangles)
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise ValueError(f"vertices: expected shape (V, 3), found {positions.shape}")
    if corners.ndim != 2 or corners.shape[1] != 3 or corners.dtype.kind not in "iu":
        raise ValueError(
            f"triangles: expected integers of shape (F, 3), found {corners.dtype} {corners.shape}"
        )
    if not np.isfinite(positions).all():
        raise ValueError("vertices: expected finite positions, found NaN, infinity or overflow")
    if corners.size and (corners.min() < 0 or corners.max() >= len(positions)):
        raise ValueError(
            f"triangles: expected rows of {len(positions)} vertices, "
            f"found indices from {corners.min()} to {corners.max()}"
        )
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor.from_numpy(positions),
        o3d.core.Tensor.from_numpy(np.ascontiguousarray(corners, dtype=np.uint32)),
    )
    return scene


def first_hits(scene: RaycastingScene, origins: ArrayLike, directions: ArrayLike) -> FirstHits:
    """Find the first triangle along each ray.

    origins, directions: (N, 3), or (3,) for one that all rays share; computed in float32.
    Raises ValueError for other shapes. Memory beyond the result is bounded by RAYS_PER_BLOCK.

    >>> from pipelines.geometry.shapes import square
    >>> flat = square()
    >>> scene = build_scene(flat.vertices, flat.triangles)
    >>> hits = first_hits(scene, [[0.1, 0.2, 3.0], [9.0, 9.0, 3.0]], [0.0, 0.0, -1.0])
    >>> hits.distance.astype(float).round(5).tolist(), (hits.triangle >= 0).tolist()
    ([3.0, inf], [True, False])
    """
    import open3d as o3d

    starts, ways = _broadcast_rays(origins, directions)
    count = len(starts)
    distance = np.empty(count, np.float32)
    triangle = np.empty(count, np.int64)
    barycentric = np.empty((count, 3), np.float32)
    for first in range(0, count, RAYS_PER_BLOCK):
        block = slice(first, first + RAYS_PER_BLOCK)
        answer = scene.cast_rays(_ray_tensor(starts[block], ways[block]))
        ids = answer["primitive_ids"].numpy()
        hit = ids != o3d.t.geometry.RaycastingScene.INVALID_ID
        distance[block] = answer["t_hit"].numpy()
        triangle[block] = np.where(hit, ids, np.int64(-1))
        barycentric[block, 1:] = answer["primitive_uvs"].numpy()
        barycentric[block, 0] = 1 - barycentric[block, 1] - barycentric[block, 2]
        barycentric[block][~hit] = 0
    return FirstHits(distance, triangle, barycentric)


def occluded(
    scene: RaycastingScene,
    origins: ArrayLike,
    directions: ArrayLike,
    *,
    farthest: float = np.inf,
) -> NDArray[np.bool_]:
    """Tell which rays meet any triangle at a distance of at most ``farthest``.

    origins, directions: (N, 3), or (3,) for one that all rays share; computed in float32.
    farthest: in lengths of the direction: with directions that reach from point to point, 1 asks
        whether anything stands between the points.
    Returns (N,) bool. Raises ValueError for other shapes. Faster than first hits.
    """
    starts, ways = _broadcast_rays(origins, directions)
    blocked = np.empty(len(starts), np.bool_)
    for first in range(0, len(starts), RAYS_PER_BLOCK):
        block = slice(first, first + RAYS_PER_BLOCK)
        rays = _ray_tensor(starts[block], ways[block])
        blocked[block] = scene.test_occlusions(rays, tfar=farthest).numpy()
    return blocked


class Seen(NamedTuple):
    """What straight lines from outside a mesh meet first: ``triangle`` (N,) int64, its row, and
    ``direction`` (N, 3), the unit vector along the line."""

    triangle: NDArray[np.int64]
    direction: NDArray[np.float64]


def seen_from_outside(vertices: ArrayLike, triangles: ArrayLike, lines: int) -> Seen:
    """Look at a mesh from all around: the same ``lines`` for equal meshes, evenly over directions
    and over the sphere around the mesh; those that miss are left out.

    vertices (V, 3), in any unit and anywhere; triangles (F, 3) integers. Of a closed surface each
    part is met as often as it is seen; of a sheet, either side.

    >>> from pipelines.geometry.shapes import square
    >>> flat = square()
    >>> seen = seen_from_outside(flat.vertices, flat.triangles, 1000)
    >>> bool(0.4 < (seen.direction[:, 2] < 0).mean() < 0.6)
    True
    """
    points = np.asarray(vertices, np.float64)
    low, high = points.min(axis=0), points.max(axis=0)
    centred = points - (low + high) / 2
    radius = float(np.linalg.norm(centred, axis=1).max())
    random = np.random.default_rng(0)
    way = random.normal(size=(lines, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    across = np.cross(way, random.normal(size=(lines, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    start = np.sqrt(random.random((lines, 1))) * across - 2.0 * way
    scene = build_scene(centred / (radius or 1.0), triangles)
    triangle = first_hits(scene, start, way).triangle
    return Seen(triangle[triangle >= 0], way[triangle >= 0])


def _broadcast_rays(origins: ArrayLike, directions: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    starts, ways = np.asarray(origins), np.asarray(directions)
    fits = all(a.ndim in (1, 2) and a.shape[-1] == 3 for a in (starts, ways))
    counts = {len(a) for a in (starts, ways) if a.ndim == 2}
    if not fits or len(counts) != 1:
        raise ValueError(
            "rays: expected origins and directions of shape (N, 3), one of them may be (3,); "
            f"found {starts.shape} and {ways.shape}"
        )
    shape = (counts.pop(), 3)
    return np.broadcast_to(starts, shape), np.broadcast_to(ways, shape)


def _ray_tensor(origins: np.ndarray, directions: np.ndarray) -> Tensor:
    import open3d as o3d

    rays = np.empty((len(origins), 6), np.float32)
    rays[:, :3] = origins
    rays[:, 3:] = directions
    return o3d.core.Tensor.from_numpy(rays)
