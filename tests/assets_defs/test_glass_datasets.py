"""Datasets of scratched glass and the objects of `pipelines`: what goes in comes out, and fits its
schema."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from assets_defs.glass_scratches import datasets
from pipelines.geometry.solid_shapes import plate
from pipelines.glass_scratches.drawing.frames import GlassFrames
from pipelines.glass_scratches.drawing.path_tracing import TracedPicture
from pipelines.glass_scratches.figures import enclosed_volume
from pipelines.glass_scratches.layers.coverage import coverage_maps
from pipelines.glass_scratches.layers.features import Layers
from pipelines.glass_scratches.layers.scratch_layers import make_layers
from pipelines.glass_scratches.layers.settings import LayerSpec
from pipelines.glass_scratches.scratched_glass import scratch_material
from pipelines.glass_scratches.tables.glass_table import glass_table
from pipelines.glass_scratches.tables.lobe import make_lobe
from pipelines.glass_scratches.tables.profiles import built_in_profile
from pipelines.glass_scratches.tables.scratch_table import scratch_brdf_table
from storage.schemas import glass_scratches as schemas

PROFILE = built_in_profile("v", 10.0, 4.0)


@pytest.fixture(scope="module")
def layers() -> Layers:
    spec = LayerSpec(length=0.4, width=0.05, layers=2, curvature=0.5, fading=0.4, breaks=0.2)
    return make_layers(spec, 1)


def assert_same(one: Any, other: Any) -> None:
    for name, a, b in zip(one._fields, one, other, strict=True):
        if hasattr(a, "_fields"):
            assert_same(a, b)
            continue
        np.testing.assert_array_equal(a, b, err_msg=name)
        assert np.asarray(a).dtype == np.asarray(b).dtype, name


def test_the_papers_table_comes_back() -> None:
    table = scratch_brdf_table(PROFILE, bins=8, method="paths", rays=200)
    stored = schemas.SCRATCH_TABLE_2D.conform(datasets.paper_table_dataset(table, 1.4))
    assert (stored.attrs["walls"], float(stored["index"])) == ("paper", 1.4)
    assert_same(datasets.table_2d_of(stored), table)


@pytest.mark.parametrize("roughness", [0.0, 1.0])
def test_a_table_of_glass_comes_back(roughness: float) -> None:
    table = glass_table(PROFILE, bins=8, index=1.4, roughness=roughness, rays=200)
    stored = schemas.SCRATCH_TABLE_2D.conform(datasets.glass_table_dataset(table))
    assert stored.attrs["walls"] == "glass"
    assert_same(datasets.table_2d_of(stored), table)


def test_what_sampling_needs_comes_back() -> None:
    """Of the paper's walls, which are put together with Fresnel's factor, and of walls of glass."""
    papers = datasets.paper_table_dataset(scratch_brdf_table(PROFILE, bins=8), 1.4)
    glass = datasets.glass_table_dataset(glass_table(PROFILE, bins=8, index=1.4))
    for plane in (papers, glass):
        table = datasets.bsdf_table_of(plane, "physical")
        lobe = make_lobe(table)
        stored = schemas.SCRATCH_TABLE.conform(datasets.table_dataset(table, lobe, "physical"))
        again, sampler = datasets.scratch_tables_of(plane, stored)
        assert_same(sampler, lobe)
        assert_same(again, table._replace(rho=table.rho.astype(np.float32).astype(np.float64)))


def test_layers_come_back_with_their_grid(layers: Layers) -> None:
    maps, stages = coverage_maps(layers, 16), np.zeros((3, 4, 4), np.uint8)
    stored = schemas.SCRATCH_LAYERS.conform(datasets.layers_dataset(layers, maps, stages))
    assert_same(datasets.layers_of(stored), layers)
    np.testing.assert_array_equal(stored["coverage"], maps)


def test_a_solid_comes_back() -> None:
    solid = plate(1.5, 1.1, 0.05)
    stored = schemas.GLASS_OBJECT.conform(datasets.solid_dataset(solid, "pane.obj"))
    assert stored.attrs["name"] == "pane.obj"
    assert_same(datasets.solid_of(stored), solid)
    assert float(stored["volume"]) == enclosed_volume(solid.vertices, solid.triangles)


def test_the_material_of_stored_parts_is_that_of_the_parts(layers: Layers) -> None:
    table = glass_table(PROFILE, bins=8, index=1.4)
    # The table that runs is stored in single precision.
    table = table._replace(rho=table.rho.astype(np.float32).astype(np.float64))
    material = scratch_material(table, layers, resolution=16)
    stored = datasets.material_of(
        datasets.glass_table_dataset(table),
        datasets.table_dataset(table, material.lobe, "paper"),
        datasets.layers_dataset(layers, material.coverage, np.zeros((3, 4, 4), np.uint8)),
    )
    assert_same(stored, material)


def test_frames_are_stored_as_they_are_displayed() -> None:
    random = np.random.default_rng(0)

    def traced(size: int) -> TracedPicture:
        return TracedPicture(
            random.random((size, size, 3), np.float32),
            random.random((size, size), np.float32),
            random.random((size, size), np.float32),
            random.random((size, size, 3), np.float32),
            random.random((size, size, 3), np.float32),
            7,
            16,
        )

    far, close, furnace = traced(4), traced(4), traced(3)
    clean, stage = random.random((2, 2, 4, 4, 3)).astype(np.float32)
    moving = random.integers(0, 256, (2, 5, 5, 3), np.uint8)
    frames = GlassFrames(far, close, clean, stage, moving, furnace, 0.5)
    light = np.full((4, 8, 3), [0.1, 0.2, 0.3], np.float32)
    stored = schemas.GLASS_FRAMES.conform(datasets.frames_dataset(frames, light))
    np.testing.assert_array_equal(stored["radiance"][1], close.radiance)
    np.testing.assert_array_equal(stored["error"][0], np.sqrt(far.variance))
    np.testing.assert_array_equal(stored["scratched"][1], close.scratched)
    np.testing.assert_array_equal(stored["moving"], moving)
    # Half the radiance, through the sRGB curve.
    np.testing.assert_array_equal(stored["clean"], clean)
    np.testing.assert_allclose(stored["surroundings"], [0.1, 0.2, 0.3], rtol=1e-6)
    linear = 0.5 * clean[0].astype(np.float64)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert np.abs(stored["frames"][0] - 255 * srgb).max() <= 1
    np.testing.assert_allclose(stored["furnace"], furnace.radiance.mean(axis=2))
