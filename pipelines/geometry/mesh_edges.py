"""Edges of triangle meshes: which triangles share them, and how those agree on the outside."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class MeshEdges(NamedTuple):
    """The edges of triangles (F, 3). Half-edge 3 f + k goes from triangle f's corner k to the next.

    half_edges: (3 F,) int64, edge by edge, ascending within an edge.
    start: (E,) int64, where each edge's half-edges begin.
    uses: (E,) int64, how many triangles each edge is in.
    forwards: (3 F,) bool, by half-edge: whether it goes from the lower to the higher vertex.
    """

    half_edges: NDArray[np.int64]
    start: NDArray[np.int64]
    uses: NDArray[np.int64]
    forwards: NDArray[np.bool_]

    def pairs(self) -> NDArray[np.int64]:
        """Half-edges (N, 2) of those edges that are in two triangles."""
        return self.half_edges[self.start[self.uses == 2][:, None] + np.arange(2)]


def mesh_edges(triangles: NDArray[np.int64]) -> MeshEdges:
    """The edges of triangles (F, 3), whose corners are three different vertices each."""
    begin, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    key = np.minimum(begin, end) * (int(triangles.max()) + 1) + np.maximum(begin, end)
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    start = np.flatnonzero(np.concatenate([[True], ordered[1:] != ordered[:-1]]))
    uses = np.diff(np.append(start, len(key)))
    return MeshEdges(order, start, uses, begin < end)


def edge_vertices(triangles: NDArray[np.integer]) -> NDArray[np.int64]:
    """Both vertices (E, 2) of each edge of triangles (F, 3), the lower first; each edge once."""
    found = mesh_edges(triangles.astype(np.int64))
    half = found.half_edges[found.start]
    begin, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    return np.sort(np.stack([begin[half], end[half]], axis=-1), axis=1).astype(np.int64)


class Orientation(NamedTuple):
    """How triangles have to be turned over for all neighbours to agree.

    piece: (F,) int64, the piece that each triangle is part of.
    turned: (F,) bool; the first triangle of each piece is not.
    one_sided: (pieces,) bool, whether no way to turn its triangles makes them agree.
    """

    piece: NDArray[np.int64]
    turned: NDArray[np.bool_]
    one_sided: NDArray[np.bool_]


def consistent_orientation(pairs: NDArray[np.int64], forwards: NDArray[np.bool_]) -> Orientation:
    """The pieces of triangles, neighbours by the pairs (N, 2) of half-edges at one edge;
    ``forwards`` as in `MeshEdges`.

    Each triangle stands for two, as it is and turned over, linked to its neighbours' that agree
    with it: a surface with two sides falls into two parts, one for each way to orient it.
    """
    count = len(forwards) // 3
    first, second = (pairs // 3).T
    agree = forwards[pairs[:, 0]] != forwards[pairs[:, 1]]
    other = np.where(agree, 0, count)
    as_is = np.stack([first, second + other], axis=-1)
    turned = np.stack([first + count, second + count - other], axis=-1)
    part = connected_components(np.concatenate([as_is, turned]), 2 * count)
    own, opposite = part[:count], part[count:]
    _, piece = np.unique(np.minimum(own, opposite), return_inverse=True)
    piece = piece.reshape(-1)
    one_sided = np.zeros(piece.max() + 1, bool)
    one_sided[piece[own == opposite]] = True
    return Orientation(piece, own != own[first_rows(piece)][piece], one_sided)


def connected_components(links: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """(count,): which connected component each of ``count`` nodes is in, by links (N, 2)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components as components_of

    graph = coo_array((np.ones(len(links), np.int8), links.T), shape=(count, count))
    _, label = components_of(graph, directed=False)
    return np.asarray(label, np.int64)


def flip_triangles(triangles: NDArray[np.int64], which: NDArray[np.bool_]) -> None:
    """Swap the second and third corner of some triangles (F, 3), in place; ``which`` (F,)."""
    triangles[which] = triangles[which][:, [0, 2, 1]]


def first_rows(number: NDArray[np.int64]) -> NDArray[np.int64]:
    """The first row with each number, of numbers (N,) from 0 without gaps."""
    first = np.full(number.max(initial=-1) + 1, len(number))
    np.minimum.at(first, number, np.arange(len(number)))
    return first
