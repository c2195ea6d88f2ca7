"""Census: how each pixel's surroundings compare with it, whatever the exposure, in 62 bits.

Zabih and Woodfill, Non-parametric local transforms for computing visual correspondence, ECCV 1994.
Two windows differ by the number of bits that do.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

Bits = NDArray[np.uint64]
Grey = NDArray[np.uint8]

_ACROSS, _DOWN = 4, 3
"""Pixels that a window reaches to each side, and up and down: 9 x 7."""
MOST_BITS = (2 * _ACROSS + 1) * (2 * _DOWN + 1) - 1


def census(grey: Grey) -> Bits:
    """Of each pixel (h, w), one bit for each of the 62 around it: set where that one is darker.

    >>> picture = np.random.default_rng(0).integers(0, 120, (9, 12), np.uint8)
    >>> bool((census(picture) == census(2 * picture)).all())
    True
    """
    padded = cv2.copyMakeBorder(grey, _DOWN, _DOWN, _ACROSS, _ACROSS, cv2.BORDER_REPLICATE)
    return np.asarray(_compared(np.asarray(padded, np.uint8), *grey.shape))


@njit(cache=True, nogil=True)
def _compared(padded: Grey, height: int, width: int) -> Bits:
    bits = np.zeros((height, width), np.uint64)
    one = np.uint64(1)
    for y in range(height):
        own = bits[y]
        here = padded[y + _DOWN, _ACROSS : _ACROSS + width]
        for j in range(2 * _DOWN + 1):
            for i in range(2 * _ACROSS + 1):
                if i == _ACROSS and j == _DOWN:
                    continue
                there = padded[y + j, i : i + width]
                for x in range(width):
                    own[x] = (own[x] << one) | np.uint64(there[x] < here[x])
    return bits


def _bits_set(typing: Any, value: Any) -> Any:
    """How many bits of a uint64 are set: what the processor has an instruction for."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.ctpop(arguments[0])

    return types.uint64(types.uint64), generate


bits_set: Any = intrinsic(_bits_set)
"""Of a uint64, in compiled code."""
