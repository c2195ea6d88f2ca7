"""Figures of layers made of a photograph: directions, coverage and width against what is known,
each beside what a photograph of another glass gives."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipelines.glass_scratches.layers.coverage import coverage_maps
from pipelines.glass_scratches.layers.settings import LayerSpec
from pipelines.glass_scratches.photograph.figures import direction_error, photograph_likeness
from pipelines.glass_scratches.photograph.photograph_layers import (
    PhotographScratches,
    layers_like,
    photograph_scratches,
)
from pipelines.glass_scratches.photograph.segments import Segments
from tests.pipelines.glass_scratches.photographs import SPEC, photograph

SEEDS = (1, 2)
SIZE = 384
OTHER = LayerSpec(length=1.0, width=0.1, coverage=0.03, layers=2)
"""Another glass, with wider scratches."""


def photograph_figures() -> dict[str, Any]:
    """All of them, means over the seeds; docs/scratches.md says what each one means."""
    rows: list[dict[str, float]] = []
    for seed in SEEDS:
        found, truth, width = _made(SPEC, seed)
        other = _made(OTHER, seed + 10)[0]
        again = coverage_maps(layers_like(found, seed), SIZE)
        likeness = photograph_likeness(found, again)
        covered = SPEC.layers * SPEC.coverage if SPEC.coverage else np.nan
        rows.append(
            {
                "photo_direction_error_deg": direction_error(found.segments, truth),
                "photo_direction_error_deg_null": direction_error(other.segments, truth),
                "photo_coverage_ratio": float(found.coverage.sum()) / covered,
                "photo_coverage_ratio_null": float(other.coverage.sum()) / covered,
                "photo_width_ratio": _width(found) / width,
                "photo_width_ratio_null": _width(other) / width,
                "photo_layers_direction_error_deg": likeness.direction_error,
                "photo_layers_coverage_ratio": likeness.coverage_ratio,
            }
        )
    figures: dict[str, Any] = {
        name: round(float(np.mean([row[name] for row in rows])), 4) for name in rows[0]
    }
    return figures | {"photo_shuffled": _shuffled()}


def _made(spec: LayerSpec, seed: int) -> tuple[PhotographScratches, Segments, float]:
    """Scratches found in a photograph; those that are there; their mean width, pixels."""
    layers, picture = photograph(spec, seed, SIZE)
    features = layers.features
    angle = np.mod(layers.angle[features.layer].astype(np.float64) + features.turn, np.pi)
    width = 2 * np.pi / 4 * SIZE * features.half_width.astype(np.float64)
    truth = Segments(
        SIZE * features.centre.astype(np.float64),
        angle,
        2.0 * SIZE * features.half_length.astype(np.float64),
        width,
        features.strength.astype(np.float64),
        np.zeros(len(angle)),
    )
    return photograph_scratches(picture), truth, float(np.average(width, weights=truth.length))


def _width(found: PhotographScratches) -> float:
    return float(np.average(found.segments.width, weights=found.segments.length))


def _shuffled() -> str:
    """What is said of a photograph whose pixels are shuffled."""
    pixels = photograph(SPEC, SEEDS[0], SIZE)[1].ravel()
    try:
        found = photograph_scratches(
            np.random.default_rng(0).permutation(pixels).reshape(SIZE, SIZE)
        )
    except ValueError as error:
        return f"refused: {error}"
    return f"taken: {len(found.layer)} scratches"
