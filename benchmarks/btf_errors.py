"""Errors of a compressed BTF over all that was measured, and how large the values are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.restoration import restoration_errors


def btf_rmse(stored: CompressedBtf, abrdfs: NDArray[np.float16], pairs: Pairs) -> float:
    """RMSE of all restored ABRDFs (texel, image, 3), over alpha."""
    return restoration_errors(stored, lambda a, b: abrdfs[a:b], pairs, block=400).rmse


def value_spread(abrdfs: NDArray[np.float16]) -> tuple[float, float]:
    """Mean and standard deviation of all measured values (texel, image, 3)."""
    total = squares = 0.0
    for first in range(0, len(abrdfs), 400):
        block = abrdfs[first : first + 400].astype(np.float64)
        total += float(block.sum())
        squares += float(np.einsum("tic,tic->", block, block))
    mean = total / abrdfs.size
    return mean, max(squares / abrdfs.size - mean**2, 0.0) ** 0.5
