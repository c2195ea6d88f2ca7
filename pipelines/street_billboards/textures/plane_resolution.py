"""Eigen-images of fewer texels than the texture: how they are upsampled, and fitted.

A plane of side s is sampled bilinearly at the middles of the texture's texels, clamped at the rim:
texel y of 32 lies at (y + 0.5) / 32 * s - 0.5 of the plane.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.textures.low_rank_fit import Factors
from pipelines.street_billboards.textures.texture_tables import SIDE

FloatArray = NDArray[np.float32]

_RIM = 4


@njit(cache=True, nogil=True)
def sample_places(side: int) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
    """For each of 32 texels: the plane's texels before and after it, and the share (32,) of the
    second."""
    before = np.empty(SIDE, np.int64)
    after = np.empty(SIDE, np.int64)
    share = np.empty(SIDE, np.float32)
    for y in range(SIDE):
        place = min(max((y + 0.5) / SIDE * side - 0.5, 0.0), side - 1.0)
        before[y] = int(place)
        after[y] = min(before[y] + 1, side - 1)
        share[y] = place - before[y]
    return before, after, share


@njit(cache=True, nogil=True)
def upsampled(planes: FloatArray, side: int) -> FloatArray:
    """Planes (r, side * side) as textures (r, 1024), float32."""
    count = len(planes)
    if side == SIDE:
        return planes.copy()
    before, after, share = sample_places(side)
    result = np.empty((count, SIDE * SIDE), np.float32)
    row = np.empty(side, np.float32)
    for k in range(count):
        for y in range(SIDE):
            top, bottom = before[y] * side, after[y] * side
            for x in range(side):
                upper = planes[k, top + x]
                row[x] = upper + share[y] * (planes[k, bottom + x] - upper)
            for x in range(SIDE):
                left = row[before[x]]
                result[k, y * SIDE + x] = left + share[x] * (row[after[x]] - left)
    return result


@njit(cache=True, nogil=True)
def upsampled_transpose(texture: FloatArray, side: int, plane: FloatArray) -> None:
    """The transpose of ``upsampled``, for one texture (1024,), into ``plane`` (side * side,)."""
    before, after, share = sample_places(side)
    plane[:] = 0.0
    for y in range(SIDE):
        top, bottom = before[y] * side, after[y] * side
        for x in range(SIDE):
            value = texture[y * SIDE + x]
            right = share[x] * value
            left = value - right
            plane[bottom + before[x]] += share[y] * left
            plane[bottom + after[x]] += share[y] * right
            plane[top + before[x]] += left - share[y] * left
            plane[top + after[x]] += right - share[y] * right


@njit(cache=True, nogil=True)
def downsampled(
    values: FloatArray, counted: FloatArray, side: int
) -> tuple[FloatArray, FloatArray]:
    """Averages (n, side²) of views (n, 1024) over what counts in each cell, and how much counts."""
    views = len(values)
    cell = SIDE // side
    small = np.zeros((views, side * side), np.float32)
    mass = np.zeros((views, side * side), np.float32)
    for i in range(views):
        for y in range(SIDE):
            for x in range(SIDE):
                q = (y // cell) * side + x // cell
                count = counted[i, y * SIDE + x]
                mass[i, q] += count
                small[i, q] += count * values[i, y * SIDE + x]
        for q in range(side * side):
            if mass[i, q] > 0.0:
                small[i, q] /= mass[i, q]
    return small, mass


@njit(cache=True, nogil=True)
def sharpen(
    values: FloatArray,
    counted: FloatArray,
    factors: Factors,
    side: int,
    steps: int,
) -> None:
    """Take images (r, side * side), in place, towards those that are nearest to views, upsampled.

    values, counted (n, 1024). Averages of cells are too smooth once they are interpolated. Steps of
    the gradient, each entry divided by the sum of what it and all others do to the texels it
    touches, which can only lower the error.
    """
    means, weights, planes = factors
    rank = len(planes)
    views, texels = values.shape
    step = np.zeros((rank, side * side), np.float32)
    plane = np.empty(side * side, np.float32)
    total = np.zeros(texels, np.float32)
    for k in range(rank):
        total[:] = 0.0
        for i in range(views):
            reach = np.float32(0.0)
            for m in range(rank):
                reach += abs(weights[i, m])
            reach *= abs(weights[i, k])
            for p in range(texels):
                total[p] += reach * counted[i, p]
        upsampled_transpose(total, side, plane)
        for q in range(side * side):
            if plane[q] > 1e-3:
                step[k, q] = 1.0 / plane[q]
    off = np.empty((views, texels), np.float32)
    for _ in range(steps):
        large = upsampled(planes, side)
        for i in range(views):
            for p in range(texels):
                off[i, p] = values[i, p] - means[i]
            for k in range(rank):
                weight = weights[i, k]
                for p in range(texels):
                    off[i, p] -= weight * large[k, p]
            for p in range(texels):
                off[i, p] *= counted[i, p]
        for k in range(rank):
            total[:] = 0.0
            for i in range(views):
                weight = weights[i, k]
                for p in range(texels):
                    total[p] += weight * off[i, p]
            upsampled_transpose(total, side, plane)
            for q in range(side * side):
                planes[k, q] += step[k, q] * plane[q]


@njit(cache=True, nogil=True)
def fill_unknown(planes: FloatArray, counted: FloatArray, side: int) -> None:
    """Planes (r, side * side), in place, where no view's ``counted`` (n, side * side) is above 0.

    Texels take the mean of the known ones around them, a rim of ``_RIM`` texels: little holes are
    opaque, and at outlines the shader interpolates with what lies outside.
    """
    known = np.zeros((side, side), np.bool_)
    for i in range(len(counted)):
        for q in range(side * side):
            if counted[i, q] > 0.0:
                known[q // side, q % side] = True
    for _ in range(_RIM):
        before = known.copy()
        for y in range(side):
            for x in range(side):
                if before[y, x]:
                    continue
                around = 0
                for v in range(max(y - 1, 0), min(y + 2, side)):
                    for u in range(max(x - 1, 0), min(x + 2, side)):
                        around += before[v, u]
                if around == 0:
                    continue
                known[y, x] = True
                for k in range(len(planes)):
                    total = np.float32(0.0)
                    for v in range(max(y - 1, 0), min(y + 2, side)):
                        for u in range(max(x - 1, 0), min(x + 2, side)):
                            if before[v, u]:
                                total += planes[k, v * side + u]
                    planes[k, y * side + x] = total / np.float32(around)
