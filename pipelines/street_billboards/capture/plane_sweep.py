"""Depth of one camera from photographs that it took along the road: plane sweep.

Collins, A space-sweep approach to true multi-image matching, CVPR 1996. Each inverse depth says
where a pixel lies in the other photographs; where it looks most alike there it is. What is nearer
in another photograph is larger there: windows are compared at the scale at which they are alike.
Of the other photographs the better half counts, pixel by pixel: what hides a thing from those
behind does not hide it from those ahead (Kang, Szeliski and Chai, Handling occlusions in dense
multi-view stereo, CVPR 2001).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.capture.census import Bits, bits_set, census
from pipelines.street_billboards.capture.depth_refinement import Partner, refine_disparities
from pipelines.street_billboards.capture.semi_global import Labels, semi_global_labels

FloatArray = NDArray[np.float64]
Map = NDArray[np.float32]

_LABELS = 128
"""Inverse depths that are asked about, in equal steps from nothing to the nearest."""
_WIDE = 512
"""Pixels across from which on every second one is looked for: the rest follows from these."""
_SCALES = (2.0, 1.6, 1.25, 1.0, 0.8, 0.64, 0.5, 0.4)
"""Of what another photograph is looked at with, where its surroundings are so much larger there."""
_STEPS = 32
"""Of a ratio of scales, to each of which the best of these scales is looked up."""
_LEAST_RATIO, _MOST_RATIO = np.float32(0.35), np.float32(2.3)
"""Of depths in another photograph and in ours, between which they are compared."""
_UNSEEN = np.uint8(255)
_BY_CHANCE = np.uint8(31)
"""Bits that differ where no photograph can tell."""
_LEAST_MARGIN = 0.01
"""How much dearer the second best inverse depth is where the best one counts."""
_FINE, _ROUGH = 0.4, 1.8
"""Pixels, standard deviation of a match where photographs tell most, and least."""
_MOST_DEVIATION = 0.15
"""Of the depth: what is less sure is unknown."""


class Photograph(NamedTuple):
    """A photograph and what took it."""

    pixels: NDArray[np.uint8]
    """(h, w, 3), sRGB."""
    intrinsics: FloatArray
    """(3, 3), pixels."""
    pose: FloatArray
    """(4, 4), from the camera's axes to the world's."""


class SweptDepth(NamedTuple):
    """Of one photograph."""

    depth: Map
    """(h, w), metres along the axis; nan where unknown."""
    deviation: Map
    """(h, w), the standard deviation to expect, metres; nan where unknown."""


def sweep_depth(
    photograph: Photograph,
    others: Sequence[Photograph],
    *,
    nearest: float = 2.0,
    farthest: float = 40.0,
) -> SweptDepth:
    """Depth of a photograph by others of the same size, which saw the same from elsewhere.

    nearest, farthest: metres; what is not between them is unknown. Exposures may differ. What lies
    in the way that the cameras went hardly moves in their pictures: its deviation is wide. What
    moves on its own is not told from what stands still: see ``drive_depth``. Raises ValueError
    without other photographs.

    >>> picture = np.random.default_rng(0).integers(0, 255, (64, 192, 3), np.uint8)
    >>> lens = np.array([[200.0, 0, 95.5], [0, 200, 31.5], [0, 0, 1]])
    >>> beside = np.eye(4)
    >>> beside[0, 3] = 1.0  # a wall at 5 m is seen 40 pixels to the left from there
    >>> moved = Photograph(np.roll(picture, -40, axis=1), lens, beside)
    >>> found = sweep_depth(Photograph(picture, lens, np.eye(4)), [moved])
    >>> round(float(np.nanmedian(found.depth)), 1)
    5.0
    """
    if not others:
        raise ValueError("others: found no photograph; expected one from elsewhere at least.")
    step = 1.0 / nearest / (_LABELS - 2)
    turns, shifts = _ways(photograph, others, step)
    grey = _grey(photograph.pixels)
    greys = [_grey(other.pixels) for other in others]
    coarse = 2 if grey.shape[1] >= _WIDE else 1
    labels = _labels(grey, greys, turns, shifts, coarse)
    value = np.where(labels.margin >= _LEAST_MARGIN, labels.value, np.float32(np.nan))
    value = _repeated(value, coarse, grey.shape)
    partners = list(map(Partner, [one.astype(np.float32) for one in greys], turns, shifts))
    pixels = np.ascontiguousarray(photograph.pixels)
    fine, told = refine_disparities(value, pixels, grey.astype(np.float32), partners)
    moving = _pixels_a_label(fine, turns, shifts)
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = 1.0 / (fine * step)
        spread = (_ROUGH * (1 - told) + _FINE * told) / moving
        deviation = depth * spread / fine
        known = (depth >= nearest) & (depth <= farthest) & (deviation <= _MOST_DEVIATION * depth)
    return SweptDepth(
        np.where(known, depth, np.nan).astype(np.float32),
        np.where(known, deviation, np.nan).astype(np.float32),
    )


def _ways(photograph: Photograph, others: Sequence[Photograph], step: float) -> tuple[Map, Map]:
    """Turns (k, 3, 3) and shifts (k, 3) of ``Partner`` for labels of ``step`` / m."""
    turns, shifts = [], []
    for other in others:
        way = np.linalg.inv(other.pose) @ photograph.pose
        turns.append(other.intrinsics @ way[:3, :3] @ np.linalg.inv(photograph.intrinsics))
        shifts.append(other.intrinsics @ way[:3, 3] * step)
    return np.array(turns, np.float32), np.array(shifts, np.float32)


def _grey(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels), cv2.COLOR_RGB2GRAY), np.uint8)


def _repeated(values: Map, times: int, shape: tuple[int, ...]) -> Map:
    """Of this shape (h, w), each value for so many pixels across and down."""
    rows, columns = (
        np.minimum(np.arange(size) // times, count - 1)
        for size, count in zip(shape, values.shape, strict=True)
    )
    return values[rows[:, None], columns]


def _labels(
    grey: NDArray[np.uint8],
    greys: Sequence[NDArray[np.uint8]],
    turns: Map,
    shifts: Map,
    coarse: int,
) -> Labels:
    """Labels of the picture at one so-manieth of its size."""
    height, width = grey.shape
    small = _resized(grey, 1 / coarse)
    pyramids = [[census(_resized(one, s / coarse)) for s in _SCALES] for one in greys]
    shapes = np.array([one.shape for one in pyramids[0]], np.int64)
    starts = np.concatenate([[0], np.cumsum(shapes.prod(axis=1))])
    flat = np.stack([np.concatenate([one.ravel() for one in each]) for each in pyramids])
    ratios = np.arange(int(_MOST_RATIO * _STEPS) + 2) / _STEPS + 0.5 / _STEPS
    level = np.abs(np.log(ratios)[:, None] - np.log(_SCALES)[None]).argmin(axis=1)
    costs = _sweep(census(small), flat, starts, shapes, level, (height, width), turns, shifts)
    return semi_global_labels(costs, small)


def _resized(grey: NDArray[np.uint8], scale: float) -> NDArray[np.uint8]:
    height, width = grey.shape
    size = max(round(width * scale), 1), max(round(height * scale), 1)
    if size == (width, height):
        return grey
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), np.uint8)


@njit(cache=True, nogil=True, error_model="numpy")
def _sweep(
    ours: Bits,
    theirs: Bits,
    starts: NDArray[np.int64],
    shapes: NDArray[np.int64],
    level: NDArray[np.int64],
    size: tuple[int, int],
    turns: Map,
    shifts: Map,
) -> NDArray[np.uint8]:
    """Costs (h, w, labels), twice the bits that differ, of census (h, w) of ours and theirs."""
    rows, columns = ours.shape
    height, width = size
    across, down = np.float32(width / columns), np.float32(height / rows)
    others = len(theirs)
    costs = np.empty((rows, columns, _LABELS), np.uint8)
    each = np.empty((others, _LABELS), np.uint8)
    half, one = np.float32(0.5), np.float32(1.0)
    for y in range(rows):
        fy = (np.float32(y) + half) * down - half
        for x in range(columns):
            fx = (np.float32(x) + half) * across - half
            own = ours[y, x]
            for k in range(others):
                turn, shift = turns[k], shifts[k]
                u0 = turn[0, 0] * fx + turn[0, 1] * fy + turn[0, 2]
                v0 = turn[1, 0] * fx + turn[1, 1] * fy + turn[1, 2]
                w0 = turn[2, 0] * fx + turn[2, 1] * fy + turn[2, 2]
                for label in range(_LABELS):
                    d = np.float32(label)
                    ratio = w0 + d * shift[2]
                    each[k, label] = _UNSEEN
                    if not (ratio > _LEAST_RATIO and ratio < _MOST_RATIO):
                        continue
                    over = one / ratio
                    u = (u0 + d * shift[0]) * over + half
                    v = (v0 + d * shift[1]) * over + half
                    if not (u >= 0 and v >= 0 and u < width and v < height):
                        continue
                    s = level[int(ratio * np.float32(_STEPS))]
                    i = int(u * np.float32(shapes[s, 1]) / np.float32(width))
                    j = int(v * np.float32(shapes[s, 0]) / np.float32(height))
                    there = theirs[k, starts[s] + j * shapes[s, 1] + i]
                    each[k, label] = np.uint8(bits_set(own ^ there))
            _better_half(each, costs[y, x])
    return costs


@njit(cache=True, nogil=True)
def _better_half(each: NDArray[np.uint8], cost: NDArray[np.uint8]) -> None:
    """Twice the mean of the better half of what is seen, of (k, labels); sorts them."""
    others, labels = each.shape
    for turn in range(others):
        for k in range(turn % 2, others - 1, 2):
            for d in range(labels):
                low, high = min(each[k, d], each[k + 1, d]), max(each[k, d], each[k + 1, d])
                each[k, d] = low
                each[k + 1, d] = high
    for d in range(labels):
        seen = 0
        for k in range(others):
            seen += each[k, d] != _UNSEEN
        if seen == 0:
            cost[d] = 2 * _BY_CHANCE
            continue
        better = (seen + 1) // 2
        total = 0
        for k in range(better):
            total += each[k, d]
        cost[d] = np.uint8(2 * total // better)


@njit(cache=True, nogil=True, error_model="numpy")
def _pixels_a_label(value: Map, turns: Map, shifts: Map) -> Map:
    """How far a label moves each pixel (h, w) in the other photographs: root of the squares' sum.

    Of the better half of those that see it, at its label; nan where it has none.
    """
    height, width = value.shape
    moves = np.full((height, width), np.nan, np.float32)
    squares = np.empty(len(turns), np.float64)
    for y in range(height):
        for x in range(width):
            d = np.float64(value[y, x])
            if not d > 0:
                continue
            seen = 0
            for k in range(len(turns)):
                turn, shift = turns[k], shifts[k]
                ratio = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] + d * shift[2]
                if not (ratio > _LEAST_RATIO and ratio < _MOST_RATIO):
                    continue
                u = (turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] + d * shift[0]) / ratio
                v = (turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] + d * shift[1]) / ratio
                if not (u >= 0 and v >= 0 and u <= width - 1 and v <= height - 1):
                    continue
                du, dv = (shift[0] - u * shift[2]) / ratio, (shift[1] - v * shift[2]) / ratio
                squares[seen] = du * du + dv * dv
                seen += 1
            if seen:
                known = np.sort(squares[:seen])
                moves[y, x] = np.sqrt(known[: (seen + 1) // 2].sum())
    return moves
