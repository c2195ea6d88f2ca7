"""Figures that tell whether a stored file is what was trained, and no worse."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pipelines.neural_btf.abrdf_pool import AbrdfReader
from pipelines.neural_btf.compressed import CompressedBtf

_TEXELS = 64
_PAIRS_STEP = 13


def rmse_ratio(
    compressed: CompressedBtf,
    network: CompressedBtf,
    read: AbrdfReader,
    directions: NDArray[np.float32],
) -> float:
    """RMSE of a compressed BTF over that of the network it was made from.

    Of 64 texels in every 13th pair. ``read`` gives measured ABRDFs; ``directions`` (pair, 4) are
    the decoder's inputs.
    """
    pairs = np.arange(0, len(directions), _PAIRS_STEP)
    texels = np.unique(np.linspace(0, compressed.texels - 1, _TEXELS).astype(int))
    squares = np.zeros(2)
    for texel in texels:
        wanted = read(texel, texel + 1)[:, pairs].astype(np.float64) / compressed.alpha
        for number, btf in enumerate((compressed, network)):
            found = btf.abrdfs(texel, texel + 1, directions[pairs])
            squares[number] += float(np.sum((found - wanted) ** 2))
    return math.sqrt(squares[0] / squares[1])
