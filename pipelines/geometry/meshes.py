"""Triangle meshes with texture coordinates and normals, and what any mesh needs.

Texture coordinates (u, v) count photographs: (0, 0) is the bottom left and (1, 1) the top right
corner of one, u to the right. Outside [0, 1] the photograph is repeated, mirrored at every whole
number, which makes its value an even function of u.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FAR = 10.0
"""Radii of a mesh; as far away single precision has its vertices to a millionth of that."""

_TINY = float(np.finfo(np.float64).tiny)


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh. ``vertices`` (V, 3) float64; ``triangles`` (F, 3) int32, counter-clockwise
    from outside; ``uvs`` (V, 2) float64, in photographs; ``normals`` (V, 3) float64, unit.

    Vertices are split where texture coordinates jump; such copies have the same position and
    the same normal, so that surfaces offset along the normals stay closed.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    uvs: NDArray[np.float64]
    normals: NDArray[np.float64]


def make_mesh(vertices: ArrayLike, triangles: ArrayLike, uvs: ArrayLike) -> Mesh:
    """A mesh with normals: ``vertices`` (V, 3), ``triangles`` (F, 3) integers, ``uvs`` (V, 2) as
    described above. Raises ValueError for other shapes, for references to vertices that do not
    exist and for numbers that are not finite.
    """
    points, coordinates = np.array(vertices, np.float64), np.array(uvs, np.float64)
    faces = np.array(triangles)
    check_mesh(points, faces)
    if coordinates.shape != (len(points), 2) or not np.isfinite(coordinates).all():
        raise ValueError(
            f"uvs have the shape {coordinates.shape}; expected ({len(points)}, 2) finite numbers"
        )
    return Mesh(points, faces.astype(np.int32), coordinates, vertex_normals(points, faces))


def check_mesh(vertices: NDArray[np.float64], triangles: NDArray[np.integer]) -> None:
    """Raise ValueError unless vertices (V, 3) are finite and triangles (F, 3), at least one, are
    integers that refer to them."""
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
        raise ValueError(f"vertices have the shape {vertices.shape}; expected (V, 3), finite")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
        raise ValueError(f"triangles have the shape {triangles.shape}; expected (F, 3) integers")
    if len(triangles) == 0:
        raise ValueError("there are no triangles; expected at least one")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise ValueError(
            f"triangles refer to vertices {triangles.min()} to {triangles.max()}; "
            f"expected 0 to {len(vertices) - 1}"
        )


def joined_vertices(
    vertices: NDArray[np.floating], normals: NDArray[np.floating]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Vertices (V, 3) without copies: the row of each position's first copy (P,), and which
    position each vertex (V,) has. Those of other normals are apart: sheets back to back are two."""
    both = np.concatenate([vertices, normals], axis=1) + 0.0  # + 0.0: no -0.0
    _, first, position = np.unique(both, axis=0, return_index=True, return_inverse=True)
    return first.astype(np.int64), position.reshape(-1).astype(np.int64)


def grid_triangles(rows: int, columns: int) -> NDArray[np.int64]:
    """Triangles (F, 3) of a grid's positions, numbered row by row; two to each of its cells."""
    numbers = np.arange(rows * columns).reshape(rows, columns)
    a, b = numbers[:-1, :-1], numbers[:-1, 1:]
    d, c = numbers[1:, :-1], numbers[1:, 1:]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def y_up_to_z_up(vertices: ArrayLike) -> NDArray[np.float64]:
    """Vertices (V, 3) of a mesh whose up is +y, turned about x so that it is +z."""
    x, y, z = np.asarray(vertices, dtype=np.float64).T
    return np.stack([x, -z, y], axis=-1)


def brought_near(vertices: ArrayLike) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Vertices (V, 3) for single precision: those of a mesh more than ``FAR`` of its radii from
    the origin (maps have it so) are moved such that the middle of their box is the origin. What was
    done is one sentence, or none.

    >>> near, notes = brought_near([[500000.0, 7.0, 0.0], [500002.0, 7.0, 1.0]])
    >>> near.tolist(), notes
    ([[-1.0, 0.0, -0.5], [1.0, 0.0, 0.5]], ('The mesh was moved by (-500001, -7, -0.5): it was \
far from the origin for its size.',))
    """
    points = np.asarray(vertices, np.float64)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = np.linalg.norm(points - middle, axis=1).max()
    if np.linalg.norm(middle) <= FAR * radius:
        return points, ()
    way = ", ".join(f"{-coordinate:.10g}" for coordinate in middle)
    note = f"The mesh was moved by ({way}): it was far from the origin for its size."
    return points - middle, (note,)


# --- Normals ------------------------------------------------------------------------------------


def vertex_normals(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Unit normals (V, 3) of vertices (V, 3) and triangles (F, 3): the mean of the triangles'
    normals, weighted by their angles at the vertex, over all vertices at the same position.

    Copies of a vertex (equal coordinates) share the triangles, so that they get one normal.
    Where those cancel out, as on a sheet with two sides, each copy keeps to its own triangles;
    a vertex without any gets (0, 0, 1). Independent of how the surface is cut into triangles
    (Thürmer and Wüthrich, "Computing vertex normals from polygonal facets", 1998).
    """
    _, position = np.unique(vertices + 0.0, axis=0, return_inverse=True)  # + 0.0: no -0.0
    position = position.reshape(-1)
    weighted = angle_weighted_normals(vertices, triangles)
    own = np.zeros_like(vertices)
    np.add.at(own, triangles, weighted)
    shared = np.zeros_like(vertices)
    np.add.at(shared, position, own)
    summed = np.where(_length(shared[position]) > 1e-9, shared[position], own)
    length = _length(summed)
    normals: NDArray[np.float64] = np.where(
        length > 1e-9, summed / np.maximum(length, 1e-9), np.array([0.0, 0.0, 1.0])
    )
    return normals


def angle_weighted_normals(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> NDArray[np.float64]:
    """(F, 3, 3): each triangle's unit normal times its angle at each corner; 0 without area."""
    corners = vertices[triangles]
    after = np.roll(corners, -1, axis=1) - corners
    before = np.roll(corners, 1, axis=1) - corners
    normal = np.cross(after, before)
    doubled_area = _length(normal)
    angle = np.arctan2(doubled_area, (after * before).sum(axis=-1, keepdims=True))
    weighted: NDArray[np.float64] = angle * normal / np.maximum(doubled_area, _TINY)
    return weighted


def _length(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    length: NDArray[np.float64] = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return length
