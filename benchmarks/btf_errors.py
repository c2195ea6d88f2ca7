"""Errors of a compressed BTF over all that was measured, alone and beside its rivals'."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.btf_rivals.all_rivals import rivals_at
from benchmarks.btf_rivals.rival import rival_rmse
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


def rmse_in_context(rmse: float, alpha: float, abrdfs: NDArray[np.float16]) -> dict[str, float]:
    """An RMSE over alpha also over the values' mean, and over their standard deviation.

    Alpha is the largest value: a few bright texels make it large. Restoring the mean everywhere
    would have 1 over the standard deviation.
    """
    mean, deviation = value_spread(abrdfs)
    return {"rmse_over_mean": rmse * alpha / mean, "rmse_over_deviation": rmse * alpha / deviation}


def against_rivals(
    stored: CompressedBtf,
    file_bytes: int,
    abrdfs: NDArray[np.float16],
    pairs: Pairs,
    *,
    steps: int,
) -> dict[str, Any]:
    """A BTF whose file has so many bytes, and every rival at as many; ``steps`` train the latent
    texture.

    ``rival_rmse_ratio`` is ours over the best rival's, ``rival_by_texel_rmse_ratio`` over the best
    one's of those that give a texel without decoding all.
    """
    size = stored.height, stored.width
    ours = btf_rmse(stored, abrdfs, pairs)
    rivals = rivals_at(abrdfs, size, pairs, file_bytes, steps=steps, seed=0)
    errors = {rival.name: rival_rmse(rival, abrdfs, stored.alpha) for rival in rivals}
    by_texel = [errors[rival.name] for rival in rivals if rival.by_texel]
    return {
        "file_rmse": ours,
        "file_bytes": file_bytes,
        "rival_rmse": errors,
        "rival_bytes": {rival.name: rival.bytes for rival in rivals},
        "rival_settings": {rival.name: rival.settings for rival in rivals},
        "rival_rmse_ratio": ours / min(errors.values()),
        "rival_by_texel_rmse_ratio": ours / min(by_texel),
        "null_rmse_ratio": errors["flat"] / ours,
    }
