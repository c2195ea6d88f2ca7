"""SSDFs laid out for decoding, whichever form they are kept in.

A vertex of cluster c has d(ω) = centre_c(ω) + sum over k of w_k vector_ck(ω), whichever form it was
compressed to. The vectors are laid out direction by direction, so that the m numbers a direction
takes lie together (lookup.py reads them).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.clustered_pca import ClusteredPca
from pipelines.ssdf_lighting.compression.compact_memory import (
    PackedCodes,
    cluster_bases,
    row_bytes,
    unpack_rows,
)
from pipelines.ssdf_lighting.compression.resident import ResidentTables

Floats = NDArray[np.float32]


class DecoderTables(NamedTuple):
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


def make_tables(
    centres: Floats,
    vectors: Floats,
    first: NDArray[np.integer],
    cluster: NDArray[np.integer],
    weights: Floats,
    weight_start: NDArray[np.integer],
) -> DecoderTables:
    """Lay out centres (K, D) and vectors (M, D), those of a cluster from ``first`` (K + 1,) on."""
    parts = []
    for number in range(len(centres)):
        own = vectors[first[number] : first[number + 1]]
        parts.append(np.concatenate([centres[number : number + 1], own]).T.ravel())
    ends = np.cumsum([len(part) for part in parts])
    return DecoderTables(
        np.concatenate(parts),
        np.concatenate([[0], ends[:-1]]).astype(np.int64),
        np.diff(first).astype(np.int64),
        cluster.astype(np.int64),
        np.ascontiguousarray(weights, dtype=np.float32),
        weight_start.astype(np.int64),
        round(centres.shape[1] ** 0.5),
    )


def tables_of_packed(memory: PackedCodes) -> DecoderTables:
    """Tables of the compact form in memory."""
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
    return make_tables(bases.centres, bases.vectors, bases.first, cluster, weights, start[:-1])


def tables_of_pca(pca: ClusteredPca, vertices: int) -> DecoderTables:
    """Tables of the paper's form; a vertex in several clusters is decoded from the first."""
    rank = np.diff(pca.first)
    sizes = np.diff(pca.row_first)
    row_cluster = np.repeat(np.arange(len(sizes)), sizes)
    row_start = np.concatenate([[0], np.cumsum(rank[row_cluster])])[:-1]
    cluster, start = np.zeros(vertices, np.int64), np.zeros(vertices, np.int64)
    cluster[pca.row_vertex[::-1]] = row_cluster[::-1]
    start[pca.row_vertex[::-1]] = row_start[::-1]
    centres = np.zeros((len(sizes), pca.vectors.shape[1]), np.float32)
    return make_tables(centres, pca.vectors, pca.first, cluster, pca.weights, start)


def tables_of_resident(resident: ResidentTables) -> DecoderTables:
    """What is resident, unfolded, at its own resolution."""
    places, counts = resident.resolution**2, resident.counts.astype(np.int64)
    columns = counts.sum(axis=1)
    first = resident.scale_start.astype(np.int64)
    parts = []
    for number, (words, whole, halves) in enumerate(counts):
        begin = resident.starts[number].astype(np.int64)
        wide, pairs = places * np.array([words, whole, (halves + 1) // 2]), (halves + 1) // 2
        ends = begin + wide
        packed = resident.nibbles[begin[2] : ends[2]].reshape(places, pairs)
        nibbles = np.stack([packed & 15, packed >> 4], axis=2).reshape(places, 2 * pairs)
        codes = np.concatenate(
            [
                resident.words[begin[0] : ends[0]].reshape(places, words),
                resident.bytes[begin[1] : ends[1]].reshape(places, whole),
                nibbles[:, :halves].astype(np.float32) - 8.0,
            ],
            axis=1,
            dtype=np.float32,
        )
        scale = resident.scale[first[number] : first[number] + columns[number]]
        parts.append((codes * scale).ravel())
    lengths = np.array([len(part) for part in parts])
    return DecoderTables(
        np.concatenate(parts),
        np.cumsum(lengths) - lengths,
        columns - 1,
        resident.cluster.astype(np.int64),
        resident.weights.astype(np.float32),
        resident.weight_start.astype(np.int64),
        resident.resolution,
    )


def decoded_rows(tables: DecoderTables, vertices: NDArray[np.integer]) -> Floats:
    """d (vertices, D) float32, radians, of some vertices in all directions."""
    distances = np.empty((len(vertices), tables.resolution**2), np.float32)
    clusters = tables.cluster[vertices]
    for cluster in np.unique(clusters):
        wanted = np.flatnonzero(clusters == cluster)
        rank = tables.rank[cluster]
        begin = tables.table_start[cluster]
        table = tables.table[begin : begin + distances.shape[1] * (rank + 1)]
        places = tables.weight_start[vertices[wanted]][:, None] + np.arange(rank)
        weights = np.pad(tables.weights[places], ((0, 0), (1, 0)), constant_values=1.0)
        distances[wanted] = weights @ table.reshape(-1, rank + 1).T
    return distances
