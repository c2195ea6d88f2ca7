"""SSDFs in few bytes: a basis that all clusters share, clusters in it, one common step.

The paper keeps, for each cluster, m vectors over all directions and m values a vertex, in single
precision. Here

- clusters' vectors are written in a *shared basis* Q of the whole scene (its strongest right
  singular vectors), a few hundred numbers instead of thousands of directions;
- a factor sigma u v of the SVD is stored as the two vectors sigma u and sigma v, both rounded to
  the same step q: an error of a step in either one is worth the same in the matrix, so one step
  for everything gives the least error for the bits (uniform noise q² / 12 an entry);
- how many vectors each cluster has follows from q: one is kept while it takes off more error than
  its bits would elsewhere;
- vectors of the shared basis are rounded after a cosine transform of the octahedral square.

X, the matrix in the weighted domain (weighted_sphere.py), is X_i = Q (mu_c + sum_k w_ik V_ck) for
a vertex i of cluster c. `quantise` makes the codes for a step; `quantise_to_rmse` and
`quantise_to_bytes` find the step for a budget.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.shared_basis import SharedBasis
from pipelines.ssdf_lighting.distances.octahedral import resolution_of

FloatArray = NDArray[np.float64]
Codes = NDArray[np.int32]

_KEPT = 0.2
"""A vector is kept where its energy is more than this times q² an entry that it costs."""
_ROUNDING = 0.38
"""Sizes are rounded up from 1 - this on: smaller than half, since zeros cost least."""
MEMORY_STEP = 0.5
"""Step of the shared basis in memory over q: there it is rounded once more, in space."""
_ROUNDS, _NEAR = 16, 0.99
"""Of the search: steps tried at most, and what is near enough to the budget."""
_LEVELS_PER_OCTAVE = 4
"""Singular values are kept to this; only the product of both halves has to be exact."""


class CompactCodes(NamedTuple):
    """Codes of a scene's SSDFs; everything is a whole number but the step.

    step: q, radians.
    shared: (R, D) of the shared basis' vectors times sigma, cosine transformed.
    shared_level: (R,) sigma = q 2^(level / 4).
    centre: (K, R) of the clusters' mu times the root of the cluster's size.
    basis: (M, R) of the clusters' vectors times sigma, cluster by cluster.
    level: (M,) their sigma.
    ranks: (K,) vectors of each cluster; they sum to M.
    cluster: (V,) of each vertex.
    weights: (W,) u sigma, vertex by vertex in their order in clusters, cluster by cluster: first
        all of the first vertex.
    """

    step: float
    shared: Codes
    shared_level: Codes
    centre: Codes
    basis: Codes
    level: Codes
    ranks: Codes
    cluster: Codes
    weights: Codes

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Vertices (K,) of each cluster."""
        return np.bincount(self.cluster, minlength=len(self.ranks))

    @property
    def vertices_in_order(self) -> NDArray[np.int64]:
        """Vertex numbers (V,) in the order of the weights."""
        return np.argsort(self.cluster, kind="stable")

    @property
    def resolution(self) -> int:
        """n of the n x n directions."""
        return resolution_of(self.shared.shape[1])


class ClusterFactors(NamedTuple):
    """SVD of one cluster's rows in the shared basis: ``centre`` (R,), ``left`` (n, r) u sigma,
    ``right`` (r, R) v, ``sigma`` (r,)."""

    centre: FloatArray
    left: FloatArray
    right: FloatArray
    sigma: FloatArray


def cluster_factors(basis: SharedBasis, cluster: NDArray[np.int32]) -> list[ClusterFactors]:
    """The SVD of each cluster about its centre, in the shared basis."""
    factors = []
    for number in range(int(cluster.max()) + 1):
        rows = basis.coordinates[cluster == number].astype(np.float64)
        centre = rows.mean(axis=0)
        left, sigma, right = np.linalg.svd(rows - centre, full_matrices=False)
        factors.append(ClusterFactors(centre, left * sigma, right, sigma))
    return factors


def quantise(
    basis: SharedBasis, cluster: NDArray[np.int32], factors: list[ClusterFactors], step: float
) -> CompactCodes:
    """Round everything to a step q (radians), and leave out what is not worth its bits."""
    rank = _worth(basis.sigma, step, len(basis.vectors))
    shared_level = _levels(basis.sigma[:rank], step)
    scaled = basis.vectors[:, :rank].T.astype(np.float64) * sigma_of(shared_level, step)[:, None]
    centres, bases, levels, ranks, weights = [], [], [], [], []
    for one in factors:
        size = len(one.left)
        kept = _worth(one.sigma, step, size + rank)
        level = _levels(one.sigma[:kept], step)
        # A scale only, that decoding divides by again: it may be a little off.
        sigma = sigma_of(level, step)
        centres.append(_rounded(one.centre[:rank] * np.sqrt(size), step))
        bases.append(_rounded(one.right[:kept, :rank] * sigma[:, None], step))
        weights.append(_rounded(one.left[:, :kept], step).ravel())
        levels.append(level)
        ranks.append(kept)
    return CompactCodes(
        float(step),
        _rounded(cosine_transform(scaled), step),
        shared_level,
        np.stack(centres),
        np.concatenate(bases),
        np.concatenate(levels),
        np.array(ranks, np.int32),
        cluster.astype(np.int32),
        np.concatenate(weights),
    )


def _worth(sigma: FloatArray, step: float, entries: int) -> int:
    return int((sigma**2 > _KEPT * step**2 * entries).sum())


def _levels(sigma: FloatArray, step: float) -> Codes:
    return np.rint(_LEVELS_PER_OCTAVE * np.log2(np.maximum(sigma / step, 1.0))).astype(np.int32)


def sigma_of(level: Codes, step: float) -> FloatArray:
    """Singular values that levels stand for."""
    return step * 2.0 ** (level / _LEVELS_PER_OCTAVE)


def _rounded(values: NDArray[np.floating], step: float) -> Codes:
    sizes = np.floor(np.abs(values) / step + _ROUNDING)
    return np.where(values < 0, -sizes, sizes).astype(np.int32)


def cosine_transform(rows: NDArray[np.floating]) -> NDArray[np.floating]:
    """Orthonormal two-dimensional cosine transform of rows (R, n²) on the octahedral square."""
    from scipy.fft import dctn

    if not len(rows):
        return rows
    n = resolution_of(rows.shape[1])
    return dctn(rows.reshape(-1, n, n), axes=(1, 2), norm="ortho").reshape(rows.shape)


def inverse_cosine_transform(rows: NDArray[np.floating]) -> NDArray[np.floating]:
    """The inverse of `cosine_transform`."""
    from scipy.fft import idctn

    if not len(rows):
        return rows
    n = resolution_of(rows.shape[1])
    return idctn(rows.reshape(-1, n, n), axes=(1, 2), norm="ortho").reshape(rows.shape)


# ---- what the codes mean ---------------------------------------------------------------------


def shared_vectors(compact: CompactCodes) -> NDArray[np.float32]:
    """Q (R, D) as decoded."""
    scaled = inverse_cosine_transform(compact.shared * compact.step)
    return (scaled / sigma_of(compact.shared_level, compact.step)[:, None]).astype(np.float32)


def cluster_vectors(compact: CompactCodes) -> tuple[FloatArray, FloatArray]:
    """mu (K, R) and V (M, R) as decoded, in the shared basis."""
    sizes = np.maximum(compact.sizes, 1)[:, None]
    sigma = sigma_of(compact.level, compact.step)[:, None]
    return compact.centre * compact.step / np.sqrt(sizes), compact.basis * compact.step / sigma


def decoded_coordinates(compact: CompactCodes) -> NDArray[np.float32]:
    """Coordinates (V, R) of the vertices in the shared basis, as decoded."""
    centres, vectors = cluster_vectors(compact)
    decoded = np.empty((len(compact.cluster), centres.shape[1]), np.float32)
    order = compact.vertices_in_order
    row, place, first = 0, 0, 0
    for size, rank, centre in zip(compact.sizes, compact.ranks, centres, strict=True):
        weights = compact.weights[place : place + size * rank].reshape(size, rank) * compact.step
        decoded[order[row : row + size]] = centre + weights @ vectors[first : first + rank]
        row, place, first = row + size, place + size * rank, first + rank
    return decoded


def squared_error(basis: SharedBasis, compact: CompactCodes) -> float:
    """Sum of squares of the error in memory, in the weighted domain, without touching the matrix.

    With C the coordinates, Q the shared basis (orthonormal), and C', Q' what is decoded of them,
    the error is (C - C') Q + C' (Q - Q'), and what the shared basis leaves out, which is at right
    angles to the first, and to the second but for what is rounding of rounding.
    """
    rank = len(compact.shared)
    decoded = decoded_coordinates(compact).astype(np.float64)
    missed = basis.coordinates.astype(np.float64)
    missed[:, :rank] -= decoded
    off = (basis.vectors[:, :rank].T - shared_vectors(compact)).astype(np.float64)
    rounding = ((decoded.T @ decoded) * (off @ off.T)).sum()
    both = 2.0 * ((decoded.T @ missed) * (off @ basis.vectors.astype(np.float64))).sum()
    again = compact.shared.size * (MEMORY_STEP * compact.step) ** 2 / 12.0
    return float((missed**2).sum() + rounding + both + again + basis.lost)


def quantise_to_rmse(basis: SharedBasis, cluster: NDArray[np.int32], rmse: float) -> CompactCodes:
    """The codes of about the largest step whose RMSE (radians, weighted by solid angle) is at most
    ``rmse``. ``cluster`` (V,) of the vertices, without gaps.

    Raises ValueError where the shared basis alone misses more than that.
    """
    factors = cluster_factors(basis, cluster)
    entries = basis.coordinates.shape[0] * basis.vectors.shape[0]
    if basis.lost >= rmse**2 * entries:
        raise ValueError(
            f"the error asked for is {rmse:g} rad; expected more than the "
            f"{(basis.lost / entries) ** 0.5:.2g} rad that the shared basis leaves out."
        )

    # Over what the basis leaves out the error grows with the step.
    limit = math.sqrt(rmse**2 * entries - basis.lost)

    def measured(tried: CompactCodes) -> float:
        return math.sqrt(max(squared_error(basis, tried) - basis.lost, 0.0))

    found = _largest(
        lambda step: quantise(basis, cluster, factors, step),
        measured,
        limit,
        20.0 * limit / math.sqrt(entries),
    )
    if found is None:
        raise ValueError(f"an error of {rmse:g} rad is out of reach; expected more.")
    return found


def quantise_to_bytes(
    basis: SharedBasis,
    cluster: NDArray[np.int32],
    count: Callable[[CompactCodes], int],
    budget: int,
) -> CompactCodes:
    """The codes of about the smallest step that ``count`` (of bytes) finds within the budget.

    Raises ValueError where no step does.
    """
    factors = cluster_factors(basis, cluster)
    found = _largest(
        lambda fineness: quantise(basis, cluster, factors, 1.0 / fineness),
        count,
        float(budget),
        5.0,
    )
    if found is None:
        raise ValueError(f"{budget} bytes are out of reach; expected more.")
    return found


def _largest(
    make: Callable[[float], CompactCodes],
    measured: Callable[[CompactCodes], float],
    limit: float,
    start: float,
) -> CompactCodes | None:
    """What ``make`` makes of about the largest number whose measure, which grows with it, is within
    the limit; None where none is found."""
    low, high, number = 0.0, np.inf, start
    best = None
    for _ in range(_ROUNDS):
        tried = make(number)
        found = measured(tried)
        if found <= limit:
            low, best = number, tried
            if found > _NEAR * limit:
                break
        else:
            high = number
        guess = number * (1.0 + _NEAR) / 2.0 * limit / max(found, 1e-300)
        if not low < guess < high:
            guess = np.sqrt(max(low, high / 16.0) * min(high, low * 16.0)) if low else high / 4.0
        number = float(guess)
    return best
