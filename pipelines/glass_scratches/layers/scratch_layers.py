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

from pipelines.glass_scratches.layers.kernels import (
    LayerArrays,
    count_cells,
    fill_cells,
    filtered_coverage,
    mean_opacities,
    scratch_at,
    visible_areas,
)
from pipelines.glass_scratches.layers.settings import LayerSpec

__all__ = [
    "LayerArrays",
    "LayerSpec",
    "Layers",
    "coverage_maps",
    "filtered_coverage",
    "flatten_pyramid",
    "join_features",
    "layer_arrays",
    "make_layers",
    "pyramid",
    "scratch_at",
    "solve_thresholds",
]

FloatArray = NDArray[np.float32]

# A feature and its copies in the next tiles may not overlap: it reaches half a tile at most.
_LONGEST, _WIDEST = 0.5, 0.5
_LONGEST_ARC, _WIDEST_ARC = 0.45, 0.2

_DIG_SIZE = 0.4
"""Radius of a pit over that of a circle with a scratch's area."""

_ALIKE = 0.6
"""Correlation of a scratch's width with its length."""

_MOST_CELLS = 1024
_POINTS = 80_000
"""Of which the coverage of a layer is measured: to about 0.2 % of itself."""

_LARGEST_THRESHOLD = 16.0


class Layers(NamedTuple):
    """Scratches of L layers, n in all, sorted by layer, with the grid that finds them.

    angle: (L,) float32 direction of each layer in [0, pi), radians from x towards y.
    layer: (n,) int32. centre: (n, 2) float32 x, y in [0, 1), middle of the scratch.
    turn: (n,) float32 direction at the middle less the layer's, radians.
    half_length, half_width: (n,) float32, tiles; the threshold is in them.
    curvature: (n,) float32, 1 / tile, positive to the left. strength: (n,) float32 in (0, 1].
    seed: (n,) uint32 of its fading and breaks. is_dig: (n,) bool.
    cells: G, cells a side. cell_start: (L * G * G + 1,) int64, cell_items: int32, the features that
        may cover the cell (layer * G + row) * G + column; row 0 lies at y = 0.
    fading, breaks: those of the spec.
    """

    angle: FloatArray
    layer: NDArray[np.int32]
    centre: FloatArray
    turn: FloatArray
    half_length: FloatArray
    half_width: FloatArray
    curvature: FloatArray
    strength: FloatArray
    seed: NDArray[np.uint32]
    is_dig: NDArray[np.bool_]
    cells: int
    cell_start: NDArray[np.int64]
    cell_items: NDArray[np.int32]
    fading: float
    breaks: float


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
    """
    spec.validate()
    angles, draws = _draw(spec, seed)
    thresholds = _thresholds(spec, angles, draws)
    sized = [_sized(draw, t) for draw, t in zip(draws, thresholds, strict=True)]
    number = np.repeat(np.arange(spec.layers, dtype=np.int32), [len(d.centre) for d in draws])
    columns = [np.concatenate(column) for column in zip(*sized, strict=True)]
    return join_features(angles, number, *columns, fading=spec.fading, breaks=spec.breaks)


def solve_thresholds(spec: LayerSpec, seed: int) -> NDArray[np.float64]:
    """Thresholds (L,) of the layers of ``make_layers``: the spec's, or what its coverage needs."""
    spec.validate()
    return _thresholds(spec, *_draw(spec, seed))


def join_features(
    angle: FloatArray,
    layer: NDArray[np.int32],
    centre: FloatArray,
    turn: FloatArray,
    half_length: FloatArray,
    half_width: FloatArray,
    curvature: FloatArray,
    strength: FloatArray,
    seed: NDArray[np.uint32],
    is_dig: NDArray[np.bool_],
    *,
    fading: float = 0.0,
    breaks: float = 0.0,
) -> Layers:
    """Make the layers of their features, as ``Layers`` has them: builds the search grid."""
    count = max(np.bincount(layer, minlength=1).max(), 1)
    # As many cells as make the lists short (scratches cross about one cell in `cells` each) and
    # no more than that, for the grid should stay in the cache.
    lengths = 2.0 * float(half_length.astype(np.float64).sum()) / len(angle)
    cells = int(np.clip(math.ceil(max(lengths, math.sqrt(count))), 4, _MOST_CELLS))
    shapes = _shapes(angle, layer, centre, turn, half_length, half_width, curvature, strength)
    per_cell = np.zeros((len(angle), cells * cells), np.int64)
    count_cells(shapes, layer, cells, per_cell)
    start = np.concatenate([[0], np.cumsum(per_cell)])
    items = np.empty(start[-1], np.int32)
    fill_cells(shapes, layer, cells, start[:-1].reshape(per_cell.shape).copy(), items)
    return Layers(
        angle, layer, centre, turn, half_length, half_width, curvature, strength, seed, is_dig,
        cells, start, items, float(fading), float(breaks),
    )  # fmt: skip


def layer_arrays(layers: Layers) -> LayerArrays:
    """Pack the layers for ``scratch_at``; worth keeping, since it copies."""
    shapes = _shapes(
        layers.angle, layers.layer, layers.centre, layers.turn, layers.half_length,
        layers.half_width, layers.curvature, layers.strength,
    )  # fmt: skip
    return LayerArrays(
        layers.angle, shapes, layers.turn, layers.seed, layers.is_dig,
        layers.cells, layers.cell_start, layers.cell_items, layers.fading, layers.breaks,
    )  # fmt: skip


def _shapes(
    angle: FloatArray,
    layer: NDArray[np.int32],
    centre: FloatArray,
    turn: FloatArray,
    half_length: FloatArray,
    half_width: FloatArray,
    curvature: FloatArray,
    strength: FloatArray,
) -> FloatArray:
    way = angle[layer].astype(np.float64) + turn
    columns = (*centre.T, np.cos(way), np.sin(way), half_length, half_width, curvature, strength)
    return np.stack(columns, axis=-1).astype(np.float32)


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


def _sized(draw: _Draw, threshold: float) -> tuple[NDArray, ...]:
    """Columns of ``Layers``, centre to is_dig."""
    bent = draw.bend != 0.0
    half_length = np.minimum(threshold * draw.length, np.where(bent, _LONGEST_ARC, _LONGEST))
    half_width = np.minimum(threshold * draw.width, np.where(bent, _WIDEST_ARC, _WIDEST))
    # Arcs may not be so tight that their inner side folds over.
    tightest = 0.5 / half_width
    curvature = np.clip(draw.bend / (2.0 * half_length), -tightest, tightest)
    single = (draw.turn, half_length, half_width, curvature, draw.strength)
    return (draw.centre, *(column.astype(np.float32) for column in single), draw.seed, draw.is_dig)


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
    alone = join_features(
        angle, np.zeros(count, np.int32), *_sized(draw, threshold),
        fading=spec.fading, breaks=spec.breaks,
    )  # fmt: skip
    areas = np.empty(count)
    visible_areas(layer_arrays(alone), 0, int(np.clip(_POINTS // count, 4, 1 << 16)), areas)
    return max(float(areas.sum()), 1e-12)


# ---- coverage ----------------------------------------------------------------------------------


def coverage_maps(layers: Layers, resolution: int, samples: int = 16) -> FloatArray:
    """Mean opacity (L, R, R) in each texel, of ``samples`` points in it.

    Row 0 lies at y = 0, column 0 at x = 0. Raises ValueError for less than one texel or point.
    """
    if resolution < 1:
        raise ValueError(f"resolution of the coverage is {resolution}; expected 1 or more.")
    if samples < 1:
        raise ValueError(f"samples of the coverage is {samples}; expected 1 or more.")
    out = np.empty((len(layers.angle), resolution, resolution), np.float32)
    mean_opacities(layer_arrays(layers), samples, out)
    return out


def pyramid(maps: FloatArray) -> list[FloatArray]:
    """Mip levels (L, R / 2^k, R / 2^k) of maps (L, R, R), down to one texel; means are kept.

    Raises ValueError for maps that are not square or whose side is not a power of two.
    """
    if maps.ndim != 3 or maps.shape[1] != maps.shape[2] or maps.shape[1].bit_count() != 1:
        raise ValueError(
            f"shape of the maps is {maps.shape}; expected (layers, R, R), R a power of two."
        )
    levels = [np.ascontiguousarray(maps, dtype=np.float32)]
    # Doubles between the levels, so that roundings do not add up.
    level = maps.astype(np.float64)
    while level.shape[1] > 1:
        half = level.shape[1] // 2
        level = level.reshape(len(level), half, 2, half, 2).mean(axis=(2, 4))
        levels.append(level.astype(np.float32))
    return levels


def flatten_pyramid(levels: list[FloatArray]) -> tuple[FloatArray, NDArray[np.int64]]:
    """All levels in one array, and where each begins, the end last (levels + 1,)."""
    offsets = np.concatenate([[0], np.cumsum([level.size for level in levels])])
    return np.concatenate([level.ravel() for level in levels]), offsets
