"""How large a BTF's values are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_BLOCK = 400


def value_spread(abrdfs: NDArray[np.float16]) -> tuple[float, float]:
    """Mean and standard deviation of all measured values (texel, image, 3)."""
    total = squares = 0.0
    for first in range(0, len(abrdfs), _BLOCK):
        block = abrdfs[first : first + _BLOCK].astype(np.float64)
        total += float(block.sum())
        squares += float(np.einsum("tic,tic->", block, block))
    mean = total / abrdfs.size
    return mean, max(squares / abrdfs.size - mean**2, 0.0) ** 0.5
