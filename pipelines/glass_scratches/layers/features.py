"""Scratches of layers as they are kept, with the grid that finds them, and as kernels take them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.layers.feature_search import LayerArrays
from pipelines.glass_scratches.layers.search_grid import count_cells, fill_cells

FloatArray = NDArray[np.float32]

_MOST_CELLS = 1024


class Features(NamedTuple):
    """Scratches and pits of all layers, n in all, sorted by layer.

    layer: (n,) int32. centre: (n, 2) float32 x, y in [0, 1), middle of the scratch.
    turn: (n,) float32 direction at the middle less the layer's, radians.
    half_length, half_width: (n,) float32, tiles; the threshold is in them.
    curvature: (n,) float32, 1 / tile, positive to the left. strength: (n,) float32 in (0, 1].
    seed: (n,) uint32 of its fading and breaks. is_dig: (n,) bool.
    """

    layer: NDArray[np.int32]
    centre: FloatArray
    turn: FloatArray
    half_length: FloatArray
    half_width: FloatArray
    curvature: FloatArray
    strength: FloatArray
    seed: NDArray[np.uint32]
    is_dig: NDArray[np.bool_]


class Layers(NamedTuple):
    """L layers of scratches, with the grid that finds them.

    angle: (L,) float32 direction of each layer in [0, pi), radians from x towards y.
    features: the scratches.
    cells: G, cells a side. cell_start: (L * G * G + 1,) int64, cell_items: int32, the features that
        may cover the cell (layer * G + row) * G + column; row 0 lies at y = 0.
    fading, breaks: those of the spec.
    """

    angle: FloatArray
    features: Features
    cells: int
    cell_start: NDArray[np.int64]
    cell_items: NDArray[np.int32]
    fading: float
    breaks: float


def layers_of_features(
    angle: FloatArray, features: Features, *, fading: float = 0.0, breaks: float = 0.0
) -> Layers:
    """Layers with directions ``angle`` (L,) of their features: builds the search grid."""
    count = max(np.bincount(features.layer, minlength=1).max(), 1)
    # As many cells as make the lists short (scratches cross about one cell in `cells` each) and
    # no more than that, for the grid should stay in the cache.
    lengths = 2.0 * float(features.half_length.astype(np.float64).sum()) / len(angle)
    cells = int(np.clip(math.ceil(max(lengths, math.sqrt(count))), 4, _MOST_CELLS))
    shapes = _shapes(angle, features)
    per_cell = np.zeros((len(angle), cells * cells), np.int64)
    count_cells(shapes, features.layer, cells, per_cell)
    start = np.concatenate([[0], np.cumsum(per_cell)])
    items = np.empty(start[-1], np.int32)
    fill_cells(shapes, features.layer, cells, start[:-1].reshape(per_cell.shape).copy(), items)
    return Layers(angle, features, cells, start, items, float(fading), float(breaks))


def layer_arrays(layers: Layers) -> LayerArrays:
    """Pack the layers for ``scratch_at``; worth keeping, since it copies."""
    features = layers.features
    return LayerArrays(
        layers.angle,
        _shapes(layers.angle, features),
        features.turn,
        features.seed,
        features.is_dig,
        layers.cells,
        layers.cell_start,
        layers.cell_items,
        layers.fading,
        layers.breaks,
    )


def _shapes(angle: FloatArray, features: Features) -> FloatArray:
    """Rows (n, 8) of ``LayerArrays.shapes``."""
    way = angle[features.layer].astype(np.float64) + features.turn
    columns = (
        *features.centre.T,
        np.cos(way),
        np.sin(way),
        features.half_length,
        features.half_width,
        features.curvature,
        features.strength,
    )
    return np.stack(columns, axis=-1).astype(np.float32)
