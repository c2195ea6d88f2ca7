"""Semi-global matching of any cost volume: what neighbouring pixels agree on, along eight paths.

Hirschmüller, Stereo processing by semiglobal matching and mutual information, PAMI 2008. Where the
photograph has an edge, a step between two surfaces costs less.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Costs = NDArray[np.uint8]
Map = NDArray[np.float32]
Grey = NDArray[np.uint8]

_SMALL, _LARGE = np.float32(6.0), np.float32(60.0)
"""What a step of one label and of more costs, in the costs' unit."""
_EDGE = np.float32(12.0)
"""Grey levels between two pixels at which a step costs half."""


class Labels(NamedTuple):
    """The label of least cost of each pixel."""

    value: Map
    """(h, w), labels, with fractions; nan where the first or the last one is the best."""
    margin: Map
    """(h, w): how much dearer the best label is that is not beside it, over what the best costs."""


def semi_global_labels(costs: Costs, grey: Grey) -> Labels:
    """The labels of costs (h, w, n) that agree with those around them; grey (h, w) of the pixels.

    n >= 3. The fraction of a label is a parabola's through the three costs around the least.
    """
    total = np.zeros(costs.shape, np.float32)
    _aggregated(costs, grey, total)
    # From below and from the right is from above and from the left, turned around.
    _aggregated(costs[::-1, ::-1], grey[::-1, ::-1], total[::-1, ::-1])
    return Labels(*_least(total))


@njit(cache=True, nogil=True, fastmath={"nsz", "nnan"})
def _aggregated(costs: Costs, grey: Grey, total: Map) -> None:
    """Adds what four paths to each pixel cost: from the left and from the three above."""
    height, width, labels = costs.shape
    # A label before the first and one after the last, which nothing comes from.
    above = np.full((2, 3, width + 2, labels + 2), np.float32(1e6), np.float32)
    left = np.full((2, labels + 2), np.float32(1e6), np.float32)
    least = np.zeros((2, 3, width + 2), np.float32)
    for y in range(height):
        now, last = y % 2, 1 - y % 2
        least_left = np.float32(0.0)
        for x in range(width):
            own = costs[y, x]
            sums = total[y, x]
            if x == 0:
                for d in range(labels):
                    left[0, d + 1] = np.float32(own[d])
                    sums[d] += np.float32(own[d])
                least_left = _least_of(left[0])
            else:
                into, out = x % 2, 1 - x % 2
                _step(
                    own, left[out], least_left, _price(grey[y, x], grey[y, x - 1]), left[into], sums
                )
                least_left = _least_of(left[into])
            for k in range(3):
                u = x + k - 1
                new = above[now, k, x + 1]
                if y == 0 or u < 0 or u >= width:
                    for d in range(labels):
                        new[d + 1] = np.float32(own[d])
                        sums[d] += np.float32(own[d])
                else:
                    _step(
                        own,
                        above[last, k, u + 1],
                        least[last, k, u + 1],
                        _price(grey[y, x], grey[y - 1, u]),
                        new,
                        sums,
                    )
                least[now, k, x + 1] = _least_of(new)
            if x == 0:
                for d in range(labels + 2):
                    left[1, d] = np.float32(1e6)


@njit(cache=True, nogil=True)
def _price(one: int, other: int) -> np.float32:
    """Of a step between two pixels of these greys."""
    apart = np.float32(abs(np.int32(one) - np.int32(other)))
    return max(_LARGE / (np.float32(1.0) + apart / _EDGE), np.float32(1.5) * _SMALL)


@njit(cache=True, nogil=True, fastmath={"nsz", "nnan"})
def _step(
    own: Costs, before: Map, least: np.float32, jump: np.float32, new: Map, sums: Map
) -> None:
    dearest = least + jump
    for d in range(len(own)):
        beside = min(before[d], before[d + 2]) + _SMALL
        best = min(min(before[d + 1], beside), dearest)
        cost = np.float32(own[d]) + best - least
        new[d + 1] = cost
        sums[d] += cost


@njit(cache=True, nogil=True, fastmath={"nsz", "nnan"})
def _least_of(values: Map) -> np.float32:
    least = np.float32(1e6)
    for d in range(1, len(values) - 1):
        least = min(least, values[d])
    return least


@njit(cache=True, nogil=True)
def _least(total: Map) -> tuple[Map, Map]:
    height, width, labels = total.shape
    value = np.full((height, width), np.nan, np.float32)
    margin = np.zeros((height, width), np.float32)
    for y in range(height):
        for x in range(width):
            sums = total[y, x]
            best = int(np.argmin(sums))
            if best == 0 or best == labels - 1:
                continue
            other = np.float32(1e9)
            for d in range(labels):
                if abs(d - best) > 2:
                    other = min(other, sums[d])
            here, low, high = sums[best], sums[best - 1], sums[best + 1]
            bend = low + high - np.float32(2.0) * here
            offset = np.float32(0.5) * (low - high) / bend if bend > 0 else np.float32(0.0)
            value[y, x] = np.float32(best) + offset
            margin[y, x] = (other - here) / max(here, np.float32(1.0))
    return value, margin
