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
from pipelines.street_billboards.textures.forms import SEEN, SIDE
from pipelines.street_billboards.textures.low_rank_fit import (
    FloatArray,
    refined,
    solve_weights,
    squared_error,
    started,
)
from pipelines.street_billboards.textures.plane_resolution import (
    enlarged,
    fill_unknown,
    reduced,
    sharpen,
)

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

LUMA_CHROMA_WEIGHTS = np.array([3.0, 2.0, 8.0 / 3.0])
"""Of squared errors in Y (Cg's part cancelled), Co and Cg."""
_GUESS = 0.1
"""How much a texel counts that was not seen, but by others."""
_SHARPENING = 6
_MEAN_SWEEPS = 2


class Sampled(NamedTuple):
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
def channels_of(colours: Bytes, luma_chroma: bool) -> FloatArray:
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
def counted_of(states: Bytes, view_weights: FloatArray) -> FloatArray:
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
def fit_planes(
    values: FloatArray,
    counted: FloatArray,
    start: tuple[FloatArray, FloatArray, FloatArray],
    rank: int,
    side: int,
    ridge: float,
    sweeps: int,
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Means (n,), weights (n, rank), planes (rank, side²) and the sum of squares that they leave.

    ``start``: of ``rank`` components or more, in the planes' resolution, by `first_planes`.
    """
    means = start[0].copy()
    weights = start[1][:, :rank].copy()
    planes = start[2][:rank].copy()
    if side == SIDE:
        refined(values, counted, means, weights, planes, ridge, sweeps)
        if rank == 0:
            solve_weights(values, counted, means, weights, planes, True)
        return means, weights, planes, squared_error(values, counted, means, weights, planes)
    small, mass = reduced(values, counted, side)
    refined(small, mass, means, weights, planes, ridge, sweeps)
    sharpen(values, counted, means, weights, planes, side, _SHARPENING)
    large = enlarged(planes, side)
    solve_weights(values, counted, means, weights, large, True)
    return means, weights, planes, squared_error(values, counted, means, weights, large)


@njit(cache=True, nogil=True)
def first_planes(
    values: FloatArray, counted: FloatArray, most: int, side: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The start of every fit, of ``most`` components."""
    if side == SIDE:
        return started(values, counted, most)
    small, mass = reduced(values, counted, side)
    return started(small, mass, most)


@njit(cache=True, nogil=True)
def rank_errors(
    data: Sampled,
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
        counted = counted_of(data.states[begin:end], data.view_weights[begin:end])
        mass = counted.sum()
        if mass <= 0.0:
            errors[b, :, 0] = 0.0
            continue
        known = 0
        for i in range(end - begin):
            known += (counted[i] > 0.0).any()
        channels = channels_of(data.colours[begin:end], data.luma_chroma)
        guess_gaps(channels, counted)
        for c in range(3):
            limit = min(known, most[c])
            start = first_planes(channels[c], counted, limit, data.sides[c])
            for rank in range(limit + 1):
                errors[b, c, rank] = fit_planes(
                    channels[c], counted, start, rank, data.sides[c], ridge, sweeps
                )[3]
                if errors[b, c, rank] <= enough * mass:
                    break


@njit(cache=True, nogil=True)
def code_planes(
    values: FloatArray,
    counted: FloatArray,
    means: FloatArray,
    weights: FloatArray,
    planes: FloatArray,
    side: int,
    mean_codes: Bytes,
    plane_codes: Bytes,
    scales: FloatArray,
    weight_codes: Bytes,
) -> None:
    """8 bit codes of one channel of a billboard; means and weights are fitted anew to coded planes.

    values, counted (n, 1024); means (n,), weights (n, r), planes (r, side²); into mean_codes (n,),
    plane_codes (r, side²), scales (r,), weight_codes (n * r,). What is decoded of weights and
    planes is left in ``means``, ``weights`` and ``planes``.
    """
    views, rank = weights.shape
    for k in range(rank):
        largest = np.float32(0.0)
        for value in planes[k]:
            largest = max(largest, abs(value))
        for q in range(planes.shape[1]):
            code = np.rint(planes[k, q] / largest * 127.0) if largest > 0.0 else 0.0
            plane_codes[k, q] = np.uint8(code + 128.0)
            planes[k, q] = np.float32(code / 127.0)
    large = enlarged(planes, side)
    for _ in range(_MEAN_SWEEPS):
        solve_weights(values, counted, means, weights, large, True)
    for i in range(views):
        mean_codes[i] = np.uint8(min(max(np.rint(means[i]), 0.0), 255.0))
        means[i] = mean_codes[i]
    solve_weights(values, counted, means, weights, large, False)
    for k in range(rank):
        largest = np.float32(0.0)
        for i in range(views):
            largest = max(largest, abs(weights[i, k]))
        scales[k] = largest
        for i in range(views):
            code = np.rint(weights[i, k] / largest * 127.0) if largest > 0.0 else 0.0
            weight_codes[i * rank + k] = np.uint8(code + 128.0)
            weights[i, k] = np.float32(code / 127.0) * largest


@njit(cache=True, nogil=True)
def code_billboards(
    data: Sampled, arrays: CodedArrays, begin_at: int, end_at: int, ridge: float, sweeps: int
) -> None:
    """Fit and code billboards ``begin_at`` to ``end_at``, of the ranks that ``arrays`` have."""
    sides = data.sides
    for b in range(begin_at, end_at):
        begin, end = data.first[b], data.first[b + 1]
        if begin == end:
            continue
        counted = counted_of(data.states[begin:end], data.view_weights[begin:end])
        channels = channels_of(data.colours[begin:end], data.luma_chroma)
        guess_gaps(channels, counted)
        for c in (2, 1, 0):
            rank = int(arrays.ranks[b, c])
            start = first_planes(channels[c], counted, rank, sides[c])
            middle, amounts, images, _ = fit_planes(
                channels[c], counted, start, rank, sides[c], ridge, sweeps
            )
            if sides[c] == SIDE:
                fill_unknown(images, counted, SIDE)
            else:
                fill_unknown(images, reduced(channels[c], counted, sides[c])[1], sides[c])
            plane, weight = arrays.first_plane[c][b], arrays.first_weight[c][b]
            code_planes(
                channels[c],
                counted,
                middle,
                amounts,
                images,
                sides[c],
                arrays.means[begin:end, c],
                arrays.planes[c][plane : plane + rank],
                arrays.scales[c][plane : plane + rank],
                arrays.weights[c][weight : weight + rank * (end - begin)],
            )
            if c == 2 and data.luma_chroma:
                large = enlarged(images, sides[c])
                for i in range(end - begin):
                    for p in range(SIDE * SIDE):
                        decoded = middle[i]
                        for k in range(rank):
                            decoded += amounts[i, k] * large[k, p]
                        channels[0, i, p] += (decoded - channels[2, i, p]) / np.float32(3.0)
