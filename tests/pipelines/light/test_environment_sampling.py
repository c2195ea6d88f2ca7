"""Sampling of environments against its own density."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

from pipelines.drawing.colour import luminance
from pipelines.light.built_in_environments import lamps, sky, uniform
from pipelines.light.environment_lookup import (
    radiance_from_direction,
    radiance_from_directions,
    texel_of_direction,
)
from pipelines.light.environment_maps import (
    solid_angles,
)
from pipelines.light.environment_sampling import (
    EnvironmentSampler,
    direction_pdf,
    direction_pdfs,
    make_environment_sampler,
    sample_direction,
    sample_directions,
)
from tests.pipelines.light.example_maps import (
    integral,
    one_light,
    rough_map,
)

ALMOST_ONE = math.nextafter(1.0, 0.0)
fractions = st.floats(0.0, 1.0)


@pytest.fixture(scope="module")
def rough() -> EnvironmentSampler:
    return make_environment_sampler(rough_map(8))


def test_the_density_is_the_luminance_and_1_percent_of_its_mean() -> None:
    light = rough_map(16)
    bright = luminance(light.astype(np.float64))
    expected = bright + 0.01 * integral(bright) / (4 * math.pi)
    made = make_environment_sampler(light)
    np.testing.assert_allclose(made.density, expected / integral(expected), rtol=1e-12)
    assert made.density.dtype == made.row_cdf.dtype == made.column_cdf.dtype == np.float64
    assert made.radiance.dtype == np.float32
    np.testing.assert_array_equal(made.radiance, light)


@pytest.mark.parametrize("height", [1, 2, 3, 8, 64])
def test_the_density_integrates_to_1_and_the_sums_belong_to_it(height: int) -> None:
    made = make_environment_sampler(rough_map(height, seed=5))
    assert integral(made.density) == pytest.approx(1.0, rel=1e-12)
    assert made.row_cdf.shape == (height + 1,)
    assert made.column_cdf.shape == (height, 2 * height + 1)
    assert made.row_cdf[0] == 0.0
    assert made.row_cdf[-1] == 1.0
    assert (made.column_cdf[:, 0] == 0.0).all()
    assert (made.column_cdf[:, -1] == 1.0).all()
    chances = np.diff(made.row_cdf)[:, None] * np.diff(made.column_cdf, axis=1)
    np.testing.assert_allclose(
        chances, made.density * solid_angles(height)[:, None], rtol=1e-9, atol=1e-15
    )


def test_light_that_is_faint_to_the_eye_is_sampled() -> None:
    light = one_light(8, 2, 3)
    light[5, 5] = (0.0, 0.0, 1e-6)
    made = make_environment_sampler(light)
    assert (made.density > 0).all()
    assert (np.diff(made.row_cdf) > 0).all()
    assert (np.diff(made.column_cdf, axis=1) > 0).all()


def test_a_uniform_map_is_sampled_evenly() -> None:
    directions, found = sample_directions(
        make_environment_sampler(uniform(8)), np.random.default_rng(1).random((100_000, 2))
    )
    np.testing.assert_allclose(found, 1 / (4 * math.pi), rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(directions.mean(axis=0), 0.0, atol=0.01)
    np.testing.assert_allclose(directions.T @ directions / len(found), np.eye(3) / 3, atol=0.01)


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_samples_fall_as_the_density_says(rough: EnvironmentSampler, seed: int) -> None:
    """Chi-square over quarters of texels of equal solid angle: within texels too."""
    count = 400_000
    directions, _ = sample_directions(rough, np.random.default_rng(seed).random((count, 2)))
    borders = np.cos(np.arange(9) * (math.pi / 8))
    middles = 0.5 * (borders[:-1] + borders[1:])
    rungs = np.sort(np.concatenate([borders, middles]))
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    counted, _, _ = np.histogram2d(
        -directions[:, 2],
        -azimuth,
        bins=[-rungs[::-1], np.linspace(-math.pi, math.pi, 33)],
    )
    expected = count * rough.density * solid_angles(8)[:, None] / 4
    expected = np.repeat(np.repeat(expected, 2, axis=0), 2, axis=1)
    often = expected >= 5
    rest = count - counted[often].sum(), count - expected[often].sum()
    assert often.sum() > 100
    statistic = ((counted - expected) ** 2 / expected)[often].sum()
    statistic += (rest[0] - rest[1]) ** 2 / rest[1]
    assert counted.sum() == count
    assert chi2.sf(statistic, often.sum()) > 1e-4


def test_samples_estimate_irradiance_without_bias() -> None:
    made = make_environment_sampler(sky(64, sun_azimuth=40.0, sun_elevation=35.0))
    directions, found = sample_directions(made, np.random.default_rng(4).random((200_000, 2)))
    estimates = radiance_from_directions(made.radiance, directions) / found[:, None]
    estimates *= np.maximum(directions[:, 2:], 0.0)
    ground = made.radiance[-1, 0].astype(np.float64)
    error = estimates.std(axis=0) / math.sqrt(len(found))
    assert (error < 0.01 * estimates.mean(axis=0)).all()
    assert (np.abs(estimates.mean(axis=0) - ground * math.pi / 0.2) < 4 * error).all()


def test_the_density_integrates_to_1_by_even_samples() -> None:
    made = make_environment_sampler(lamps(32))
    evenly, _ = sample_directions(
        make_environment_sampler(uniform(1)), np.random.default_rng(6).random((400_000, 2))
    )
    found = direction_pdfs(made, evenly) * 4 * math.pi
    assert abs(found.mean() - 1) < 4 * found.std() / math.sqrt(len(found))
    assert found.mean() == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("height", [1, 2, 3, 8, 129])
def test_a_samples_density_is_that_of_its_direction_to_the_bit(height: int) -> None:
    made = make_environment_sampler(rough_map(height, seed=height))
    u = np.random.default_rng(height).random((50_000, 2))
    u[:9] = [(a, b) for a in (0.0, 1.0, 0.5) for b in (0.0, 1.0, 0.5)]
    directions, found = sample_directions(made, u)
    np.testing.assert_array_equal(found, direction_pdfs(made, directions))


def test_all_borders_of_the_sums_lead_into_the_texels_they_begin() -> None:
    made = make_environment_sampler(rough_map(12))
    for row in range(12):
        for column in range(24):
            for u1, u2 in (
                (made.row_cdf[row], made.column_cdf[row, column]),
                (
                    np.nextafter(made.row_cdf[row + 1], 0.0),
                    np.nextafter(made.column_cdf[row, column + 1], 0.0),
                ),
            ):
                x, y, z, found = sample_direction(
                    made.row_cdf, made.column_cdf, made.density, u1, u2
                )
                assert texel_of_direction(12, 24, x, y, z) == (row, column)
                assert found == made.density[row, column]


@pytest.mark.parametrize("height", [1024, 9001, 16384])
def test_samples_of_large_maps_stay_in_their_texels(height: int) -> None:
    width = 2 * height
    rows = np.linspace(0.0, 1.0, height + 1)
    columns = np.broadcast_to(np.linspace(0.0, 1.0, width + 1), (height, width + 1))
    density = np.broadcast_to(np.float64(1.0), (height, width))
    for row in (0, 1, 2, height // 2 - 1, height // 2, height - 2, height - 1):
        for column in (0, 1, height // 2, height - 1, height, height + 1, width - 1):
            ends = (
                (rows[row], columns[0, column]),
                (math.nextafter(rows[row + 1], 0.0), math.nextafter(columns[0, column + 1], 0.0)),
            )
            for u1, u2 in ends:
                x, y, z, _ = sample_direction(rows, columns, density, u1, u2)
                assert texel_of_direction(height, width, x, y, z) == (row, column)
                assert math.isclose(math.hypot(x, y, z), 1.0, rel_tol=1e-14)


@given(fractions, fractions)
@example(0.0, 0.0)
@example(1.0, 1.0)
@example(ALMOST_ONE, ALMOST_ONE)
@example(5e-324, ALMOST_ONE)
@settings(max_examples=200, deadline=None)
def test_no_sample_falls_out_of_the_map(u1: float, u2: float) -> None:
    made = _DARK_WITH_A_SUN
    x, y, z, found = sample_direction(made.row_cdf, made.column_cdf, made.density, u1, u2)
    assert math.hypot(x, y, z) == pytest.approx(1.0, abs=1e-14)
    assert found > 0
    assert direction_pdf(made.density, x, y, z) == found
    row, column = texel_of_direction(5, 10, x, y, z)
    assert radiance_from_direction(made.radiance, x, y, z) == tuple(made.radiance[row, column])


_DARK_WITH_A_SUN = make_environment_sampler(one_light(5, 4, 9) * np.float32(1e30))


# ---- arrays of the wrong shape ---------------------------------------------------------------


def test_wrong_arrays_are_refused(rough: EnvironmentSampler) -> None:
    with pytest.raises(ValueError, match=r"^u: found shape \(3,\), expected \(N, 2\)"):
        sample_directions(rough, [0.1, 0.2, 0.3])
    with pytest.raises(ValueError, match=r"^u: found numbers outside \[0, 1\]"):
        sample_directions(rough, [[0.1, 1.5]])
    with pytest.raises(ValueError, match=r"^u: found numbers outside \[0, 1\]"):
        sample_directions(rough, [[0.1, math.nan]])
    with pytest.raises(ValueError, match=r"^directions: found shape \(1, 2\), expected \(N, 3\)"):
        direction_pdfs(rough, [[0.1, 0.2]])


def test_no_directions_give_no_results(rough: EnvironmentSampler) -> None:
    directions, found = sample_directions(rough, np.empty((0, 2)))
    assert directions.shape == (0, 3)
    assert found.shape == (0,)
    assert direction_pdfs(rough, directions).shape == (0,)
