"""Evaluate, sample and pdf against each other, quadrature and the laws of a BRDF."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray
from scipy.stats import chi2

from pipelines.glass_scratches.tables import sampling
from pipelines.glass_scratches.tables.bins import bin_centres, bin_weights
from pipelines.glass_scratches.tables.lobe import Direction, Lobe, lobe_from_sums, make_lobe
from pipelines.glass_scratches.tables.profiles import built_in_profile
from pipelines.glass_scratches.tables.scratch_table import scratch_brdf_table

Floats = NDArray[np.float64]

BINS = 16
PLACE = 5
VIEWS = [(0.0, 0.0), (0.6, 0.5), (-1.0, 1.2)]
"""theta along the scratch, phi across it; radians."""


def lobe(roughness: float, albedo: float = 0.8) -> Lobe:
    made = scratch_brdf_table(
        built_in_profile("v", 10.0, 4.0),
        bins=BINS,
        albedo=albedo,
        roughness=roughness,
        method="exact" if roughness == 1.0 else "paths",
        facets=60,
        rays=4000,
        paths_per_ray=1,
        seed=1,
    )
    return make_lobe(made.across, roughness)


@pytest.fixture(scope="module", params=[1.0, 0.3], ids=["diffuse", "roughness 0.3"])
def table(request: pytest.FixtureRequest) -> Lobe:
    return lobe(request.param)


@njit
def _samples(table: Lobe, place: int, view: Direction, numbers: Floats, found: Floats) -> None:
    for i in range(len(numbers)):
        found[i] = sampling.sample(table, place, view, numbers[i, 0], numbers[i, 1], numbers[i, 2])


@njit
def _values(
    table: Lobe, place: int, view: Direction, lights: Floats, f: Floats, density: Floats
) -> None:
    for i in range(len(lights)):
        light = Direction(lights[i, 0], lights[i, 1], lights[i, 2])
        f[i] = sampling.evaluate(table, place, view, light)
        density[i] = sampling.pdf(table, place, view, light)


@njit
def _kernel(views: Floats, lights: Floats, blur: float, found: Floats) -> None:
    for i in range(len(views)):
        for j in range(len(lights)):
            found[i, j] = sampling.theta_kernel(views[i], lights[j], blur)


def direction(theta: Floats | float, phi: Floats | float) -> Floats:
    parts = np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def values(table: Lobe, view: Floats, lights: Floats, place: int = PLACE) -> tuple[Floats, Floats]:
    flat = np.ascontiguousarray(lights.reshape(-1, 3))
    f, density = np.empty(len(flat)), np.empty(len(flat))
    _values(table, place, Direction(*view), flat, f, density)
    return f.reshape(lights.shape[:-1]), density.reshape(lights.shape[:-1])


def kernel(views: Floats, lights: Floats, blur: float) -> Floats:
    found = np.empty((len(views), len(lights)))
    _kernel(views, lights, blur, found)
    return found


def grid(phis: int, thetas: int) -> tuple[Floats, Floats]:
    """Lights (phis, thetas, 3), ``phis`` middles in each bin, and their cos theta dtheta dphi."""
    phi = (np.arange(BINS * phis) + 0.5) / (BINS * phis) * np.pi - np.pi / 2
    theta = (np.arange(thetas) + 0.5) / thetas * np.pi - np.pi / 2
    lights = direction(theta[None], phi[:, None])
    weight = np.cos(theta) * np.pi / thetas * np.pi / (BINS * phis)
    return lights, np.broadcast_to(weight, lights.shape[:-1])


# ---- sample, pdf and f -----------------------------------------------------------------------


@pytest.mark.parametrize("view", VIEWS)
def test_samples_fall_as_the_pdf_has_them(table: Lobe, view: tuple[float, float]) -> None:
    """Chi square over cells of phi (the bins) and theta (24 of 7.5 degrees)."""
    count, cells, fine = 60_000, 24, 20
    rng = np.random.default_rng(2)
    found = np.empty((count, 3))
    o = direction(*view)
    _samples(table, PLACE, Direction(*o), rng.random((count, 3)), found)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-12)
    assert (found[:, 2] >= 0).all()
    phi = np.arctan2(found[:, 1], found[:, 2])
    theta = np.arcsin(found[:, 0])
    edge = np.pi / 2
    counts, _, _ = np.histogram2d(phi, theta, [BINS, cells], [[-edge, edge], [-edge, edge]])
    lights, weight = grid(4, cells * fine)
    density = values(table, o, lights)[1] * weight
    expected = count * density.reshape(BINS, 4, cells, fine).sum(axis=(1, 3))
    common = expected > 8
    assert common.sum() > 40
    statistic = ((counts - expected)[common] ** 2 / expected[common]).sum()
    assert chi2.sf(statistic, common.sum()) > 1e-4
    assert chi2.sf(statistic, common.sum()) < 1 - 1e-4
    assert counts[~common].sum() < 2 * expected[~common].sum() + 10


@pytest.mark.parametrize("view", VIEWS)
def test_the_pdf_integrates_to_one(table: Lobe, view: tuple[float, float]) -> None:
    lights, weight = grid(8, 1000)
    f, density = values(table, direction(*view), lights)
    assert (density * weight).sum() == pytest.approx(1.0, abs=2e-3)
    row = table.share[PLACE, int((view[1] / np.pi + 0.5) * BINS)]
    assert (f * lights[..., 2] * weight).sum() == pytest.approx(row, rel=2e-3)


def test_the_weight_of_a_sample_is_the_share(table: Lobe) -> None:
    """Eq. 5: f cos over the density is the same for all lights of a view."""
    lights, _ = grid(1, 51)
    for view in VIEWS:
        f, density = values(table, direction(*view), lights)
        seen = density > 1e-12
        row = table.share[PLACE, int((view[1] / np.pi + 0.5) * BINS)]
        np.testing.assert_allclose((f * lights[..., 2])[seen] / density[seen], row, rtol=1e-6)
        assert seen.mean() > 0.05


def test_the_share_is_what_leaves(table: Lobe) -> None:
    np.testing.assert_allclose(
        table.share, table.rho.astype(np.float64) @ bin_weights(BINS) / np.pi, rtol=1e-6
    )
    np.testing.assert_array_equal(table.cdf[..., 0], 0.0)
    np.testing.assert_array_equal(table.cdf[..., -1], 1.0)
    assert (np.diff(table.cdf, axis=-1) >= 0).all()


def test_all_that_meets_white_walls_leaves_from_every_place() -> None:
    white = lobe(1.0, albedo=1.0)
    np.testing.assert_allclose(white.share.mean(axis=0), 1.0, rtol=1e-6)
    np.testing.assert_allclose(white.share, 1.0, atol=0.005)
    grey = lobe(1.0, albedo=0.5)
    assert grey.share.max() < 0.5 + 1e-6
    assert np.ptp(grey.share, axis=0).max() > 0.05


def test_diffuse_light_does_not_know_the_lean() -> None:
    table = lobe(1.0)
    phi = bin_centres(BINS)
    upright = values(table, direction(0.0, 0.3), direction(0.0, phi))[0]
    leaning = values(table, direction(-1.1, 0.3), direction(0.9, phi))[0]
    np.testing.assert_allclose(upright, leaning, rtol=1e-12)
    row = int((0.3 / np.pi + 0.5) * BINS)
    np.testing.assert_allclose(upright, 2 / np.pi**2 * table.rho[PLACE, row], rtol=1e-6)


@pytest.mark.parametrize("blur", [math.inf, 0.5, 0.1])
def test_light_and_view_may_be_swapped(blur: float) -> None:
    """At the middles of bins and on average over the places, by the exact table."""
    table = lobe(1.0)._replace(blur=blur)
    rng = np.random.default_rng(3)
    thetas = rng.uniform(-1.3, 1.3, (40, 2))
    columns = rng.integers(0, BINS, (40, 2))
    differed = 0.0
    for (one, other), (left, right) in zip(thetas, columns, strict=True):
        a = direction(one, bin_centres(BINS)[left])
        b = direction(other, bin_centres(BINS)[right])
        there = [values(table, a, b[None], place)[0][0] for place in range(len(table.rho))]
        back = [values(table, b, a[None], place)[0][0] for place in range(len(table.rho))]
        assert np.mean(there) == pytest.approx(np.mean(back), rel=1e-5, abs=1e-12)
        differed = max(differed, float(np.abs(np.subtract(there, back)).max()))
    assert differed > 0.01


def test_nothing_below_the_surface(table: Lobe) -> None:
    up, down, flat = direction(0.2, 0.3), -direction(0.2, 0.3), np.array([1.0, 0.0, 0.0])
    both = np.stack([up, down, flat])
    f, density = values(table, up, both)
    assert f[0] > 0
    assert density[0] > 0
    np.testing.assert_array_equal([*f[1:], *density[1:]], 0.0)
    for view in (down, flat):
        f, density = values(table, view, both)
        np.testing.assert_array_equal([*f, *density], 0.0)


def test_black_walls_reflect_nothing() -> None:
    table = lobe(1.0, albedo=0.0)
    f, density = values(table, direction(0.1, 0.2), direction(0.0, bin_centres(BINS)))
    np.testing.assert_array_equal([f, density], 0.0)
    np.testing.assert_array_equal(table.share, 0.0)
    assert np.isfinite(table.cdf).all()


def test_a_mirror_turns_the_lean_over() -> None:
    table = lobe(0.0)
    numbers = np.random.default_rng(4).random((4000, 3))
    found = np.empty((4000, 3))
    view = direction(0.7, 0.2)
    _samples(table, PLACE, Direction(*view), numbers, found)
    assert np.median(found[:, 0]) == pytest.approx(-math.sin(0.7), abs=2e-3)
    assert np.ptp(found[:, 0]) < 0.2


# ---- the lean --------------------------------------------------------------------------------


def test_the_quantile_is_the_integral_of_the_squared_cosine() -> None:
    theta = np.linspace(-np.pi / 2, np.pi / 2, 20_001)
    middles = (theta[1:] + theta[:-1]) / 2
    running = np.cumsum(np.cos(middles) ** 2) * (theta[1] - theta[0]) * 2 / np.pi
    found = [sampling.theta_quantile(float(np.sin(t))) for t in theta[1::500]]
    np.testing.assert_allclose(found, running[::500], atol=1e-7)
    assert (sampling.theta_quantile(-1.0), sampling.theta_quantile(0.0)) == (0.0, 0.5)
    assert sampling.theta_quantile(1.0 + 1e-9) == sampling.theta_quantile(1.0) == 1.0


def test_the_lean_of_a_quantile_is_found_again() -> None:
    shares = np.concatenate([np.linspace(0, 1, 401), [1e-12, 1e-8, 1e-4, 1 - 1e-4, 1 - 1e-9]])
    sines = np.array([sampling.sine_of_quantile(c) for c in shares])
    np.testing.assert_allclose([sampling.theta_quantile(s) for s in sines], shares, atol=1e-12)
    assert (np.diff(sines[:401]) > 0).all()
    inner = np.sin(np.linspace(-1.5, 1.5, 101))
    again = [sampling.sine_of_quantile(sampling.theta_quantile(s)) for s in inner]
    np.testing.assert_allclose(again, inner, atol=1e-9)


@pytest.mark.parametrize("blur", [0.02, 0.1, 0.39, 0.41, 1.0, 5.0])
def test_the_lean_is_blurred_and_folded(blur: float) -> None:
    """Against a hundred images of a Gaussian; symmetric and of mean one."""
    shares = np.linspace(0, 1, 41)
    found = kernel(shares, shares, blur)
    np.testing.assert_allclose(found, found.T, rtol=1e-9, atol=1e-12)
    if blur < 5:
        shift = 2 * np.arange(-50, 51)[:, None, None]
        images = 0
        for sign in (-1, 1):
            z = (sign * shares + shift - (1 - shares[:, None])) / blur
            images = images + np.exp(-(z**2) / 2).sum(axis=0)
        expected = images / (blur * math.sqrt(2 * np.pi))
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-9)
    middles = (np.arange(2000) + 0.5) / 2000
    np.testing.assert_allclose(kernel(shares, middles, blur).mean(axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(found[::-1, ::-1], found, rtol=1e-7, atol=1e-9)


def test_both_series_meet_at_a_blur_of_0_4() -> None:
    shares = np.linspace(0, 1, 41)
    below, above = (kernel(shares, shares, blur) for blur in (0.4, 0.4 + 1e-12))
    np.testing.assert_allclose(below, above, rtol=1e-9)
    assert (below != above).any()
    assert np.ptp(below) > 1


def test_a_diffuse_lean_is_even() -> None:
    shares = np.linspace(0, 1, 5)
    np.testing.assert_array_equal(kernel(shares, shares, math.inf), 1.0)
    np.testing.assert_allclose(kernel(shares, shares, 5.0), 1.0, atol=1e-12)


# ---- lobes -----------------------------------------------------------------------------------


def test_the_blur_of_a_lobe_is_half_that_of_a_bounce() -> None:
    across = np.ones((2, 8, 8), np.float32)
    assert make_lobe(across, 1.0).blur == math.inf
    assert make_lobe(across, 0.5).blur == pytest.approx(0.5)
    assert make_lobe(across, 0.0).blur == 0.01
    again = make_lobe(across, 0.5)
    kept = lobe_from_sums(across, again.cdf, again.share, 0.5)
    for one, other in zip(again, kept, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_allclose(np.diff(np.arcsin(kept.sines)), np.pi / 8)


@pytest.mark.parametrize("roughness", [-0.1, 1.1, math.nan])
def test_a_roughness_outside_0_to_1_is_refused(roughness: float) -> None:
    with pytest.raises(ValueError, match=rf"^roughness is {roughness:g}; expected 0 \(mirror\)"):
        make_lobe(np.ones((2, 8, 8), np.float32), roughness)
