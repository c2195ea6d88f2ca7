"""Distances along a few directions of every vertex, as shading needs them.

A vertex of cluster c has d(ω) = centre_c(ω) + sum over k of w_k vector_ck(ω), whichever form it was
compressed to. The vectors are laid out direction by direction, so that the m numbers a direction
takes lie together; between directions d is interpolated over the octahedral square.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.compact_memory import (
    Packed,
    cluster_bases,
    row_bytes,
    unpack_rows,
)

Floats = NDArray[np.float32]


class Decoder(NamedTuple):
    """Clusters' vectors, ready to be looked up.

    table: float32, for each cluster (D, 1 + m): its centre, then its vectors; radians.
    table_start: (K,) int64, where a cluster's begin. rank: (K,) int64, m.
    cluster: (V,) int64 of each vertex. weights: float32, all vertices' after one another;
        weight_start: (V,) int64. resolution: n of n x n directions.
    """

    table: Floats
    table_start: NDArray[np.int64]
    rank: NDArray[np.int64]
    cluster: NDArray[np.int64]
    weights: Floats
    weight_start: NDArray[np.int64]
    resolution: int


def make_decoder(
    centres: Floats,
    vectors: Floats,
    first: NDArray[np.integer],
    cluster: NDArray[np.integer],
    weights: Floats,
    weight_start: NDArray[np.integer],
) -> Decoder:
    """Lay out centres (K, D) and vectors (M, D), those of a cluster from ``first`` (K + 1,) on."""
    parts = []
    for number in range(len(centres)):
        own = vectors[first[number] : first[number + 1]]
        parts.append(np.concatenate([centres[number : number + 1], own]).T.ravel())
    ends = np.cumsum([len(part) for part in parts])
    return Decoder(
        np.concatenate(parts),
        np.concatenate([[0], ends[:-1]]).astype(np.int64),
        np.diff(first).astype(np.int64),
        cluster.astype(np.int64),
        np.ascontiguousarray(weights, dtype=np.float32),
        weight_start.astype(np.int64),
        round(centres.shape[1] ** 0.5),
    )


def decoder_of(memory: Packed) -> Decoder:
    """A decoder of the compact form in memory."""
    bases = cluster_bases(memory)
    cluster = memory.cluster.astype(np.int64)
    rank = np.diff(bases.first)
    start = np.concatenate([[0], np.cumsum(rank[cluster])])
    weights = np.empty(start[-1], np.float32)
    for number in range(len(rank)):
        members = np.flatnonzero(cluster == number)
        if not len(members) or not rank[number]:
            continue
        bits = memory.weight_bits[bases.first[number] : bases.first[number + 1]]
        begin, length = int(memory.weight_start[number]), row_bytes(bits)
        rows = memory.weights[begin : begin + len(members) * length].reshape(-1, length)
        values = unpack_rows(rows[memory.place[members]], bits) * memory.step
        weights[start[members][:, None] + np.arange(rank[number])] = values
    return make_decoder(bases.centres, bases.vectors, bases.first, cluster, weights, start[:-1])


def decoded_rows(decoder: Decoder, vertices: NDArray[np.integer]) -> Floats:
    """d (vertices, D) float32, radians, of some vertices in all directions."""
    distances = np.empty((len(vertices), decoder.resolution**2), np.float32)
    clusters = decoder.cluster[vertices]
    for cluster in np.unique(clusters):
        wanted = np.flatnonzero(clusters == cluster)
        rank = decoder.rank[cluster]
        begin = decoder.table_start[cluster]
        table = decoder.table[begin : begin + distances.shape[1] * (rank + 1)]
        places = decoder.weight_start[vertices[wanted]][:, None] + np.arange(rank)
        weights = np.pad(decoder.weights[places], ((0, 0), (1, 0)), constant_values=1.0)
        distances[wanted] = weights @ table.reshape(-1, rank + 1).T
    return distances


def distances_along(decoder: Decoder, vertices: NDArray[np.integer], axes: Floats) -> Floats:
    """d (P, L) float32, radians, of vertices (P,) along unit vectors (P, L, 3) float32."""
    found = np.empty(axes.shape[:2], np.float32)
    _decode(decoder, vertices.astype(np.int64), np.ascontiguousarray(axes, dtype=np.float32), found)
    return found


def matrix_along(matrix: Floats, vertices: NDArray[np.integer], axes: Floats) -> Floats:
    """The same from a matrix (V, n²) float32 that was not compressed."""
    found = np.empty(axes.shape[:2], np.float32)
    ways = np.ascontiguousarray(axes, dtype=np.float32)
    _look_up(matrix, vertices.astype(np.int64), round(matrix.shape[1] ** 0.5), ways, found)
    return found


@njit(cache=True, nogil=True, inline="always")
def _taps(
    n: int,
    axis: Floats,
    texels: NDArray[np.int64],
    shares: Floats,
) -> None:
    """`octahedral.taps` of one direction."""
    x, y, z = axis[0], axis[1], axis[2]
    # An axis of zeros, which asks for nothing, gets some texel.
    scale = np.float32(1.0) / max(abs(x) + abs(y) + abs(z), np.float32(1e-30))
    u, v = x * scale, y * scale
    if z < 0.0:
        u, v = (
            math.copysign(np.float32(1.0) - abs(v), u),
            math.copysign(np.float32(1.0) - abs(u), v),
        )
    column = (u + np.float32(1.0)) * np.float32(0.5 * n) - np.float32(0.5)
    row = (v + np.float32(1.0)) * np.float32(0.5 * n) - np.float32(0.5)
    left, top = math.floor(column), math.floor(row)
    right, down = column - np.float32(left), row - np.float32(top)
    for k in range(4):
        r, c = top + (k >> 1), left + (k & 1)
        if r < 0 or r >= n:
            r, c = min(max(r, 0), n - 1), n - 1 - c
        if c < 0 or c >= n:
            c, r = min(max(c, 0), n - 1), n - 1 - r
        texels[k] = r * n + c
        share_down = down if k >> 1 else np.float32(1.0) - down
        share_right = right if k & 1 else np.float32(1.0) - right
        shares[k] = share_down * share_right


@njit(cache=True, nogil=True, parallel=True, fastmath={"reassoc", "contract", "nsz"})
def _decode(decoder: Decoder, vertices: NDArray[np.int64], axes: Floats, found: Floats) -> None:
    table, n = decoder.table, decoder.resolution
    for row in prange(len(axes)):
        texels, shares = np.empty(4, np.int64), np.empty(4, np.float32)
        vertex = vertices[row]
        own = decoder.cluster[vertex]
        width = decoder.rank[own] + 1
        first = decoder.weight_start[vertex]
        weight = decoder.weights[first : first + width - 1]
        for lobe in range(axes.shape[1]):
            _taps(n, axes[row, lobe], texels, shares)
            distance = np.float32(0.0)
            for tap in range(4):
                place = decoder.table_start[own] + texels[tap] * width
                there = table[place]
                for k in range(width - 1):
                    there += weight[k] * table[place + 1 + k]
                distance += shares[tap] * there
            found[row, lobe] = distance


@njit(cache=True, nogil=True, parallel=True)
def _look_up(
    matrix: Floats, vertices: NDArray[np.int64], n: int, axes: Floats, found: Floats
) -> None:
    for vertex in prange(len(axes)):
        texels, shares = np.empty(4, np.int64), np.empty(4, np.float32)
        for lobe in range(axes.shape[1]):
            _taps(n, axes[vertex, lobe], texels, shares)
            distance = np.float32(0.0)
            for tap in range(4):
                distance += shares[tap] * matrix[vertices[vertex], texels[tap]]
            found[vertex, lobe] = distance
