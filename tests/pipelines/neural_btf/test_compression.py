"""Photographs in memory, compressed by one call and restored."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.light.directions import Pairs, all_pairs, hemisphere_table, unit_vectors
from pipelines.neural_btf.compression import compress_photographs
from pipelines.neural_btf.training.plan import TrainingPlan

PAIRS: Pairs = all_pairs(hemisphere_table(15), hemisphere_table(15))
PLAN = TrainingPlan(steps=250, batch_texels=32, batch_images=64)


def lambertian() -> NDArray[np.float32]:
    """8 x 6 texels of two colours."""
    colour = np.where(np.arange(8)[:, None, None] < 3, [0.6, 0.3, 0.1], [0.2, 0.3, 0.7])
    cosine = unit_vectors(PAIRS.light)[:, 2, None, None, None]
    return (cosine * np.broadcast_to(colour, (8, 6, 3))).astype(np.float32)


@pytest.mark.parametrize("clusters", [None, 2])
def test_photographs_come_back(clusters: int | None) -> None:
    images = lambertian()
    # Without clusters texels must differ a little: their latents start at principal components.
    images *= np.random.default_rng(0).uniform(0.98, 1.0, (8, 6, 1)).astype(np.float32)
    told: list[float] = []
    btf = compress_photographs(images, PAIRS, clusters=clusters, plan=PLAN, progress=told.append)
    assert (btf.height, btf.width) == (8, 6)
    assert btf.latents.shape == (48 if clusters is None else 2, 8)
    assert (btf.ids is None) == (clusters is None)
    assert btf.alpha == images.astype(np.float16).max()
    restored = btf.photographs(PAIRS)
    assert np.sqrt(np.mean((restored - images) ** 2)) < 0.15 * images.std()
    assert told[-1] == pytest.approx(240 / 250)


def test_photographs_that_cannot_be_stored_are_refused() -> None:
    images = lambertian()
    images[3, 2, 1, 0] = np.nan
    with pytest.raises(ValueError, match="BTF: a value is not finite"):
        compress_photographs(images, PAIRS)
