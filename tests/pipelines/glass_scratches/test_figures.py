"""Figures of scratched glass: nothing wrong gives nothing, one fault is measured."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pipelines.geometry.solid_shapes import plate
from pipelines.glass_scratches import figures
from pipelines.glass_scratches.layers.coverage import coverage_maps
from pipelines.glass_scratches.layers.scratch_layers import make_layers
from pipelines.glass_scratches.layers.settings import LayerSpec
from pipelines.glass_scratches.tables.bins import bin_weights
from pipelines.glass_scratches.tables.glass_table import glass_table
from pipelines.glass_scratches.tables.profiles import built_in_profile
from pipelines.glass_scratches.tables.scratch_table import scratch_brdf_table
from pipelines.glass_scratches.tables.table_2d import Table2D

BINS = 16
PROFILE = built_in_profile("v", 10.0, 4.0)


@pytest.fixture(scope="module")
def table() -> Table2D:
    return scratch_brdf_table(built_in_profile("v", 10.0, 4.0), bins=BINS, albedo=0.8, facets=40)


# ---- profiles and tables -----------------------------------------------------------------------


def test_depth_over_width_and_what_lies_off_the_opening() -> None:
    profile = built_in_profile("trapezoid", 8.0, 2.0)
    assert figures.profile_aspect(profile) == 0.25
    assert figures.opening_tilt(profile) == 0.0
    raised = profile.copy()
    raised[-1, 1] = -0.1
    raised[1, 1] = 0.3
    assert figures.opening_tilt(raised) == pytest.approx(0.4)


def test_light_that_neither_leaves_nor_stays_is_found(table: Table2D) -> None:
    assert figures.energy_error(table) < 1e-12
    lost = table.absorbed.copy()
    lost[3] -= 0.01
    assert figures.energy_error(table._replace(absorbed=lost)) == pytest.approx(0.01)


def test_a_table_of_glass_that_loses_light_or_has_sides_is_found() -> None:
    glass = glass_table(PROFILE, bins=8, index=1.5, facets=20)
    assert figures.energy_error(glass) < 1e-11
    assert figures.reciprocity_error(glass) == 0.0
    darker = glass._replace(rho=0.99 * glass.rho)
    assert figures.energy_error(darker) == pytest.approx(0.01, rel=1e-6)
    tilted = glass._replace(rho=glass.rho * np.linspace(0.95, 1.05, 16))
    assert figures.reciprocity_error(tilted) > 0.01


@pytest.mark.parametrize("roughness", [0.0, 0.5, 1.0])
def test_new_paths_find_the_table_and_no_other(roughness: float) -> None:
    """RMS z of some 400 blocks: about one, and far off for the table of a deeper scratch."""
    walls = {"albedo": 1.0, "roughness": roughness}
    options: dict[str, Any] = {"bins": 16, "index": 1.5, "roughness": roughness, "rays": 20_000}
    right = glass_table(PROFILE, **options)
    assert figures.paths_z_rms(PROFILE, right, **walls) < 1.3
    other = glass_table(PROFILE * [1.0, 1.6], **options)
    assert figures.paths_z_rms(PROFILE, other, **walls) > 5


def test_block_means_are_weighted_by_the_cosines() -> None:
    rho = np.random.default_rng(0).random((BINS, BINS))
    weight = bin_weights(BINS)
    means = figures.block_means(rho, 4)
    first = np.outer(weight[:4], weight[4:8])
    assert means[0, 1] == pytest.approx((rho[:4, 4:8] * first).sum() / first.sum())


def test_a_one_sided_table_is_found_beyond_its_noise(table: Table2D) -> None:
    assert figures.reciprocity_error(table) < 1e-12
    tilted = table._replace(rho=table.rho * np.linspace(0.95, 1.05, BINS))
    assert figures.reciprocity_error(tilted) > 0.01
    noisy = tilted._replace(standard_error=np.full_like(table.rho, 0.1))
    assert figures.reciprocity_error(noisy) == 0.0


def test_the_mean_across_the_opening_is_the_table(table: Table2D) -> None:
    assert figures.across_error(table.across[None], table.rho[None]) < 1e-6
    brighter = table.across.copy()
    brighter[:, 2, 5] *= 1.1
    expected = 0.1 * table.rho[5, 2] / table.rho.max()
    assert figures.across_error(brighter[None], table.rho[None]) == pytest.approx(
        expected, rel=1e-4
    )


# ---- layers ------------------------------------------------------------------------------------


def test_the_coverage_is_compared_with_what_was_asked_for() -> None:
    maps = np.full((2, 4, 4), 0.11, np.float32)
    maps[1] = 0.09
    asked = LayerSpec(coverage=0.1, fading=0.5)
    assert figures.coverage_error(maps, asked) == pytest.approx(0.1, rel=1e-6)
    poisson = LayerSpec(threshold=0.2)
    share = 1 - np.exp(-np.pi * 0.04)
    assert figures.coverage_error(np.full((1, 4, 4), share), poisson) == pytest.approx(0.0)
    assert figures.coverage_error(maps, LayerSpec(breaks=0.1)) is None


def test_maps_of_other_scratches_are_found() -> None:
    layers = make_layers(LayerSpec(length=0.3, width=0.02, threshold=0.3, layers=2), 1)
    maps = coverage_maps(layers, 64, 8)
    assert figures.coverage_map_z(maps, layers, 8) < 1.5
    assert figures.coverage_map_z(np.roll(maps, 20, axis=2), layers, 8) > 5


# ---- solids and pictures -----------------------------------------------------------------------


def test_a_solid_is_closed_and_has_a_volume() -> None:
    solid = plate(1.5, 1.1, 0.05)
    assert figures.edge_error(solid.triangles) == 0.0
    assert figures.edge_error(solid.triangles[1:]) == pytest.approx(3 / 33)
    assert figures.enclosed_volume(solid.vertices, solid.triangles) == pytest.approx(0.0825)


def test_radiance_that_cannot_be_is_counted() -> None:
    radiance = np.ones((2, 2, 3))
    assert figures.impossible_share(radiance) == 0.0
    radiance[0, 0] = np.nan, np.inf, -1e-3
    assert figures.impossible_share(radiance) == 0.25


def test_the_brightest_block_stands_out_in_standard_errors() -> None:
    picture, error = np.ones((17, 16)), np.full((17, 16), 0.08)
    assert figures.brightest_excess(picture, error) == 0.0
    picture[8:16, 8:16] += 0.05  # of a mean of 64 pixels: 0.01 standard error
    assert figures.brightest_excess(picture, error) == pytest.approx(5.0)
    picture[16] = 9.0  # no whole block
    assert figures.brightest_excess(picture, error) == pytest.approx(5.0)
