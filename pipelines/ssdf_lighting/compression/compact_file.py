"""The compact codes as one file, every number through the entropy coder.

docs/ssdf_file.md is its specification: parts, contexts, coder and what the numbers mean.
"""

from __future__ import annotations

import math
import struct

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.compact import Codes, CompactCodes, quantise_to_rmse
from pipelines.ssdf_lighting.compression.entropy_coding import decode, encode
from pipelines.ssdf_lighting.compression.shared_basis import shared_basis
from pipelines.ssdf_lighting.compression.triangle_clusters import clusters_by_distance
from pipelines.ssdf_lighting.distances.octahedral import resolution_of

MAGIC = b"TSUYASDF"
_VERSION = 1
_HEADER = struct.Struct("<8sHHdIIIII")
_MOST_LEVEL = 80
_LARGEST_LEVEL = 4000  # 2^(4000 / 4) is finite
_SHARED_ERROR = 0.5
"""Part of the error that the shared basis alone may make."""
_MOST_A_BYTE = 12_000
"""Numbers that a byte can hold: the surest answer costs -log2(65504 / 65536) bits."""


def compress(
    matrix: NDArray[np.float32],
    triangles: NDArray[np.integer],
    *,
    clusters: int = 256,
    rmse: float = 0.006,
    seed: int = 0,
) -> bytes:
    """The file of an SSDF matrix (V, D), whole in memory; triangles (F, 3).

    clusters: of triangles that are alike in their SSDFs. rmse: error in memory, radians weighted by
    solid angle. Raises ValueError for more clusters than triangles.
    """
    basis = shared_basis(lambda: [matrix], matrix.shape, _SHARED_ERROR * rmse)
    found = clusters_by_distance(basis.coordinates, triangles, clusters, seed)
    # Without gaps: a cluster of triangles may have no vertex.
    _, dense = np.unique(found.vertex, return_inverse=True)
    return to_bytes(quantise_to_rmse(basis, dense.astype(np.int32), rmse))


def to_bytes(compact: CompactCodes) -> bytes:
    """The file's bytes."""
    rank, count = len(compact.shared), len(compact.ranks)
    header = _HEADER.pack(
        MAGIC,
        _VERSION,
        compact.resolution,
        compact.step,
        rank,
        count,
        len(compact.level),
        len(compact.cluster),
        len(compact.weights),
    )
    small = _parts(
        [
            compact.ranks,
            np.diff(compact.shared_level, prepend=0),
            _differences(compact.level, compact.ranks),
            moved_to_front(compact.cluster, count),
        ]
    )
    first = encode(*small)
    large = encode(
        np.concatenate(
            [compact.shared.ravel(), compact.centre.ravel(), compact.basis.ravel(), compact.weights]
        ),
        _contexts(
            compact.resolution, compact.shared_level, compact.level, compact.ranks, compact.sizes
        ),
    )
    return header + struct.pack("<I", len(first)) + first + large


def from_bytes(data: bytes) -> CompactCodes:
    """The codes of a file.

    Raises ValueError for what is no such file, ends too early or does not fit together.
    """
    if len(data) < _HEADER.size + 4 or data[:8] != MAGIC:
        raise ValueError("the file does not begin as compact SSDFs do; expected TSUYASDF.")
    _, version, n, step, rank, count, total, vertices, weights = _HEADER.unpack_from(data)
    if version != _VERSION:
        raise ValueError(f"the file's version is {version}; expected {_VERSION}.")
    resolution_of(n * n)
    numbers = (n * n + count + total) * rank + weights + vertices + count + total
    if not 0.0 < step < math.inf or not count or numbers > _MOST_A_BYTE * len(data):
        raise ValueError("the file is damaged: its header announces what it cannot hold.")
    (length,) = struct.unpack_from("<I", data, _HEADER.size)
    start = _HEADER.size + 4
    lengths = [count, rank, total, vertices]
    contexts = np.repeat(np.arange(4), lengths)
    small = decode(data[start : start + length], contexts)
    ranks, shared_level, level, moved = np.split(small, np.cumsum(lengths)[:-1])
    if (ranks < 0).any() or ranks.sum() != total or ((moved < 0) | (moved >= count)).any():
        raise ValueError("the file is damaged: its clusters do not add up.")
    shared_level = np.cumsum(shared_level).astype(np.int32)
    level = _summed(level, ranks)
    both = np.concatenate([shared_level, level])
    if ((both < 0) | (both > _LARGEST_LEVEL)).any():
        raise ValueError("the file is damaged: its levels are out of range.")
    cluster = moved_back(moved, count)
    sizes = np.bincount(cluster, minlength=count)
    if (ranks * sizes).sum() != weights:
        raise ValueError("the file is damaged: its clusters do not add up.")
    large = decode(data[start + length :], _contexts(n, shared_level, level, ranks, sizes))
    cuts = np.cumsum([rank * n * n, count * rank, total * rank])
    shared, centre, basis, rest = np.split(large, cuts)
    return CompactCodes(
        step,
        shared.reshape(rank, n * n),
        shared_level,
        centre.reshape(count, rank),
        basis.reshape(total, rank),
        level,
        ranks,
        cluster,
        rest,
    )


def _parts(parts: list[Codes]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    values = np.concatenate([np.asarray(part, np.int64) for part in parts])
    return values, np.repeat(np.arange(len(parts)), [len(part) for part in parts])


def _differences(level: Codes, ranks: Codes) -> Codes:
    """Each level less the one before it in its cluster; the first as it is."""
    steps = np.diff(level, prepend=0)
    starts = (np.cumsum(ranks) - ranks)[ranks > 0]
    steps[starts] = level[starts]
    return steps


def _summed(steps: Codes, ranks: Codes) -> Codes:
    sums = np.concatenate([[0], np.cumsum(steps)])
    starts = np.cumsum(ranks) - ranks
    return (sums[1:] - np.repeat(sums[starts], ranks)).astype(np.int32)


@njit(cache=True, nogil=True)
def moved_to_front(cluster: Codes, count: int) -> Codes:
    """Places in a list in which the last one used is the first."""
    recent = np.arange(count)
    moved = np.empty(len(cluster), np.int32)
    for k in range(len(cluster)):
        place = 0
        while recent[place] != cluster[k]:
            place += 1
        moved[k] = place
        recent[1 : place + 1] = recent[:place].copy()
        recent[0] = cluster[k]
    return moved


@njit(cache=True, nogil=True)
def moved_back(moved: Codes, count: int) -> Codes:
    """The inverse of `moved_to_front`."""
    recent = np.arange(count)
    cluster = np.empty(len(moved), np.int32)
    for k in range(len(moved)):
        place = moved[k]
        cluster[k] = recent[place]
        recent[1 : place + 1] = recent[:place].copy()
        recent[0] = cluster[k]
    return cluster


def _contexts(
    n: int, shared_level: Codes, level: Codes, ranks: Codes, sizes: NDArray[np.int64]
) -> NDArray[np.int32]:
    """Context (entries,) of the shared basis, the centres, the clusters' vectors, the weights."""
    row, column = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    ring = _octaves(1.0 + np.hypot(row, column).ravel(), 3.0, 24)
    shared = _clipped(shared_level)[:, None] * 24 + ring
    place = _octaves(1.0 + np.arange(len(shared_level)) / 4.0, 2.0, 16)
    counts = _octaves(np.maximum(sizes, 1), 1.0, 24)
    centre = (counts[:, None] * 16 + place).ravel()
    basis = _clipped(level)[:, None] * 16 + place
    # An entry u of a column of length 1 over n vertices is about 1 / sqrt(n).
    spread = _clipped(level) - np.rint(2.0 * np.log2(np.repeat(np.maximum(sizes, 1), ranks)))
    own = (spread + 80).astype(np.int64)
    firsts = np.cumsum(ranks) - ranks
    weights = [
        np.tile(own[first : first + rank], size)
        for first, rank, size in zip(firsts, ranks, sizes, strict=True)
    ]
    groups = [shared.ravel(), centre, basis.ravel(), np.concatenate(weights)]
    offset, joined = 0, []
    for group in groups:
        _, dense = np.unique(group, return_inverse=True)
        joined.append(dense.reshape(-1).astype(np.int32) + offset)
        offset += int(dense.max(initial=-1)) + 1
    return np.concatenate(joined)


def _clipped(level: Codes) -> NDArray[np.int64]:
    return np.clip(level, 0, _MOST_LEVEL).astype(np.int64)


def _octaves(values: NDArray[np.generic], per_octave: float, most: int) -> NDArray[np.int64]:
    return np.minimum((np.log2(values) * per_octave).astype(np.int64), most - 1)
