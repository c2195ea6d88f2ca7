"""The built-in environments against closed forms and the daylight paper's figures."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad

from pipelines.drawing.colour import luminance
from pipelines.light.built_in_environments import lamps, sky, uniform
from pipelines.light.environment_maps import (
    check_environment,
    rotate_environment,
    texel_directions,
)
from tests.pipelines.light.example_maps import (
    direction,
    integral,
    power_of_sun,
)

# ---- sky -------------------------------------------------------------------------------------

# The texel of a dome of 256 rows whose middle is nearest to the zenith.
ZENITH = (0, 0)


def test_the_domes_mean_luminance_is_1_apart_from_the_sun() -> None:
    """The sun's horizontal irradiance gives its power away: compare with the ground's light."""
    for elevation, turbidity in ((35.0, 3.0), (70.0, 2.0), (12.0, 8.0)):
        light = sky(256, sun_azimuth=40, sun_elevation=elevation, turbidity=turbidity)
        check_environment(light)
        assert light.dtype == np.float32
        ground = float(luminance(light[-1, 0].astype(np.float64)))
        # The ground: 0.2 / pi of the dome's irradiance D and of the sun's 5 D sin(elevation).
        dome = ground * math.pi / 0.2 / (1 + 5 * math.sin(math.radians(elevation)))
        assert power_of_sun(light) == pytest.approx(5 * dome, rel=0.005)


@pytest.mark.parametrize("radius", [2.5, 15.0, 30.0])
def test_the_suns_irradiance_is_that_of_its_soft_disc(radius: float) -> None:
    light = sky(128, sun_azimuth=-70, sun_elevation=55, sun_radius=radius)
    faint, full = math.cos(math.radians(radius)), math.cos(math.radians(0.8 * radius))

    def ramp(q: float) -> float:
        return min(max((q - faint) / (full - faint), 0.0), 1.0)

    across = quad(lambda q: ramp(q) * q, faint, 1.0, points=[full])[0]
    along = quad(ramp, faint, 1.0, points=[full])[0]
    irradiance = power_of_sun(light) * across / along
    ground = float(luminance(light[-1, 0].astype(np.float64)))
    dome = ground * math.pi / 0.2 / (1 + 5 * math.sin(math.radians(55)))
    assert irradiance == pytest.approx(5 * dome, rel=0.005)


def test_the_ground_is_even_and_reflects_a_fifth_of_what_comes_from_above() -> None:
    height = 128
    light = sky(height, sun_azimuth=200, sun_elevation=50).astype(np.float64)
    ground = light[height // 2 :]
    np.testing.assert_array_equal(ground, np.broadcast_to(ground[0, 0], ground.shape))
    above = np.maximum(texel_directions(height)[..., 2], 0.0)
    irradiance = [integral(light[..., channel] * above) for channel in range(3)]
    np.testing.assert_allclose(ground[0, 0], 0.2 / math.pi * np.array(irradiance), rtol=1e-3)


@pytest.mark.parametrize("radius", [0.11, 0.8, 2.5, 12.0])
def test_the_suns_power_does_not_depend_on_the_height_of_the_map(radius: float) -> None:
    powers = [
        power_of_sun(sky(height, sun_azimuth=77.7, sun_elevation=41.3, sun_radius=radius))
        for height in (16, 34, 64, 256)
    ]
    np.testing.assert_allclose(powers, powers[-1], rtol=0.02)


@pytest.mark.parametrize("radius", [0.11, 1.0, 6.0])
def test_the_suns_power_does_not_depend_on_its_azimuth(radius: float) -> None:
    powers = [
        power_of_sun(sky(32, sun_azimuth=azimuth, sun_elevation=41.3, sun_radius=radius))
        for azimuth in (0.0, 1.3, 2.8, 45.0, 179.9, 180.0, -123.4, 720.5)
    ]
    np.testing.assert_allclose(powers, powers[0], rtol=0.003)


@pytest.mark.parametrize("elevation", [90.0, 89.9, 80.0, 65.0])
def test_the_suns_power_is_the_same_at_the_zenith(elevation: float) -> None:
    """Against the dome's irradiance, which itself changes with the elevation."""
    light = sky(64, sun_azimuth=33.0, sun_elevation=elevation, sun_radius=1.0)
    ground = float(luminance(light[-1, 0].astype(np.float64)))
    dome = ground * math.pi / 0.2 / (1 + 5 * math.sin(math.radians(elevation)))
    assert power_of_sun(light) == pytest.approx(5 * dome, rel=0.01)


@pytest.mark.parametrize(("azimuth", "elevation"), [(40.0, 35.0), (-130.0, 65.0), (178.0, 12.0)])
def test_the_brightest_light_is_the_suns_round_its_place(azimuth: float, elevation: float) -> None:
    light = sky(180, sun_azimuth=azimuth, sun_elevation=elevation)
    bright = luminance(light.astype(np.float64))
    # Glare is at most a few dozen times the mean, the sun some thousand times.
    sun = np.where(bright > 200.0, bright, 0.0)
    ways = texel_directions(180)
    centre = np.array([integral(sun * ways[..., axis]) for axis in range(3)])
    centre /= np.linalg.norm(centre)
    towards = np.array(direction(azimuth, elevation))
    assert math.degrees(math.acos(min(centre @ towards, 1.0))) < 0.1
    angles = np.degrees(np.arccos(np.clip(ways[sun > 0] @ towards, -1, 1)))
    assert 2.0 < angles.max() < 2.5 + 0.8  # its radius and half the diagonal of a texel


def test_a_setting_sun_is_hidden_where_it_is_below_the_horizon() -> None:
    light = sky(128, sun_azimuth=10, sun_elevation=0.1, sun_radius=3.0)
    assert len(np.unique(light[64:].reshape(-1, 3), axis=0)) == 1
    ground_below = float(luminance(light[64, 60]))
    assert luminance(light[63]).max() > 100 * ground_below


def test_turning_the_sun_by_whole_texels_turns_the_sky() -> None:
    one = sky(64, sun_azimuth=20.0, sun_elevation=35.0)
    other = sky(64, sun_azimuth=20.0 + 360.0 / 128 * 29, sun_elevation=35.0)
    np.testing.assert_allclose(rotate_environment(one, 360.0 / 128 * 29), other, rtol=1e-4)


def test_the_sky_is_the_same_left_and_right_of_the_sun() -> None:
    light = sky(64, sun_azimuth=0.0, sun_elevation=30.0)
    np.testing.assert_allclose(light, light[:, ::-1], rtol=1e-4)


def test_luminance_follows_perez() -> None:
    """Turbidity 3; coefficients by hand from the paper's table."""
    a, b, c, d, e = -0.9269, -0.6387, 5.2570, -2.2153, 0.1693
    towards = np.array(direction(40.0, 35.0))
    light = luminance(sky(256, sun_azimuth=40, sun_elevation=35).astype(np.float64))
    ways = texel_directions(256)

    def perez(row: int, column: int) -> float:
        x = ways[row, column]
        gamma = math.acos(x @ towards)
        fall = 1 + a * math.exp(b / x[2])
        return fall * (1 + c * math.exp(d * gamma) + e * math.cos(gamma) ** 2)

    for row, column in ((20, 100), (60, 400), (100, 10), (127, 300), (90, 140)):
        found = light[row, column] / light[ZENITH]
        assert found == pytest.approx(perez(row, column) / perez(*ZENITH), rel=2e-3)


def test_the_zeniths_chromaticity_is_the_papers() -> None:
    turbidity, theta = 3.0, math.radians(90.0 - 35.0)
    powers = np.array([theta**3, theta**2, theta, 1.0])
    x = (
        turbidity**2 * (powers @ [0.00166, -0.00375, 0.00209, 0.0])
        + turbidity * (powers @ [-0.02903, 0.06377, -0.03202, 0.00394])
        + powers @ [0.11693, -0.21196, 0.06052, 0.25886]
    )
    y = (
        turbidity**2 * (powers @ [0.00275, -0.00610, 0.00317, 0.0])
        + turbidity * (powers @ [-0.04214, 0.08970, -0.04153, 0.00516])
        + powers @ [0.15346, -0.26756, 0.06670, 0.26688]
    )
    xyz_of_srgb = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    )
    xyz = xyz_of_srgb @ sky(256, sun_azimuth=40, sun_elevation=35)[ZENITH]
    np.testing.assert_allclose(xyz[:2] / xyz.sum(), [x, y], atol=1e-3)


@pytest.mark.parametrize("turbidity", [2.0, 3.0, 5.0])
def test_the_sky_is_blue_brighter_to_the_sun_and_to_the_horizon_and_the_ground_grey(
    turbidity: float,
) -> None:
    light = sky(128, sun_azimuth=90.0, sun_elevation=30.0, turbidity=turbidity)
    red, green, blue = light[ZENITH]
    assert red < green < blue
    bright = luminance(light)
    for row in (10, 30, 50, 60):
        assert bright[row, 64] > 1.5 * bright[row, 192]  # towards azimuth 90, and away from it
    if turbidity < 4:  # the more haze, the less so
        assert bright[62, 192] > 1.2 * bright[ZENITH]
    ground = light[-1, 0]
    assert ground.max() < 1.3 * ground.min()


def test_a_low_sun_is_red_and_a_high_one_nearly_white() -> None:
    def red_to_blue(elevation: float) -> float:
        light = sky(128, sun_azimuth=0.0, sun_elevation=elevation)
        sun = light.reshape(-1, 3)[int(np.argmax(luminance(light)))]
        return float(sun[0] / sun[2])

    assert red_to_blue(4.0) > 4.0
    assert 1.0 < red_to_blue(80.0) < 1.6


@given(
    st.integers(4, 20),
    st.floats(-720.0, 720.0),
    st.floats(0.0, 90.0, exclude_min=True),
    st.floats(0.1, 30.0, exclude_min=True),
    st.floats(2.0, 10.0),
)
@settings(max_examples=60, deadline=None)
def test_every_sky_is_an_environment(
    half: int, azimuth: float, elevation: float, radius: float, turbidity: float
) -> None:
    light = sky(
        2 * half,
        sun_azimuth=azimuth,
        sun_elevation=elevation,
        sun_radius=radius,
        turbidity=turbidity,
    )
    check_environment(light)
    assert light.shape == (2 * half, 4 * half, 3)
    assert power_of_sun(light) > 0


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"height": 7}, "height is 7; expected an even"),
        ({"height": 6}, "height is 6; expected an even"),
        ({"sun_elevation": 0.0}, "sun_elevation is 0.0; expected"),
        ({"sun_elevation": 90.1}, "sun_elevation is 90.1; expected"),
        ({"sun_elevation": math.nan}, "sun_elevation is nan; expected"),
        ({"sun_radius": 0.1}, "sun_radius is 0.1; expected"),
        ({"sun_radius": 31.0}, "sun_radius is 31.0; expected"),
        ({"turbidity": 1.9}, "turbidity is 1.9; expected"),
        ({"turbidity": 10.1}, "turbidity is 10.1; expected"),
        ({"sun_azimuth": math.inf}, "sun_azimuth is inf; expected"),
    ],
)
def test_parameters_of_the_sky_out_of_range_are_refused(
    changed: dict[str, float], message: str
) -> None:
    given_: dict[str, float] = {"height": 8, "sun_azimuth": 0.0, "sun_elevation": 30.0} | changed
    with pytest.raises(ValueError, match=f"^{message}"):
        sky(int(given_.pop("height")), **given_)


# ---- uniform and lamps -----------------------------------------------------------------------


def test_a_uniform_map_has_its_value_and_lights_a_surface_with_pi_of_it() -> None:
    light = uniform(64, 0.7)
    assert light.dtype == np.float32
    assert (light == np.float32(0.7)).all()
    above = np.maximum(texel_directions(64)[..., 2], 0.0)
    assert integral(light[..., 0] * above) == pytest.approx(0.7 * math.pi, rel=1e-3)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_uniform_map_has_to_be_lit(value: float) -> None:
    with pytest.raises(ValueError, match=rf"^value is {value}; expected finite radiance above 0"):
        uniform(8, value)


def spots(lit: NDArray[np.bool_]) -> int:
    """Number of connected regions of a map that goes round."""
    from scipy.ndimage import label

    joined, number = label(lit)
    pairs = {(a, b) for a, b in zip(joined[:, 0], joined[:, -1], strict=True) if a and b and a != b}
    return int(number) - len(pairs)


def test_lamps_are_five_in_a_dim_room_mostly_above() -> None:
    light = lamps(256)
    bright = luminance(light.astype(np.float64))
    assert bright.min() == pytest.approx(0.02, rel=1e-5)
    assert spots(bright > 0.5) == 5
    assert integral(bright) / (4 * math.pi) == pytest.approx(0.284, abs=0.001)
    assert bright[:128].sum() > 20 * (bright[128:] - 0.02).sum()
    assert (bright[128:] > 0.5).any()  # the lamp on the horizon
    # Warm and cool, none coloured much.
    lit = light[bright > 1.5]
    assert lit[:, 0].max() / lit[lit[:, 0].argmax(), 2] > 1.1
    ratios = lit[:, 2] / lit[:, 0]
    assert 0.6 < ratios.min() < 0.9 < 1.05 < ratios.max() < 1.3


@pytest.mark.parametrize("height", [1, 7, 16, 64])
def test_lamps_give_as_much_light_in_coarse_maps(height: int) -> None:
    bright = luminance(lamps(height).astype(np.float64))
    assert integral(bright) / (4 * math.pi) == pytest.approx(0.28422, abs=1e-4)
