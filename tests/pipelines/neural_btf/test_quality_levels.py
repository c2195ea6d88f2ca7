"""Levels against averages: boxes by brute force, known errors, levels of a decoder."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.light.directions import Pairs, all_pairs, hemisphere_table
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.network import Decoder, decoder_arrays
from pipelines.neural_btf.quality_levels import (
    averaged_photographs,
    level_errors,
    restored_levels,
)

TABLE = hemisphere_table(15)
PAIRS = Pairs(*(part[::9] for part in all_pairs(TABLE, TABLE)))


def photographs(size: tuple[int, int] = (8, 12)) -> np.ndarray:
    return np.random.default_rng(0).random((5, *size, 3), np.float32)


def test_averages_are_means_of_boxes() -> None:
    images = photographs()
    found = averaged_photographs(images, (2, 3))
    for row in range(2):
        for column in range(3):
            box = images[:, 4 * row : 4 * row + 4, 4 * column : 4 * column + 4]
            np.testing.assert_allclose(found[:, row, column], box.mean(axis=(1, 2)), rtol=1e-5)


def test_averages_keep_the_mean_of_odd_sizes() -> None:
    images = photographs((7, 5))
    for size in ((4, 3), (2, 2), (1, 1)):
        found = averaged_photographs(images, size)
        np.testing.assert_allclose(found.mean(axis=(1, 2)), images.mean(axis=(1, 2)), rtol=1e-5)


def test_the_ratio_is_of_the_levels_error_over_the_averages() -> None:
    truth = photographs((8, 8))
    near = truth + np.float32(0.1)
    sizes = ((4, 4), (2, 2), (1, 1))
    averages = [averaged_photographs(near, size) for size in sizes]
    found = level_errors(truth, near, averages).figures
    assert found["mip_error_ratio"] == pytest.approx(1.0, abs=1e-5)
    assert found["mip_error_ratio_null"] > 1.0 / 3
    worse = [average + np.float32(0.2) for average in averages]
    found = level_errors(truth, near, worse).figures
    for name in ("", "_level_1", "_level_2", "_level_3"):
        assert found[f"mip_error_ratio{name}"] == pytest.approx(3.0, rel=1e-4)


def test_a_flat_level_has_the_nulls_error() -> None:
    truth = photographs((8, 8))
    mean = truth.mean(axis=(1, 2), keepdims=True)
    levels = [np.broadcast_to(mean, (5, side, side, 3)) for side in (4, 2)]
    found = level_errors(truth, truth + np.float32(0.01), levels).figures
    assert found["mip_error_ratio"] == pytest.approx(found["mip_error_ratio_null"], rel=1e-5)
    assert found["mip_error_ratio_null"] > 5


def test_a_level_of_another_size_is_refused() -> None:
    truth = photographs((8, 8))
    with pytest.raises(ValueError, match=r"level 1 .*\(2, 2\).*expected \(4, 4\)"):
        level_errors(truth, truth, [averaged_photographs(truth, (2, 2))])


@pytest.mark.parametrize("moved", [False, True])
def test_levels_decode_as_textures_of_their_own(moved: bool) -> None:
    random = np.random.default_rng(1)
    sizes = ((6, 5), (3, 3), (2, 2), (1, 1))
    tables = [random.standard_normal((h * w, 8)).astype(np.float32) for h, w in sizes]
    shift = random.normal(0, 0.5, (9, 2)).astype(np.float32) if moved else None
    btf = CompressedBtf(
        decoder_arrays(Decoder()),
        tables[0],
        None,
        1.5,
        6,
        5,
        mips=tuple(tables[1:]),
        parallax=shift,
    )
    found = restored_levels(btf, PAIRS)
    assert [level.shape for level in found] == [(25, h, w, 3) for h, w in sizes[1:]]
    # The last level is one texel: wherever it is looked up, its latents are the same.
    one = CompressedBtf(btf.decoder, tables[3], None, 1.5, 1, 1)
    np.testing.assert_allclose(found[2], one.photographs(PAIRS), atol=1e-5)
    # A level whose texels are all alike is not moved by anything.
    alike = np.repeat(tables[1][:1], 9, axis=0)
    still = restored_levels(
        CompressedBtf(btf.decoder, tables[0], None, 1.5, 6, 5, (alike,), shift), PAIRS
    )[0]
    np.testing.assert_allclose(still, np.broadcast_to(still[:, :1, :1], still.shape), atol=1e-5)


def test_a_levels_parallax_is_the_finest_ones_in_its_own_texels() -> None:
    """Of a texture that is the finest one seen at half the size, moved by as much of the tile."""
    random = np.random.default_rng(2)
    coarse = random.standard_normal((16, 8)).astype(np.float32)
    shift = np.zeros((9, 2), np.float32)
    shift[0] = 2.0  # texels of the finest level: one of the coarser one
    btf = CompressedBtf(
        decoder_arrays(Decoder()), np.zeros((64, 8), np.float32), None, 1.0, 8, 8, (coarse,), shift
    )
    half = CompressedBtf(btf.decoder, coarse, None, 1.0, 4, 4, parallax=shift / np.float32(2))
    np.testing.assert_allclose(restored_levels(btf, PAIRS)[0], half.photographs(PAIRS), atol=1e-6)
