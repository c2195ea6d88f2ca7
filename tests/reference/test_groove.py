"""The exact table's BRDF, f = 2 rho_m / pi², against Mitsuba's paths in a groove in space."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.glass_scratches.tables.profiles import Shape, built_in_profile
from tests.reference.groove import (
    ALBEDO,
    DEPTH,
    WIDTH,
    direction_pairs,
    reference_figures,
    seen_of_the_ends,
    table_brdf,
    traced_brdf,
    unit_vectors,
)

PAIRS = 40
Compared = tuple[np.ndarray, np.ndarray, np.ndarray]


def rms(z: np.ndarray) -> float:
    return float(np.sqrt(np.mean(z**2)))


@pytest.fixture(scope="module")
def v_groove() -> Compared:
    return compared("v")


def compared(shape: Shape) -> Compared:
    """f as traced, its standard error, and f of the table."""
    profile, pairs = built_in_profile(shape, WIDTH, DEPTH), direction_pairs(PAIRS, seed=1)
    traced, error = traced_brdf(profile, ALBEDO, pairs, seed=1)
    return traced, error, table_brdf(profile, ALBEDO, pairs)


def check_agreement(traced: np.ndarray, error: np.ndarray, table: np.ndarray) -> None:
    """The sum of 40 squares of normal numbers lies below 40 · 0.7² once in 360 times, and above
    40 · 1.35² once in 880 times."""
    assert (error / traced).max() <= 0.01
    assert 0.7 < rms((traced - table) / error) < 1.35


def test_table_of_a_v_groove_agrees_with_paths_in_space(v_groove) -> None:
    check_agreement(*v_groove)


@pytest.mark.parametrize("shape", ["u", "trapezoid", "raised"])
def test_tables_of_other_grooves_agree_with_paths_in_space(shape) -> None:
    check_agreement(*compared(shape))


def test_a_wrong_law_is_found_out(v_groove) -> None:
    """rho_m / pi, as if the table were a BRDF in space, and a table that depends on the lean."""
    traced, error, table = v_groove
    leans = np.cos(direction_pairs(PAIRS, seed=1)[..., 0]).prod(axis=1)
    assert rms((traced - np.pi / 2 * table) / error) > 5
    assert rms((traced - leans / leans.mean() * table) / error) > 5


def test_light_and_view_are_not_mixed_up() -> None:
    """The light's and the view's phi both change sign where the groove is mirrored; a profile that
    is not its own mirror image tells one side from the other."""
    profile = np.array([(-5.0, 0.0), (3.0, -4.0), (5.0, 0.0)])
    pairs = direction_pairs(PAIRS, seed=1)
    traced, error = traced_brdf(profile, ALBEDO, pairs, seed=1)
    check_agreement(traced, error, table_brdf(profile, ALBEDO, pairs))
    mirrored = table_brdf(profile, ALBEDO, pairs * [1, -1])
    assert rms((traced - mirrored) / error) > 5


@pytest.mark.parametrize("view", [(0, 0), (75, 0), (75, 75), (-75, 40)])
def test_ends_of_the_groove_are_out_of_reach(view) -> None:
    """Far below the error of the paths."""
    profile = built_in_profile("v", WIDTH, DEPTH)
    assert 0 < seen_of_the_ends(profile, ALBEDO, np.radians(view)) < 1e-5


def test_unit_vectors_lean_along_the_groove_and_turn_across_it() -> None:
    expected = [(0, 0, 1), (0, 0.5, np.sqrt(0.75)), (0.5, 0, np.sqrt(0.75))]
    given = np.radians([(0, 0), (0, 30), (30, 0)])
    np.testing.assert_allclose(unit_vectors(given), expected, atol=1e-12)


@pytest.mark.slow
def test_reference_of_the_benchmark() -> None:
    """z rms <= 1.1: 320 squares of normal numbers sum to more than 320 · 1.1² once in 170 times."""
    figures = reference_figures()
    assert figures["reference_pairs"] >= 300
    assert figures["reference_worst_se"] <= 0.01
    assert figures["reference_z_rms"] <= 1.1
