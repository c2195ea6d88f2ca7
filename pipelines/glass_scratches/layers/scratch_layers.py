"""Scratch layers (section 3.2 of the scratch paper): features in a tile, and their coverage.

The paper makes a layer of Worley's cell noise F1, turned by the layer's angle, stretched by length
and width and thresholded. Where F1 is below the threshold there is an ellipse about every feature
point; so we keep the features, and any magnification finds their exact outline, each in its own
metric. Worley's points are a Poisson process; ours too, one a cell on average.

A tile is the unit square, x to the right and y up, and repeats in both directions.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from pipelines.glass_scratches.layers.coverage import visible_areas
from pipelines.glass_scratches.layers.features import (
    Features,
    FloatArray,
    Layers,
    layer_arrays,
    layers_of_features,
)
from pipelines.glass_scratches.layers.settings import LayerSpec

# A feature and its copies in the next tiles may not overlap: it reaches half a tile at most.
_LONGEST, _WIDEST = 0.5, 0.5
_LONGEST_ARC, _WIDEST_ARC = 0.45, 0.2

_DIG_SIZE = 0.4
"""Radius of a pit over that of a circle with a scratch's area."""

_ALIKE = 0.6
"""Correlation of a scratch's width with its length."""

_POINTS = 80_000
"""Of which the coverage of a layer is measured: to about 0.2 % of itself."""

_LARGEST_THRESHOLD = 16.0


class _Draw(NamedTuple):
    """Features of one layer before they get their sizes: lengths and widths at threshold 1."""

    centre: FloatArray
    turn: NDArray[np.float64]
    length: NDArray[np.float64]
    width: NDArray[np.float64]
    bend: NDArray[np.float64]  # turn from end to end
    strength: NDArray[np.float64]
    seed: NDArray[np.uint32]
    is_dig: NDArray[np.bool_]


# ---- features ----------------------------------------------------------------------------------


def make_layers(spec: LayerSpec, seed: int) -> Layers:
    """Draw the layers; equal arguments give equal layers.

    Raises ValueError for settings out of range, and for a coverage that such scratches cannot
    reach.

    >>> layers = make_layers(LayerSpec(length=0.6, width=0.01, layers=3), seed=1)
    >>> layers.angle.shape, layers.features.centre.shape
    ((3,), (496, 2))
    """
    spec.validate()
    angles, draws = _draw(spec, seed)
    thresholds = _thresholds(spec, angles, draws)
    sized = [_sized(*each) for each in zip(range(spec.layers), draws, thresholds, strict=True)]
    features = Features(*(np.concatenate(column) for column in zip(*sized, strict=True)))
    return layers_of_features(angles, features, fading=spec.fading, breaks=spec.breaks)


def solve_thresholds(spec: LayerSpec, seed: int) -> NDArray[np.float64]:
    """Thresholds (L,) of the layers of ``make_layers``: the spec's, or what its coverage needs."""
    spec.validate()
    return _thresholds(spec, *_draw(spec, seed))


def _draw(spec: LayerSpec, seed: int) -> tuple[FloatArray, list[_Draw]]:
    """Draw angles (L,) and features. What a setting of 0 leaves out is drawn all the same.

    So scratches stay in their places while settings are tried.
    """
    rng = np.random.default_rng(seed)
    # One direction in each L-th of the half circle: no two layers alike.
    order = rng.permutation(spec.layers)
    angles = np.pi * (order + rng.random(spec.layers)) / spec.layers
    return angles.astype(np.float32), [_draw_layer(spec, own) for own in rng.spawn(spec.layers)]


def _draw_layer(spec: LayerSpec, rng: np.random.Generator) -> _Draw:
    count = max(1, int(rng.poisson(spec.features_per_layer)))
    centre = rng.random((count, 2), dtype=np.float32)
    is_dig = rng.random(count) < spec.digs
    long, wide, deep = rng.standard_normal((3, count))
    bend = np.clip(spec.curvature * rng.standard_normal(count), -np.pi, np.pi)
    # Somewhere along it a scratch runs exactly in the layer's direction.
    turn = bend * (rng.random(count) - 0.5)
    turn = np.where(is_dig, rng.uniform(0.0, np.pi, count), turn)
    sigma = spec.spread
    # Long scratches are wide, and none is a short thick stroke. The mean area stays what it was.
    wide = _ALIKE * long + math.sqrt(1.0 - _ALIKE**2) * wide
    length = spec.length * np.exp(sigma * long - sigma**2 / 2)
    width = spec.width * np.exp(sigma * wide - sigma**2 * (0.5 + _ALIKE))
    round_ = _DIG_SIZE * math.sqrt(spec.length * spec.width) * np.exp(sigma * long - sigma**2)
    return _Draw(
        centre=centre,
        turn=turn,
        length=np.where(is_dig, round_, length),
        width=np.where(is_dig, round_, width),
        bend=np.where(is_dig, 0.0, bend),
        strength=np.exp(-sigma * np.abs(deep)),
        seed=rng.integers(0, 2**32, count, dtype=np.uint32),
        is_dig=is_dig,
    )


def _sized(layer: int, draw: _Draw, threshold: float) -> Features:
    """The features of one layer at a threshold."""
    bent = draw.bend != 0.0
    half_length = np.minimum(threshold * draw.length, np.where(bent, _LONGEST_ARC, _LONGEST))
    half_width = np.minimum(threshold * draw.width, np.where(bent, _WIDEST_ARC, _WIDEST))
    # Arcs may not be so tight that their inner side folds over.
    tightest = 0.5 / half_width
    curvature = np.clip(draw.bend / (2.0 * half_length), -tightest, tightest)
    return Features(
        layer=np.full(len(draw.centre), layer, np.int32),
        centre=draw.centre,
        turn=draw.turn.astype(np.float32),
        half_length=half_length.astype(np.float32),
        half_width=half_width.astype(np.float32),
        curvature=curvature.astype(np.float32),
        strength=draw.strength.astype(np.float32),
        seed=draw.seed,
        is_dig=draw.is_dig,
    )


# ---- thresholds --------------------------------------------------------------------------------


def _thresholds(spec: LayerSpec, angles: FloatArray, draws: list[_Draw]) -> NDArray[np.float64]:
    if spec.coverage is None:
        return np.full(spec.layers, float(spec.threshold))
    return np.array(
        [_solve(spec, angles[k : k + 1], draw, spec.coverage) for k, draw in enumerate(draws)]
    )


def _solve(spec: LayerSpec, angle: FloatArray, draw: _Draw, coverage: float) -> float:
    """Find the threshold at which one layer covers what it should."""

    @functools.cache
    def excess(log_threshold: float) -> float:
        return math.log(_coverage(spec, angle, draw, math.exp(log_threshold)) / coverage)

    # What full-strength scratches of a Poisson process would need: 1 - exp(-pi t²).
    low = high = 0.5 * math.log(-math.log1p(-coverage) / math.pi)
    step = 0.25
    while excess(low) > 0.0:
        low -= step
    while excess(high) < 0.0:
        high += step
        if high > math.log(_LARGEST_THRESHOLD):
            reached = _coverage(spec, angle, draw, math.exp(high))
            raise ValueError(
                f"coverage of the layers is {coverage:g}; expected at most {reached:.2g}, all that "
                "such scratches reach."
            )
    return math.exp(brentq(excess, low, high, xtol=1e-4))


def _coverage(spec: LayerSpec, angle: FloatArray, draw: _Draw, threshold: float) -> float:
    count = len(draw.centre)
    features = _sized(0, draw, threshold)
    alone = layers_of_features(angle, features, fading=spec.fading, breaks=spec.breaks)
    areas = np.empty(count)
    visible_areas(layer_arrays(alone), 0, int(np.clip(_POINTS // count, 4, 1 << 16)), areas)
    return max(float(areas.sum()), 1e-12)
