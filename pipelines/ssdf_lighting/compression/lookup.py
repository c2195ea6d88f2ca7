"""Distances along a few directions of every vertex: interpolated on the octahedral square, fast.

Compiled by Numba, which is imported here and where files are decoded (entropy_coding.py), and
nowhere else on the way from a stored basis to a decoder.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.decoder_tables import DecoderTables
from pipelines.ssdf_lighting.compression.resident import ResidentTables

Floats = NDArray[np.float32]


def decoded_along(tables: DecoderTables, vertices: NDArray[np.integer], axes: Floats) -> Floats:
    """d (P, L) float32, radians, of vertices (P,) along unit vectors (P, L, 3) float32."""
    found = np.empty(axes.shape[:2], np.float32)
    _decode(tables, vertices.astype(np.int64), np.ascontiguousarray(axes, dtype=np.float32), found)
    return found


def resident_along(tables: ResidentTables, vertices: NDArray[np.integer], axes: Floats) -> Floats:
    """The same from what is resident: columns are read as they are, none is unfolded."""
    found = np.empty(axes.shape[:2], np.float32)
    ways = np.ascontiguousarray(axes, dtype=np.float32)
    _read_codes(tables, vertices.astype(np.int64), ways, found)
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
    """`octahedral.bilinear_taps` of one direction."""
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
def _decode(
    tables: DecoderTables, vertices: NDArray[np.int64], axes: Floats, found: Floats
) -> None:
    table, n = tables.table, tables.resolution
    for row in prange(len(axes)):
        texels, shares = np.empty(4, np.int64), np.empty(4, np.float32)
        vertex = vertices[row]
        own = tables.cluster[vertex]
        width = tables.rank[own] + 1
        first = tables.weight_start[vertex]
        weight = tables.weights[first : first + width - 1]
        for lobe in range(axes.shape[1]):
            _taps(n, axes[row, lobe], texels, shares)
            distance = np.float32(0.0)
            for tap in range(4):
                place = tables.table_start[own] + texels[tap] * width
                there = table[place]
                for k in range(width - 1):
                    there += weight[k] * table[place + 1 + k]
                distance += shares[tap] * there
            found[row, lobe] = distance


@njit(cache=True, nogil=True, parallel=True, fastmath={"reassoc", "contract", "nsz"})
def _read_codes(
    tables: ResidentTables, vertices: NDArray[np.int64], axes: Floats, found: Floats
) -> None:
    n = tables.resolution
    for row in prange(len(axes)):
        texels, shares = np.empty(4, np.int64), np.empty(4, np.float32)
        vertex = vertices[row]
        own = tables.cluster[vertex]
        wide, middle, narrow = tables.counts[own]
        words, whole, halves = tables.starts[own]
        pairs = (narrow + 1) // 2
        # Each code's factor: the centre's weight is 1, and so is that of what pads a pair, 0.
        factor = np.zeros(wide + middle + 2 * pairs, np.float32)
        factor[0] = tables.scale[tables.scale_start[own]]
        for k in range(1, wide + middle + narrow):
            code = tables.weights[tables.weight_start[vertex] + k - 1]
            factor[k] = tables.scale[tables.scale_start[own] + k] * code
        for lobe in range(axes.shape[1]):
            _taps(n, axes[row, lobe], texels, shares)
            distance = np.float32(0.0)
            for tap in range(4):
                there = np.float32(0.0)
                place = np.int64(words) + texels[tap] * wide
                for k in range(wide):
                    there += factor[k] * tables.words[place + k]
                place = np.int64(whole) + texels[tap] * middle
                for k in range(middle):
                    there += factor[wide + k] * tables.bytes[place + k]
                place = np.int64(halves) + texels[tap] * pairs
                for k in range(pairs):
                    pair = np.int32(tables.nibbles[place + k])
                    at = wide + middle + 2 * k
                    there += factor[at] * np.float32((pair & 15) - 8)
                    there += factor[at + 1] * np.float32((pair >> 4) - 8)
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
