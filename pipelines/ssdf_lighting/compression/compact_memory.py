"""The compact codes in memory: any vertex is decoded from one read of its own few bytes.

Whole numbers of 4, 8, 16 or 32 bits, as many as a column's largest needs; no entropy coder. A row
of bytes holds a row's 32-bit numbers, then its 16-bit ones, its 8-bit ones, then its 4-bit ones,
two a byte, the first in the lower half; columns keep their order within a width. The weights of a
vertex are a row of its cluster, clusters' vectors are rows over the shared basis, and the shared
basis has a row a direction, no longer cosine transformed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.compact import (
    MEMORY_STEP,
    Codes,
    CompactCodes,
    shared_vectors,
    sigma_of,
)
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights

Bytes = NDArray[np.uint8]

_WHOLE = {32: "<i4", 16: "<i2", 8: "i1"}
"""Bits of numbers of whole bytes, in the order of a row."""


class PackedCodes(NamedTuple):
    """A scene's SSDFs as they stay in memory.

    shared: (D, bytes) rows of codes over the R vectors; shared_bits: (R,); shared_scale: (R,).
    centre: (K, bytes); centre_bits: (R,); centre_scale: (K,).
    basis: (M, bytes); basis_bits: (R,); basis_scale: (M,).
    first: (K + 1,) row of ``basis`` with a cluster's first vector.
    weights: (bytes,) rows of all vertices; weight_bits: (M,); weight_start: (K,) a cluster's first
        byte; step: of all weights.
    cluster, place: (V,) the cluster of a vertex, and its row there.
    """

    shared: Bytes
    shared_bits: Bytes
    shared_scale: NDArray[np.float32]
    centre: Bytes
    centre_bits: Bytes
    centre_scale: NDArray[np.float32]
    basis: Bytes
    basis_bits: Bytes
    basis_scale: NDArray[np.float32]
    first: NDArray[np.uint32]
    weights: Bytes
    weight_bits: Bytes
    weight_start: NDArray[np.uint32]
    step: NDArray[np.float32]
    cluster: NDArray[np.unsignedinteger]
    place: NDArray[np.unsignedinteger]

    @property
    def nbytes(self) -> int:
        """Bytes of everything here."""
        return sum(part.nbytes for part in self)


def pack(compact: CompactCodes) -> PackedCodes:
    """Pack codes for memory."""
    shared_scale = MEMORY_STEP * compact.step / sigma_of(compact.shared_level, compact.step)
    shared = np.rint(shared_vectors(compact) / shared_scale[:, None]).astype(np.int32).T
    sizes, order = compact.sizes, compact.vertices_in_order
    place = np.empty(len(order), np.int64)
    place[order] = np.concatenate([np.arange(size) for size in sizes])
    rows, bits, starts, start, read = [], [], [], 0, 0
    for size, rank in zip(sizes, compact.ranks, strict=True):
        codes = compact.weights[read : read + size * rank].reshape(size, rank)
        bits.append(column_bits(codes))
        rows.append(pack_rows(codes, bits[-1]).ravel())
        starts.append(start)
        start, read = start + len(rows[-1]), read + size * rank
    shared_bits, centre_bits = column_bits(shared), column_bits(compact.centre)
    basis_bits = column_bits(compact.basis)
    return PackedCodes(
        pack_rows(shared, shared_bits),
        shared_bits,
        shared_scale.astype(np.float32),
        pack_rows(compact.centre, centre_bits),
        centre_bits,
        (compact.step / np.sqrt(np.maximum(sizes, 1))).astype(np.float32),
        pack_rows(compact.basis, basis_bits),
        basis_bits,
        (compact.step / sigma_of(compact.level, compact.step)).astype(np.float32),
        np.concatenate([[0], np.cumsum(compact.ranks)]).astype(np.uint32),
        np.concatenate(rows),
        np.concatenate(bits),
        np.array(starts, np.uint32),
        np.array(compact.step, np.float32),
        compact.cluster.astype(np.min_scalar_type(len(sizes) - 1)),
        place.astype(np.min_scalar_type(int(place.max()))),
    )


def column_bits(codes: Codes) -> Bytes:
    """Bits (columns,) uint8, 4, 8, 16 or 32, that the columns of codes (rows, columns) need."""
    low, high = codes.min(axis=0, initial=0), codes.max(axis=0, initial=0)
    needed = np.maximum(high, -1 - low)
    return np.select([needed < 1 << 3, needed < 1 << 7, needed < 1 << 15], [4, 8, 16], 32).astype(
        np.uint8
    )


def row_bytes(bits: Bytes) -> int:
    """Bytes of a row whose columns have these bits."""
    return (int(bits.sum(dtype=np.int64)) + 7) // 8


def pack_rows(codes: Codes, bits: Bytes) -> Bytes:
    """Rows of bytes (rows, bytes) of codes (rows, columns)."""
    if not len(codes):
        return np.empty((0, row_bytes(bits)), np.uint8)
    whole = [
        np.ascontiguousarray(codes[:, bits == width].astype(kind)).view(np.uint8)
        for width, kind in _WHOLE.items()
    ]
    narrow = (codes[:, bits == 4] & 15).astype(np.uint8)
    narrow = np.pad(narrow, ((0, 0), (0, narrow.shape[1] % 2)))
    pairs = narrow[:, 0::2] | (narrow[:, 1::2] << 4)
    return np.concatenate([*(part.reshape(len(codes), -1) for part in whole), pairs], axis=1)


def unpack_rows(rows: Bytes, bits: Bytes) -> Codes:
    """Codes (rows, columns) int32 of rows of bytes."""
    codes = np.empty((len(rows), len(bits)), np.int32)
    if not codes.size:
        return codes
    start = 0
    for width, kind in _WHOLE.items():
        end = start + int((bits == width).sum()) * width // 8
        codes[:, bits == width] = np.ascontiguousarray(rows[:, start:end]).view(kind)
        start = end
    pairs = rows[:, start:]
    narrow = np.stack([pairs & 15, pairs >> 4], axis=-1).reshape(len(rows), -1).astype(np.int32)
    codes[:, bits == 4] = (narrow[:, : int((bits == 4).sum())] ^ 8) - 8
    return codes


class ClusterBases(NamedTuple):
    """Clusters' vectors over all directions, in radians, for decoding many vertices.

    centres: (K, D) and vectors: (M, D) float32, no longer weighted; first: (K + 1,) row of
    ``vectors`` with a cluster's first.
    """

    centres: NDArray[np.float32]
    vectors: NDArray[np.float32]
    first: NDArray[np.int64]


def cluster_bases(memory: PackedCodes) -> ClusterBases:
    """Expand the clusters' vectors."""
    shared = unpack_rows(memory.shared, memory.shared_bits) * memory.shared_scale
    shared = (shared / root_weights(len(shared))[:, None]).astype(np.float32)
    centre = unpack_rows(memory.centre, memory.centre_bits) * memory.centre_scale[:, None]
    basis = unpack_rows(memory.basis, memory.basis_bits) * memory.basis_scale[:, None]
    return ClusterBases(
        centre.astype(np.float32) @ shared.T,
        basis.astype(np.float32) @ shared.T,
        memory.first.astype(np.int64),
    )


def vertex_distances(memory: PackedCodes, bases: ClusterBases, vertex: int) -> NDArray[np.float32]:
    """d (D,) float32, radians, of one vertex: one read of its bytes."""
    cluster = int(memory.cluster[vertex])
    own = slice(bases.first[cluster], bases.first[cluster + 1])
    bits = memory.weight_bits[own]
    length = row_bytes(bits)
    start = int(memory.weight_start[cluster]) + int(memory.place[vertex]) * length
    codes = unpack_rows(memory.weights[None, start : start + length], bits)[0]
    weights = (codes * memory.step).astype(np.float32)
    distances: NDArray[np.float32] = bases.centres[cluster] + weights @ bases.vectors[own]
    return distances
