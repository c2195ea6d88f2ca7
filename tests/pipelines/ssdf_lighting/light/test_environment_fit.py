"""Lights fitted to maps: known sums of Gaussians found again, light conserved, sun and dome."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.light.built_in_environments import lamps, sky, uniform
from pipelines.light.environment_maps import rotate_environment, solid_angles, texel_directions
from pipelines.ssdf_lighting.light.environment_fit import Fit, fit_lights
from pipelines.ssdf_lighting.light.fit_quality import fit_errors, flux_error
from pipelines.ssdf_lighting.light.sphere_maps import blurred, downsampled
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, evaluate, integral


def flux_of_map(light: NDArray[np.floating]) -> NDArray[np.float64]:
    return np.einsum("h,hwc->c", solid_angles(len(light)), light.astype(np.float64))


def flux_of(lights: Lights) -> NDArray[np.float64]:
    return np.einsum("n,nc->c", integral(lights.sharpness), lights.amplitudes)


def towards(azimuth: float, elevation: float) -> NDArray[np.float64]:
    a, e = math.radians(azimuth), math.radians(elevation)
    return np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])


def irradiance(light: NDArray[np.floating], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    falling = np.maximum(np.einsum("nk,hwk->nhw", normals, texel_directions(len(light))), 0.0)
    return np.einsum("nhw,h,hwc->nc", falling, solid_angles(len(light)), light.astype(np.float64))


@pytest.fixture(scope="module")
def clear() -> NDArray[np.float32]:
    return sky(128, sun_azimuth=40.0, sun_elevation=35.0, sun_radius=0.8)


@pytest.fixture(scope="module")
def clear_fit(clear: NDArray[np.float32]) -> Fit:
    return fit_lights(clear, 16)


# ---- the map ---------------------------------------------------------------------------------


@pytest.mark.parametrize("height", [1, 5, 64, 96, 128])
def test_averaging_keeps_the_flux_and_even_light(height: int) -> None:
    light = np.random.default_rng(height).random((height, 2 * height, 3)).astype(np.float32)
    np.testing.assert_allclose(flux_of_map(downsampled(light, 64)), flux_of_map(light), rtol=1e-12)
    np.testing.assert_allclose(downsampled(uniform(height), 64), 1.0, rtol=1e-12)


def test_averaging_by_a_whole_number_is_a_weighted_mean() -> None:
    light = np.random.default_rng(1).random((12, 24, 3)).astype(np.float32)
    weights = np.broadcast_to(solid_angles(12)[:, None, None], (12, 24, 1))
    sums = (light * weights).reshape(4, 3, 8, 3, 3).sum(axis=(1, 3))
    expected = sums / weights.reshape(4, 3, 8, 3, 1).sum(axis=(1, 3))
    np.testing.assert_allclose(downsampled(light, 4), expected, rtol=1e-12)
    with pytest.raises(ValueError, match=r"^height is 0; expected 1 or more\.$"):
        downsampled(light, 0)


def test_blurring_is_a_mean_over_the_surroundings() -> None:
    light = np.random.default_rng(2).random((8, 16, 3))
    ways = texel_directions(8).reshape(-1, 3)
    kernel = np.exp(20.0 * (ways @ ways.T - 1)) * np.repeat(solid_angles(8), 16)
    expected = kernel / kernel.sum(axis=1, keepdims=True) @ light.reshape(-1, 3)
    np.testing.assert_allclose(blurred(light, 20.0).reshape(-1, 3), expected, rtol=1e-10)


# ---- known lights ----------------------------------------------------------------------------


def test_a_sum_of_gaussians_is_found_again() -> None:
    true = Lights(
        np.stack([towards(-100, 20), towards(30, 60), towards(150, -25), towards(60, -60)]),
        np.array([4.0, 60.0, 15.0, 2.0]),
        np.array([[1.0, 0.2, 0.1], [9.0, 8.0, 7.0], [0.0, 1.0, 3.0], [0.3, 0.3, 0.3]]),
    )
    fit = fit_lights(evaluate(true, texel_directions(64)).astype(np.float32), 4)
    nearest = np.argmax(true.axes @ fit.lights.axes.T, axis=1)
    assert sorted(nearest) == [0, 1, 2, 3]
    found = Lights(*(values[nearest] for values in fit.lights))
    assert (np.einsum("nk,nk->n", found.axes, true.axes) > math.cos(math.radians(0.5))).all()
    np.testing.assert_allclose(found.sharpness, true.sharpness, rtol=0.05)
    np.testing.assert_allclose(found.amplitudes, true.amplitudes, rtol=0.05, atol=0.02)
    assert fit.errors.error < 0.01
    assert fit.errors.tone_error < 0.01
    assert fit.errors.irradiance_error < 0.002


def test_a_small_lamp_is_in_its_direction_with_its_colour() -> None:
    light = np.full((64, 128, 3), 1e-3, np.float32)
    light[20, 33] = (5000.0, 2000.0, 500.0)
    fit = fit_lights(light, 2)
    brightest = int(np.argmax(fit.lights.amplitudes[:, 0]))
    cosine = float(fit.lights.axes[brightest] @ texel_directions(64)[20, 33])
    assert cosine > math.cos(math.radians(0.3))
    power = fit.lights.amplitudes[brightest] * integral(fit.lights.sharpness[brightest])
    np.testing.assert_allclose(power, np.array([5000, 2000, 500]) * solid_angles(64)[20], rtol=0.02)


# ---- maps ------------------------------------------------------------------------------------


def test_a_clear_sky_has_its_sun_and_its_dome(clear: NDArray[np.float32], clear_fit: Fit) -> None:
    """The sun's flux at the sun, and farther off each part of the dome as bright as it is."""
    assert clear.max() > 1000 * np.median(clear)
    lights = clear_fit.lights
    sun = int(np.argmax(lights.amplitudes[:, 1]))
    assert lights.axes[sun] @ towards(40.0, 35.0) > math.cos(math.radians(0.5))
    bright = clear.astype(np.float64) * (clear[..., 1:2] > 50)
    power = lights.amplitudes[sun] * integral(lights.sharpness[sun])
    np.testing.assert_allclose(power, flux_of_map(bright), rtol=0.05)

    ways = texel_directions(64)
    dome, found = downsampled(clear, 64), evaluate(lights, ways)
    away = ways @ towards(40.0, 35.0) < math.cos(math.radians(12.0))
    away &= np.abs(ways[..., 2]) > 0.15  # the horizon is an edge
    ratio = (found / dome)[away]
    assert 0.6 < ratio.min() < ratio.max() < 1.7
    assert np.sqrt(np.mean((ratio - 1) ** 2)) < 0.15
    assert np.sqrt(np.mean((ratio[:, 1] - 1) ** 2)) < 0.08


def test_irradiance_is_near(clear: NDArray[np.float32], clear_fit: Fit) -> None:
    assert clear_fit.errors.irradiance_error < 0.005
    normals = np.stack([towards(a, e) for a in (0, 90, 200) for e in (-60, 10, 45, 80)])
    expected = irradiance(clear, normals)
    sun = clear_fit.lights.sharpness > 1000.0  # too narrow for texels
    soft = Lights(*(values[~sun] for values in clear_fit.lights))
    found = irradiance(evaluate(soft, texel_directions(128)), normals)
    beams = Lights(*(values[sun] for values in clear_fit.lights))
    flux = beams.amplitudes * integral(beams.sharpness)[:, None]
    found += np.maximum(normals @ beams.axes.T, 0.0) @ flux
    np.testing.assert_allclose(found, expected, rtol=0.03, atol=0.005 * expected.max())


@pytest.mark.parametrize(
    ("light", "count"),
    [
        (lamps(96), 5),
        pytest.param(lamps(96), 20, marks=pytest.mark.slow),
        (uniform(8, 3e-5), 3),
        (np.float32(1e30) * lamps(10), 1),
        (np.exp(np.random.default_rng(3).normal(0, 3, (6, 12, 3))).astype(np.float32), 8),
    ],
    ids=["lamps-5", "lamps-20", "uniform", "one", "rough"],
)
def test_the_flux_is_conserved_in_each_channel(light: NDArray[np.float32], count: int) -> None:
    fit = fit_lights(light, count)
    lights = fit.lights
    assert lights.axes.shape == lights.amplitudes.shape == (count, 3)
    assert lights.sharpness.shape == (count,)
    assert {values.dtype for values in lights} == {np.dtype(np.float64)}
    np.testing.assert_allclose(np.linalg.norm(lights.axes, axis=1), 1.0, rtol=1e-12)
    assert (lights.amplitudes >= 0).all()
    assert (lights.sharpness >= 0.5).all()
    assert (lights.sharpness <= 1000.0).all()
    np.testing.assert_allclose(flux_of(lights), flux_of_map(light), rtol=1e-9)


def test_more_lights_fit_lamps_better() -> None:
    light = lamps(64)
    few, some, many = (fit_lights(light, count) for count in (4, 8, 16))
    assert few.errors.irradiance_error > some.errors.irradiance_error > many.errors.irradiance_error
    assert few.errors.error > some.errors.error > many.errors.error
    assert many.errors.irradiance_error < 0.003
    assert many.errors.error < 0.3


def test_an_even_map_is_even() -> None:
    fit = fit_lights(uniform(16, 2.0), 8)
    np.testing.assert_allclose(evaluate(fit.lights, texel_directions(12)), 2.0, rtol=0.005)
    assert fit.errors.error < 0.002


def test_a_black_channel_stays_black() -> None:
    light = lamps(64)
    light[..., 2] = 0.0
    np.testing.assert_array_equal(fit_lights(light, 6).lights.amplitudes[:, 2], 0.0)


def test_the_scale_of_the_map_is_that_of_the_lights() -> None:
    light = lamps(64)
    one, other = fit_lights(light, 5), fit_lights(light * np.float32(1024.0), 5)
    np.testing.assert_allclose(other.lights.axes, one.lights.axes, atol=1e-6)
    np.testing.assert_allclose(
        other.lights.amplitudes, 1024.0 * one.lights.amplitudes, rtol=1e-5, atol=1e-6
    )
    assert other.errors == pytest.approx(one.errors, rel=1e-5)


def test_a_rotated_map_is_fitted_as_well() -> None:
    light = lamps(64)
    one, other = fit_lights(light, 12), fit_lights(rotate_environment(light, 77.0), 12)
    assert other.errors.error < 1.3 * one.errors.error
    assert other.errors.irradiance_error < 0.005


def test_fits_repeat_for_a_seed_and_report_progress() -> None:
    light, told = lamps(64), list[float]()
    one = fit_lights(light, 6, seed=5, progress=told.append)
    other = fit_lights(light, 6, seed=5)
    for left, right in zip(one.lights, other.lights, strict=True):
        np.testing.assert_array_equal(left, right)
    assert told == sorted(told)
    assert told[0] > 0
    assert told[-1] == 1.0
    assert len(told) == 7


def test_the_bounds_of_sharpness_hold_but_for_suns() -> None:
    """In a map whose texels are smaller than the sun."""
    clear = sky(512, sun_azimuth=40.0, sun_elevation=35.0, sun_radius=0.8)
    sharpness = fit_lights(clear, 6, least_sharpness=5.0, most_sharpness=50.0).lights.sharpness
    assert sharpness[:-1].min() >= 5.0
    assert sharpness[:-1].max() <= 50.0
    assert sharpness[-1] == pytest.approx(4.0 / math.radians(0.8) ** 2, rel=0.2)


def test_errors_know_another_light(clear: NDArray[np.float32], clear_fit: Fit) -> None:
    """Nulls: one even light of the same flux, and the lights upside down."""
    flux = flux_of_map(clear)[None] / integral([1e-3])[:, None]
    even = fit_errors(Lights(np.array([[0.0, 0.0, 1.0]]), np.array([1e-3]), flux), clear)
    turned = clear_fit.lights._replace(axes=clear_fit.lights.axes * [1.0, 1.0, -1.0])
    for null in (even, fit_errors(turned, clear)):
        assert null.shadowed_error > 30 * clear_fit.errors.shadowed_error
    assert clear_fit.errors.shadowed_error < 0.01
    assert flux_error(clear_fit.lights, clear) < 1e-6


@pytest.mark.parametrize("count", [0, 25])
def test_a_count_out_of_range_is_refused(count: int) -> None:
    with pytest.raises(ValueError, match=rf"^count is {count}; expected 1 to 24 lights\.$"):
        fit_lights(uniform(8), count)


def test_what_is_no_map_and_bounds_out_of_order_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^environment: found shape \(8, 8, 3\)"):
        fit_lights(np.ones((8, 8, 3), np.float32), 4)
    with pytest.raises(ValueError, match=r"^environment: found nothing but black"):
        fit_lights(np.zeros((8, 16, 3), np.float32), 4)
    for bounds in ((0.0, 9.0), (9.0, 9.0), (1.0, math.inf), (math.nan, 9.0)):
        with pytest.raises(ValueError, match=r"^sharpness is \S+ to \S+; expected a finite range"):
            fit_lights(uniform(8), 4, least_sharpness=bounds[0], most_sharpness=bounds[1])
