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

SEEDS = (1, 2, 3)
SIZE = 384
OTHER = LayerSpec(length=1.0, width=0.1, coverage=0.06, layers=2)
"""Another glass, with wider scratches, over twice the area."""


def photograph_figures() -> dict[str, Any]:
    """All of them, means over the seeds; docs/scratches.md says what each one means."""
    rows: list[dict[str, float]] = []
    for seed in SEEDS:
        found, truth = _made(SPEC, seed)
        covered, width = _area(truth), _width(truth)
        other = _made(OTHER, seed + 10)[0]
        again = coverage_maps(layers_like(found, seed), SIZE)
        likeness = photograph_likeness(found, again)
        rows.append(
            {
                "photo_direction_error_deg": direction_error(found.segments, truth),
                "photo_direction_error_deg_null": direction_error(other.segments, truth),
                "photo_area_ratio": _area(found.segments) / covered,
                "photo_area_ratio_null": _area(other.segments) / covered,
                "photo_width_ratio": _width(found.segments) / width,
                "photo_width_ratio_null": _width(other.segments) / width,
                "photo_layers_direction_error_deg": likeness.direction_error,
                "photo_layers_coverage_ratio": likeness.coverage_ratio,
            }
        )
    figures: dict[str, Any] = {
        name: round(float(np.mean([row[name] for row in rows])), 4) for name in rows[0]
    }
    return figures | {"photo_shuffled": _shuffled()}


def _made(spec: LayerSpec, seed: int) -> tuple[PhotographScratches, Segments]:
    """Scratches found in a photograph, and those that are there."""
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
    return photograph_scratches(picture), truth


def _width(segments: Segments) -> float:
    return float(np.average(segments.width, weights=segments.length))


def _area(segments: Segments) -> float:
    return float((segments.length * segments.width).sum()) / SIZE**2


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
