"""How large a BTF's values are, and how far from their mean ABRDF."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.neural_btf.abrdf_pool import AbrdfReader

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


def mean_abrdf_rmse(read: AbrdfReader, texels: int) -> float:
    """RMSE of the mean ABRDF in place of every texel's, a colour a photograph; ``read`` gives those
    of texels first to last - 1, (texel, image, 3).

    >>> abrdfs = np.array([[[0.0] * 3] * 4, [[2.0] * 3] * 4])
    >>> mean_abrdf_rmse(lambda first, last: abrdfs[first:last], 2)
    1.0
    """
    total, squares, size = np.zeros(()), 0.0, 0
    for first in range(0, texels, _BLOCK):
        block = read(first, min(first + _BLOCK, texels)).astype(np.float64)
        total = total + block.sum(axis=0)
        squares += float(np.einsum("tic,tic->", block, block))
        size += block.size
    return max((squares - float((total**2).sum()) / texels) / size, 0.0) ** 0.5
