"""Lids over a surface's small holes, as scans have them where the scanner did not see."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.mesh_edges import (
    connected_components,
    consistent_orientation,
    flip_triangles,
    mesh_edges,
)

SMALL = 0.03
"""Share of a surface's area up to which its holes, together, are small."""


class Lids(NamedTuple):
    """``vertices`` (L, 3), the middle of each lid; ``triangles`` (N, 3), of the mesh's vertices
    and, numbered after these, of the lids' middles; ``share``, the largest of lids' area over that
    of the surface in which they are."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    share: float


def lids_over_holes(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> Lids | None:
    """Fans of triangles that close all holes of vertices (V, 3), triangles (F, 3), around the mean
    of each hole's vertices; None for holes that are large or touch each other or themselves, for
    edges in more than two triangles and for a surface with one side."""
    edges = mesh_edges(triangles)
    if (edges.uses > 2).any():
        return None
    piece, turned, one_sided = consistent_orientation(edges.pairs(), edges.forwards)
    if one_sided.any():
        return None
    faces = triangles.copy()
    flip_triangles(faces, turned)
    edges = mesh_edges(faces)
    border = edges.half_edges[edges.start[edges.uses == 1]]
    begin, end = faces.ravel()[border], np.roll(faces, -1, axis=1).ravel()[border]
    rim, number = np.unique(np.concatenate([begin, end]), return_inverse=True)
    begin_of, end_of = number.reshape(2, -1)
    if len(rim) != len(border) or (np.bincount(begin_of) != 1).any():
        return None  # a vertex in which several holes meet
    hole = connected_components(np.stack([begin_of, end_of], axis=1), len(rim))
    middle = np.stack(
        [np.bincount(hole, axis) / np.bincount(hole) for axis in vertices[rim].T], axis=1
    )
    lids = np.stack([end, begin, len(vertices) + hole[begin_of]], axis=1)
    points = np.concatenate([vertices, middle])
    of_lids = np.bincount(piece[border // 3], _areas(points, lids), len(one_sided))
    share = float((of_lids / np.bincount(piece, _areas(vertices, faces))).max())
    return Lids(middle, lids, share) if share <= SMALL else None


def _areas(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.float64]:
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    areas: NDArray[np.float64] = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return areas
