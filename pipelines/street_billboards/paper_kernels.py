"""The paper's eigen-textures (4.2), one billboard after the other: R, G, B of all 32 directions.

What a view did not see of its texture is filled by the fit of Eq. 1 with gaps, of as many
components as there are views; a direction that nobody observed is as the nearest one observed.
Equal rows of a matrix need not be written out: each counts as often as there are directions like it.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.eigen_kernels import channels_of, code_planes, counted_of
from pipelines.street_billboards.low_rank_fit import RIDGE, FloatArray, dot, refined, started
from pipelines.street_billboards.plane_resolution import fill_unknown
from pipelines.street_billboards.textures import SIDE

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

_SWEEPS = 10


@njit(cache=True, nogil=True)
def _components(
    values: FloatArray, counted: FloatArray, shares: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """The filled matrix (n, 1024), its means (n,), weights (n, n), images (n, 1024) and the squares
    of its singular values (n,), falling; view i stands for shares[i] rows."""
    views, texels = values.shape
    known = 0
    for i in range(views):
        known += (counted[i] > 0.0).any()
    means, weights, images = started(values, counted, known)
    refined(values, counted, means, weights, images, RIDGE, _SWEEPS)
    fill_unknown(images, counted, SIDE)
    filled = np.empty((views, texels), np.float32)
    for i in range(views):
        filled[i] = means[i]
        for k in range(known):
            filled[i] += weights[i, k] * images[k]
        for p in range(texels):
            if counted[i, p] > 0.0:
                filled[i, p] = values[i, p]
        means[i] = filled[i].mean()
    gram = np.empty((views, views), np.float64)
    for i in range(views):
        for j in range(i + 1):
            inner = dot(filled[i] - means[i], filled[j] - means[j])
            gram[i, j] = gram[j, i] = inner * np.sqrt(shares[i] * shares[j])
    lengths, turned = np.linalg.eigh(gram)
    squares = np.zeros(views, np.float32)
    weights = np.zeros((views, views), np.float32)
    images = np.zeros((views, texels), np.float32)
    for k in range(views):
        square = lengths[views - 1 - k]
        # What is left of rounding is no component.
        if square <= 1e-6 * max(lengths[views - 1], 1.0):
            break
        squares[k] = square
        for i in range(views):
            if shares[i] > 0.0:
                share = turned[i, views - 1 - k]
                weights[i, k] = share * np.sqrt(square / (shares[i] * texels))
                images[k] += np.float32(share * np.sqrt(shares[i] * texels / square)) * (
                    filled[i] - means[i]
                )
    return filled, means, weights, images, squares


@njit(cache=True, nogil=True)
def paper_squares(
    first: Ints,
    colours: Bytes,
    states: Bytes,
    shares: FloatArray,
    squares: NDArray[np.float64],
) -> None:
    """Squared singular values into ``squares`` (b, 3, 32); shares (v,): directions of each view."""
    for b in range(len(squares)):
        begin, end = first[b], first[b + 1]
        counted = counted_of(states[begin:end], np.ones(end - begin, np.float32))
        if not (counted > 0.0).any():
            continue
        channels = channels_of(colours[begin:end], False)
        for c in range(3):
            squares[b, c, : end - begin] = _components(channels[c], counted, shares[begin:end])[4]


@njit(cache=True, nogil=True)
def code_paper(
    first: Ints,
    colours: Bytes,
    states: Bytes,
    shares: FloatArray,
    nearest: Ints,
    ranks: Bytes,
    first_plane: tuple[Ints, Ints, Ints],
    first_weight: tuple[Ints, Ints, Ints],
    means: Bytes,
    planes: tuple[Bytes, Bytes, Bytes],
    scales: tuple[FloatArray, FloatArray, FloatArray],
    weights: tuple[Bytes, Bytes, Bytes],
) -> None:
    """Codes of 32 views a billboard into the arrays of CompressedTextures, ranks (b, 3) given.

    nearest (b, 32): rows of observed views. planes are (r, 1024) here; what is not written (planes
    beyond the rank that exists) must stand for zero.
    """
    for b in range(len(ranks)):
        begin, end = first[b], first[b + 1]
        views = end - begin
        counted = counted_of(states[begin:end], np.ones(views, np.float32))
        if not (counted > 0.0).any():
            continue
        channels = channels_of(colours[begin:end], False)
        everything = np.ones((views, SIDE * SIDE), np.float32)
        for c in range(3):
            rank = int(ranks[b, c])
            filled, middle, amounts, images, squares = _components(
                channels[c], counted, shares[begin:end]
            )
            kept = 0
            while kept < min(rank, views) and squares[kept] > 0.0:
                kept += 1
            plane, weight = first_plane[c][b], first_weight[c][b]
            mean_codes = np.empty(views, np.uint8)
            weight_codes = np.empty(views * kept, np.uint8)
            code_planes(
                filled,
                everything,
                middle,
                amounts[:, :kept].copy(),
                images[:kept].copy(),
                SIDE,
                mean_codes,
                planes[c][plane : plane + kept],
                scales[c][plane : plane + kept],
                weight_codes,
            )
            for d in range(nearest.shape[1]):
                i = nearest[b, d] - begin
                means[b * nearest.shape[1] + d, c] = mean_codes[i]
                place = weight + d * rank
                weights[c][place : place + kept] = weight_codes[i * kept : (i + 1) * kept]
