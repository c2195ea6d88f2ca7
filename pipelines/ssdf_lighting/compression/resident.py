"""What is resident while a scene is drawn: clusters' vectors at half the resolution, in few bits.

Distances change smoothly, so half as many rows and columns of directions do, where the values there
are those whose bilinear interpolation is nearest to the vectors (least squares over the sphere),
not samples of them. A column of a cluster (its centre, then its vectors) is rounded to 16, 8 or 4
bits, the fewest that keep its error of d below `_ROUNDING`; a vertex's weights are 16 bits.
`ResidentTables` holds nothing else, and nothing is unfolded to draw from it: `resident_along` reads
the codes.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.clustered_pca import ReadRows, gram_svd
from pipelines.ssdf_lighting.compression.compact import (
    CompactCodes,
    cluster_vectors,
    shared_vectors,
)
from pipelines.ssdf_lighting.distances.octahedral import (
    bilinear_taps,
    resolution_of,
    solid_angles,
    texel_directions,
)
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Floats = NDArray[np.float32]

_ROUNDING = 0.0012
"""Radians: RMS error of d that the rounding of one column may make."""
_NIBBLE, _BYTE, _WORD = 7, 127, 32767
"""Largest codes of 4, 8 and 16 bits."""
_WORTH = 0.035
"""Radians: the root of the squared error, in one direction of one vertex, that a byte is worth."""
_ROUNDS = 16
"""Of conjugate gradients."""
_LEAST_HALVED = 64
"""Rows of directions from which on half as many are kept."""


class ResidentTables(NamedTuple):
    """Clusters' columns and vertices' weights, of K clusters, M vectors and V vertices.

    words: int16, bytes: int8, nibbles: uint8, the codes of all clusters, place by place of the
        n x n: a cluster's row has its columns of 16 bits in ``words``, those of 8 in ``bytes``,
        those of 4, two a byte, the first in the lower half, plus 8, in ``nibbles``.
    starts: (K, 3) uint32, where a cluster's begin in them; counts: (K, 3) uint16, columns of each
        kind. The first column is the centre, always of 16 bits.
    scale: (K + M,) float32, radians a code times a weight's code, by cluster, in the order of the
        columns; scale_start: (K,) uint32.
    weights: int16, vertex by vertex, in the order of the columns but the centre;
        weight_start: (V,) uint32; cluster: (V,) uint16 or uint32.
    resolution: n, half of that of the directions from 64 on.
    """

    words: NDArray[np.int16]
    bytes: NDArray[np.int8]
    nibbles: NDArray[np.uint8]
    starts: NDArray[np.uint32]
    counts: NDArray[np.uint16]
    scale: Floats
    scale_start: NDArray[np.uint32]
    weights: NDArray[np.int16]
    weight_start: NDArray[np.uint32]
    cluster: NDArray[np.unsignedinteger]
    resolution: int


def resident_tables(compact: CompactCodes) -> ResidentTables:
    """Lay out the codes of a file for drawing."""
    n = compact.resolution
    shared = shared_vectors(compact) / root_weights(n * n)
    if n >= _LEAST_HALVED:
        shared = resampled(shared, n // 2)
    centres, vectors = cluster_vectors(compact)
    sizes = compact.sizes
    columns, first, read = [], 0, 0
    for size, rank, centre in zip(sizes, compact.ranks, centres, strict=True):
        codes = compact.weights[read : read + size * rank].reshape(size, rank)
        own = np.concatenate([centre[None], vectors[first : first + rank]]).astype(np.float32)
        columns.append(_columns(own @ shared, codes * compact.step))
        first, read = first + rank, read + size * rank
    return _laid_out(columns, compact.cluster, resolution_of(shared.shape[1]))


def resident_of_rows(
    read: ReadRows, cluster: NDArray[np.integer], n: int, resolution: int
) -> ResidentTables:
    """Clustered PCA of d in n x n directions, made for drawing at once.

    read: gives d (P, n²) float32, radians, of vertices (P,); called once a cluster, so the rows of
    all never lie in memory together. ``cluster`` (V,) numbers without gaps. A vector is kept where
    it takes off more squared error than its bytes are worth (`_WORTH`). ``resolution``, at most n,
    is that of the tables.
    """
    root = root_weights(n * n)
    columns = []
    for number in range(int(cluster.max()) + 1):
        rows = read(np.flatnonzero(cluster == number)).astype(np.float64)
        centre = rows.mean(axis=0)
        left, sigma, right = gram_svd(((rows - centre) * root).astype(np.float32))
        kept = int((sigma**2 > _WORTH**2 * (resolution**2 + 2 * len(rows))).sum())
        own = np.concatenate([centre[None], right[:kept] / root])
        columns.append((own, left[:, :kept] * sigma[:kept]))
    fitted = np.concatenate([own for own, _ in columns])
    if resolution < n:
        fitted = resampled(fitted, resolution)
    parts = np.split(fitted, np.cumsum([len(own) for own, _ in columns])[:-1])
    return _laid_out(
        [_columns(own, weights) for own, (_, weights) in zip(parts, columns, strict=True)],
        cluster,
        resolution,
    )


def _laid_out(
    columns: list[_Columns], cluster: NDArray[np.integer], resolution: int
) -> ResidentTables:
    """The tables of clusters' columns, whose weights are those of their vertices, ascending."""
    sizes, order = np.bincount(cluster, minlength=len(columns)), np.argsort(cluster, kind="stable")
    start, row, written = np.empty(len(order), np.uint32), 0, 0
    for size, made in zip(sizes, columns, strict=True):
        rank = made.weights.shape[1]
        start[order[row : row + size]] = written + rank * np.arange(size)
        row, written = row + size, written + size * rank
    parts = [[made.codes[kind].ravel() for made in columns] for kind in range(3)]
    lengths = [[len(each) for each in part] for part in parts]
    words, whole, nibbles = (np.concatenate(part) for part in parts)
    return ResidentTables(
        words.astype(np.int16, copy=False),
        whole.astype(np.int8, copy=False),
        nibbles.astype(np.uint8, copy=False),
        np.stack([np.cumsum(each) - each for each in lengths], axis=1).astype(np.uint32),
        np.array([made.counts for made in columns], np.uint16),
        np.concatenate([made.scale for made in columns]).astype(np.float32),
        np.cumsum([0, *(len(made.scale) for made in columns[:-1])]).astype(np.uint32),
        np.concatenate([made.weights.ravel() for made in columns]).astype(np.int16),
        start,
        cluster.astype(np.uint16 if len(columns) <= 1 << 16 else np.uint32),
        resolution,
    )


class _Columns(NamedTuple):
    """A cluster's: codes of 16, 8 and 4 bits, (places, columns) each; ``counts`` (3,); ``scale``
    (1 + m,), ``weights`` (vertices, m) in the order of the columns."""

    codes: tuple[NDArray[np.integer], NDArray[np.integer], NDArray[np.integer]]
    counts: tuple[int, int, int]
    scale: NDArray[np.float64]
    weights: NDArray[np.int16]


def _columns(rows: Floats, weights: NDArray[np.floating]) -> _Columns:
    """Round the centre and the vectors, rows (1 + m, places), with weights (vertices, m)."""
    reach = np.maximum(np.abs(rows).max(axis=1), 1e-30)
    spread = np.append(1.0, np.sqrt((weights**2).mean(axis=0)) if len(weights) else weights[:0])
    # A step s is an error of s / sqrt(12), times the weight.
    error = reach * spread / math.sqrt(12.0)
    most = np.select(
        [error / _NIBBLE <= _ROUNDING, error / _BYTE <= _ROUNDING], [_NIBBLE, _BYTE], _WORD
    )
    most[0] = _WORD
    order = np.argsort(-most, kind="stable")
    step = (reach / most)[order]
    codes = np.rint(rows[order] / step[:, None]).astype(np.int16).T
    counts = tuple(int((most == kind).sum()) for kind in (_WORD, _BYTE, _NIBBLE))
    words, whole, halves = np.split(codes, np.cumsum(counts)[:2], axis=1)
    halves = np.pad(halves + 8, ((0, 0), (0, halves.shape[1] % 2)), constant_values=8)
    pairs = (halves[:, 0::2] | (halves[:, 1::2] << 4)).astype(np.uint8)
    own = weights[:, order[1:] - 1]
    largest = np.maximum(np.abs(own).max(axis=0, initial=0.0), 1e-30) / _WORD
    return _Columns(
        (np.ascontiguousarray(words), whole.astype(np.int8), pairs),
        (counts[0], counts[1], counts[2]),
        step * np.append(1.0, largest),
        np.rint(own / largest).astype(np.int16),
    )


# ---- fewer directions --------------------------------------------------------------------------


def resampled(rows: NDArray[np.floating], m: int) -> Floats:
    """Values (P, m²) float32 whose bilinear interpolation at n x n directions is nearest to
    rows (P, n²), by solid angle; m is less than n.

    Normal equations by conjugate gradients with their diagonal as preconditioner.

    >>> import numpy as np
    >>> bool(np.allclose(resampled(np.full((1, 64), 0.5), 4), 0.5, atol=1e-4))
    True
    """
    n = resolution_of(rows.shape[1])
    taps, areas = _taps(n, m), solid_angles(n)[:, None]
    weighted = taps.T * areas.T
    diagonal = (taps.multiply(taps)).T @ areas
    values = np.zeros((taps.shape[1], len(rows)))
    left = weighted @ rows.T.astype(np.float64)
    way = left / diagonal
    energy = (left * way).sum(axis=0)
    for _ in range(_ROUNDS):
        turned = weighted @ (taps @ way)
        length = energy / np.maximum((way * turned).sum(axis=0), 1e-300)
        values += length * way
        left -= length * turned
        ready = left / diagonal
        before, energy = energy, (left * ready).sum(axis=0)
        way = ready + energy / np.maximum(before, 1e-300) * way
    return np.ascontiguousarray(values.T, dtype=np.float32)


@functools.lru_cache(maxsize=4)
def _taps(n: int, m: int) -> csr_array:
    """(n², m²): bilinear interpolation from fewer rows and columns."""
    from scipy.sparse import csr_array

    found = bilinear_taps(texel_directions(n), m)
    rows = np.repeat(np.arange(n * n), 4)
    places = (rows, found.texels.ravel())
    return csr_array((found.weights.ravel(), places), shape=(n * n, m * m))
