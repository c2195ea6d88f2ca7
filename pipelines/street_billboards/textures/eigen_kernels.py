"""Eigen-images of one billboard after the other: what each rank would leave, and their 8 bit codes.

In Y, Co, Cg the squares of errors of R, G and B sum up to 3 dS² + 2 dCo² + 8/3 dCg² with
dS = dY - dCg / 3. So channels can be fitted apart, chroma first: luma is then fitted to what
cancels the chroma's error in R + G + B.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.textures.coded_arrays import CodedArrays
from pipelines.street_billboards.textures.low_rank_fit import (
    Factors,
    FloatArray,
    alternate_least_squares,
    solve_weights,
    squared_error,
    truncated_svd,
)
from pipelines.street_billboards.textures.plane_resolution import (
    downsampled,
    fill_unknown,
    sharpen,
    upsampled,
)
from pipelines.street_billboards.textures.texture_tables import SEEN, SIDE

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

LUMA_CHROMA_WEIGHTS = np.array([3.0, 2.0, 8.0 / 3.0])
"""Of squared errors in Y (Cg's part cancelled), Co and Cg."""
_GUESS = 0.1
"""How much a texel counts that was not seen, but by others."""
_SHARPENING = 6
_MEAN_SWEEPS = 2


class ViewsToFit(NamedTuple):
    """What kernels read of ViewTextures, and how they are to look at it."""

    first: Ints
    colours: Bytes
    states: Bytes
    view_weights: FloatArray
    """(v,)."""
    luma_chroma: bool
    sides: Ints
    """(3,), of planes."""


@njit(cache=True, nogil=True)
def colour_channels(colours: Bytes, luma_chroma: bool) -> FloatArray:
    """Channels (3, n, 1024) of textures (n, 32, 32, 3), in codes; 128 is added to Co and Cg."""
    views = len(colours)
    result = np.empty((3, views, SIDE * SIDE), np.float32)
    for i in range(views):
        for y in range(SIDE):
            for x in range(SIDE):
                red = np.float32(colours[i, y, x, 0])
                green = np.float32(colours[i, y, x, 1])
                blue = np.float32(colours[i, y, x, 2])
                p = y * SIDE + x
                if luma_chroma:
                    both = np.float32(0.5) * (red + blue)
                    result[0, i, p] = np.float32(0.5) * (green + both)
                    result[1, i, p] = np.float32(0.5) * (red - blue) + np.float32(128.0)
                    result[2, i, p] = np.float32(0.5) * (green - both) + np.float32(128.0)
                else:
                    result[0, i, p], result[1, i, p], result[2, i, p] = red, green, blue
    return result


@njit(cache=True, nogil=True)
def texel_weights(states: Bytes, view_weights: FloatArray) -> FloatArray:
    """How much each texel (n, 1024) counts: its view's weight where it was SEEN."""
    views = len(states)
    result = np.zeros((views, SIDE * SIDE), np.float32)
    for i in range(views):
        for y in range(SIDE):
            for x in range(SIDE):
                if states[i, y, x] == SEEN:
                    result[i, y * SIDE + x] = view_weights[i]
    return result


@njit(cache=True, nogil=True)
def guess_gaps(channels: FloatArray, counted: FloatArray) -> None:
    """Let texels that a view did not see count a little, as the nearest view that saw them.

    channels (3, n, 1024) and counted (n, 1024) are changed. Without it a component that few views
    share is free to be anything where they did not look.
    """
    views, texels = counted.shape
    for p in range(texels):
        for i in range(views):
            if counted[i, p] > _GUESS:
                continue
            for away in range(1, views):
                before, after = i - away, i + away
                j = before if before >= 0 and counted[before, p] > _GUESS else after
                if 0 <= j < views and counted[j, p] > _GUESS:
                    channels[:, i, p] = channels[:, j, p]
                    counted[i, p] = _GUESS
                    break


@njit(cache=True, nogil=True)
def start_planes(values: FloatArray, counted: FloatArray, most: int, side: int) -> Factors:
    """The start of every fit, of ``most`` components, images in the planes' resolution."""
    if side == SIDE:
        return truncated_svd(values, counted, most)
    small, mass = downsampled(values, counted, side)
    return truncated_svd(small, mass, most)


@njit(cache=True, nogil=True)
def fit_planes(
    values: FloatArray,
    counted: FloatArray,
    start: Factors,
    rank: int,
    side: int,
    ridge: float,
    sweeps: int,
) -> tuple[Factors, float]:
    """The fit of so many components, images (rank, side²), and the sum of squares that it leaves.

    values, counted (n, 1024); start: of ``rank`` components or more, by `start_planes`.
    """
    factors = Factors(
        start.means.copy(), start.weights[:, :rank].copy(), start.images[:rank].copy()
    )
    if side == SIDE:
        alternate_least_squares(values, counted, factors, ridge, sweeps)
        if rank == 0:
            solve_weights(values, counted, factors, True)
        return factors, squared_error(values, counted, factors)
    small, mass = downsampled(values, counted, side)
    alternate_least_squares(small, mass, factors, ridge, sweeps)
    sharpen(values, counted, factors, side, _SHARPENING)
    large = Factors(factors.means, factors.weights, upsampled(factors.images, side))
    solve_weights(values, counted, large, True)
    return factors, squared_error(values, counted, large)


@njit(cache=True, nogil=True)
def rank_errors(
    data: ViewsToFit,
    most: Ints,
    enough: float,
    ridge: float,
    sweeps: int,
    errors: NDArray[np.float64],
) -> None:
    """Into ``errors`` (b, 3, ranks): sums of squares, a channel's, that each rank would leave.

    A billboard's curve ends (infinity follows) at the views that saw anything, at most[c], or where
    what is left is less than ``enough`` (codes²) a texel.
    """
    errors[:] = np.inf
    for b in range(len(errors)):
        begin, end = data.first[b], data.first[b + 1]
        counted = texel_weights(data.states[begin:end], data.view_weights[begin:end])
        mass = counted.sum()
        if mass <= 0.0:
            errors[b, :, 0] = 0.0
            continue
        known = 0
        for i in range(end - begin):
            known += (counted[i] > 0.0).any()
        channels = colour_channels(data.colours[begin:end], data.luma_chroma)
        guess_gaps(channels, counted)
        for c in range(3):
            limit = min(known, most[c])
            start = start_planes(channels[c], counted, limit, data.sides[c])
            for rank in range(limit + 1):
                errors[b, c, rank] = fit_planes(
                    channels[c], counted, start, rank, data.sides[c], ridge, sweeps
                )[1]
                if errors[b, c, rank] <= enough * mass:
                    break


class ChannelCodes(NamedTuple):
    """Where 8 bit codes of one channel of a billboard are written."""

    means: Bytes
    """(n,)."""
    planes: Bytes
    """(r, side²)."""
    scales: FloatArray
    """(r,)."""
    weights: Bytes
    """(n * r,), view by view."""


@njit(cache=True, nogil=True)
def code_channel(
    values: FloatArray, counted: FloatArray, factors: Factors, side: int, codes: ChannelCodes
) -> None:
    """8 bit codes of a fit, images (r, side²); means and weights are fitted anew to coded planes.

    values, counted (n, 1024). What is decoded of the codes is left in ``factors``.
    """
    means, weights, planes = factors
    views, rank = weights.shape
    for k in range(rank):
        largest = np.float32(0.0)
        for value in planes[k]:
            largest = max(largest, abs(value))
        for q in range(planes.shape[1]):
            code = np.rint(planes[k, q] / largest * 127.0) if largest > 0.0 else 0.0
            codes.planes[k, q] = np.uint8(code + 128.0)
            planes[k, q] = np.float32(code / 127.0)
    large = Factors(means, weights, upsampled(planes, side))
    for _ in range(_MEAN_SWEEPS):
        solve_weights(values, counted, large, True)
    for i in range(views):
        codes.means[i] = np.uint8(min(max(np.rint(means[i]), 0.0), 255.0))
        means[i] = codes.means[i]
    solve_weights(values, counted, large, False)
    for k in range(rank):
        largest = np.float32(0.0)
        for i in range(views):
            largest = max(largest, abs(weights[i, k]))
        codes.scales[k] = largest
        for i in range(views):
            code = np.rint(weights[i, k] / largest * 127.0) if largest > 0.0 else 0.0
            codes.weights[i * rank + k] = np.uint8(code + 128.0)
            weights[i, k] = np.float32(code / 127.0) * largest


@njit(cache=True, nogil=True)
def code_billboards(
    data: ViewsToFit, arrays: CodedArrays, begin_at: int, end_at: int, ridge: float, sweeps: int
) -> None:
    """Fit and code billboards ``begin_at`` to ``end_at``, of the ranks that ``arrays`` have."""
    sides = data.sides
    for b in range(begin_at, end_at):
        begin, end = data.first[b], data.first[b + 1]
        if begin == end:
            continue
        counted = texel_weights(data.states[begin:end], data.view_weights[begin:end])
        channels = colour_channels(data.colours[begin:end], data.luma_chroma)
        guess_gaps(channels, counted)
        for c in (2, 1, 0):
            rank = int(np.int64(arrays.ranks[b, c]))  # as `rank_errors` has it: compiled once
            start = start_planes(channels[c], counted, rank, sides[c])
            factors, _ = fit_planes(channels[c], counted, start, rank, sides[c], ridge, sweeps)
            mass = counted
            if sides[c] != SIDE:
                mass = downsampled(channels[c], counted, sides[c])[1]
            fill_unknown(factors.images, mass, sides[c])
            plane, weight = arrays.first_plane[c][b], arrays.first_weight[c][b]
            codes = ChannelCodes(
                arrays.means[begin:end, c],
                arrays.planes[c][plane : plane + rank],
                arrays.scales[c][plane : plane + rank],
                arrays.weights[c][weight : weight + rank * (end - begin)],
            )
            code_channel(channels[c], counted, factors, sides[c], codes)
            if c == 2 and data.luma_chroma:
                _cancel_green_error(channels, factors, sides[c])


@njit(cache=True, nogil=True)
def _cancel_green_error(channels: FloatArray, coded: Factors, side: int) -> None:
    """Change luma, in place, by a third of what the coded Cg is off."""
    means, weights, _ = coded
    large = upsampled(coded.images, side)
    for i in range(len(means)):
        for p in range(SIDE * SIDE):
            decoded = means[i]
            for k in range(weights.shape[1]):
                decoded += weights[i, k] * large[k, p]
            channels[0, i, p] += (decoded - channels[2, i, p]) / np.float32(3.0)
