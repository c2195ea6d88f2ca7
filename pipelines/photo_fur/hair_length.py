"""How long hair is over a body: short where the body is thin, as on ears, legs and a muzzle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.mesh_edges import edge_vertices
from pipelines.geometry.meshes import joined_vertices
from pipelines.geometry.rays import build_scene, first_hits

SHORTEST = 0.35
"""Of the longest."""
_THICK = 0.6
"""Quantile of the body's thicknesses from which on hair is longest."""
_RAYS = 7
_SPREAD = 0.5
"""Tangent of the angle between the inward normal and the rays about it."""
_ROUNDS = 12
_START = 1e-4
"""Of the mesh's size: how far inside rays start."""


def hair_lengths(
    vertices: NDArray[np.floating],
    normals: NDArray[np.floating],
    triangles: NDArray[np.integer],
) -> NDArray[np.float64]:
    """Lengths (V,), 1 for the longest: with the square root of the body's thickness under each
    vertex, the median along a cone of rays inwards, evened out along the surface.

    vertices, normals (V, 3), outwards; triangles (F, 3). A sheet, which has no inside, has hair of
    one length.

    >>> from pipelines.geometry.shapes import sphere
    >>> ball = sphere(12)
    >>> bool(hair_lengths(ball.vertices, ball.normals, ball.triangles).min() > 0.95)
    True
    """
    thickness = body_thickness(vertices, normals, triangles)
    known = np.isfinite(thickness)
    if known.mean() < 0.5:
        return np.ones(len(vertices))
    thickness = np.where(known, thickness, np.median(thickness[known]))
    thick = np.quantile(thickness, _THICK)
    lengths = np.clip(np.sqrt(thickness / thick), SHORTEST, 1.0)
    return _evened(lengths, vertices, normals, triangles)


def body_thickness(
    vertices: NDArray[np.floating],
    normals: NDArray[np.floating],
    triangles: NDArray[np.integer],
) -> NDArray[np.float64]:
    """Distance (V,) to the surface across the body, inf where there is none (after Shapira et al.,
    "Consistent mesh partitioning … using the shape diameter function", 2008)."""
    scene = build_scene(vertices, triangles)
    start = vertices - _START * np.ptp(vertices, axis=0).max() * normals
    aside = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    aside /= np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-12)
    other = np.cross(normals, aside)
    found = []
    for number in range(_RAYS):
        angle = 2 * np.pi * number / (_RAYS - 1)
        spread = _SPREAD if number else 0.0
        way = spread * (np.cos(angle) * aside + np.sin(angle) * other) - normals
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        found.append(first_hits(scene, start, way).distance)
    return np.median(np.stack(found), axis=0).astype(np.float64)


def _evened(
    lengths: NDArray[np.float64],
    vertices: NDArray[np.floating],
    normals: NDArray[np.floating],
    triangles: NDArray[np.integer],
) -> NDArray[np.float64]:
    """Means over neighbours, several times."""
    from scipy.sparse import coo_array, eye_array

    first, position = joined_vertices(vertices, normals)
    edges = np.unique(np.sort(position[edge_vertices(triangles)], axis=1), axis=0)
    ends = np.concatenate([edges, edges[:, ::-1]])
    ones = np.ones(len(ends))
    beside = coo_array((ones, ends.T), shape=(len(first), len(first))).tocsr() + eye_array(
        len(first)
    )
    degree = np.asarray(beside.sum(axis=1)).ravel()
    evened = lengths[first]
    for _ in range(_ROUNDS):
        evened = (beside @ evened) / degree
    return evened[position]
