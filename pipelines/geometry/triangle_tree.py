"""A tree of boxes around triangles, as two pictures of floats that a shader can walk through.

A node is two texels of ``nodes``: the least corner of its box and the number of the node to go on
with where that is missed or done, the greatest corner and its triangles: 0 for an inner node, whose
first child is the next node, else 8 times the first one's number and their count. A triangle is six
texels of ``corners``: three places, three normals. Texels run along rows of ``TREE_WIDTH``.
`triangle_tree.glsl` reads them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

TREE_WIDTH = 512
_LEAF = 4


class TriangleTree(NamedTuple):
    """``nodes``, ``corners`` (rows, ``TREE_WIDTH``, 4) float32; ``order`` (F,) int64: the number
    that a triangle had before."""

    nodes: NDArray[np.float32]
    corners: NDArray[np.float32]
    order: NDArray[np.int64]


def triangle_tree(places: NDArray[np.floating], normals: NDArray[np.floating]) -> TriangleTree:
    """The tree of triangles (F, 3, 3) with a normal at each corner (F, 3, 3).

    Halved at the median of the middles along a box's longest side, until four are left. Raises
    ValueError for no triangles, and where the shapes differ.
    """
    if places.shape != normals.shape or places.ndim != 3 or not len(places):
        raise ValueError(
            f"triangles are {places.shape}, their normals {normals.shape}; expected (F, 3, 3), "
            "one or more of both."
        )
    corners = np.asarray(places, np.float32)
    low, high = corners.min(axis=1), corners.max(axis=1)
    middle = (low + high) / 2
    order = np.arange(len(corners))
    nodes: list[list[float]] = []

    def grow(first: int, after: int) -> None:
        mine = order[first:after]
        node = [*low[mine].min(axis=0), 0.0, *high[mine].max(axis=0), 0.0]
        nodes.append(node)
        if after - first <= _LEAF:
            node[7] = 8.0 * first + after - first
        else:
            axis = int(np.argmax(np.ptp(middle[mine], axis=0)))
            order[first:after] = mine[np.argsort(middle[mine, axis], kind="stable")]
            half = (first + after) // 2
            grow(first, half)
            grow(half, after)
        node[3] = len(nodes)

    grow(0, len(order))
    texels = np.array(nodes, np.float32)
    of_corners = np.zeros((len(corners), 6, 4), np.float32)
    of_corners[:, :3, :3] = corners[order]
    of_corners[:, 3:, :3] = normals[order]
    return TriangleTree(_rows(texels.reshape(-1, 4)), _rows(of_corners.reshape(-1, 4)), order)


def _rows(texels: NDArray[np.float32]) -> NDArray[np.float32]:
    rows = -(-len(texels) // TREE_WIDTH)
    filled = np.zeros((rows * TREE_WIDTH, 4), np.float32)
    filled[: len(texels)] = texels
    return filled.reshape(rows, TREE_WIDTH, 4)
