"""How many planes each billboard gets for the fewest bytes.

Rate against distortion: a plane is worth its bytes where it takes off more squared error than they
would elsewhere. With one Lagrange multiplier for all billboards each chooses for itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_LEAST, _MOST = -20.0, 40.0
"""Octaves of the multiplier, codes² a byte."""
_BISECTIONS = 50


class RankAllocation(NamedTuple):
    """Of b billboards."""

    ranks: NDArray[np.uint8]
    """(b, 3), planes of each channel."""
    squares: float
    """Sum of squares that this leaves, as foretold."""


def allocate_ranks(squares: Floats, costs: Floats, allowed: float) -> RankAllocation:
    """The fewest bytes that leave ``allowed`` at most, or as little as can be.

    squares, costs (b, 3, ranks): sums of squares that ranks leave (infinity where there is no such
    rank), and their bytes. The multiplier is found by bisection: the result does not depend on
    the order of billboards.

    >>> left = np.array([[[90.0, 30.0, 20.0]] * 3, [[50.0, 45.0, 44.0]] * 3])
    >>> found = allocate_ranks(left, np.broadcast_to(np.arange(3.0) * 1024, left.shape), 240.0)
    >>> found.ranks.tolist(), found.squares
    ([[1, 1, 1], [0, 0, 0]], 240.0)
    """

    def at(multiplier: float) -> RankAllocation:
        ranks = (squares + multiplier * costs).argmin(axis=2)
        left = np.take_along_axis(squares, ranks[:, :, None], 2).sum()
        return RankAllocation(ranks.astype(np.uint8), float(left))

    low, high = _LEAST, _MOST
    if at(2.0**low).squares > allowed:
        return at(0.0)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if at(2.0**middle).squares <= allowed:
            low = middle
        else:
            high = middle
    return at(2.0**low)
