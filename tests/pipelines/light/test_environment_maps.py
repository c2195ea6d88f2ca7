"""Maps of radiance against closed forms: solid angles, texels, checks, turning."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pipelines.drawing.colour import luminance
from pipelines.light.built_in_environments import lamps, sky, uniform
from pipelines.light.environment_lookup import (
    radiance_from_directions,
)
from pipelines.light.environment_maps import (
    check_environment,
    rotate_environment,
    solid_angles,
    texel_directions,
)
from pipelines.light.environment_sampling import (
    make_environment_sampler,
)
from tests.pipelines.light.example_maps import (
    direction,
    one_light,
    rough_map,
)

# ---- texels ----------------------------------------------------------------------------------


@pytest.mark.parametrize("height", [1, 2, 3, 8, 255, 4096])
def test_solid_angles_are_differences_of_cosines_and_fill_the_sphere(height: int) -> None:
    borders = np.cos(np.arange(height + 1, dtype=np.longdouble) * np.longdouble(np.pi) / height)
    expected = -np.diff(borders) * (2 * np.pi / (2 * height))
    found = solid_angles(height)
    assert found.shape == (height,)
    np.testing.assert_allclose(found, expected.astype(np.float64), rtol=1e-9)
    assert found.sum() * 2 * height == pytest.approx(4 * math.pi, rel=1e-12)


@pytest.mark.parametrize("height", [0, -4])
def test_a_map_without_rows_is_refused(height: int) -> None:
    message = rf"^height is {height}; expected 1 or more\.$"
    for function in (texel_directions, solid_angles, uniform, lamps):
        with pytest.raises(ValueError, match=message):
            function(height)


# ---- checks ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "shape", [(4, 8), (4, 8, 4), (4, 4, 3), (8, 4, 3), (0, 0, 3), (2, 4, 8, 3)]
)
def test_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"^environment: found shape \("):
        check_environment(np.ones(shape, np.float32))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, -0.25])
def test_radiance_that_is_not_finite_or_negative_is_refused_with_its_place(value: float) -> None:
    light = uniform(4)
    light[2, 5, 1] = value
    message = rf"^environment: found {value} at column 5, row 2, expected finite radiance"
    with pytest.raises(ValueError, match=message):
        check_environment(light)
    with pytest.raises(ValueError, match=message):
        make_environment_sampler(light)
    with pytest.raises(ValueError, match=message):
        rotate_environment(light, 10.0)


def test_a_black_map_and_pixel_codes_are_refused() -> None:
    with pytest.raises(ValueError, match="nothing but black"):
        check_environment(np.zeros((4, 8, 3), np.float32))
    with pytest.raises(ValueError, match="found uint8, expected floats"):
        check_environment(np.ones((4, 8, 3), np.uint8))


@pytest.mark.parametrize(
    ("value", "message"), [(1e300, "found inf"), (1e-300, "nothing but black")]
)
def test_doubles_beyond_single_precision_are_refused(value: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make_environment_sampler(np.full((2, 4, 3), value))


# ---- turning ---------------------------------------------------------------------------------


def test_a_light_at_azimuth_a_is_at_a_plus_degrees_afterwards() -> None:
    light = one_light(36, 10, 40)  # azimuth 180 - 40.5 * 5 = -22.5
    np.testing.assert_array_equal(radiance_from_directions(light, [direction(-22.5, 37.5)]), 1.0)
    for degrees in (5.0, 90.0, -120.0, 360.0, 725.0):
        turned = rotate_environment(light, degrees)
        assert turned.sum() == 3.0
        np.testing.assert_array_equal(
            radiance_from_directions(turned, [direction(-22.5 + degrees, 37.5)]), 1.0
        )


def test_rotating_moves_the_sun() -> None:
    turned = rotate_environment(sky(64, sun_azimuth=-30.0, sun_elevation=40.0), 131.7)
    row, column = np.unravel_index(np.argmax(luminance(turned)), (64, 128))
    x, y, z = texel_directions(64)[row, column]
    assert math.degrees(math.atan2(y, x)) == pytest.approx(101.7, abs=3.0)
    assert math.degrees(math.asin(z)) == pytest.approx(40.0, abs=3.0)


def test_half_a_texel_mixes_two_columns() -> None:
    turned = rotate_environment(one_light(4, 1, 5), 22.5)
    np.testing.assert_array_equal(turned[1, :, 0], [0, 0, 0, 0, 0.5, 0.5, 0, 0])


@given(st.floats(-2000.0, 2000.0))
@example(0.0)
@example(-1e-13)
@settings(max_examples=50, deadline=None)
def test_rotating_keeps_every_rows_mean(degrees: float) -> None:
    light = rough_map(6)
    turned = rotate_environment(light, degrees)
    assert turned.dtype == np.float32
    assert turned.shape == light.shape
    assert (turned >= 0).all()
    np.testing.assert_allclose(
        turned.mean(axis=1, dtype=np.float64), light.mean(axis=1, dtype=np.float64), rtol=1e-6
    )


def test_rotating_by_nothing_gives_an_equal_copy() -> None:
    light = rough_map(6)
    turned = rotate_environment(light, 0.0)
    np.testing.assert_array_equal(turned, light)
    assert not np.shares_memory(turned, light)


@pytest.mark.parametrize("degrees", [math.nan, math.inf])
def test_an_angle_that_is_not_finite_is_refused(degrees: float) -> None:
    with pytest.raises(ValueError, match=rf"^degrees is {degrees}; expected a finite angle"):
        rotate_environment(uniform(4), degrees)
