"""The benchmark's own figures on cloths that are made up: a print, and noise."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from benchmarks.btf_quality import contrast_error, encoder_promise, turned_table
from pipelines.light.directions import (
    all_pairs,
    angles_between,
    hemisphere_table,
)
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.network import Decoder, decoder_arrays
from pipelines.neural_btf.training.plan import TrainingPlan

TABLE = hemisphere_table(15)
PAIRS = all_pairs(TABLE, TABLE)


@pytest.mark.parametrize("count", [15, 41, 81])
def test_turned_directions_are_as_steep_and_none_is_on_the_grid(count: int) -> None:
    table = hemisphere_table(count)
    turned = turned_table(table)
    assert len(turned) == count - 1
    np.testing.assert_allclose(np.sort(turned[:, 0]), np.sort(table[1:, 0]))
    away = np.degrees(angles_between(turned[:, None], table[None]).min(axis=1))
    assert away.min() > 5
    # Half the step of its own ring.
    for ring in np.unique(turned[:, 0]):
        angle = turned[turned[:, 0] == ring]
        neighbours = table[np.isclose(table[:, 0], ring)]
        steps = [np.abs(np.angle(np.exp(1j * (one[1] - neighbours[:, 1])))) for one in angle]
        np.testing.assert_allclose([step.min() for step in steps], np.pi / len(neighbours))


def prints(texels: tuple[int, int] = (12, 12)) -> NDArray[np.float32]:
    """Photographs of dyes of three colours, Lambertian with a gloss that differs by texel."""
    random = np.random.default_rng(0)
    colour = random.uniform(0.1, 1.0, (1, *texels, 3))
    gloss = random.uniform(0.0, 1.0, (1, *texels, 1))
    cosine = np.cos(PAIRS.light[:, 0])[:, None, None, None]
    shine = np.exp(-4 * angles_between(PAIRS.light, PAIRS.view) ** 2)[:, None, None, None]
    return np.asarray(colour * cosine + gloss * shine, np.float32)


def test_the_contrast_error_is_of_the_pairs_that_are_asked() -> None:
    torch.manual_seed(0)
    latents = np.random.default_rng(0).normal(0, 3, (24, 8)).astype(np.float32)
    btf = CompressedBtf(decoder_arrays(Decoder()), latents, None, 1.0, 4, 6)
    images = btf.photographs(PAIRS)
    assert contrast_error(btf, images, PAIRS) == pytest.approx(0.0, abs=1e-4)
    other = all_pairs(TABLE[::-1].copy(), TABLE)
    assert contrast_error(btf, images, PAIRS, asked=other) > 0.02


def test_texels_of_a_print_are_encoded_better_than_by_what_knows_nothing() -> None:
    plan = TrainingPlan(steps=300, encoder_steps=150, batch_images=64)
    found = encoder_promise(prints(), PAIRS, plan)
    assert found["encoder_trained"] < 0.4
    assert found["encoder_fitted"] < 0.5
    assert found["encoder_encoded"] < 0.8 * found["encoder_mean"]
    assert found["encoder_linear"] < found["encoder_mean"]
    assert 0.7 < found["encoder_mean"] < 1.6


def test_texels_of_noise_cannot_be_encoded() -> None:
    """The null: of texels that have nothing in common, no encoder helps."""
    random = np.random.default_rng(1)
    noise = random.uniform(0.0, 1.0, (225, 12, 12, 3)).astype(np.float32)
    found = encoder_promise(noise, PAIRS, TrainingPlan(steps=100, encoder_steps=30))
    for name in ("encoder_encoded", "encoder_linear", "encoder_nearest", "encoder_mean"):
        assert found[name] > 0.97, name
