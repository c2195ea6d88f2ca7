"""Exposure and size against brute force and what both must keep."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipelines.photo_fur.attenuation import fit_attenuation
from pipelines.photo_fur.photograph import (
    HIGHLIGHT_SHARE,
    expose,
    fit_cutout,
    fit_size,
    fur_photograph,
)


def test_a_photograph_inside_the_display_stays_as_it_is() -> None:
    radiance = np.random.default_rng(0).random((9, 7, 3)).astype(np.float32)
    radiance[0, 0, 0] = 1.0
    np.testing.assert_array_equal(expose(radiance), radiance)
    assert expose(radiance.astype(np.float64)).dtype == np.float32


@pytest.mark.parametrize("seed", range(4))
def test_of_an_hdr_photograph_no_more_than_the_share_clips(seed: int) -> None:
    radiance = np.random.default_rng(seed).lognormal(1.0, 2.0, (60, 50, 3)).astype(np.float32)
    exposed = expose(radiance)
    assert exposed.dtype == np.float32
    assert exposed.min() >= 0
    assert exposed.max() == 1
    clipped = np.count_nonzero(exposed >= 1.0)
    assert 0 < clipped <= HIGHLIGHT_SHARE * radiance.size + 1
    # What does not clip is scaled by one factor.
    kept = exposed < 1.0
    factor = exposed[kept] / radiance[kept]
    np.testing.assert_allclose(factor, factor[0], rtol=1e-5)


@settings(deadline=None)
@given(st.floats(1.5, 1e6))
def test_exposure_does_not_depend_on_the_unit_of_radiance(unit: float) -> None:
    radiance = np.random.default_rng(1).lognormal(1.0, 1.0, (20, 20, 3)).astype(np.float32)
    np.testing.assert_allclose(expose(radiance * np.float32(unit)), expose(radiance), rtol=1e-5)


def test_a_few_lights_clip_and_brighten_nothing_else() -> None:
    radiance = np.full((50, 50, 3), 0.25, np.float32)
    radiance[3, 4] = (8.0, 4.0, 0.5)
    exposed = expose(radiance)
    np.testing.assert_array_equal(exposed[3, 4], [1.0, 1.0, 0.5])
    assert exposed[0, 0, 0] == 0.25


def test_transparent_pixels_have_no_say_in_the_exposure() -> None:
    radiance = np.full((50, 50, 3), 0.25, np.float32)
    radiance[:, :20] = 90.0
    opaque = np.ones((50, 50), bool)
    opaque[:, :20] = False
    assert expose(radiance, opaque)[0, 30, 0] == 0.25
    assert expose(radiance)[0, 30, 0] < 0.01


# ---- size ------------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [2, 3, 5])
def test_an_even_reduction_is_the_mean_of_the_blocks(factor: int) -> None:
    radiance = np.random.default_rng(2).random((4 * factor, 6 * factor, 3)).astype(np.float32)
    expected = radiance.reshape(4, factor, 6, factor, 3).astype(float).mean(axis=(1, 3))
    fitted = fit_size(radiance, 6)
    assert fitted.dtype == np.float32
    np.testing.assert_allclose(fitted, expected, atol=1e-6)


def shares_of(size: int, smaller: int) -> np.ndarray:
    """(smaller, size): what share of each new pixel's extent lies in each old pixel."""
    edges, new = np.arange(size + 1), np.arange(smaller + 1) * size / smaller
    low = np.maximum(edges[None, :-1], new[:-1, None])
    high = np.minimum(edges[None, 1:], new[1:, None])
    return np.maximum(high - low, 0) * smaller / size


@settings(deadline=None, max_examples=40)
@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 40))
def test_any_reduction_averages_by_area_and_keeps_the_mean(
    height: int, width: int, largest: int
) -> None:
    radiance = np.random.default_rng(3).random((height, width, 3)).astype(np.float32) * 5
    fitted = fit_size(radiance, largest)
    longer = max(height, width)
    if largest >= longer:
        np.testing.assert_array_equal(fitted, radiance)
        return
    assert max(fitted.shape[:2]) == largest
    for size, smaller in zip((height, width), fitted.shape[:2], strict=True):
        assert smaller >= 1
        assert smaller == 1 or abs(smaller - size * largest / longer) <= 0.5
    rows, columns = shares_of(height, fitted.shape[0]), shares_of(width, fitted.shape[1])
    expected = np.einsum("yh,xw,hwc->yxc", rows, columns, radiance.astype(float))
    np.testing.assert_allclose(fitted, expected, atol=2e-5)
    np.testing.assert_allclose(fitted.mean(axis=(0, 1)), radiance.mean(axis=(0, 1)), rtol=1e-4)


def test_a_constant_photograph_stays_constant() -> None:
    radiance = np.full((37, 53, 3), 0.3, np.float32)
    np.testing.assert_allclose(fit_size(radiance, 17), np.float32(0.3), rtol=1e-6)


def test_a_photograph_that_fits_is_not_touched() -> None:
    radiance = np.random.default_rng(4).random((8, 16, 3))
    for largest in (16, 17, 1000):
        fitted = fit_size(radiance, largest)
        assert fitted.dtype == np.float32
        np.testing.assert_array_equal(fitted, radiance.astype(np.float32))


# ---- luminance and medium --------------------------------------------------------------------


@pytest.mark.parametrize("tail", [0.0, 0.2])
def test_a_photograph_gets_its_luminance_and_the_medium_of_that(tail: float) -> None:
    radiance = np.random.default_rng(5).random((20, 30, 3)).astype(np.float32)
    photograph = fur_photograph(radiance, tail=tail)
    assert photograph.radiance is radiance
    assert photograph.luminance.dtype == np.float32
    expected = radiance.astype(float) @ [0.2126, 0.7152, 0.0722]
    np.testing.assert_allclose(photograph.luminance, expected, rtol=1e-6)
    assert photograph.attenuation == fit_attenuation(photograph.luminance, tail=tail)


@pytest.mark.parametrize("factor", [2, 5])
def test_a_cut_out_is_reduced_by_its_opaque_pixels_alone(factor: int) -> None:
    random = np.random.default_rng(3)
    radiance = random.random((4 * factor, 6 * factor, 3)).astype(np.float32)
    opaque = random.random((4 * factor, 6 * factor)) < 0.55
    light, left = fit_cutout(radiance, opaque, 6)
    for row, column in np.ndindex(4, 6):
        block = np.s_[row * factor : (row + 1) * factor, column * factor : (column + 1) * factor]
        assert left[row, column] == (opaque[block].mean() >= 0.5)
        expected = radiance[block][opaque[block]].mean(axis=0) if left[row, column] else 0
        np.testing.assert_allclose(light[row, column], expected, atol=1e-6)


def test_a_small_cut_out_stays_as_it_is() -> None:
    radiance = np.random.default_rng(4).random((20, 30, 3)).astype(np.float32)
    opaque = radiance[..., 0] > 0.3
    light, left = fit_cutout(radiance, opaque, 64)
    np.testing.assert_array_equal(left, opaque)
    np.testing.assert_array_equal(light, np.where(opaque[..., None], radiance, 0))
