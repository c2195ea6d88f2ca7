"""Visibility as a file, version 2 of docs/ssdf_file.md; distances are rebuilt where it is loaded.

Bits are coded without loss (visibility_bits.py), in as many directions as the caller chose. Beside
them stands the cluster of each vertex, so that what is resident is made without a search.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.compact_file import MAGIC, moved_back, moved_to_front
from pipelines.ssdf_lighting.compression.entropy_coding import decode, encode
from pipelines.ssdf_lighting.compression.resident import ResidentTables, resident_of_rows
from pipelines.ssdf_lighting.compression.visibility_bits import decode_visibility, encode_visibility
from pipelines.ssdf_lighting.distances.octahedral import resolution_of
from pipelines.ssdf_lighting.distances.rebuilt import rebuilt_distances

Floats = NDArray[np.float32]
Improve = Callable[[NDArray[np.int64], Floats], Floats]
"""Better distances (P, n²) of vertices (P,), of those rebuilt: where the mesh is at hand, with what
bits miss."""

VERSION = 2
_HEADER = struct.Struct("<8sHHIIII")
_MOST_A_BYTE = 1 << 17
"""Bits that a byte can hold: a row of n at the surest flag."""
_RESIDENT = 32
"""Rows of directions of what is resident, at most."""


class CodedBits(NamedTuple):
    """``visible`` (V, n²) and the number of each vertex' ``cluster`` (V,) int32, without gaps."""

    visible: NDArray[np.bool_]
    cluster: NDArray[np.int32]

    @property
    def resolution(self) -> int:
        """n of the n x n directions."""
        return resolution_of(self.visible.shape[1])


def bits_to_bytes(coded: CodedBits, triangles: NDArray[np.integer]) -> bytes:
    """The file of bits of the vertices of triangles (F, 3)."""
    count = int(coded.cluster.max()) + 1
    moved = moved_to_front(coded.cluster, count)
    clusters = encode(moved, np.zeros(len(moved), np.int64))
    references, bits = encode_visibility(coded.visible, triangles)
    header = _HEADER.pack(
        MAGIC,
        VERSION,
        coded.resolution,
        len(coded.visible),
        count,
        len(clusters),
        len(references),
    )
    return header + clusters + references + bits


def bits_from_bytes(data: bytes) -> CodedBits:
    """What a file holds.

    Raises ValueError for what is no such file, ends too early or does not fit together.
    """
    if len(data) < _HEADER.size or data[:8] != MAGIC:
        raise ValueError("the file does not begin as SSDFs do; expected TSUYASDF.")
    _, version, n, vertices, count, first, second = _HEADER.unpack_from(data)
    if version != VERSION:
        raise ValueError(f"the file's version is {version}; expected {VERSION}.")
    resolution_of(n * n)
    if not 0 < count <= vertices or vertices * n * n > _MOST_A_BYTE * len(data):
        raise ValueError("the file is damaged: its header announces what it cannot hold.")
    cuts = np.cumsum([_HEADER.size, first, second])
    codes = [data[begin:end] for begin, end in zip(cuts, [*cuts[1:], len(data)], strict=True)]
    moved = decode(codes[0], np.zeros(vertices, np.int64))
    if ((moved < 0) | (moved >= count)).any():
        raise ValueError("the file is damaged: its clusters do not add up.")
    cluster = moved_back(moved, count)
    if (np.bincount(cluster, minlength=count) == 0).any():
        raise ValueError("the file is damaged: a cluster has no vertex.")
    return CodedBits(decode_visibility(codes[1], codes[2], vertices, n), cluster)


def rows_of_bits(coded: CodedBits, improve: Improve | None = None) -> Callable[..., Floats]:
    """Function of vertices (P,): their d (P, n²) float32, radians, rebuilt."""

    def rows(vertices: NDArray[np.int64]) -> Floats:
        found = rebuilt_distances(coded.visible[vertices])
        return found if improve is None else improve(vertices, found)

    return rows


def resident_of_bits(coded: CodedBits, improve: Improve | None = None) -> ResidentTables:
    """What is drawn from, made anew: distances rebuilt, cluster by cluster, and their PCA."""
    n = coded.resolution
    rows = rows_of_bits(coded, improve)
    return resident_of_rows(rows, coded.cluster, n, min(n, _RESIDENT))
