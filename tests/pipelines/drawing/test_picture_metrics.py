"""PSNR, SSIM and FLIP of pictures whose differences are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pipelines.drawing.picture_metrics import (
    SSIM_SIDE,
    flip_map,
    image_metrics,
    psnr,
    psnr_of_squared_errors,
    squared_errors,
    ssim_map,
)

ALL = np.ones((24, 30), bool)


def noise(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(20, 230, (24, 30, 3), dtype=np.uint8)


@pytest.mark.parametrize("off", [1, 7, 20])
def test_psnr_of_an_even_difference(off: int) -> None:
    truth = noise()
    picture = truth + np.uint8(off)
    assert psnr(picture, truth, ALL) == pytest.approx(20 * math.log10(255 / off))
    assert psnr(truth, picture, ALL) == pytest.approx(20 * math.log10(255 / off))


def test_psnr_asks_only_where_it_is_told() -> None:
    truth = noise()
    where = np.random.default_rng(1).random(ALL.shape) < 0.5
    picture = np.where(where[..., None], truth + np.uint8(10), 0).astype(np.uint8)
    assert psnr(picture, truth, where) == pytest.approx(20 * math.log10(25.5))


def test_squares_may_be_pooled() -> None:
    truth, picture = noise(1), noise(2)
    left = ALL.copy()
    left[:, 11:] = False
    parts = [squared_errors(picture, truth, left), squared_errors(picture, truth, ~left)]
    assert psnr_of_squared_errors(np.concatenate(parts)) == pytest.approx(psnr(picture, truth, ALL))


def test_equal_pictures_are_alike() -> None:
    found = image_metrics(noise(), noise(), ALL)
    assert found.psnr > 100
    assert found.ssim == pytest.approx(1.0)
    assert found.flip == pytest.approx(0.0, abs=1e-6)


def test_image_metrics_see_only_the_asked_half() -> None:
    truth = noise()
    picture = truth.copy()
    picture[:, :8] = 255 - picture[:, :8]
    right = ALL.copy()
    right[:, :23] = False  # FLIP's and SSIM's windows are smaller than the gap
    spoilt = image_metrics(picture, truth, ~right)
    assert image_metrics(picture, truth, right).ssim == pytest.approx(1.0)
    assert image_metrics(picture, truth, right).psnr > 100
    assert spoilt.ssim < 0.9
    assert spoilt.flip > 0.05


def test_ssim_has_a_least_size() -> None:
    some, other = noise()[:SSIM_SIDE], noise(1)[:SSIM_SIDE]
    assert ssim_map(some, other).shape == (SSIM_SIDE, 30)
    with pytest.raises(ValueError, match="win_size"):
        ssim_map(some[1:], other[1:])


def test_flip_grows_with_the_difference() -> None:
    truth = noise() // 2
    means = [float(flip_map(truth + np.uint8(off), truth).mean()) for off in (0, 5, 20, 60)]
    assert means == sorted(means)
    assert means[0] == pytest.approx(0.0, abs=1e-6)
    assert 0.1 < means[-1] < 1.0
