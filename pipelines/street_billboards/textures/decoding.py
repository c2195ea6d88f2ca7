"""Eigen-textures decoded on the CPU, for viewers anywhere (Eq. 1), as the shader does it.

Between two stored views, weights and means are interpolated: Eq. 1 is linear in them, so that is
the interpolation of the views. The paper compares drawing frames with this to decoding in the
shader.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.textures.coded_arrays import offsets
from pipelines.street_billboards.textures.plane_resolution import sample_places
from pipelines.street_billboards.textures.texture_tables import (
    SEEN,
    SIDE,
    CompressedTextures,
    ViewTextures,
)

Planes = tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]
Scales = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
Offsets = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]


class Decodable(NamedTuple):
    """The arrays of CompressedTextures with where each billboard's part of them begins."""

    luma_chroma: bool
    first: NDArray[np.int64]
    direction: NDArray[np.uint8]
    means: NDArray[np.uint8]
    ranks: NDArray[np.uint8]
    planes: Planes
    """By channel, (r, side, side)."""
    scales: Scales
    weights: Planes
    first_plane: Offsets
    """By channel, (b + 1,), of planes and scales."""
    first_weight: Offsets
    """By channel, (b + 1,), of weights."""
    first_mask: NDArray[np.int64]
    masks: NDArray[np.uint8]


class ViewPair(NamedTuple):
    """The two stored views between which a viewer stands, counted from the billboard's first."""

    lower: int
    upper: int
    fraction: float
    """Share of the upper one."""


def decodable(textures: CompressedTextures) -> Decodable:
    """What the kernels read; make it once for many frames."""
    views = np.diff(textures.first)
    ranks = textures.ranks.astype(np.int64)
    planes = [offsets(ranks[:, c]) for c in range(3)]
    weights = [offsets(ranks[:, c] * views) for c in range(3)]
    return Decodable(
        textures.colour == "ycocg",
        textures.first,
        textures.direction,
        textures.means,
        textures.ranks,
        textures.planes,
        textures.scales,
        textures.weights,
        (planes[0], planes[1], planes[2]),
        (weights[0], weights[1], weights[2]),
        textures.first_mask,
        textures.masks,
    )


def decode_views(
    textures: CompressedTextures | Decodable,
    billboards: NDArray[np.integer],
    position: NDArray[np.floating],
    out: NDArray[np.uint8],
) -> None:
    """Textures of k billboards as their viewers see them, into ``out`` (k, 32, 32, 4) uint8.

    billboards (k,): rows; position (k,): where the viewer stands in each one's fan, as
    ``fan_position`` says. Channels are R, G, B, rounded, and alpha, 0 or 255: of the mask, or of
    two views' masks interpolated like the colours, opaque from one half on. A billboard without a
    view is transparent.
    """
    data = textures if isinstance(textures, Decodable) else decodable(textures)
    _decode_many(data, billboards.astype(np.int64), position.astype(np.float64), out)


@njit(cache=True, nogil=True)
def view_pair(direction: NDArray[np.uint8], position: float) -> ViewPair:
    """The views around a place in the fan; directions (n,) rise. Beyond the ends, one view twice.

    fraction: (position - lower direction) / (upper - lower direction).
    """
    lower, last = 0, len(direction) - 1
    if position <= direction[0]:
        return ViewPair(lower, lower, 0.0)
    if position >= direction[last]:
        return ViewPair(last, last, 0.0)
    while direction[lower + 1] <= position:
        lower += 1
    begin, end = float(direction[lower]), float(direction[lower + 1])
    return ViewPair(lower, lower + 1, (position - begin) / (end - begin))


@njit(cache=True, nogil=True, fastmath=True)
def _add_planes(
    planes: NDArray[np.uint8],
    scales: NDArray[np.float32],
    lower: NDArray[np.uint8],
    upper: NDArray[np.uint8],
    fraction: float,
    mean: float,
    out: NDArray[np.float32],
) -> None:
    """One channel of Eq. 1, in codes, into ``out`` (32, 32); planes, scales and weights of two
    views are of one billboard."""
    side = planes.shape[1]
    small = np.full((side, side), np.float32(mean), np.float32)
    for k in range(len(planes)):
        weight = (1.0 - fraction) * lower[k] + fraction * upper[k] - 128.0
        amount = np.float32(scales[k] * weight / (127.0 * 127.0))
        for y in range(side):
            for x in range(side):
                small[y, x] += amount * np.float32(np.int32(planes[k, y, x]) - 128)
    if side == SIDE:
        out[:] = small
        return
    before, after, share = sample_places(side)
    row = np.empty(side, np.float32)
    for y in range(SIDE):
        for x in range(side):
            top = small[before[y], x]
            row[x] = top + share[y] * (small[after[y], x] - top)
        for x in range(SIDE):
            left = row[before[x]]
            out[y, x] = left + share[x] * (row[after[x]] - left)


@njit(cache=True, nogil=True)
def decode_colours(
    data: Decodable, billboard: int, pair: ViewPair, out: NDArray[np.float32]
) -> None:
    """Colours between two views of a billboard into ``out`` (3, 32, 32), codes, clamped."""
    for channel in range(3):
        _decode_channel(data, channel, billboard, pair, out[channel])
    for y in range(SIDE):
        for x in range(SIDE):
            red, green, blue = out[0, y, x], out[1, y, x], out[2, y, x]
            if data.luma_chroma:
                luma, orange, leaf = red, green - np.float32(128.0), blue - np.float32(128.0)
                red, green, blue = luma + orange - leaf, luma + leaf, luma - orange - leaf
            out[0, y, x] = min(max(red, np.float32(0.0)), np.float32(255.0))
            out[1, y, x] = min(max(green, np.float32(0.0)), np.float32(255.0))
            out[2, y, x] = min(max(blue, np.float32(0.0)), np.float32(255.0))


@njit(cache=True, nogil=True)
def _decode_channel(
    data: Decodable, channel: int, billboard: int, pair: ViewPair, out: NDArray[np.float32]
) -> None:
    rank = np.int64(data.ranks[billboard, channel])
    plane = data.first_plane[channel][billboard]
    planes = slice(plane, plane + rank)
    lower = data.first_weight[channel][billboard] + pair.lower * rank
    upper = data.first_weight[channel][billboard] + pair.upper * rank
    weights, first = data.weights[channel], data.first[billboard]
    mean = (1.0 - pair.fraction) * data.means[first + pair.lower, channel]
    mean += pair.fraction * data.means[first + pair.upper, channel]
    _add_planes(
        data.planes[channel][planes],
        data.scales[channel][planes],
        weights[lower : lower + rank],
        weights[upper : upper + rank],
        pair.fraction,
        mean,
        out,
    )


@njit(cache=True, nogil=True)
def _decode_many(
    data: Decodable,
    billboards: NDArray[np.int64],
    position: NDArray[np.float64],
    out: NDArray[np.uint8],
) -> None:
    colours = np.empty((3, SIDE, SIDE), np.float32)
    for j in range(len(billboards)):
        b = billboards[j]
        begin, end = data.first[b], data.first[b + 1]
        if begin == end:
            out[j] = 0
            continue
        pair = view_pair(data.direction[begin:end], position[j])
        decode_colours(data, b, pair, colours)
        mask = data.first_mask[b]
        each = data.first_mask[b + 1] - mask > 1
        one = data.masks[mask + (pair.lower if each else 0)]
        other = data.masks[mask + (pair.upper if each else 0)]
        # One half is opaque: the upper view decides from the middle on.
        nearer = other if pair.fraction > 0.5 else one
        for y in range(SIDE):
            for x in range(SIDE):
                for c in range(3):
                    out[j, y, x, c] = np.uint8(colours[c, y, x] + np.float32(0.5))
                bit = 128 >> (x & 7)
                opaque = (nearer[y, x >> 3] & bit) != 0
                if pair.fraction == 0.5:
                    opaque = opaque or (other[y, x >> 3] & bit) != 0
                out[j, y, x, 3] = 255 if opaque else 0


@njit(cache=True, nogil=True)
def squared_errors_of_seen(
    data: Decodable, views: ViewTextures, total: NDArray[np.float64]
) -> None:
    """Sums of squares of errors of rounded colours of SEEN texels, into ``total`` (b,).

    Views are found by their direction.
    """
    buffer = np.empty((3, SIDE, SIDE), np.float32)
    for b in range(len(total)):
        total[b] = 0.0
        for i in range(views.first[b], views.first[b + 1]):
            begin, end = data.first[b], data.first[b + 1]
            pair = view_pair(data.direction[begin:end], float(views.direction[i]))
            decode_colours(data, b, pair, buffer)
            for y in range(SIDE):
                for x in range(SIDE):
                    if views.states[i, y, x] == SEEN:
                        for c in range(3):
                            code = np.int64(buffer[c, y, x] + np.float32(0.5))
                            off = code - np.int64(views.colours[i, y, x, c])
                            total[b] += off * off
