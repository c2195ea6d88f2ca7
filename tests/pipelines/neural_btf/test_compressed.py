"""What a compressed BTF restores, against the decoder written out in NumPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from pipelines.light.directions import Pairs, all_pairs, hemisphere_table, unit_vectors
from pipelines.neural_btf import compressed as compressed_module
from pipelines.neural_btf.compressed import CompressedBtf, compressed_btf
from pipelines.neural_btf.decoder_arrays import LATENTS, decode_in_numpy, direction_inputs
from pipelines.neural_btf.network import Decoder, decoder_arrays
from pipelines.neural_btf.restoration import restoration_errors

HEIGHT, WIDTH, CLUSTERS, ALPHA = 5, 4, 6, 3.25
PAIRS: Pairs = all_pairs(hemisphere_table(15)[:4], hemisphere_table(15))


def made(*, clustered: bool) -> CompressedBtf:
    torch.manual_seed(0)
    random = np.random.default_rng(0)
    texels = HEIGHT * WIDTH
    count = CLUSTERS if clustered else texels
    latents = random.standard_normal((count, LATENTS)).astype(np.float32)
    ids = random.integers(0, CLUSTERS, texels).astype(np.int32) if clustered else None
    return CompressedBtf(decoder_arrays(Decoder()), latents, ids, ALPHA, HEIGHT, WIDTH)


def plainly(btf: CompressedBtf, pairs: Pairs = PAIRS) -> NDArray[np.float64]:
    """Values over alpha of all texels, (texel, pair, 3)."""
    stored = [btf.latents[texel if btf.ids is None else btf.ids[texel]] for texel in range(20)]
    return decode_in_numpy(btf.decoder, np.stack(stored), direction_inputs(pairs))


with_and_without_clusters = pytest.mark.parametrize("clustered", [False, True])


@with_and_without_clusters
def test_abrdfs_are_the_decoders_values_over_alpha(clustered: bool) -> None:
    btf = made(clustered=clustered)
    found = btf.abrdfs(0, btf.texels, direction_inputs(PAIRS))
    assert (found.shape, found.dtype) == ((20, len(PAIRS.light), 3), np.float32)
    np.testing.assert_allclose(found, plainly(btf), atol=1e-6)
    np.testing.assert_array_equal(btf.abrdfs(7, 11, direction_inputs(PAIRS)), found[7:11])


@with_and_without_clusters
def test_photographs_are_radiance_with_texels_row_by_row(clustered: bool) -> None:
    btf = made(clustered=clustered)
    found, values = btf.photographs(PAIRS), plainly(btf)
    assert (found.shape, found.dtype) == ((len(PAIRS.light), HEIGHT, WIDTH, 3), np.float32)
    for y, x in np.ndindex(HEIGHT, WIDTH):
        np.testing.assert_allclose(found[:, y, x], ALPHA * values[y * WIDTH + x], atol=1e-5)


@with_and_without_clusters
def test_radiance_of_directions_is_that_of_the_photographs(clustered: bool) -> None:
    btf = made(clustered=clustered)
    random = np.random.default_rng(1)
    texels, numbers = random.integers(0, 20, 300), random.integers(0, len(PAIRS.light), 300)
    found = btf.radiance(
        texels, unit_vectors(PAIRS.light[numbers]), unit_vectors(PAIRS.view[numbers])
    )
    assert (found.shape, found.dtype) == ((300, 3), np.float32)
    expected = ALPHA * plainly(btf)[texels, numbers]
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_light_and_view_are_not_exchanged() -> None:
    btf = made(clustered=False)
    light, view = unit_vectors([[0.3, 1.0]]), unit_vectors([[1.1, -2.0]])
    one, other = btf.radiance(np.array([0]), light, view), btf.radiance(np.array([0]), view, light)
    assert np.abs(one - other).max() > 1e-3


def test_texels_of_one_cluster_look_the_same() -> None:
    btf = made(clustered=True)
    assert btf.ids is not None
    values = btf.abrdfs(0, btf.texels, direction_inputs(PAIRS))
    for a, b in np.ndindex(20, 20):
        same = np.allclose(values[a], values[b], atol=1e-6)
        assert same == (btf.ids[a] == btf.ids[b])


@pytest.mark.parametrize("rows", [1, 7, 60, 61, 1000])
def test_it_does_not_matter_how_many_values_are_decoded_at_a_time(
    rows: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    btf = made(clustered=True)
    texels = np.arange(20).repeat(3)
    light, view = (unit_vectors(some[:60]) for some in PAIRS)
    whole = btf.photographs(PAIRS), btf.radiance(texels, light, view)
    monkeypatch.setattr(compressed_module, "_ROWS", rows)
    np.testing.assert_allclose(btf.photographs(PAIRS), whole[0], atol=1e-5)
    np.testing.assert_allclose(btf.radiance(texels, light, view), whole[1], atol=1e-5)


def test_cluster_numbers_are_left_out_where_every_texel_has_its_own_latents() -> None:
    latents = np.zeros((6, LATENTS), np.float32)
    decoder = decoder_arrays(Decoder())
    own = compressed_btf(decoder, latents, np.arange(6, dtype=np.int32), 1.5, (2, 3))
    assert own.ids is None
    shared = compressed_btf(decoder, latents[:4], np.arange(6, dtype=np.int32) % 4, 1.5, (2, 3))
    np.testing.assert_array_equal(shared.ids, [0, 1, 2, 3, 0, 1])
    assert (shared.alpha, shared.height, shared.width, shared.texels) == (1.5, 2, 3, 6)
    assert shared.payload_bytes == 4 * (24_383 + 8 * 4 + 6)
    assert own.payload_bytes == 4 * (24_383 + 8 * 6)


# ---- errors ----------------------------------------------------------------------------------


@with_and_without_clusters
@pytest.mark.parametrize("block", [1, 6, 20, 100])
def test_errors_are_equation_10_whatever_the_block(clustered: bool, block: int) -> None:
    btf = made(clustered=clustered)
    random = np.random.default_rng(2)
    measured = random.gamma(1.0, 1.0, (20, len(PAIRS.light), 3)).astype(np.float16)
    told: list[float] = []
    found = restoration_errors(
        btf, lambda a, b: measured[a:b], PAIRS, block=block, progress=told.append
    )
    squares = (plainly(btf) - measured.astype(np.float64) / ALPHA) ** 2
    assert found.rmse == pytest.approx(math.sqrt(squares.mean()), rel=1e-5)
    np.testing.assert_allclose(found.of_image, np.sqrt(squares.mean(axis=(0, 2))), rtol=1e-5)
    np.testing.assert_allclose(found.of_texel, np.sqrt(squares.mean(axis=(1, 2))), rtol=1e-5)
    assert told[-1] == 1.0
    assert (np.diff(told) > 0).all()


def test_what_is_restored_exactly_has_no_error() -> None:
    btf = made(clustered=True)
    abrdfs = btf.abrdfs(0, 20, direction_inputs(PAIRS)) * np.float32(ALPHA)
    found = restoration_errors(btf, lambda a, b: abrdfs[a:b], PAIRS, block=6)
    assert found.rmse < 1e-6
