"""Figures of walls of glass: laws of the table, Mitsuba's grooves, what table and profile do to
pictures, and the stage beside traced pictures.

At the paper's scale there are as many pairs of directions, and paths a pixel, as the figures ask
for: the better part of an hour. Else fewer, and the names of what is measured with fewer end in
``_small``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.picture_metrics import flip_map
from pipelines.geometry.solid_shapes import glass_teapot, plate
from pipelines.geometry.solids import Solid
from pipelines.glass_scratches.drawing.denoising import denoised
from pipelines.glass_scratches.drawing.frames import (
    object_cameras,
    picture_exposure,
    trace_view,
)
from pipelines.glass_scratches.drawing.path_tracing import TracedPicture
from pipelines.glass_scratches.drawing.stage_view import draw_scratched
from pipelines.glass_scratches.layers.scratch_layers import make_layers
from pipelines.glass_scratches.layers.settings import LayerSpec
from pipelines.glass_scratches.scratched_glass import (
    ScratchedGlass,
    scratch_material,
    scratched_glass,
)
from pipelines.glass_scratches.tables.bsdf_table import BsdfTable, asymmetry, energy_error
from pipelines.glass_scratches.tables.glass_table import glass_table
from pipelines.glass_scratches.tables.profiles import Shape, built_in_profile
from pipelines.light.environment_sampling import EnvironmentSampler, make_environment_sampler
from pipelines.light.room import room

INDEX, BINS, RAYS = 1.5, 128, 20_000
SETTINGS = {
    "setting_1": LayerSpec(length=0.3, width=0.001, threshold=0.1),
    "setting_2": LayerSpec(length=0.6, width=0.01, threshold=0.1),
}
WALLS = {"even": 1.0, "ground": 0.5, "clear": 0.0}
"""Roughness."""
SHAPES: tuple[Shape, ...] = ("v", "u", "trapezoid", "raised")
MATTERS_SIZE = 80


class Extent(NamedTuple):
    """Pairs of directions to each side, of clear and of ground walls each; paths a pixel of what
    tells whether tables matter; pixels a side and paths of the pictures that the stage is beside.
    """

    pairs: int
    matters: int
    stage: tuple[int, int]


EXTENTS = {"default": Extent(40, 64, (128, 96)), "paper": Extent(160, 512, (180, 256))}


def glass_figures(scale: str) -> dict[str, Any]:
    """All of them; docs/scratches.md says what each one means."""
    from tests.reference.glass_groove import reference_figures

    light = make_environment_sampler(room(1024))
    extent = EXTENTS[scale]
    counted = (
        _matters(light, extent.matters)
        | _stage_beside_traced(light, extent.stage)
        | reference_figures(extent.pairs)
    )
    end = "" if scale == "paper" else "_small"
    return _laws() | {f"{name}{end}": value for name, value in counted.items()}


def _table(shape: Shape, roughness: float, bins: int = BINS) -> BsdfTable:
    profile = built_in_profile(shape, 10.0, 4.0)
    return glass_table(profile, bins=bins, index=INDEX, roughness=roughness, rays=RAYS)


def _laws() -> dict[str, float]:
    """Worst of four profiles and three kinds of walls; the null of reciprocity is the table of
    radiance itself, not over n²."""
    tables = [_table(shape, roughness, 64) for shape in SHAPES for roughness in WALLS.values()]
    one = tables[0].rho[0]
    radiance = one * np.repeat([1.0, INDEX**2], len(one) // 2)
    return {
        "energy_error": max(energy_error(table) for table in tables),
        "reciprocity_error": max(asymmetry(table) for table in tables),
        "reciprocity_null": float(np.abs(radiance - radiance.T).max() / radiance.max()),
    }


def _matters(light: EnvironmentSampler, samples: int) -> dict[str, Any]:
    """Relative change of the pixels that show scratches, plate from close, where the table is set
    to zero and where the V becomes a trapezoid: RMS over mean, less what noise makes of it; beside
    it the same from one seed to another, which knows of no change."""
    solid = plate(1.5, 1.1, 0.05)
    found: dict[str, dict[str, float]] = {"table": {}, "profile": {}, "noise": {}}
    for setting, spec in SETTINGS.items():
        layers = make_layers(spec, 3)
        for walls, roughness in WALLS.items():
            table = _table("v", roughness)
            black = table._replace(rho=0 * table.rho, across=0 * table.across)
            others = {"table": black, "profile": _table("trapezoid", roughness), "noise": table}
            shown = _close_up(solid, table, layers, light, samples=samples, seed=0)
            for name, other in others.items():
                changed = _close_up(solid, other, layers, light, samples=samples, seed=1)
                found[name][f"{setting}_{walls}"] = _change(shown, changed)
    return {
        "table_matters": min(found["table"].values()),
        "profile_matters": min(found["profile"].values()),
        "matters_null": max(found["noise"].values()),
        "matters": found,
    }


def _close_up(
    solid: Solid,
    table: BsdfTable,
    layers: Any,
    light: EnvironmentSampler,
    *,
    samples: int,
    seed: int,
) -> TracedPicture:
    glass = scratched_glass(solid, scratch_material(table, layers))
    return trace_view(
        glass,
        light,
        object_cameras(solid)[1],
        size=MATTERS_SIZE,
        samples=samples,
        seed=seed,
    )


def _change(one: TracedPicture, other: TracedPicture) -> float:
    """Of the pixels half of whose paths meet a scratch, or of the most scratched hundredth."""
    seen = one.scratched >= min(0.5, float(np.quantile(one.scratched, 0.99)))
    a, b = one.radiance.mean(axis=2)[seen], other.radiance.mean(axis=2)[seen]
    # A few fireflies have most of the variance: less weight where there is more of it.
    noise = (one.variance + other.variance)[seen]
    weight = 1.0 / (noise + np.median(noise) + 1e-12)
    square = float(weight @ ((a - b) ** 2 - noise) / weight.sum())
    return float(np.sqrt(max(square, 0.0)) / (weight @ a / weight.sum()))


def _stage_beside_traced(light: EnvironmentSampler, extent: tuple[int, int]) -> dict[str, Any]:
    """FLIP of the stage's pictures against traced and denoised ones: plate and teapot, far and
    close, walls of each kind; null: the stage's picture moved by half its width."""
    layers = make_layers(SETTINGS["setting_2"], 3)
    solids = {"plate": plate(1.5, 1.1, 0.05), "teapot": glass_teapot(14, 0.05)}
    flips: dict[str, float] = {}
    nulls: dict[str, float] = {}
    for walls, roughness in WALLS.items():
        material = scratch_material(_table("v", roughness), layers)
        for name, solid in solids.items():
            glass = scratched_glass(solid, material)
            for view in range(2):
                one, null = _flips(glass, light, view, extent)
                key = f"{name}_{'far' if view == 0 else 'close'}_{walls}"
                flips[key], nulls[key] = one, null
    return {
        "stage_vs_traced_flip": max(flips.values()),
        "stage_vs_traced_flip_mean": float(np.mean(list(flips.values()))),
        "stage_vs_traced_null": min(nulls.values()),
        "stage_views": {"flip": flips, "null": nulls},
    }


def _flips(
    glass: ScratchedGlass, light: EnvironmentSampler, view: int, extent: tuple[int, int]
) -> tuple[float, float]:
    size, samples = extent
    camera = object_cameras(glass.solid)[view]
    traced = denoised(trace_view(glass, light, camera, size=size, samples=samples))
    stage = draw_scratched(glass.actor, light, camera, width=size, height=size, supersampling=2)[
        ..., :3
    ]
    empty = np.roll(stage, size // 2, axis=1)
    exposure = picture_exposure(traced)

    truth, one, null = (to_8bit(each * exposure) for each in (traced, stage, empty))
    return float(flip_map(one, truth).mean()), float(flip_map(null, truth).mean())
