"""The price of latents against the file's own coder."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from pipelines.neural_btf.latent_texture import averaged, level_sizes
from pipelines.neural_btf.training.latent_price import LatentPrice
from storage.btf_file import BtfFile, Quantised, section_bytes, write_btf_file

SIZE = (60, 60)


def fields(smooth: float) -> list[NDArray[np.int32]]:
    """Whole numbers (texel, 8) of all levels: noise, as smooth as is asked."""
    noise = np.random.default_rng(0).standard_normal((*SIZE, 8))
    field = gaussian_filter(noise, (smooth, smooth, 0), mode="wrap")
    field = 6 * field / field.std()
    finest = field.reshape(-1, 8)
    levels = [finest, *(averaged(finest, SIZE, size) for size in level_sizes(*SIZE)[1:])]
    return [np.rint(level).astype(np.int32) for level in levels]


def priced(levels: list[NDArray[np.int32]]) -> float:
    """Bytes by `LatentPrice`."""
    grids = [
        torch.from_numpy(level).float().reshape(*size, 8)
        for level, size in zip(levels, level_sizes(*SIZE), strict=True)
    ]
    price, bits = LatentPrice(8, 2, torch.device("cpu")), 0.0
    for group, (own, over) in enumerate(((grids[:1], grids[1:2]), (grids[1:], [*grids[2:], None]))):
        price.fit(group, own, over)
        bits += float(price.bits(group, own, over))
    return bits / 8


def coded(levels: list[NDArray[np.int32]]) -> int:
    """Bytes that the file takes more for these levels than for others that are 0."""
    step = np.full(8, 0.1, np.float32)
    weights = {"weight_1": np.zeros((3, 12), np.float32), "bias_1": np.zeros(3, np.float32)}

    def total(parts: list[NDArray[np.int32]]) -> int:
        finest, *mips = (Quantised(part, step) for part in parts)
        data = write_btf_file(BtfFile(weights, finest, *SIZE, 1.0, mips=tuple(mips)))
        return sum(section_bytes(data).values())

    return total(levels) - total([np.zeros_like(level) for level in levels])


@pytest.mark.parametrize("smooth", [0.0, 1.0, 2.0])
def test_latents_are_priced_as_the_file_codes_them(smooth: float) -> None:
    levels = fields(smooth)
    assert priced(levels) == pytest.approx(coded(levels), rel=0.15)


def test_smooth_latents_are_cheap() -> None:
    assert priced(fields(2.0)) < 0.6 * priced(fields(0.0))
