"""Directions against the databases' descriptions, the paper's formulas and higher precision."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipelines.light.directions import (
    all_pairs,
    angles_between,
    hemisphere_table,
    stereographic,
    stereographic_of_vectors,
    unit_vectors,
)

thetas = st.floats(0.0, math.pi / 2)
phis = st.floats(-2 * math.pi, 2 * math.pi)


def rings_of(table: np.ndarray) -> list[tuple[float, int, float, float]]:
    """Degrees of theta, number, degrees of the first phi and of the step, in the table's order."""
    found = []
    for theta in dict.fromkeys(np.round(np.degrees(table[:, 0]), 6)):
        phi = np.degrees(table[np.isclose(np.degrees(table[:, 0]), theta), 1])
        steps = np.unique(np.round(np.diff(phi), 6))
        assert len(steps) <= 1
        found.append(
            (float(theta), len(phi), float(phi[0]), float(steps[0]) if len(phi) > 1 else 0)
        )
    return found


# ---- tables ----------------------------------------------------------------------------------


def test_the_81_directions_are_those_of_ubo2003_atrium_and_utia() -> None:
    assert rings_of(hemisphere_table(81)) == [
        (0, 1, 0, 0), (15, 6, 0, 60), (30, 12, 0, 30), (45, 18, 0, 20), (60, 20, 0, 18),
        (75, 24, 0, 15),
    ]  # fmt: skip


def test_the_151_directions_are_those_of_ubo2014() -> None:
    thetas = [0, 11, 23.5, 30, 37.5, 45, 52.5, 60, 67.5, 75]
    counts = [1, 6, 12, 12, 12, 18, 18, 24, 24, 24]
    firsts = [0, 15, 0, 15, 0, 0, 7.5, 0, 7.5, 0]
    found = rings_of(hemisphere_table(151))
    assert [ring[:2] for ring in found] == list(zip(thetas, counts, strict=True))
    np.testing.assert_allclose([ring[2] for ring in found], firsts, atol=1e-9)
    np.testing.assert_allclose([ring[3] for ring in found[1:]], [360 / n for n in counts[1:]])


@pytest.mark.parametrize("count", [15, 41, 81, 151])
def test_a_table_has_its_number_of_directions_all_different_from_the_normal_down(
    count: int,
) -> None:
    table = hemisphere_table(count)
    assert table.shape == (count, 2)
    assert tuple(table[0]) == (0.0, 0.0)
    assert (np.diff(table[:, 0]) >= 0).all()
    assert ((table[:, 1] >= 0) & (table[:, 1] < 2 * math.pi)).all()
    vectors = unit_vectors(table)
    assert (vectors @ vectors.T - 2 * np.eye(count)).max() < math.cos(math.radians(5))


@pytest.mark.parametrize("count", [15, 41, 81, 151])
def test_every_ring_is_spread_evenly_about_the_normal(count: int) -> None:
    table = hemisphere_table(count)
    np.testing.assert_allclose(unit_vectors(table)[:, :2].sum(axis=0), 0.0, atol=1e-12)


@pytest.mark.parametrize("count", [0, -81, 80, 6561])
def test_another_number_of_directions_is_refused(count: int) -> None:
    message = rf"^directions is {count}; expected one of 15, 41, 81, 151\.$"
    with pytest.raises(ValueError, match=message):
        hemisphere_table(count)


# ---- pairs -----------------------------------------------------------------------------------


def test_pairs_are_numbered_view_times_lights_plus_light() -> None:
    views, lights = hemisphere_table(15), hemisphere_table(41)
    pairs = all_pairs(views, lights)
    assert len(pairs.view) == len(pairs.light) == 15 * 41
    for view in range(15):
        for light in range(41):
            number = view * 41 + light
            assert tuple(pairs.view[number]) == tuple(views[view])
            assert tuple(pairs.light[number]) == tuple(lights[light])


# ---- vectors and planes ----------------------------------------------------------------------


def test_unit_vectors_have_their_axes_where_the_texture_has_them() -> None:
    right, up = math.pi / 2, math.pi / 2
    named = [(0.0, 0.0), (right, 0.0), (right, up), (right, math.pi)]
    expected = [(0, 0, 1), (1, 0, 0), (0, 1, 0), (-1, 0, 0)]
    np.testing.assert_allclose(unit_vectors(named), expected, atol=1e-15)


@given(thetas, phis)
def test_unit_vectors_are_as_long_as_1_and_have_the_angles_they_were_made_of(
    theta: float, phi: float
) -> None:
    x, y, z = unit_vectors((theta, phi))
    assert math.hypot(x, y, z) == pytest.approx(1.0, abs=1e-15)
    assert math.atan2(math.hypot(x, y), z) == pytest.approx(theta, abs=1e-15)
    assert math.hypot(x, y) * math.cos(phi) == pytest.approx(x, abs=1e-15)
    assert math.hypot(x, y) * math.sin(phi) == pytest.approx(y, abs=1e-15)


@given(st.floats(1e-3, math.pi / 2), phis)
def test_the_stereographic_plane_is_equations_7_to_9(theta: float, phi: float) -> None:
    radius = math.sin(math.pi - theta) / (1 - math.cos(math.pi - theta))
    expected = (radius * math.cos(phi), radius * math.sin(phi))
    np.testing.assert_allclose(stereographic((theta, phi)), expected, rtol=1e-12, atol=1e-15)


@given(thetas, phis)
def test_the_stereographic_plane_of_vectors_is_that_of_their_angles(
    theta: float, phi: float
) -> None:
    found = stereographic_of_vectors(unit_vectors((theta, phi)))
    np.testing.assert_allclose(found, stereographic((theta, phi)), atol=1e-15)


def test_the_stereographic_plane_keeps_angles() -> None:
    """Conformal: a small step in theta and one across it are stretched alike."""
    theta, phi, step = 0.9, 0.4, 1e-6
    here = stereographic((theta, phi))
    down = np.linalg.norm(stereographic((theta + step, phi)) - here) / step
    across = np.linalg.norm(stereographic((theta, phi + step)) - here) / (step * math.sin(theta))
    assert down == pytest.approx(across, rel=1e-5)


# ---- angles ----------------------------------------------------------------------------------


@given(thetas, phis, thetas, phis)
def test_angles_agree_with_the_arc_cosine_in_higher_precision(
    theta: float, phi: float, other_theta: float, other_phi: float
) -> None:
    a, b, c, d = (np.longdouble(value) for value in (theta, phi, other_theta, other_phi))
    cosine = np.cos(a) * np.cos(c) + np.sin(a) * np.sin(c) * np.cos(b - d)
    expected = float(np.arccos(np.clip(cosine, np.longdouble(-1), np.longdouble(1))))
    # The arc cosine itself loses half its digits near 0 and pi, extended precision or not.
    assert angles_between((theta, phi), (other_theta, other_phi)) == pytest.approx(
        expected, abs=2e-9
    )


@pytest.mark.parametrize("step", [1e-4, 1e-8, 1e-12])
def test_tiny_angles_are_not_lost(step: float) -> None:
    assert angles_between((0.7, 1.1), (0.7 + step, 1.1)) == pytest.approx(step, rel=1e-3)
    assert angles_between((0.7, 1.1), (0.7, 1.1)) == pytest.approx(0.0, abs=1e-16)


def test_angles_to_one_direction_are_taken_from_all() -> None:
    table = hemisphere_table(81)
    np.testing.assert_allclose(angles_between(table, (0.0, 3.0)), table[:, 0], atol=1e-15)
