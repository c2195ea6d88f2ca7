"""Latents between texels and levels, against SciPy, brute force and closed forms."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from pipelines.neural_btf.latent_texture import (
    averaged,
    between_levels,
    between_texels,
    cover,
    level_sizes,
)

RANDOM = np.random.default_rng(0)


def test_between_texels_is_what_scipy_interpolates() -> None:
    table = RANDOM.standard_normal((7 * 5, 3)).astype(np.float32)
    rows, columns = RANDOM.uniform(-20, 20, (2, 200))
    found = between_texels(table, (7, 5), rows, columns)
    for channel in range(3):
        grid = table[:, channel].reshape(7, 5).astype(np.float64)
        expected = map_coordinates(grid, [rows, columns], order=1, mode="grid-wrap")
        np.testing.assert_allclose(found[:, channel], expected, atol=1e-5)


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (12, 12), (100, 37)])
def test_levels_halve_down_to_one_texel(size: tuple[int, int]) -> None:
    sizes = level_sizes(*size)
    assert sizes[0] == size
    assert sizes[-1] == (1, 1)
    assert sizes.count((1, 1)) == 1 or size == (1, 1)
    for (rows, columns), (fewer_rows, fewer_columns) in itertools.pairwise(sizes):
        assert 2 * fewer_rows - rows in (0, 1) or rows == 1
        assert 2 * fewer_columns - columns in (0, 1) or columns == 1


@pytest.mark.parametrize(("fine", "coarse"), [(100, 50), (100, 13), (7, 4), (5, 5), (9, 1)])
def test_cover_is_what_many_points_say(fine: int, coarse: int) -> None:
    points = (np.arange(fine * coarse * 20) + 0.5) / (fine * coarse * 20)
    counted = np.zeros((coarse, fine))
    np.add.at(counted, ((points * coarse).astype(int), (points * fine).astype(int)), 1)
    np.testing.assert_allclose(cover(fine, coarse), counted / counted.sum(axis=1)[:, None])


def test_averages_keep_the_mean_and_blocks_are_plain_means() -> None:
    values = RANDOM.random((13 * 6, 2))
    np.testing.assert_allclose(
        averaged(values, (13, 6), (7, 3)).mean(axis=0), values.mean(axis=0), rtol=1e-5
    )
    grid = values[: 12 * 6].reshape(6, 2, 3, 2, 2).mean(axis=(1, 3)).reshape(18, 2)
    np.testing.assert_allclose(averaged(values[: 12 * 6], (12, 6), (6, 3)), grid, rtol=1e-5)


def test_between_levels_is_the_finest_close_by_and_the_last_far_away() -> None:
    levels = [
        RANDOM.standard_normal((rows * columns, 8)).astype(np.float32)
        for rows, columns in level_sizes(6, 10)
    ]
    rows, columns = RANDOM.uniform(-9, 9, (2, 50))
    close = between_levels(levels, (6, 10), (rows, columns), np.full(50, 0.7))
    np.testing.assert_array_equal(close, between_texels(levels[0], (6, 10), rows, columns))
    far = between_levels(levels, (6, 10), (rows, columns), np.full(50, 1e4))
    np.testing.assert_allclose(far, np.broadcast_to(levels[-1], (50, 8)), atol=1e-6)
    half = between_levels(levels, (6, 10), (rows, columns), np.full(50, 2**0.5))
    second = between_texels(levels[1], (3, 5), (rows + 0.5) / 2 - 0.5, (columns + 0.5) / 2 - 0.5)
    np.testing.assert_allclose(half, (close + second) / 2, atol=1e-5)
