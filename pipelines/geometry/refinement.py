"""Meshes whose long edges are cut: what is known at vertices alone is then known everywhere."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_MOST_TRIANGLES = 2_000_000


class RefinedMesh(NamedTuple):
    """``vertices`` (V, 3) float64, the given ones first; ``triangles`` (F, 3) int32; ``owner``
    (F,) int64, the given triangle that each is in; ``weights`` (F, 3, 3) float64: corner k is
    the given triangle's corners times ``weights[:, k]``."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    owner: NDArray[np.int64]
    weights: NDArray[np.float64]


def refine_mesh(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer], longest: float
) -> RefinedMesh:
    """Halve edges, in all triangles that have them, until none is longer than ``longest``.

    vertices (V, 3), triangles (F, 3). The surface stays where it is. Stops before there are more
    than two million triangles.

    >>> corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    >>> mesh = refine_mesh(corners, np.array([[0, 1, 2]]), 0.8)
    >>> mesh.triangles.tolist(), mesh.owner.tolist()
    ([[3, 4, 0], [1, 5, 3], [2, 4, 5], [3, 5, 4]], [0, 0, 0, 0])
    """
    points, faces = vertices, triangles.astype(np.int64)
    owner = np.arange(len(faces))
    weights = np.tile(np.eye(3), (len(faces), 1, 1))
    while len(faces) < _MOST_TRIANGLES // 4:
        ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        long = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1) > longest
        if not long.any():
            break
        edges, number = np.unique(ends[long], axis=0, return_inverse=True)
        middle = np.full(len(ends), -1, np.int64)
        middle[long] = len(points) + number.reshape(-1)
        points = np.concatenate([points, points[edges].mean(axis=1)])
        faces, source, mixed = _cut(faces, middle.reshape(-1, 3))
        owner, weights = owner[source], mixed @ weights[source]
    return RefinedMesh(points, faces.astype(np.int32), owner, weights)


# Triangles of the corners 0 to 2 and the middles 3 (of 0 and 1), 4 (of 1 and 2) and 5 (of 2 and
# 0), by how many edges are cut, turned about so that these are the first ones.
_PATTERNS = {
    0: ((0, 1, 2),),
    1: ((0, 3, 2), (3, 1, 2)),
    2: ((3, 1, 4), (0, 3, 4), (0, 4, 2)),
    3: ((3, 5, 0), (1, 4, 3), (2, 5, 4), (3, 4, 5)),
}
_CORNERS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.5, 0], [0, 0.5, 0.5], [0.5, 0, 0.5]])


def _cut(
    faces: NDArray[np.int64], middle: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """``middle`` (F, 3): the vertex in the middle of each edge, or -1. Triangles (F', 3), the row
    that each is of, and its corners' weights (F', 3, 3) of that row's corners."""
    cut = middle >= 0
    count = cut.sum(axis=1)
    # The uncut edge last where there is one, the cut one first where it is alone.
    turn = np.where(
        count == 1, cut.argmax(axis=1), np.where(count == 2, (~cut).argmax(axis=1) + 1, 0)
    )
    order = (np.arange(3) + turn[:, None]) % 3
    turned = np.take_along_axis(faces, order, axis=1)
    places = np.concatenate([turned, np.take_along_axis(middle, order, axis=1)], axis=1)
    found, rows, mixed = [], [], []
    for number, pattern in _PATTERNS.items():
        these = np.flatnonzero(count == number)
        for corners in pattern:
            found.append(places[these][:, corners])
            rows.append(these)
            part = np.empty((len(these), 3, 3))
            np.put_along_axis(
                part,
                np.broadcast_to(order[these][:, None, :], part.shape),
                _CORNERS[list(corners)][None],
                axis=2,
            )
            mixed.append(part)
    source = np.concatenate(rows)
    by_source = np.argsort(source, kind="stable")
    return np.concatenate(found)[by_source], source[by_source], np.concatenate(mixed)[by_source]
