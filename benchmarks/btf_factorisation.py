"""What a compressed BTF is compared with: a full-matrix factorisation of the same bytes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs
from pipelines.lowrank import principal_components
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.restoration import restoration_errors


def _factorisation_rmse(
    abrdfs: NDArray[np.float16], alpha: float, budget: int
) -> tuple[float, int, int]:
    """RMSE over alpha, rank and bytes of a full-matrix factorisation of the log-ABRDFs in fp16.

    The largest rank whose mean, scores and loadings together are not above ``budget`` bytes.
    """
    texels, images, _ = abrdfs.shape
    columns = 3 * images
    rank = max(0, (budget - 2 * columns) // (2 * (texels + columns)))

    def blocks() -> Iterator[NDArray[np.float32]]:
        for first in range(0, images, 81):
            part = abrdfs[:, first : first + 81].astype(np.float32)
            yield np.log1p(part).reshape(texels, -1)

    mean = np.concatenate([block.mean(axis=0, dtype=np.float64) for block in blocks()])
    found = principal_components(blocks, max(1, rank))
    lengths = np.sqrt(found.singular_values)  # shared, so that both factors fit a half float
    scores = (found.scores / lengths).astype(np.float16)[:, :rank].astype(np.float32)
    loadings = (found.loadings * lengths).astype(np.float16)[:, :rank].astype(np.float32)
    mean = mean.astype(np.float16).astype(np.float32)
    total = 0.0
    for first in range(0, texels, 100):
        logs = scores[first : first + 100] @ loadings.T + mean
        wanted = abrdfs[first : first + 100].astype(np.float32).reshape(logs.shape)
        total += float(np.sum(((np.expm1(logs) - wanted) / alpha) ** 2, dtype=np.float64))
    used = 2 * (rank * (texels + columns) + columns)
    return float(np.sqrt(total / (texels * columns))), rank, used


def _halved(stored: CompressedBtf) -> CompressedBtf:
    """The same with weights and latents rounded to half floats."""
    decoder = {name: values.astype(np.float16) for name, values in stored.decoder.items()}
    latents = stored.latents.astype(np.float16).astype(np.float32)
    return replace(stored, decoder=decoder, latents=latents)


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


def against_factorisation(
    stored: CompressedBtf, abrdfs: NDArray[np.float16], pairs: Pairs
) -> dict[str, Any]:
    """Both in half floats, the factorisation with the largest rank that is not larger.

    ``rival_bytes`` of ``allowed_bytes``: one more rank would not fit. Rank 0 is the mean alone.
    """
    budget = 2 * (sum(values.size for values in stored.decoder.values()) + stored.latents.size)
    ours = btf_rmse(_halved(stored), abrdfs, pairs)
    theirs, rank, used = _factorisation_rmse(abrdfs, stored.alpha, budget)
    return {
        "rmse_fp16": ours,
        "bytes_fp16": budget,
        "factorisation_rmse_fp16": theirs,
        "rival_rank": rank,
        "rival_bytes": used,
        "allowed_bytes": budget,
        "pca_rmse_ratio": ours / theirs,
    }
