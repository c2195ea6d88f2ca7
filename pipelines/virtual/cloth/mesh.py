"""The mesh of a cloth: one tile, and the making of it from tubes and sheets."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.virtual.cloth.yarns import FloatArray, Tubes, normalize


class Cloth(NamedTuple):
    """One tile of cloth: a mesh of V vertices and F triangles, and its fibres.

    vertices: (V, 3) float32, in sides of the tile. triangles: (F, 3) int32, counter-clockwise
        from outside. normals, fibres: (V, 3) float32 unit vectors; the fibres' direction.
    albedo, specular: (V, 3) float32 linear RGB of the two lobes (see ``fibre_brdf.py``).
    roughness: (V, 2) float32, GGX alpha along and across the fibre.
    """

    vertices: NDArray[np.float32]
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32]
    fibres: NDArray[np.float32]
    albedo: NDArray[np.float32]
    specular: NDArray[np.float32]
    roughness: NDArray[np.float32]


def cloth_of_tubes(
    tubes: Tubes, *, albedo: ArrayLike, specular: ArrayLike, roughness: tuple[float, float]
) -> Cloth:
    """Give tubes their reflectance; albedo and specular broadcast to (Y, R, A, 3)."""
    shape = tubes.positions.shape

    def flat(values: ArrayLike, columns: int = 3) -> NDArray[np.float32]:
        wide = np.broadcast_to(np.asarray(values, np.float32), (*shape[:3], columns))
        return np.ascontiguousarray(wide).reshape(-1, columns)

    return Cloth(
        flat(tubes.positions),
        tubes.triangles(),
        flat(tubes.normals),
        flat(tubes.fibres),
        np.clip(flat(albedo), 0.0, 0.95),
        np.clip(flat(specular), 0.0, 0.9),
        flat(roughness, 2),
    )


def join_cloths(*parts: Cloth) -> Cloth:
    """Put parts together."""
    first = np.cumsum([0] + [len(p.vertices) for p in parts[:-1]])
    triangles = [p.triangles + np.int32(f) for p, f in zip(parts, first, strict=True)]
    joined = [np.concatenate(column) for column in zip(*parts, strict=True)]
    joined[1] = np.concatenate(triangles)
    return Cloth(*joined)


def cloth_sheet(
    positions: FloatArray,
    *,
    fibres: ArrayLike,
    albedo: ArrayLike,
    specular: ArrayLike = 0.0,
    roughness: tuple[float, float] = (0.6, 0.6),
) -> Cloth:
    """Make a surface without gaps from a grid of points (N, N, 3).

    The first axis goes along x, the second along y; the grid goes on periodically. Fibres need
    not lie in the surface and broadcast to (N, N, 3), as albedo and specular do.
    """
    cells = len(positions)
    points = np.pad(positions, ((1, 2), (1, 2), (0, 0)), mode="wrap")
    points[0, :, 0] -= 1
    points[-2:, :, 0] += 1
    points[:, 0, 1] -= 1
    points[:, -2:, 1] += 1
    normals = np.cross(points[2:, 1:-1] - points[:-2, 1:-1], points[1:-1, 2:] - points[1:-1, :-2])
    side = cells + 1
    a = (np.arange(cells)[:, None] * side + np.arange(cells)).ravel()
    b = a + side
    triangles = np.stack([a, b, a + 1, b, b + 1, a + 1], axis=-1).reshape(-1, 3)

    def flat(values: ArrayLike) -> NDArray[np.float32]:
        grid = np.broadcast_to(np.asarray(values, np.float32), positions.shape)
        return np.pad(grid, ((0, 1), (0, 1), (0, 0)), mode="wrap").reshape(-1, 3)

    return Cloth(
        points[1:-1, 1:-1].reshape(-1, 3).astype(np.float32),
        triangles.astype(np.int32),
        normalize(normals).reshape(-1, 3).astype(np.float32),
        flat(normalize(np.asarray(fibres, np.float64))),
        flat(albedo),
        flat(specular),
        np.tile(np.array(roughness, np.float32), (side * side, 1)),
    )
