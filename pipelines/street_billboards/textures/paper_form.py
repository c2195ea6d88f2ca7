"""The paper's eigen-textures (4.2), one billboard after the other: R, G, B of all 32 directions.

What a view did not see of its texture is filled by the fit of Eq. 1 with gaps, of as many
components as there are views; a direction that nobody observed is as the nearest one observed.
Equal rows of a matrix need not be written out: each counts as often as there are such directions.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.textures.coded_arrays import CodedArrays, offsets
from pipelines.street_billboards.textures.eigen_kernels import (
    ChannelCodes,
    code_channel,
    colour_channels,
    texel_weights,
)
from pipelines.street_billboards.textures.low_rank_fit import (
    RIDGE,
    Factors,
    FloatArray,
    alternate_least_squares,
    truncated_svd,
)
from pipelines.street_billboards.textures.masks import opacity_masks
from pipelines.street_billboards.textures.plane_resolution import fill_unknown
from pipelines.street_billboards.textures.texture_tables import SIDE, ViewTextures
from pipelines.street_billboards.textures.vector_sums import dot
from pipelines.street_billboards.textures.view_directions import DIRECTIONS

_SWEEPS = 10


@njit(cache=True, nogil=True)
def _components(
    values: FloatArray, counted: FloatArray, shares: FloatArray
) -> tuple[FloatArray, Factors, FloatArray]:
    """The filled matrix (n, 1024), its SVD, and the squares of its singular values (n,), falling.

    View i stands for shares[i] rows.
    """
    views, texels = values.shape
    known = 0
    for i in range(views):
        known += (counted[i] > 0.0).any()
    factors = truncated_svd(values, counted, known)
    alternate_least_squares(values, counted, factors, RIDGE, _SWEEPS)
    means, weights, images = factors
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
    return filled, Factors(means, weights, images), squares


@njit(cache=True, nogil=True)
def squared_singular_values(
    views: ViewTextures, shares: FloatArray, squares: NDArray[np.float64]
) -> None:
    """Of R, G and B, into ``squares`` (b, 3, 32), falling; shares (v,): directions of each view."""
    for b in range(len(squares)):
        begin, end = views.first[b], views.first[b + 1]
        counted = texel_weights(views.states[begin:end], np.ones(end - begin, np.float32))
        if not (counted > 0.0).any():
            continue
        channels = colour_channels(views.colours[begin:end], False)
        for c in range(3):
            squares[b, c, : end - begin] = _components(channels[c], counted, shares[begin:end])[2]


@njit(cache=True, nogil=True)
def code_paper_form(
    views: ViewTextures, shares: FloatArray, nearest: NDArray[np.int64], arrays: CodedArrays
) -> None:
    """Codes of 32 views a billboard into ``arrays``, of the ranks that they have.

    shares (v,): directions of each view; nearest (b, 32): rows of observed views. Planes beyond the
    rank that exists stay as they are.
    """
    for b in range(len(nearest)):
        begin, end = views.first[b], views.first[b + 1]
        count = end - begin
        counted = texel_weights(views.states[begin:end], np.ones(count, np.float32))
        if not (counted > 0.0).any():
            continue
        channels = colour_channels(views.colours[begin:end], False)
        everything = np.ones((count, SIDE * SIDE), np.float32)
        for c in range(3):
            rank = int(arrays.ranks[b, c])
            filled, factors, squares = _components(channels[c], counted, shares[begin:end])
            kept = 0
            while kept < min(rank, count) and squares[kept] > 0.0:
                kept += 1
            plane, weight = arrays.first_plane[c][b], arrays.first_weight[c][b]
            codes = ChannelCodes(
                np.empty(count, np.uint8),
                arrays.planes[c][plane : plane + kept],
                arrays.scales[c][plane : plane + kept],
                np.empty(count * kept, np.uint8),
            )
            largest = Factors(
                factors.means, factors.weights[:, :kept].copy(), factors.images[:kept].copy()
            )
            code_channel(filled, everything, largest, SIDE, codes)
            for d in range(nearest.shape[1]):
                i = nearest[b, d] - begin
                arrays.means[b * nearest.shape[1] + d, c] = codes.means[i]
                place = weight + d * rank
                arrays.weights[c][place : place + kept] = codes.weights[i * kept : (i + 1) * kept]


# ---- directions ------------------------------------------------------------------------------


def nearest_views(views: ViewTextures) -> NDArray[np.int64]:
    """(b, 32) rows of the views nearest to each direction, -1 for a billboard without any."""
    counts = np.diff(views.first)
    owner = np.repeat(np.arange(len(counts)), counts)
    apart = np.full((len(counts), DIRECTIONS), 2 * DIRECTIONS)
    nearest = np.full((len(counts), DIRECTIONS), -1, np.int64)
    # The n-th view of every billboard that has as many; the first of two that are as near stays.
    for n in range(int(counts.max(initial=0))):
        rows = (views.first[:-1] + n)[counts > n]
        far = np.abs(views.direction[rows, None].astype(np.int64) - np.arange(DIRECTIONS))
        better = far < apart[owner[rows]]
        nearest[owner[rows]] = np.where(better, rows[:, None], nearest[owner[rows]])
        apart[owner[rows]] = np.where(better, far, apart[owner[rows]])
    return nearest


def ranks_for_contribution(squares: NDArray[np.float64], contribution: float) -> NDArray[np.uint8]:
    """How many of squared singular values (b, 3, 32), falling, add up to a share of all."""
    total = squares.sum(axis=2, keepdims=True)
    # A hair less, so that the share 1 does not hang on rounding.
    short = np.cumsum(squares, axis=2) < contribution * (1.0 - 1e-6) * total
    return np.where(total[..., 0] > 0.0, short.sum(axis=2) + 1, 0).astype(np.uint8)


def masks_of_directions(
    views: ViewTextures, turns: NDArray[np.bool_], nearest: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Masks of the observed views, for all 32 directions of what turns."""
    first, masks = opacity_masks(views, turns)
    first_mask = offsets(np.where(turns, DIRECTIONS, 1))
    result = np.zeros((first_mask[-1], SIDE, SIDE // 8), np.uint8)
    result[first_mask[:-1][~turns]] = masks[first[:-1][~turns]]
    observed = turns & (np.diff(views.first) > 0)
    rows = nearest[observed] + (first[:-1] - views.first[:-1])[observed, None]
    result[first_mask[:-1][observed, None] + np.arange(DIRECTIONS)] = masks[rows]
    return first_mask, result
