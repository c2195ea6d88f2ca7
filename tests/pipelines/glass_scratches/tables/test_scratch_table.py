"""Fresnel's factor along the scratch against closed forms; tables by both methods."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_centres
from pipelines.glass_scratches.tables.fresnel import (
    TABULATED_THETA,
    Fresnel,
    fresnel_factors,
    interpolated_fresnel,
    interpolation_error,
    schlick,
)
from pipelines.glass_scratches.tables.monte_carlo import PLACES
from pipelines.glass_scratches.tables.profiles import built_in_profile, cut_profile
from pipelines.glass_scratches.tables.radiosity import leaving_share, solve_radiosity, view_factors
from pipelines.glass_scratches.tables.scratch_table import scratch_brdf_table
from pipelines.glass_scratches.tables.table_2d import Table2D
from pipelines.glass_scratches.tables.walls import Method

BINS = 16
PAPERS_GAMMA = math.log(1 / 32) / math.log(2 / 3)
V = built_in_profile("v", 10.0, 4.0)
W = cut_profile([(-4, 0), (-2, -3), (0, -0.8), (1.5, -2.2), (4, 0)], "w")

indices = st.floats(1.01, 3.0)


def made(profile: NDArray[np.float64], method: Method, *, albedo: float = 0.8) -> Table2D:
    return scratch_brdf_table(
        profile,
        bins=BINS,
        albedo=albedo,
        method=method,
        facets=80,
        rays=15_000,
        paths_per_ray=4,
        seed=1,
    )


# ---- Schlick ---------------------------------------------------------------------------------


@given(indices, st.floats(0.0, 1.0))
def test_schlick_is_equation_2(index: float, cosine: float) -> None:
    expected = ((index - 1) ** 2 + 4 * index * (1 - cosine) ** 5) / (index + 1) ** 2
    # As a mean of what is reflected head-on and everything.
    head_on = ((index - 1) / (index + 1)) ** 2
    mixed = head_on + (1 - head_on) * (1 - cosine) ** 5
    found = float(schlick(index, np.array(cosine)))
    assert found == pytest.approx(expected, rel=1e-12)
    assert found == pytest.approx(mixed, rel=1e-9, abs=1e-15)


def test_schlick_of_glass() -> None:
    np.testing.assert_allclose(schlick(1.5, np.array([1.0, 0.5, 0.0])), [0.04, 0.07, 1.0])
    np.testing.assert_array_equal(schlick(1.0, np.array([1.0, 0.0])), [0.0, 1.0])


@pytest.mark.parametrize("index", [0.0, -1.5, math.nan, math.inf])
def test_an_index_that_is_not_positive_is_refused(index: float) -> None:
    message = rf"^refractive index is {index:g}; expected more than 0\.$"
    with pytest.raises(ValueError, match=message):
        schlick(index, np.array([1.0]))
    for variant in ("paper", "physical"):
        with pytest.raises(ValueError, match=message):
            fresnel_factors(8, index, variant)


# ---- gamma and the interpolation -------------------------------------------------------------


@given(indices, st.sampled_from([8, 10, 64]))
def test_the_papers_gamma_is_one_number(index: float, bins: int) -> None:
    lean = fresnel_factors(bins, index, "paper")
    assert lean.gamma.shape == (bins,)
    np.testing.assert_allclose(lean.gamma, PAPERS_GAMMA, rtol=1e-12)
    assert pytest.approx(8.5476, abs=5e-5) == PAPERS_GAMMA
    np.testing.assert_allclose(lean.factor[2], 1.0, rtol=1e-12)
    np.testing.assert_allclose(lean.factor[0], ((index - 1) / (index + 1)) ** 2, rtol=1e-12)


def test_gamma_needs_no_glass() -> None:
    """Index 1 reflects nothing head-on; the exponent stays."""
    np.testing.assert_allclose(fresnel_factors(8, 1.0, "paper").gamma, PAPERS_GAMMA)
    physical = fresnel_factors(8, 1.0, "physical").gamma
    np.testing.assert_allclose(physical, fresnel_factors(8, 1.7, "physical").gamma, rtol=1e-12)


@given(indices, st.sampled_from(["paper", "physical"]))
def test_the_interpolation_is_exact_where_the_table_is(index: float, variant: Fresnel) -> None:
    bins = 32
    lean = fresnel_factors(bins, index, variant)
    flat = np.ones(bins) if variant == "paper" else np.cos(bin_centres(bins))
    found = interpolated_fresnel(lean, np.array([0.0, np.pi / 3, np.pi / 2]))
    expected = np.stack([schlick(index, c * flat) for c in (1.0, 0.5, 0.0)])
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    np.testing.assert_allclose(lean.factor, expected, rtol=1e-9)
    np.testing.assert_allclose(
        interpolated_fresnel(lean, np.array([-np.pi / 3])), found[1:2], rtol=1e-12
    )
    assert (0.0, np.pi / 3, np.pi / 2) == TABULATED_THETA


def test_the_physical_gamma_follows_equation_4() -> None:
    bins, index = 8, 1.5
    lean = fresnel_factors(bins, index, "physical")
    low, middle, high = lean.factor
    quotient = (middle - low) / (high - low)
    np.testing.assert_allclose(lean.gamma, np.log(quotient) / np.log(2 / 3), rtol=1e-9)
    assert np.ptp(lean.gamma) > 1.0
    np.testing.assert_allclose(lean.gamma, lean.gamma[::-1], rtol=1e-9)


def test_the_papers_interpolation_is_off_by_5_per_cent_at_most() -> None:
    error = interpolation_error(BINS, 1.5, "paper")
    assert set(error) == {"largest", "mean"}
    assert error["largest"] == pytest.approx(0.050, abs=0.0005)
    assert error["mean"] == pytest.approx(0.0137, abs=0.00005)
    # Once more, written out.
    theta = np.linspace(0, np.pi / 2, 2001)
    true = 0.04 + 0.96 * (1 - np.cos(theta)) ** 5
    shown = 0.04 + 0.96 * (2 * theta / np.pi) ** PAPERS_GAMMA
    off = np.abs(shown / true - 1)
    assert error["largest"] == pytest.approx(off.max(), rel=1e-9)
    assert error["mean"] == pytest.approx(off.mean(), rel=1e-9)


def test_the_physical_interpolation_has_an_error_for_every_phi() -> None:
    """Bin by bin, by equations 2 to 4 written out."""
    theta = np.linspace(0, np.pi / 2, 2001)
    errors = []
    for flat in np.cos((np.arange(BINS) + 0.5) / BINS * np.pi - np.pi / 2):
        true = 0.04 + 0.96 * (1 - np.cos(theta) * flat) ** 5
        low, middle = 0.04 + 0.96 * (1 - flat) ** 5, 0.04 + 0.96 * (1 - flat / 2) ** 5
        gamma = math.log((middle - low) / (1 - low)) / math.log(2 / 3)
        shown = low + (1 - low) * (2 * theta / np.pi) ** gamma
        errors.append(np.abs(shown / true - 1))
    found = interpolation_error(BINS, 1.5, "physical")
    assert found["largest"] == pytest.approx(np.max(errors), rel=1e-9)
    assert found["mean"] == pytest.approx(np.mean(errors), rel=1e-9)


# ---- tables ----------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", [V, W], ids=["v", "w"])
def test_the_exact_table_is_the_solved_one(profile: NDArray[np.float64]) -> None:
    found = made(profile, "exact")
    solved = solve_radiosity(view_factors(profile, BINS, 80), 0.8)
    np.testing.assert_array_equal(found.rho, solved.rho)
    np.testing.assert_array_equal(found.absorbed, solved.absorbed)
    np.testing.assert_array_equal(found.standard_error, 0.0)
    assert found.across.shape == (PLACES, BINS, BINS)
    assert found.across.dtype == np.float32


@pytest.mark.parametrize("profile", [V, W], ids=["v", "w"])
def test_the_mean_over_places_is_the_table(profile: NDArray[np.float64]) -> None:
    found = made(profile, "exact")
    np.testing.assert_allclose(found.across.astype(np.float64).mean(axis=0), found.rho, rtol=1e-6)
    # Not for lack of differences between the places.
    assert np.ptp(found.across, axis=0).mean() > 0.1 * found.rho.mean()
    shot = made(profile, "paths")
    np.testing.assert_allclose(
        shot.across.astype(np.float64).mean(axis=0), shot.rho.T, rtol=1e-5, atol=1e-7
    )


@pytest.mark.parametrize("profile", [V, W], ids=["v", "w"])
def test_paths_find_the_exact_table(profile: NDArray[np.float64]) -> None:
    exact, shot = made(profile, "exact"), made(profile, "paths")
    assert (shot.standard_error > 0).mean() > 0.9
    often = shot.standard_error * 5 < shot.rho
    z = (shot.rho - exact.rho)[often] / shot.standard_error[often]
    assert often.mean() > 0.7
    assert np.abs(z).max() < 4.5
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1.0, abs=0.15)
    np.testing.assert_allclose(shot.absorbed, exact.absorbed, atol=0.012)
    np.testing.assert_allclose(leaving_share(shot.rho) + shot.absorbed, 1.0, rtol=1e-12)


@pytest.mark.parametrize("profile", [V, W], ids=["v", "w"])
def test_both_methods_agree_on_every_place(profile: NDArray[np.float64]) -> None:
    """Places of a view: seen facets on one side, by reciprocity counted paths on the other."""
    exact, shot = made(profile, "exact"), made(profile, "paths")
    middle = slice(4, 12)  # steep views, whose bins are like their middles
    one = exact.across[:, middle, middle].astype(np.float64)
    other = shot.across[:, middle, middle].astype(np.float64)
    assert np.corrcoef(one.ravel(), other.ravel())[0, 1] > 0.97
    assert np.abs(one.mean(axis=2) - other.mean(axis=2)).max() < 0.25 * one.mean()
    mirrored = np.corrcoef(one[::-1].ravel(), other.ravel())[0, 1]
    assert mirrored < 0.9


@pytest.mark.parametrize("method", ["exact", "paths"])
def test_settings_out_of_range_are_refused(method: Method) -> None:
    with pytest.raises(ValueError, match=r"^albedo is 1\.5; expected 0 to 1\.$"):
        made(V, method, albedo=1.5)
