"""What bytes buy: rounding, clusters, gains, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipelines.light.directions import all_pairs, hemisphere_table
from pipelines.neural_btf import rate_distortion
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.decoder_arrays import decode_in_numpy, direction_inputs
from pipelines.neural_btf.network import Decoder, decoder_arrays

PAIRS = all_pairs(hemisphere_table(15), hemisphere_table(15))
DIRECTIONS = direction_inputs(PAIRS)


@pytest.fixture(scope="module")
def btf() -> CompressedBtf:
    latents = np.random.default_rng(0).standard_normal((300, 8)).astype(np.float32)
    return CompressedBtf(decoder_arrays(Decoder()), latents, None, 2.0, height=15, width=20)


@pytest.fixture(scope="module")
def sample(btf: CompressedBtf) -> rate_distortion.Sample:
    """Of what the network itself gives: without error in float32."""
    return rate_distortion.sample_of(
        lambda first, last: btf.abrdfs(first, last, DIRECTIONS), btf.texels, DIRECTIONS
    )


def test_a_sample_is_of_texels_from_first_to_last(
    btf: CompressedBtf, sample: rate_distortion.Sample
) -> None:
    assert sample.blocks[0][0] == 0
    assert sample.blocks[-1][1] == btf.texels
    texels = np.concatenate([np.arange(*block) for block in sample.blocks])
    expected = decode_in_numpy(btf.decoder, btf.latents[texels], sample.directions)
    np.testing.assert_allclose(sample.values, expected, atol=1e-5)
    assert rate_distortion.rmse(rate_distortion.restored(btf, sample), sample) < 1e-7


def test_the_null_is_the_deviation_over_texels(sample: rate_distortion.Sample) -> None:
    expected = np.sqrt(sample.values.astype(np.float64).var(axis=0).mean())
    assert rate_distortion.rmse_null(sample) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("bits", [2, 4, 8])
def test_rounding_misses_by_half_a_step_at_most(bits: int) -> None:
    values = np.random.default_rng(1).standard_normal((500, 3)) * [0.1, 1.0, 7.0]
    symbols, steps = rate_distortion.rounded(values, bits)
    assert np.abs(symbols).max() == 2 ** (bits - 1) - 1
    assert np.all(np.abs(symbols * steps - values) <= steps / 2 * (1 + 1e-5))


def test_a_column_of_zeros_stays_zero() -> None:
    symbols, steps = rate_distortion.rounded(np.zeros((4, 2)), 5)
    assert not symbols.any()
    assert np.all(steps > 0)


def test_clusters_of_latents_that_are_the_same_change_nothing(
    btf: CompressedBtf, sample: rate_distortion.Sample
) -> None:
    few = replace(btf, latents=np.repeat(btf.latents[:10], 30, axis=0))
    held = rate_distortion.clustered(few, 10)
    assert held.latents.shape == (10, 8)
    found, right = (rate_distortion.restored(one, sample) for one in (held, few))
    np.testing.assert_allclose(found, right, atol=1e-5)


def test_fewer_clusters_are_worse(btf: CompressedBtf, sample: rate_distortion.Sample) -> None:
    errors = [
        rate_distortion.rmse(
            rate_distortion.restored(rate_distortion.clustered(btf, count), sample), sample
        )
        for count in (200, 60, 10)
    ]
    assert errors == sorted(errors)
    assert errors[0] < 0.7 * errors[-1]


def test_a_gain_mends_what_is_a_gain_and_never_harms(sample: rate_distortion.Sample) -> None:
    random = np.random.default_rng(2)
    dimmed = sample.values * random.uniform(0.3, 2.0, (len(sample.values), 1, 1)).astype(np.float32)
    mended = rate_distortion.with_gains(dimmed, sample)
    np.testing.assert_allclose(mended, sample.values, atol=1e-4)
    noisy = (sample.values + random.normal(0, 0.3, sample.values.shape)).astype(np.float32)
    before, after = (
        rate_distortion.rmse(found, sample)
        for found in (noisy, rate_distortion.with_gains(noisy, sample))
    )
    assert after <= before


def test_an_error_between_sizes_lies_on_a_line_of_logarithms() -> None:
    sizes, errors = np.array([100.0, 1000.0, 10_000.0]), np.array([0.3, 0.03, 0.003])
    for asked in (100.0, 234.0, 5000.0):
        found = rate_distortion.rmse_at(asked, sizes, errors)
        assert found == pytest.approx(30.0 / asked)
    assert rate_distortion.rmse_at(10.0, sizes, errors) == pytest.approx(0.3)
