"""Disparities made better by the photographs they come from: at edges, and below a pixel.

Semi-global matching is right to a fraction of a pixel, prefers whole ones, and spreads what is near
over what is beside it. Three steps mend that:

- at edges a pixel takes the disparity of the pixels around it that look like it: the median,
  weighted by likeness and distance (``weighted_median``);
- a plane through each pixel's surroundings tells how disparity changes across its window, and the
  window is moved along that plane until the photographs agree (Lucas and Kanade 1981; the slanted
  window: Bleyer et al., PatchMatch stereo, BMVC 2011);
- a plane through the surroundings again, for what noise is left.

Disparities are pixels; nan: unknown. What is unknown stays so.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.capture.slanted_windows import (
    RELAXED,
    RUN,
    fit_disparity_planes,
    padded_to_runs,
)
from pipelines.street_billboards.capture.weighted_median import disparity_edges, weighted_median

Map = NDArray[np.float32]
Photograph = NDArray[np.uint8]

_SIDE = 2
"""Pixels that a window reaches to each side."""
_DAMPING = np.float32(120.0)
"""Squared grey levels a pixel that texture is weighed against: what noise looks like."""
_FARTHEST = np.float32(0.6)
"""Pixels: what lies farther from the matching's answer is another match."""
_ON_PLANE = np.float32(0.5)
"""Pixels from a window's plane within which it is one surface."""


class Partner(NamedTuple):
    """Another photograph: the pixel p of disparity d is at turn @ (x, y, 1) + d * shift in it."""

    grey: Map
    """(h, w), in grey levels of 256, at the first photograph's exposure or not."""
    turn: Map
    """(3, 3)."""
    shift: Map
    """(3,)."""


def rectified_partner(grey: Map, sign: int) -> Partner:
    """The other photograph of a rectified pair; sign -1: it is the right one, 1: the left one."""
    return Partner(grey, np.eye(3, dtype=np.float32), np.array([sign, 0, 0], np.float32))


def refine_disparities(
    disparity: Map, photograph: Photograph, grey: Map, partners: list[Partner]
) -> tuple[Map, Map]:
    """Refined disparities (h, w) and, in [0, 1], how much the photographs had to say of each.

    photograph (h, w, 3) sRGB and grey (h, w) of the same camera. Partners may be occluded: those
    that look different are left out, pixel by pixel.
    """
    cleaned = weighted_median(disparity, photograph, disparity_edges(disparity), 6, 2)
    smooth, across, down = fit_disparity_planes(cleaned, 2, 0.5)
    ours = np.ascontiguousarray(grey, dtype=np.float32)
    compared = [
        _grey_differences(smooth, ours, one.grey.astype(np.float32), one.turn, one.shift)
        for one in partners
    ]
    errors, slopes = (np.stack(both) for both in zip(*compared, strict=True))
    moved, told = _moved(smooth, across, down, ours, errors, slopes)
    answer = fit_disparity_planes(moved, 2, 0.4)[0]
    # There, windows hold two surfaces.
    told[disparity_edges(answer)] *= 0.5
    return answer, told


@njit(cache=True, nogil=True, fastmath=RELAXED, error_model="numpy")
def _grey_differences(
    disparity: Map, grey: Map, other: Map, turn: Map, shift: Map
) -> tuple[Map, Map]:
    """How much brighter each pixel is than in the other photograph, and how that would change.

    Grey levels, and grey levels a pixel of disparity; slope nan where the other does not see it.
    """
    height, width = disparity.shape
    rows, columns = other.shape
    error = np.zeros((height, width), np.float32)
    slope = np.full((height, width), np.nan, np.float32)
    seen = np.zeros(2, np.float32)
    one = np.float32(1.0)
    for y in range(height):
        for x in range(width):
            if disparity[y, x] != disparity[y, x]:
                continue
            fx, fy = np.float32(x), np.float32(y)
            inside = True
            for k in range(2):
                d = disparity[y, x] + (np.float32(0.5) if k else np.float32(-0.5))
                w = one / (turn[2, 0] * fx + turn[2, 1] * fy + turn[2, 2] + d * shift[2])
                u = (turn[0, 0] * fx + turn[0, 1] * fy + turn[0, 2] + d * shift[0]) * w
                v = (turn[1, 0] * fx + turn[1, 1] * fy + turn[1, 2] + d * shift[1]) * w
                # The last row has no next: half a pixel of slack, not to lose it.
                if not (u >= 0 and v >= -0.5 and u < columns - 1 and v < rows - 0.5):
                    inside = False
                    break
                v = min(max(v, np.float32(0.0)), np.float32(rows - 1.001))
                g, h = int(u), int(v)
                f, t = u - np.float32(g), v - np.float32(h)
                top = other[h, g] + (other[h, g + 1] - other[h, g]) * f
                low = other[h + 1, g] + (other[h + 1, g + 1] - other[h + 1, g]) * f
                seen[k] = top + (low - top) * t
            if inside:
                error[y, x] = grey[y, x] - np.float32(0.5) * (seen[0] + seen[1])
                slope[y, x] = seen[1] - seen[0]
    return error, slope


def _moved(
    disparity: Map, across: Map, down: Map, grey: Map, errors: Map, slopes: Map
) -> tuple[Map, Map]:
    """One step of Gauss and Newton for each pixel's window, and how much the photographs told.

    errors, slopes (k, h, w): as ``_grey_differences`` has them. Each partner's differences count
    less their mean: what it sees may be brighter there.
    """
    height, width = disparity.shape
    step, told = _steps_of_runs(
        padded_to_runs(disparity, _SIDE),
        padded_to_runs(across, _SIDE),
        padded_to_runs(down, _SIDE),
        padded_to_runs(grey, _SIDE),
        padded_to_runs(errors, _SIDE),
        padded_to_runs(slopes, _SIDE),
        height,
        width,
    )
    taken = np.abs(step) <= _FARTHEST
    return np.where(taken, disparity + step, disparity), np.where(taken, told, 0)


@njit(cache=True, nogil=True, fastmath=RELAXED, error_model="numpy")
def _steps_of_runs(
    disparity: Map,
    across: Map,
    down: Map,
    grey: Map,
    errors: Map,
    slopes: Map,
    height: int,
    width: int,
) -> tuple[Map, Map]:
    steps, told = np.zeros((height, width), np.float32), np.zeros((height, width), np.float32)
    sums = np.zeros(6 * RUN, np.float32)
    pull, push = np.zeros(RUN, np.float32), np.zeros(RUN, np.float32)
    one, none = np.float32(1.0), np.float32(0.0)
    for y in range(height):
        row = y + _SIDE
        for start in range(0, width, RUN):
            begin = start + _SIDE
            here, own = disparity[row, begin : begin + RUN], grey[row, begin : begin + RUN]
            ax, ay = across[row, begin : begin + RUN], down[row, begin : begin + RUN]
            pull[:] = none
            push[:] = none
            for k in range(len(errors)):
                sums[:] = none
                for j in range(-_SIDE, _SIDE + 1):
                    for i in range(-_SIDE, _SIDE + 1):
                        fi, fj = np.float32(i), np.float32(j)
                        at = begin + i
                        there = disparity[row + j, at : at + RUN]
                        looks = grey[row + j, at : at + RUN]
                        e = errors[k, row + j, at : at + RUN]
                        g = slopes[k, row + j, at : at + RUN]
                        for x in range(RUN):
                            # The plane at that pixel, less the disparity it was compared at.
                            ahead = here[x] + ax[x] * fi + ay[x] * fj - there[x]
                            counts = (abs(ahead) < _ON_PLANE) & (g[x] == g[x])
                            slope = g[x] if counts else none
                            error = e[x] - g[x] * ahead if counts else none
                            unlike = looks[x] - own[x]
                            w = one / (one + unlike * unlike * np.float32(1 / 800))
                            w = w if counts else none
                            sums[x] += w
                            sums[RUN + x] += w * error
                            sums[2 * RUN + x] += w * slope
                            sums[3 * RUN + x] += w * error * slope
                            sums[4 * RUN + x] += w * slope * slope
                            sums[5 * RUN + x] += w * error * error
                for x in range(RUN):
                    weight, e_sum, g_sum = sums[x], sums[RUN + x], sums[2 * RUN + x]
                    each = one / max(weight, one)
                    both = sums[3 * RUN + x] - e_sum * g_sum * each
                    square = sums[4 * RUN + x] - g_sum * g_sum * each
                    spread = (sums[5 * RUN + x] - e_sum * e_sum * each) * each
                    # What does not look alike is hidden there.
                    sure = one / (one + spread * np.float32(1 / 150))
                    sure = sure if weight >= 2 else none
                    pull[x] += sure * both
                    push[x] += sure * square
            for x in range(min(RUN, width - start)):
                steps[y, start + x] = pull[x] / (push[x] + _DAMPING)
                told[y, start + x] = push[x] / (push[x] + _DAMPING)
    return steps, told
