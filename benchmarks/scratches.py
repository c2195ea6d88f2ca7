"""Figures of scratched glass: laws of the table, its speed, sampling, rendering, a reference."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scratches_glass import glass_figures
from benchmarks.scratches_photo import photograph_figures
from benchmarks.scratches_pictures import picture_figures
from pipelines.geometry.solid_shapes import plate
from pipelines.glass_scratches.drawing.frames import object_cameras
from pipelines.glass_scratches.drawing.path_tracing import (
    Strategy,
    trace_picture,
)
from pipelines.glass_scratches.figures import block_means
from pipelines.glass_scratches.layers.scratch_layers import make_layers
from pipelines.glass_scratches.layers.settings import LayerSpec
from pipelines.glass_scratches.scratched_glass import (
    ScratchedGlass,
    ScratchMaterial,
    scratch_material,
    scratched_glass,
)
from pipelines.glass_scratches.tables.bins import bin_weights
from pipelines.glass_scratches.tables.fresnel import interpolation_error
from pipelines.glass_scratches.tables.glass_table import glass_table
from pipelines.glass_scratches.tables.monte_carlo import shoot_paths
from pipelines.glass_scratches.tables.profiles import Shape, built_in_profile
from pipelines.glass_scratches.tables.radiosity import leaving_share, solve_radiosity, view_factors
from pipelines.light.built_in_environments import lamps, sky
from pipelines.light.environment_sampling import make_environment_sampler

BINS, RAYS, PATHS = 256, 10_000, 100
"""The paper's M, N, Nr."""
PATHS_A_BIN = 1_000_000
FACETS = (64, 128, 256, 512)
REFERENCE_FACETS = 1024
SHAPES: tuple[Shape, ...] = ("v", "u", "trapezoid", "raised")
SEEDS = 16
VARIANCE_SIZE, VARIANCE_SAMPLES = 64, 64
RENDER_SIZE, RENDER_SAMPLES = 512, 64


def run(scale: str) -> dict[str, Any]:
    """All figures; docs/scratches.md says what each one means. The paper's scale is that of
    `scratches_pictures` and `scratches_glass`."""
    figures: dict[str, Any] = {}
    parts = (
        _laws,
        _paths_against_exact,
        _table_speed,
        _interpolation,
        _sampling,
        _rendering,
    )
    for part in parts:
        figures |= part()
    figures |= picture_figures(_material(), scale) | glass_figures(scale) | photograph_figures()
    from tests.reference.groove import reference_figures

    return figures | reference_figures()


def _v() -> NDArray[np.float64]:
    return built_in_profile("v", 10.0, 4.0)


def _laws() -> dict[str, float]:
    """White furnace and reciprocity of the paper's table, worst of four profiles, albedo 1."""
    furnace, reciprocity = 0.0, 0.0
    for shape in SHAPES:
        factors = view_factors(built_in_profile(shape, 10.0, 4.0), BINS, FACETS[1])
        rho = solve_radiosity(factors, 1.0).rho
        furnace = max(furnace, float(np.abs(leaving_share(rho) - 1).max()))
        reciprocity = max(reciprocity, float(np.abs(rho - rho.T).max() / rho.max()))
    return {"white_furnace_error": furnace, "paper_reciprocity_error": reciprocity}


def _paths_against_exact() -> dict[str, float]:
    """z-scores of the Monte Carlo's counts, sigma from the exact probabilities."""
    rho = solve_radiosity(view_factors(_v(), BINS, REFERENCE_FACETS), 1.0).rho
    chance = (rho * bin_weights(BINS)[:, None] / np.pi).T
    counts = shoot_paths(
        _v(), bins=BINS, rays=PATHS_A_BIN, paths_per_ray=1, albedo=1.0, seed=1
    ).leaving.sum(axis=1)
    variance = PATHS_A_BIN * chance * (1 - chance)
    z = (counts - PATHS_A_BIN * chance) / np.sqrt(variance)
    blocks = (16, BINS // 16, 16, BINS // 16)
    over = (counts - PATHS_A_BIN * chance).reshape(blocks).sum(axis=(1, 3))
    joined = chance.reshape(BINS, *blocks[2:]).sum(axis=2)
    block_variance = PATHS_A_BIN * (joined * (1 - joined)).reshape(*blocks[:2], 16).sum(axis=1)
    return {
        "mc_z_rms": float(np.sqrt(np.mean(z**2))),
        "mc_z_max": float(np.abs(z).max()),
        "mc_block_z_rms": float(np.sqrt(np.mean(over**2 / block_variance))),
    }


def _table_speed() -> dict[str, Any]:
    """The fewest facets whose table agrees with that of four times as many, and their time."""
    errors = {}
    for facets in FACETS:
        coarse, fine = (
            block_means(solve_radiosity(view_factors(_v(), BINS, count), 1.0).rho)
            for count in (facets, 4 * facets)
        )
        errors[facets] = float(np.abs(coarse / fine - 1).max())
        if errors[facets] <= 1e-3:
            break
    exact = []
    for _ in range(7):
        started = time.perf_counter()
        solve_radiosity(view_factors(_v(), BINS, facets), 1.0)
        exact.append(time.perf_counter() - started)
    started = time.perf_counter()
    shoot_paths(_v(), bins=BINS, rays=RAYS, paths_per_ray=PATHS, albedo=1.0, seed=2)
    paths = time.perf_counter() - started
    seconds = float(np.median(exact))
    return {
        "table_facets": facets,
        "table_error": errors[facets],
        "table_exact_s": seconds,
        "table_paths_s": paths,
        "table_speedup": paths / seconds,
        "table_mpaths_s": BINS * RAYS * PATHS / paths / 1e6,
    }


def _interpolation() -> dict[str, float]:
    paper = interpolation_error(BINS, 1.5, "paper")
    physical = interpolation_error(BINS, 1.5, "physical")
    return {
        "gamma_interpolation_error": paper["largest"],
        "gamma_interpolation_error_mean": paper["mean"],
        "gamma_interpolation_error_physical": physical["largest"],
        "gamma_interpolation_error_physical_mean": physical["mean"],
    }


def _material() -> ScratchMaterial:
    """The paper's second setting, its walls glass that scatters evenly."""
    table = glass_table(_v(), bins=BINS, index=1.5, facets=FACETS[1])
    layers = make_layers(LayerSpec(length=0.6, width=0.01, threshold=0.1), 3)
    return scratch_material(table, layers)


def _setting_2() -> ScratchedGlass:
    """The plate with it."""
    return scratched_glass(plate(1.5, 1.1, 0.05), _material())


def _sampling() -> dict[str, float]:
    """Variance over the seeds of the pixels that show scratches, times the rays it took."""
    glass = _setting_2()
    light = make_environment_sampler(sky(256, sun_azimuth=-115.0, sun_elevation=38.0))
    camera = object_cameras(glass.solid)[1]

    def pictures(strategy: Strategy) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
        taken = [
            trace_picture(
                glass.solid,
                glass.surface,
                light,
                camera,
                width=VARIANCE_SIZE,
                height=VARIANCE_SIZE,
                samples=VARIANCE_SAMPLES,
                seed=seed,
                strategy=strategy,
            )
            for seed in range(SEEDS)
        ]
        shown = np.stack([picture.radiance.mean(axis=2) for picture in taken])
        scratched = np.mean([picture.scratched for picture in taken], axis=0)
        return shown, scratched, sum(picture.rays for picture in taken)

    guided, scratched, rays = pictures("importance")
    even, _, even_rays = pictures("uniform")
    seen = scratched > 0.5
    one, other = (shown.var(axis=0, ddof=1)[seen].sum() for shown in (even, guided))
    return {
        "sampling_variance_ratio": float(one * even_rays / (other * rays)),
        "sampling_variance_ratio_equal_paths": float(one / other),
        "sampling_mean_importance": float(guided[:, seen].mean()),
        "sampling_mean_uniform": float(even[:, seen].mean()),
    }


def _rendering() -> dict[str, float]:
    """The plate, setting 2, from far, among lamps."""
    glass = _setting_2()
    light = make_environment_sampler(lamps(512))
    camera = object_cameras(glass.solid)[0]
    started = time.perf_counter()
    trace_picture(
        glass.solid,
        glass.surface,
        light,
        camera,
        width=RENDER_SIZE,
        height=RENDER_SIZE,
        samples=RENDER_SAMPLES,
    )
    seconds = time.perf_counter() - started
    return {
        "render_s": seconds,
        "render_mpaths_s": RENDER_SIZE**2 * RENDER_SAMPLES / seconds / 1e6,
    }
