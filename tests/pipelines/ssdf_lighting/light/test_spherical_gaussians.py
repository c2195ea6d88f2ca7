"""Spherical Gaussians against quadrature on the sphere, closed forms and the graphics card."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import i1e, ndtr

from assets_defs.ssdf_lighting.lights import LightSettings
from pipelines.light import environment_maps
from pipelines.ssdf_lighting.light.spherical_gaussians import (
    Lights,
    VisibleTable,
    evaluate,
    integral,
    product,
    rotated,
    softened,
    visible_integral,
    visible_share,
    visible_table,
)

sharpnesses = st.floats(1e-3, 1e5)
distances = st.floats(-math.pi, math.pi)
SHARP = np.geomspace(1e-3, 1e5, 60)


def unit_vectors(count: int, seed: int = 0) -> NDArray[np.float64]:
    vectors = np.random.default_rng(seed).standard_normal((count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def some_lights(count: int = 3) -> Lights:
    rng = np.random.default_rng(4)
    return Lights(unit_vectors(count), rng.uniform(2.0, 30.0, count), rng.random((count, 3)))


@pytest.fixture(scope="module")
def table() -> VisibleTable:
    return visible_table()


# ---- one and two -----------------------------------------------------------------------------


def test_a_gaussian_is_its_formula() -> None:
    lights = Lights(
        np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
        np.array([3.0, 8.0]),
        np.array([[1.0, 2.0, 0.0], [0.0, 0.5, 7.0]]),
    )
    found = evaluate(lights, [[[0.0, 0.0, 1.0]], [[0.6, 0.0, 0.8]]])
    assert found.shape == (2, 1, 3)
    one, other = math.exp(-0.6), math.exp(-3.2)
    np.testing.assert_allclose(found[1, 0], [one, 2 * one + 0.5 * other, 7 * other])
    np.testing.assert_allclose(found[0, 0], [1, 2 + 0.5 * math.exp(-8), 7 * math.exp(-8)])
    with pytest.raises(
        ValueError, match=r"^directions: found shape \(2,\), expected \(\.\.\., 3\)"
    ):
        evaluate(lights, [1.0, 0.0])


@pytest.mark.parametrize("sharpness", [0.0, 1e-9, 1e-3, 0.7, 40.0, 1e5])
def test_the_integral_is_that_of_a_quadrature(sharpness: float) -> None:
    """Over 1 - v·p, its part within twenty e-foldings."""
    last = min(2.0, 50.0 / max(sharpness, 1e-9))
    expected, _ = quad(lambda less: 2 * math.pi * math.exp(-sharpness * less), 0.0, last)
    assert float(integral(sharpness)) == pytest.approx(expected, rel=1e-12)


@given(sharpnesses, sharpnesses, st.integers(0, 99))
@settings(max_examples=100, deadline=None)
def test_products_are_products_everywhere(a: float, b: float, seed: int) -> None:
    one, other, *ways = unit_vectors(6, seed)
    axis, sharpness, scale = product(one, a, other, b)
    for way in (*ways, axis):
        exponents = a * (way @ one - 1), b * (way @ other - 1)
        found = math.log(max(float(scale), 1e-300)) + float(sharpness) * (way @ axis - 1)
        if scale > 1e-300:
            assert found == pytest.approx(sum(exponents), rel=1e-9, abs=1e-9)
    assert np.linalg.norm(axis) == pytest.approx(1.0, rel=1e-12)


def test_products_are_exact_where_axes_nearly_agree_or_cancel() -> None:
    """A difference of sharpnesses around 1e5 would leave nothing of 1e-9."""
    tilt = 1e-7
    _, sharpness, scale = product([0, 0, 1.0], 1e5, [math.sin(tilt), 0, math.cos(tilt)], 1e5)
    assert float(sharpness) == pytest.approx(2e5, rel=1e-12)
    assert 1 - float(scale) == pytest.approx(1e5 * tilt**2 / 4, rel=1e-5)
    axis, sharpness, scale = product([0, 0, 1.0], 2.0, [0, 0, -1.0], 2.0)
    assert axis.tolist() == [0, 0, 1]
    assert sharpness == 0
    assert float(scale) == pytest.approx(math.exp(-4))


def test_products_broadcast() -> None:
    axes = unit_vectors(6).reshape(2, 3, 3)
    axis, sharpness, scale = product(axes, np.arange(1.0, 4.0), axes[0, 0], 5.0)
    assert axis.shape == (2, 3, 3)
    assert sharpness.shape == scale.shape == (2, 3)
    alone = product(axes[1, 2], 3.0, axes[0, 0], 5.0)
    np.testing.assert_allclose(axis[1, 2], alone[0])
    np.testing.assert_allclose([sharpness[1, 2], scale[1, 2]], alone[1:])


@pytest.mark.parametrize("columns", [1, 24, 100, -17])
def test_rotated_lights_are_the_rotated_map(columns: int) -> None:
    height, lights = 48, some_lights()
    ways = environment_maps.texel_directions(height)
    degrees = columns * 360.0 / (2 * height)
    expected = environment_maps.rotate_environment(
        evaluate(lights, ways).astype(np.float32), degrees
    )
    np.testing.assert_allclose(evaluate(rotated(lights, degrees), ways), expected, rtol=1e-5)


def test_an_angle_that_is_not_finite_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^degrees is nan; expected a finite angle\.$"):
        rotated(some_lights(), math.nan)


# ---- the visible part ------------------------------------------------------------------------


def over_the_sphere(distance: float, sharpness: float) -> float:
    """f by its definition: around p, an arc of each circle is in front of the edge.

    Half-space: v·n > 0 with p·n = sin d. On the circle at the angle t the condition is
    cos t sin d + sin t cos d cos(phi) > 0. Midpoints in t.
    """
    last = min(math.pi, math.sqrt(90.0 / sharpness))
    count = 400_000
    t = (np.arange(count) + 0.5) * (last / count)
    if abs(distance) > math.pi / 2:
        arc = 2 * math.pi * ((t < abs(distance)) == (distance > 0))
    else:
        limit = np.cos(t) * math.sin(distance) / (np.sin(t) * math.cos(distance))
        arc = 2 * np.arccos(np.clip(-limit, -1.0, 1.0))
    weights = np.exp(-2 * sharpness * np.sin(t / 2) ** 2) * np.sin(t)
    return float((weights * arc).sum() * last / count)


@pytest.mark.parametrize("sharpness", [1e-3, 0.3, 2.1, 17.0, 300.0, 1e5])
@pytest.mark.parametrize("part", [-0.9, -0.3, 0.01, 0.5, 0.99, 1.4, -1.7])
def test_f_is_the_integral_over_half_spaces_and_caps(part: float, sharpness: float) -> None:
    """Near the SG's own width too."""
    whole = float(integral(sharpness))
    for distance in (part * math.pi / 2, part * min(1.0, 1.5 / math.sqrt(sharpness))):
        expected = over_the_sphere(distance, sharpness)
        found = float(visible_integral(distance, sharpness))
        assert found == pytest.approx(expected, abs=2e-6 * whole)


@pytest.mark.parametrize("sharpness", [1e-3, 0.5, 3.0, 80.0, 2e3, 1e5])
def test_f_is_that_of_an_adaptive_quadrature_to_nine_digits(sharpness: float) -> None:
    edge = math.pi / 2
    for distance in np.array([0.1, 0.5, 1.0, 3.0]) * min(1.0, 2.0 / math.sqrt(sharpness)):
        last = min(float(distance), edge)
        gained, _ = quad(
            lambda t: i1e(sharpness * math.cos(t)) * math.exp(-sharpness * (1 - math.cos(t))),
            0.0,
            last,
            epsabs=1e-14,
            epsrel=1e-13,
        )
        if distance <= edge:
            expected = 0.5 * float(integral(sharpness)) + 2 * math.pi * gained
            found = float(visible_integral(distance, sharpness))
            assert found == pytest.approx(expected, rel=1e-9)


def test_half_is_visible_at_the_edge_all_and_nothing_at_pi() -> None:
    whole = integral(SHARP)
    np.testing.assert_allclose(visible_integral(0.0, SHARP), 0.5 * whole, rtol=1e-14)
    np.testing.assert_allclose(visible_integral(math.pi, SHARP), whole, rtol=1e-14)
    np.testing.assert_allclose(visible_integral(-math.pi, SHARP), 0.0, atol=1e-13)
    np.testing.assert_array_equal(visible_integral(4.0, SHARP), visible_integral(np.pi, SHARP))


def test_f_rises_with_the_distance() -> None:
    distance = np.linspace(-math.pi, math.pi, 1001)[:, None]
    share = visible_integral(distance, SHARP) / integral(SHARP)
    assert np.diff(share, axis=0).min() > -1e-13
    assert share.min() > -1e-13
    assert share.max() < 1 + 1e-13


@pytest.mark.parametrize("edge", [-math.pi / 2, 0.0, math.pi / 2])
def test_f_is_continuous_where_its_formulas_meet(edge: float) -> None:
    below = visible_integral(math.nextafter(edge, -9.0), SHARP)
    above = visible_integral(math.nextafter(edge, 9.0), SHARP)
    np.testing.assert_allclose(below, above, rtol=0, atol=1e-12)


def test_at_a_right_angle_it_is_the_half_sphere() -> None:
    expected = 2 * math.pi * -np.expm1(-SHARP) / SHARP
    np.testing.assert_allclose(visible_integral(math.pi / 2, SHARP), expected, rtol=1e-12)


@given(distances, sharpnesses)
@settings(max_examples=100, deadline=None)
def test_what_one_side_loses_the_other_has(distance: float, sharpness: float) -> None:
    both = visible_integral(distance, sharpness) + visible_integral(-distance, sharpness)
    assert float(both) == pytest.approx(float(integral(sharpness)), rel=1e-13)


@given(st.floats(-1.5, 1.5), st.floats(1e-2, 1e3))
@settings(max_examples=100, deadline=None)
def test_the_slope_is_a_bessel_function(distance: float, sharpness: float) -> None:
    step = 1e-4 / math.sqrt(1 + sharpness)
    ends = visible_integral([distance - step, distance + step], sharpness)
    cosine = math.cos(distance)
    expected = 2 * math.pi * i1e(sharpness * cosine) * math.exp(-sharpness * (1 - cosine))
    scale = float(integral(sharpness)) * math.sqrt(1 + sharpness)
    assert float(ends[1] - ends[0]) / (2 * step) == pytest.approx(expected, abs=1e-7 * scale)


def test_very_sharp_ones_follow_the_plane_gaussian() -> None:
    spread = np.linspace(-3.0, 3.0, 13)
    share = visible_integral(spread / 1e5, 1e10) / integral(1e10)
    np.testing.assert_allclose(share, ndtr(spread), atol=1e-9)


def test_many_at_once_are_what_they_are_alone() -> None:
    distance = np.linspace(-3.0, 3.0, 300)[:, None]
    found = visible_integral(distance, SHARP)
    assert found.shape == (300, 60)
    for row, column in ((0, 0), (299, 59), (150, 7), (211, 40)):
        alone = visible_integral(distance[row, 0], SHARP[column])
        assert float(alone) == pytest.approx(float(found[row, column]), rel=1e-13)


@pytest.mark.parametrize("sharpness", [-1.0, math.nan, math.inf])
def test_a_sharpness_that_is_none_is_refused(sharpness: float) -> None:
    message = rf"^sharpness: found {sharpness}, expected finite values of 0 and more\.$"
    for function in (integral, lambda one: visible_integral(0.0, one)):
        with pytest.raises(ValueError, match=message):
            function(sharpness)
    with pytest.raises(ValueError, match=r"^distance: found NaN, expected radians\.$"):
        visible_integral(math.nan, 1.0)


# ---- the table -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rows", "columns", "bound"), [(128, 64, 4e-4), (256, 64, 3e-4), (128, 32, 1e-3)]
)
def test_the_table_is_accurate_for_all_sharpnesses(rows: int, columns: int, bound: float) -> None:
    """Even angles, and even ones in units of the SG's width."""
    made = visible_table(rows, columns)
    assert made.values.shape == (rows, columns)
    assert made.values.dtype == np.float32
    sharp = np.geomspace(1e-2, 1e6, 240)
    widths = np.linspace(-6.0, 6.0, 301)[:, None] / np.sqrt(sharp)
    even = np.broadcast_to(np.linspace(-math.pi, math.pi, 601)[:, None], (601, 240))
    distance = np.concatenate([even, widths])
    expected = visible_integral(distance, sharp) / integral(sharp)
    assert np.abs(visible_share(made, distance, sharp) - expected).max() < bound


def test_the_tables_ends_are_exact(table: VisibleTable) -> None:
    np.testing.assert_array_equal(visible_share(table, 0.0, SHARP), 0.5)
    np.testing.assert_array_equal(visible_share(table, math.pi, SHARP), 1.0)
    np.testing.assert_array_equal(visible_share(table, -9.0, SHARP), 0.0)
    assert float(visible_share(table, -math.pi, 0.0)) == 0.0
    middle = (1 - math.cos(2.5)) / 2  # a cap's part of the sphere
    assert float(visible_share(table, 2.5, 0.0)) == pytest.approx(middle, abs=1e-3)


@given(st.floats(-10.0, 10.0), st.floats(0.0, 1e12))
@settings(max_examples=200, deadline=None)
def test_no_look_up_leaves_the_table(distance: float, sharpness: float) -> None:
    share = float(visible_share(_SMALL, distance, sharpness))
    assert 0.0 <= share <= 1.0
    assert (share >= 0.5) == (distance >= 0) or share == 0.5


_SMALL = visible_table(8, 4)


def test_a_table_too_small_and_a_name_that_is_none_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^rows is 7; expected 8 or more\.$"):
        visible_table(7, 64)
    with pytest.raises(ValueError, match=r"^columns is 3; expected 4 or more\.$"):
        visible_table(64, 3)


def test_softened_lights_are_what_edges_with_an_error_show_on_average() -> None:
    """Edges off by Gaussian noise, by quadrature; the light itself is far from their mean."""
    sharpness, rmse = 184_889.0, 0.006
    soft = softened(Lights(np.array([[0.0, 0, 1]]), np.array([sharpness]), np.ones((1, 3))), rmse)
    noise, weights = np.polynomial.hermite_e.hermegauss(80)
    distance = np.linspace(-0.04, 0.04, 41)
    shown = visible_integral(distance[:, None] + 2.0 * rmse * noise, sharpness)
    mean = shown @ weights / weights.sum() / integral(sharpness)
    found = visible_integral(distance, soft.sharpness) / integral(soft.sharpness)
    assert np.abs(found - mean).max() < 0.01
    exact = visible_integral(distance, sharpness) / integral(sharpness)
    assert np.abs(exact - mean).max() > 0.3


def test_softened_lights_keep_their_flux_and_wide_ones_their_width() -> None:
    lights = Lights(np.eye(3), np.array([3.0, 300.0, 1e5]), np.arange(9.0).reshape(3, 3))
    soft = softened(lights, 0.006)
    flux, before = (integral(one.sharpness)[:, None] * one.amplitudes for one in (soft, lights))
    np.testing.assert_allclose(flux, before, rtol=1e-12)
    assert soft.sharpness[0] > 2.99
    assert soft.sharpness[2] < 1 / 0.012**2
    np.testing.assert_allclose(softened(lights, 0.0).sharpness, lights.sharpness, rtol=1e-15)
    with pytest.raises(ValueError, match="rmse is -0"):
        softened(lights, -0.1)


@pytest.mark.parametrize("half", [10.0, 20.0, 45.0])
def test_an_even_sky_through_a_slit_is_nearer_by_lights_that_are_not_wide(
    half: float, table: VisibleTable
) -> None:
    """Of the band within ``half`` degrees of the equator the true share is its sine; d knows the
    nearer edge only. The widest light of the default, against one as wide as was once let in."""
    sine = 1.0 - 2.0 * (np.arange(4000) + 0.5) / 4000
    distance = math.radians(half) - np.abs(np.arcsin(sine))

    def error(sharpness: float) -> float:
        share = float(visible_share(table, distance, sharpness).mean())
        return abs(share / math.sin(math.radians(half)) - 1.0)

    assert error(LightSettings().least_sharpness) < 0.5 * error(3.0)
    assert error(1000.0) < 0.002
