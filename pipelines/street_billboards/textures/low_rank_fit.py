"""Low-rank factors of a few views that do not all see every texel (Eq. 1 with gaps).

X_i = mean_i + sum_k w_ik V_k holds where view i saw the texel. Filling gaps with zeros would make
them part of the picture, so only seen texels count: the start is an SVD of the matrix whose gaps
the other views fill, then images and weights are solved for in turn, each by least squares.

Two small ridges decide what the seen texels leave open. Images are kept at a root mean square of 1,
so that w is an amplitude in codes: a component's value at a texel pays ``ridge`` (codes²) times
its square, as in probabilistic PCA, so weak components say little where few views looked. A view's
weights are drawn to the mean of all views' weights as if by ``_PULL`` texels: a view that saw
hardly anything looks like the others.

Loops run along texels inside, so that they become vector instructions: a billboard has five views
and a thousand texels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.textures.vector_sums import dot, matrix_product, total_of

FloatArray = NDArray[np.float32]

RIDGE = 0.05
"""Codes², of images."""
_PULL = 0.5
_START_SWEEPS = 3


class Factors(NamedTuple):
    """A fit of r components to n views of P texels: means[:, None] + weights @ images; float32."""

    means: FloatArray
    """(n,)."""
    weights: FloatArray
    """(n, r)."""
    images: FloatArray
    """(r, P)."""


def fit_low_rank(
    values: FloatArray,
    seen: NDArray[np.bool_],
    rank: int,
    *,
    view_weights: NDArray[np.floating] | None = None,
    ridge: float = RIDGE,
    sweeps: int = 30,
) -> Factors:
    """Means, weights and images that are nearest to what was seen.

    values (n, P): views' texels in codes; seen (n, P); rank: 0 up to the number of views that saw
    anything; view_weights (n,): how much an error in each view counts, 1 unless given; sweeps: of
    alternating least squares; where all is seen the SVD is the answer and there are none. Images
    are orthogonal, the strongest first, each with a mean of 0 over the texels that any view saw
    and a mean square of 1 over all; their values are 0 at texels that none saw.

    Raises ValueError where the rank is not possible. Source: Eq. 1; the alternation is that of
    weighted low-rank approximation (Srebro, Jaakkola 2003).
    """
    most = int(seen.any(axis=1).sum())
    if not 0 <= rank <= most:
        raise ValueError(f"rank is {rank}; expected 0 to {most}, the views that saw anything.")
    counted = seen.astype(np.float32)
    if view_weights is not None:
        counted *= np.asarray(view_weights, np.float32)[:, None]
    data = np.ascontiguousarray(values, np.float32)
    factors = truncated_svd(data, counted, rank)
    alternate_least_squares(data, counted, factors, ridge, sweeps)
    return factors


@njit(cache=True, nogil=True)
def truncated_svd(values: FloatArray, counted: FloatArray, rank: int) -> Factors:
    """The truncated SVD, gaps filled with the mean of the other views.

    values, counted (n, P) float32: a texel counts by the second, 0 for unseen.
    """
    views, texels = values.shape
    means = np.zeros(views, np.float32)
    middle = np.zeros(texels, np.float32)
    total = np.zeros(texels, np.float32)
    for i in range(views):
        for p in range(texels):
            total[p] += counted[i, p]
    # Means of views and of texels in turn: a view that saw the dark half only is not a dark view.
    for _ in range(_START_SWEEPS):
        _centre(values, counted, middle, means)
        middle[:] = 0.0
        for i in range(views):
            for p in range(texels):
                middle[p] += counted[i, p] * (values[i, p] - means[i])
        for p in range(texels):
            middle[p] = middle[p] / total[p] if total[p] > 0.0 else np.float32(0.0)
    filled = np.empty((views, texels), np.float32)
    for i in range(views):
        for p in range(texels):
            filled[i, p] = values[i, p] - means[i] if counted[i, p] > 0.0 else middle[p]
    for i in range(views):
        own = total_of(filled[i]) / np.float32(texels)
        for p in range(texels):
            filled[i, p] -= own
        means[i] += own
    gram = np.empty((views, views), np.float64)
    for i in range(views):
        for j in range(i + 1):
            gram[i, j] = gram[j, i] = dot(filled[i], filled[j])
    _, vectors = np.linalg.eigh(gram)
    weights = np.zeros((views, rank), np.float32)
    images = np.zeros((rank, texels), np.float32)
    for k in range(rank):
        for i in range(views):
            share = np.float32(vectors[i, views - 1 - k])
            weights[i, k] = share
            for p in range(texels):
                images[k, p] += share * filled[i, p]
        for p in range(texels):
            if total[p] <= 0.0:
                images[k, p] = 0.0
        _normalise(images[k], weights[:, k])
    return Factors(means, weights, images)


@njit(cache=True, nogil=True)
def _centre(values: FloatArray, counted: FloatArray, middle: FloatArray, means: FloatArray) -> None:
    """Views' means beyond the texels' ``middle``; the mean of these for views that saw nothing."""
    views, texels = values.shape
    known = 0
    mean = np.float32(0.0)
    off = np.empty(texels, np.float32)
    for i in range(views):
        for p in range(texels):
            off[p] = values[i, p] - middle[p]
        mass, moment = total_of(counted[i]), dot(counted[i], off)
        if mass > 0.0:
            means[i] = moment / mass
            mean += means[i]
            known += 1
        else:
            means[i] = 0.0
    for i in range(views):
        if not (counted[i] > 0.0).any():
            means[i] = mean / known if known else np.float32(0.0)


@njit(cache=True, nogil=True)
def _normalise(image: FloatArray, weights: FloatArray) -> None:
    size = np.float32(np.sqrt(dot(image, image) / len(image)))
    if size > 1e-6:
        image /= size
        weights *= size
    else:
        image[:] = 0.0
        weights[:] = 0.0


@njit(cache=True, nogil=True)
def alternate_least_squares(
    values: FloatArray,
    counted: FloatArray,
    factors: Factors,
    ridge: float,
    sweeps: int,
) -> None:
    """Alternating least squares over what counts, in place; then images are made orthogonal.

    values, counted (n, P); factors as `truncated_svd` leaves them. Does nothing where every texel
    counts alike: then the start is the answer.
    """
    rank = len(factors.images)
    if rank == 0 or (counted == counted[0, 0]).all():
        return
    for _ in range(sweeps):
        solve_images(values, counted, factors, ridge)
        # Images that grow alike have weights that grow without bound, until single precision
        # cannot tell them apart.
        _orthogonalise(counted, factors)
        solve_weights(values, counted, factors, True)
    _orthogonalise(counted, factors)


@njit(cache=True, nogil=True)
def solve_images(
    values: FloatArray,
    counted: FloatArray,
    factors: Factors,
    ridge: float,
) -> None:
    """Least squares for the images, in place, given means and weights.

    A Cholesky decomposition at each texel, all texels side by side.
    """
    means, weights, images = factors
    rank, texels = images.shape
    views = len(values)
    factor = np.zeros((rank, rank, texels), np.float32)
    images[:] = 0.0
    for i in range(views):
        for k in range(rank):
            weight, mean = weights[i, k], means[i]
            for p in range(texels):
                images[k, p] += weight * counted[i, p] * (values[i, p] - mean)
            for m in range(k + 1):
                product = weight * weights[i, m]
                for p in range(texels):
                    factor[k, m, p] += product * counted[i, p]
    small = np.float32(ridge)
    for k in range(rank):
        for p in range(texels):
            factor[k, k, p] += small
        for m in range(k + 1):
            for j in range(m):
                for p in range(texels):
                    factor[k, m, p] -= factor[k, j, p] * factor[m, j, p]
            if m < k:
                for p in range(texels):
                    factor[k, m, p] *= factor[m, m, p]
            else:
                for p in range(texels):
                    # The inverse of the diagonal; rounding must not make it a root of less than 0.
                    factor[k, k, p] = np.float32(1.0) / np.sqrt(
                        max(factor[k, k, p], np.float32(1e-3) * small)
                    )
    for k in range(rank):
        for m in range(k):
            for p in range(texels):
                images[k, p] -= factor[k, m, p] * images[m, p]
        for p in range(texels):
            images[k, p] *= factor[k, k, p]
    for k in range(rank - 1, -1, -1):
        for m in range(k + 1, rank):
            for p in range(texels):
                images[k, p] -= factor[m, k, p] * images[m, p]
        for p in range(texels):
            images[k, p] *= factor[k, k, p]


@njit(cache=True, nogil=True)
def solve_weights(
    values: FloatArray,
    counted: FloatArray,
    factors: Factors,
    with_means: bool,
) -> None:
    """Least squares for each view's weights and, if asked for, means, in place."""
    means, weights, images = factors
    rank, texels = images.shape
    views = len(values)
    if rank == 0:
        if with_means:
            _centre(values, counted, np.zeros(texels, np.float32), means)
        return
    centre = np.zeros(rank, np.float64)
    for i in range(views):
        for k in range(rank):
            centre[k] += weights[i, k] / views
    pull = np.empty(rank, np.float64)
    for k in range(rank):
        pull[k] = _PULL * dot(images[k], images[k]) / texels + 1e-6
    matrix = np.empty((rank + 1, rank + 1), np.float64)
    right = np.empty(rank + 1, np.float64)
    weighted = np.empty(texels, np.float32)
    off = np.empty(texels, np.float32)
    mean_of_means, known = 0.0, 0
    empty = np.zeros(views, np.bool_)
    for i in range(views):
        for p in range(texels):
            off[p] = values[i, p] - means[i]
        mass, moment = total_of(counted[i]), dot(counted[i], off)
        if mass <= 0.0:
            empty[i] = True
            for k in range(rank):
                weights[i, k] = centre[k]
            continue
        for k in range(rank):
            for p in range(texels):
                weighted[p] = images[k, p] * counted[i, p]
            matrix[rank, k] = matrix[k, rank] = total_of(weighted)
            right[k] = dot(weighted, off) + pull[k] * centre[k]
            for m in range(k + 1):
                matrix[k, m] = matrix[m, k] = dot(weighted, images[m])
            matrix[k, k] += pull[k]
        matrix[rank, rank], right[rank] = mass, moment
        if with_means:
            solution = np.linalg.solve(matrix, right)
            means[i] += solution[rank]
        else:
            solution = np.linalg.solve(matrix[:rank, :rank].copy(), right[:rank].copy())
        for k in range(rank):
            weights[i, k] = solution[k]
        mean_of_means += means[i]
        known += 1
    if with_means and known:
        for i in range(views):
            if empty[i]:
                means[i] = mean_of_means / known


@njit(cache=True, nogil=True)
def _orthogonalise(counted: FloatArray, factors: Factors) -> None:
    """The same sum, with centred orthogonal images, the strongest first, in place."""
    means, weights, images = factors
    rank, texels = images.shape
    views = len(weights)
    known = np.zeros(texels, np.float32)
    for i in range(views):
        for p in range(texels):
            if counted[i, p] > 0.0:
                known[p] = 1.0
    for k in range(rank):
        middle = dot(images[k], known) / max(total_of(known), np.float32(1.0))
        for p in range(texels):
            images[k, p] -= middle * known[p]
        for i in range(views):
            means[i] += weights[i, k] * middle
    gram = np.empty((rank, rank), np.float64)
    for k in range(rank):
        for m in range(k + 1):
            gram[k, m] = gram[m, k] = dot(images[k], images[m])
    sizes, turned = np.linalg.eigh(gram)
    root = np.empty((rank, rank), np.float64)
    back = np.empty((rank, rank), np.float64)
    for k in range(rank):
        size = np.sqrt(max(sizes[k], 0.0))
        for m in range(rank):
            root[m, k] = turned[m, k] * size
            back[k, m] = turned[m, k] / size if size > 1e-6 else 0.0
    # weights @ images = (weights @ root) @ (back @ images); the rows of the latter are orthonormal.
    scaled = matrix_product(weights.astype(np.float64), root)
    left, lengths, right = np.linalg.svd(scaled, full_matrices=False)
    turn = matrix_product(right, back)
    new = np.zeros((len(turn), texels), np.float32)
    for k in range(len(turn)):
        for m in range(rank):
            share = np.float32(turn[k, m])
            for p in range(texels):
                new[k, p] += share * images[m, p]
    images[:] = 0.0
    weights[:] = 0.0
    size = np.sqrt(np.float64(texels))
    for k in range(min(rank, len(lengths))):
        for p in range(texels):
            images[k, p] = new[k, p] * size
        for i in range(views):
            weights[i, k] = left[i, k] * lengths[k] / size


@njit(cache=True, nogil=True)
def squared_error(
    values: FloatArray,
    counted: FloatArray,
    factors: Factors,
) -> float:
    """Sum over n views and P texels of ``counted`` times the error's square."""
    means, weights, images = factors
    rank, texels = images.shape
    off = np.empty(texels, np.float32)
    squares = np.empty(texels, np.float32)
    total = 0.0
    for i in range(len(values)):
        for p in range(texels):
            off[p] = values[i, p] - means[i]
        for k in range(rank):
            weight = weights[i, k]
            for p in range(texels):
                off[p] -= weight * images[k, p]
        for p in range(texels):
            squares[p] = off[p] * off[p]
        total += float(dot(counted[i], squares))
    return total
