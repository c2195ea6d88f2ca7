"""Medians of the disparities of pixels that look alike: at edges, and in holes.

The window's pixels are weighted by likeness and distance (Ma et al., Constant time weighted median
filtering for stereo matching and beyond, ICCV 2013).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Map = NDArray[np.float32]
Photograph = NDArray[np.uint8]

_STEP = 1.0
"""Pixels of disparity that make an edge."""


def fill_disparity_holes(disparity: Map, photograph: Photograph) -> Map:
    """Disparities (h, w) everywhere: holes take the far side's, then that of pixels alike.

    What only one camera sees lies behind what hides it from the other. Holes of whole rows take the
    nearest row's. All nan where nothing is known.
    """
    known = np.isfinite(disparity)
    if not known.any():
        return disparity.copy()
    dense = _from_the_sides(disparity)
    rows = np.flatnonzero(known.any(axis=1))
    nearest = rows[np.abs(np.arange(len(dense))[:, None] - rows[None, :]).argmin(axis=1)]
    dense = dense[nearest]
    return np.asarray(weighted_median(dense, photograph, ~known, 9, 1))


@njit(cache=True, nogil=True)
def _from_the_sides(disparity: Map) -> Map:
    height, width = disparity.shape
    dense = disparity.copy()
    for y in range(height):
        last = np.float32(np.nan)
        x = 0
        while x < width:
            if np.isfinite(disparity[y, x]):
                last = disparity[y, x]
                x += 1
                continue
            end = x
            while end < width and not np.isfinite(disparity[y, end]):
                end += 1
            following = disparity[y, end] if end < width else np.float32(np.nan)
            value = last
            if not np.isfinite(last) or following < last:
                value = following
            dense[y, x:end] = value
            x = end
    return dense


@njit(cache=True, nogil=True)
def disparity_edges(disparity: Map) -> NDArray[np.bool_]:
    """Pixels with a step of disparity within four pixels beside, or two above or below."""
    height, width = disparity.shape
    edge = np.zeros((height, width), np.bool_)
    for y in range(height):
        for x in range(width):
            here = disparity[y, x]
            if not np.isfinite(here):
                continue
            for away in range(1, 5):
                # A slanted surface changes, too: by less than this for each pixel.
                step = _STEP + 0.4 * away
                if (x >= away and abs(disparity[y, x - away] - here) > step) or (
                    x + away < width and abs(disparity[y, x + away] - here) > step
                ):
                    edge[y, x] = True
                    break
                if away <= 2 and (
                    (y >= away and abs(disparity[y - away, x] - here) > step + 0.2 * away)
                    or (
                        y + away < height and abs(disparity[y + away, x] - here) > step + 0.2 * away
                    )
                ):
                    edge[y, x] = True
                    break
    return edge


@njit(cache=True, nogil=True)
def weighted_median(
    disparity: Map, photograph: Photograph, asked: NDArray[np.bool_], side: int, step: int
) -> Map:
    """Where asked, the median of the window's disparities, weighted by likeness and distance.

    The window reaches ``side`` pixels to each side; each ``step``-th of them has a vote.
    """
    height, width = disparity.shape
    answer = disparity.copy()
    most = (2 * side // step + 1) ** 2
    values, weights = np.empty(most, np.float32), np.empty(most, np.float32)
    likeness = np.exp(-np.arange(766) / 30.0).astype(np.float32)
    closeness = np.empty((side + 1, side + 1), np.float32)
    for j in range(side + 1):
        for i in range(side + 1):
            closeness[j, i] = np.exp(-np.sqrt(i * i + j * j) / 6.0)
    for y in range(height):
        for x in range(width):
            if not asked[y, x]:
                continue
            red, green, blue = photograph[y, x]
            count = 0
            total = np.float32(0.0)
            for j in range(-side, side + 1, step):
                v = y + j
                if v < 0 or v >= height:
                    continue
                for i in range(-side, side + 1, step):
                    u = x + i
                    if u < 0 or u >= width or not np.isfinite(disparity[v, u]):
                        continue
                    apart = (
                        abs(np.int32(photograph[v, u, 0]) - np.int32(red))
                        + abs(np.int32(photograph[v, u, 1]) - np.int32(green))
                        + abs(np.int32(photograph[v, u, 2]) - np.int32(blue))
                    )
                    weight = likeness[apart] * closeness[abs(j), abs(i)]
                    values[count] = disparity[v, u]
                    weights[count] = weight
                    total += weight
                    count += 1
            below = np.float32(0.0)
            for k in np.argsort(values[:count]):
                below += weights[k]
                if below >= 0.5 * total:
                    answer[y, x] = values[k]
                    break
    return answer
