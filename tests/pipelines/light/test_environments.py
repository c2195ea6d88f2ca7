"""Environments against closed forms, the daylight paper's figures and their own density."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.stats import chi2

from pipelines.drawing.colour import luminance
from pipelines.light.environments import (
    Sampler,
    check_environment,
    density_of,
    evaluate,
    lamps,
    pdf,
    radiance_of,
    rotated,
    sample,
    sample_direction,
    sampler,
    sky,
    solid_angles,
    texel_directions,
    texel_of,
    uniform,
)

ALMOST_ONE = math.nextafter(1.0, 0.0)
fractions = st.floats(0.0, 1.0)
anything = st.floats(allow_nan=True, allow_infinity=True)


def direction(azimuth: float, elevation: float) -> tuple[float, float, float]:
    a, e = math.radians(azimuth), math.radians(elevation)
    return math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)


def one_light(height: int, row: int, column: int) -> NDArray[np.float32]:
    light = np.zeros((height, 2 * height, 3), np.float32)
    light[row, column] = 1.0
    return light


def rough_map(height: int, seed: int = 0) -> NDArray[np.float32]:
    """Radiance over many powers of ten, black texels among it."""
    rng = np.random.default_rng(seed)
    light = np.exp(rng.normal(0.0, 3.0, (height, 2 * height, 3)))
    light[rng.random((height, 2 * height)) < 0.2] = 0.0
    return light.astype(np.float32)


def integral(values: NDArray[np.floating]) -> float:
    """Over the sphere, of values (H, W)."""
    return float((solid_angles(len(values))[:, None] * values).sum(dtype=np.float64))


def power_of_sun(light: NDArray[np.float32]) -> float:
    """Luminance times steradians above the horizon, less the dome's 2 pi."""
    bright = luminance(light.astype(np.float64))
    bright[len(light) // 2 :] = 0.0
    return integral(bright) - 2 * math.pi


# ---- the grid --------------------------------------------------------------------------------


@pytest.mark.parametrize("height", [1, 2, 3, 8, 255, 4096])
def test_solid_angles_are_differences_of_cosines_and_fill_the_sphere(height: int) -> None:
    borders = np.cos(np.arange(height + 1, dtype=np.longdouble) * np.longdouble(np.pi) / height)
    expected = -np.diff(borders) * (2 * np.pi / (2 * height))
    found = solid_angles(height)
    assert found.shape == (height,)
    np.testing.assert_allclose(found, expected.astype(np.float64), rtol=1e-9)
    assert found.sum() * 2 * height == pytest.approx(4 * math.pi, rel=1e-12)


def test_texels_lie_where_a_hand_computes_them() -> None:
    """Of 4 x 8 texels, row 1 lies 22.5 degrees up, column 2 at azimuth 180 - 2.5 * 45."""
    np.testing.assert_allclose(texel_directions(4)[1, 2], direction(67.5, 22.5), atol=1e-15)
    np.testing.assert_allclose(texel_directions(4)[3, 7], direction(-157.5, -67.5), atol=1e-15)
    assert texel_of(4, 8, *direction(67.5, 22.5)) == (1, 2)


@pytest.mark.parametrize(
    ("azimuth", "elevation", "row", "column"),
    [
        (0.5, 0.5, 31, 63), (-0.5, -0.5, 32, 64), (90.5, 1.0, 31, 31), (89.5, 1.0, 31, 32),
        (179.5, 89.0, 0, 0), (-179.5, -89.0, 63, 127), (-90.5, 45.5, 15, 96),
    ],
)  # fmt: skip
def test_the_map_is_seen_from_inside_with_x_in_the_middle_and_y_a_quarter_from_the_left(
    azimuth: float, elevation: float, row: int, column: int
) -> None:
    assert texel_of(64, 128, *direction(azimuth, elevation)) == (row, column)
    light = one_light(64, row, column)
    assert evaluate(light, [direction(azimuth, elevation)]).tolist() == [[1.0, 1.0, 1.0]]
    assert luminance(evaluate(light, texel_directions(64).reshape(-1, 3))).sum() > 0.99


@pytest.mark.parametrize("height", [1, 3, 8, 65])
def test_every_texel_holds_the_direction_to_its_centre(height: int) -> None:
    ways = texel_directions(height)
    np.testing.assert_allclose(np.linalg.norm(ways, axis=-1), 1.0, rtol=1e-14)
    light = rough_map(height, seed=height)
    np.testing.assert_array_equal(evaluate(light, ways.reshape(-1, 3)), light.reshape(-1, 3))


@pytest.mark.parametrize("height", [0, -4])
def test_a_map_without_rows_is_refused(height: int) -> None:
    message = rf"^height is {height}; expected 1 or more\.$"
    for function in (texel_directions, solid_angles, uniform, lamps):
        with pytest.raises(ValueError, match=message):
            function(height)


def test_directions_need_not_be_unit_vectors_and_may_be_of_single_precision() -> None:
    ways = texel_directions(64).reshape(-1, 3)
    light = rough_map(64)
    expected = evaluate(light, ways)
    np.testing.assert_array_equal(evaluate(light, 37.0 * ways), expected)
    np.testing.assert_array_equal(evaluate(light, ways.astype(np.float32)), expected)


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
        sampler(light)
    with pytest.raises(ValueError, match=message):
        rotated(light, 10.0)


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
        sampler(np.full((2, 4, 3), value))


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
    np.testing.assert_allclose(rotated(one, 360.0 / 128 * 29), other, rtol=1e-4)


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


# ---- rotated ---------------------------------------------------------------------------------


def test_a_light_at_azimuth_a_is_at_a_plus_degrees_afterwards() -> None:
    light = one_light(36, 10, 40)  # azimuth 180 - 40.5 * 5 = -22.5
    np.testing.assert_array_equal(evaluate(light, [direction(-22.5, 37.5)]), 1.0)
    for degrees in (5.0, 90.0, -120.0, 360.0, 725.0):
        turned = rotated(light, degrees)
        assert turned.sum() == 3.0
        np.testing.assert_array_equal(evaluate(turned, [direction(-22.5 + degrees, 37.5)]), 1.0)


def test_rotating_moves_the_sun() -> None:
    turned = rotated(sky(64, sun_azimuth=-30.0, sun_elevation=40.0), 131.7)
    row, column = np.unravel_index(np.argmax(luminance(turned)), (64, 128))
    x, y, z = texel_directions(64)[row, column]
    assert math.degrees(math.atan2(y, x)) == pytest.approx(101.7, abs=3.0)
    assert math.degrees(math.asin(z)) == pytest.approx(40.0, abs=3.0)


def test_half_a_texel_mixes_two_columns() -> None:
    turned = rotated(one_light(4, 1, 5), 22.5)
    np.testing.assert_array_equal(turned[1, :, 0], [0, 0, 0, 0, 0.5, 0.5, 0, 0])


@given(st.floats(-2000.0, 2000.0))
@example(0.0)
@example(-1e-13)
@settings(max_examples=50, deadline=None)
def test_rotating_keeps_every_rows_mean(degrees: float) -> None:
    light = rough_map(6)
    turned = rotated(light, degrees)
    assert turned.dtype == np.float32
    assert turned.shape == light.shape
    assert (turned >= 0).all()
    np.testing.assert_allclose(
        turned.mean(axis=1, dtype=np.float64), light.mean(axis=1, dtype=np.float64), rtol=1e-6
    )


def test_rotating_by_nothing_gives_an_equal_copy() -> None:
    light = rough_map(6)
    turned = rotated(light, 0.0)
    np.testing.assert_array_equal(turned, light)
    assert not np.shares_memory(turned, light)


@pytest.mark.parametrize("degrees", [math.nan, math.inf])
def test_an_angle_that_is_not_finite_is_refused(degrees: float) -> None:
    with pytest.raises(ValueError, match=rf"^degrees is {degrees}; expected a finite angle"):
        rotated(uniform(4), degrees)


# ---- sampling --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def rough() -> Sampler:
    return sampler(rough_map(8))


def test_the_density_is_the_luminance_and_1_percent_of_its_mean() -> None:
    light = rough_map(16)
    bright = luminance(light.astype(np.float64))
    expected = bright + 0.01 * integral(bright) / (4 * math.pi)
    made = sampler(light)
    np.testing.assert_allclose(made.density, expected / integral(expected), rtol=1e-12)
    assert made.density.dtype == made.row_cdf.dtype == made.column_cdf.dtype == np.float64
    assert made.radiance.dtype == np.float32
    np.testing.assert_array_equal(made.radiance, light)


@pytest.mark.parametrize("height", [1, 2, 3, 8, 64])
def test_the_density_integrates_to_1_and_the_sums_belong_to_it(height: int) -> None:
    made = sampler(rough_map(height, seed=5))
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
    made = sampler(light)
    assert (made.density > 0).all()
    assert (np.diff(made.row_cdf) > 0).all()
    assert (np.diff(made.column_cdf, axis=1) > 0).all()


def test_a_uniform_map_is_sampled_evenly() -> None:
    directions, found = sample(sampler(uniform(8)), np.random.default_rng(1).random((100_000, 2)))
    np.testing.assert_allclose(found, 1 / (4 * math.pi), rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(directions.mean(axis=0), 0.0, atol=0.01)
    np.testing.assert_allclose(directions.T @ directions / len(found), np.eye(3) / 3, atol=0.01)


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_samples_fall_as_the_density_says(rough: Sampler, seed: int) -> None:
    """Chi-square over quarters of texels of equal solid angle: within texels too."""
    count = 400_000
    directions, _ = sample(rough, np.random.default_rng(seed).random((count, 2)))
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
    made = sampler(sky(64, sun_azimuth=40.0, sun_elevation=35.0))
    directions, found = sample(made, np.random.default_rng(4).random((200_000, 2)))
    estimates = evaluate(made.radiance, directions) / found[:, None]
    estimates *= np.maximum(directions[:, 2:], 0.0)
    ground = made.radiance[-1, 0].astype(np.float64)
    error = estimates.std(axis=0) / math.sqrt(len(found))
    assert (error < 0.01 * estimates.mean(axis=0)).all()
    assert (np.abs(estimates.mean(axis=0) - ground * math.pi / 0.2) < 4 * error).all()


def test_the_density_integrates_to_1_by_even_samples() -> None:
    made = sampler(lamps(32))
    evenly, _ = sample(sampler(uniform(1)), np.random.default_rng(6).random((400_000, 2)))
    found = pdf(made, evenly) * 4 * math.pi
    assert abs(found.mean() - 1) < 4 * found.std() / math.sqrt(len(found))
    assert found.mean() == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("height", [1, 2, 3, 8, 129])
def test_a_samples_density_is_that_of_its_direction_to_the_bit(height: int) -> None:
    made = sampler(rough_map(height, seed=height))
    u = np.random.default_rng(height).random((50_000, 2))
    u[:9] = [(a, b) for a in (0.0, 1.0, 0.5) for b in (0.0, 1.0, 0.5)]
    directions, found = sample(made, u)
    np.testing.assert_array_equal(found, pdf(made, directions))


def test_all_borders_of_the_sums_lead_into_the_texels_they_begin() -> None:
    made = sampler(rough_map(12))
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
                assert texel_of(12, 24, x, y, z) == (row, column)
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
                assert texel_of(height, width, x, y, z) == (row, column)
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
    assert density_of(made.density, x, y, z) == found
    row, column = texel_of(5, 10, x, y, z)
    assert radiance_of(made.radiance, x, y, z) == tuple(made.radiance[row, column])


_DARK_WITH_A_SUN = sampler(one_light(5, 4, 9) * np.float32(1e30))


@given(anything, anything, anything, st.integers(1, 5000))
@example(0.0, 0.0, 0.0, 8)
@example(0.0, 0.0, 1.0, 8)
@example(0.0, 0.0, -1.0, 8)
@example(-1.0, 0.0, 0.0, 8)
@example(-1.0, -0.0, 0.0, 8)
@example(-1.0, -5e-324, 0.0, 8)
@example(-0.0, -0.0, -1.0, 8)
@example(math.nan, math.nan, math.nan, 8)
@settings(max_examples=300, deadline=None)
def test_no_direction_leads_out_of_the_map(x: float, y: float, z: float, height: int) -> None:
    row, column = texel_of(height, 2 * height, x, y, z)
    assert 0 <= row < height
    assert 0 <= column < 2 * height


def test_the_poles_and_the_seam_belong_to_the_rows_and_columns_at_the_border() -> None:
    assert texel_of(8, 16, 0.0, 0.0, 1.0)[0] == 0
    assert texel_of(8, 16, 0.0, 0.0, -1.0)[0] == 7
    assert texel_of(8, 16, -1.0, 0.0, 0.0)[1] == 0
    assert texel_of(8, 16, -1.0, -0.0, 0.0)[1] == 15
    assert texel_of(8, 16, 1.0, 0.0, 0.0)[1] == 8


# ---- arrays of the wrong shape ---------------------------------------------------------------


def test_wrong_arrays_are_refused(rough: Sampler) -> None:
    with pytest.raises(ValueError, match=r"^u: found shape \(3,\), expected \(N, 2\)"):
        sample(rough, [0.1, 0.2, 0.3])
    with pytest.raises(ValueError, match=r"^u: found numbers outside \[0, 1\]"):
        sample(rough, [[0.1, 1.5]])
    with pytest.raises(ValueError, match=r"^u: found numbers outside \[0, 1\]"):
        sample(rough, [[0.1, math.nan]])
    with pytest.raises(ValueError, match=r"^directions: found shape \(1, 2\), expected \(N, 3\)"):
        pdf(rough, [[0.1, 0.2]])
    with pytest.raises(ValueError, match=r"^directions: found shape \(3,\), expected \(N, 3\)"):
        evaluate(rough.radiance, [0.1, 0.2, 0.3])
    with pytest.raises(ValueError, match=r"^environment: found shape \(8, 8, 3\)"):
        evaluate(rough.radiance[:, :8], [[0.1, 0.2, 0.3]])


def test_no_directions_give_no_results(rough: Sampler) -> None:
    directions, found = sample(rough, np.empty((0, 2)))
    assert directions.shape == (0, 3)
    assert found.shape == (0,)
    assert evaluate(rough.radiance, directions).shape == (0, 3)
    assert pdf(rough, directions).shape == (0,)
