"""Pictures of scratch layers: the three stages of figure 4, and all layers together.

Pictures are seen as one looks at the tile: rows run downwards, y = 1 at the top.
"""

from __future__ import annotations

import colorsys
import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.glass_scratches.layers.arcs import arc_coordinates
from pipelines.glass_scratches.layers.feature_search import (
    COSINE,
    CURVATURE,
    HALF_LENGTH,
    HALF_WIDTH,
    SINE,
    X,
    Y,
)
from pipelines.glass_scratches.layers.features import layer_arrays
from pipelines.glass_scratches.layers.scratch_layers import make_layers, solve_thresholds
from pipelines.glass_scratches.layers.settings import LayerSpec

WHITE = 1.25
"""The noise F1, in cells, that is shown white: of a Poisson process 0.7 % lies above it."""

_CELLS = 6
"""Cells along a side of the first stage."""


def layer_stages(spec: LayerSpec, seed: int, size: int, layer: int = 0) -> NDArray[np.uint8]:
    """Figure 4, (3, size, size): cell noise, the same turned and stretched, and thresholded.

    The second and third are the tile of ``make_layers(spec, seed)``, each feature in its own metric
    but without fading and breaks. Noise is F1 / ``WHITE`` from black to white; the third picture is
    white where F1 is below the layer's threshold. Raises ValueError for settings out of range, a
    size below 1 and a layer that there is not.
    """
    _check_size(size)
    spec.validate()
    if not 0 <= layer < spec.layers:
        raise ValueError(f"layer of the stages is {layer}; expected 0 to {spec.layers - 1}.")
    noise = _noise(_even_cells(np.random.default_rng([seed, layer])), 1.0, size)
    made = make_layers(spec, seed)
    threshold = float(solve_thresholds(spec, seed)[layer])
    stretched = _noise(layer_arrays(made).shapes[made.features.layer == layer], threshold, size)
    shown = [np.clip(field / WHITE, 0.0, 1.0) for field in (noise, stretched)]
    return np.rint(255 * np.stack([*shown, stretched < threshold])).astype(np.uint8)


def layers_picture(
    coverage: NDArray[np.float32], angles: NDArray[np.floating]
) -> NDArray[np.uint8]:
    """All layers (L, R, R) of ``coverage_maps`` in one picture (R, R, 3), sRGB.

    Each layer has the colour of its direction, angles (L,): the same for opposite ones.
    """
    light = np.zeros((*coverage.shape[1:], 3))
    for layer, angle in zip(coverage, angles, strict=True):
        light += layer[::-1, :, None] * np.array(
            colorsys.hsv_to_rgb(float(angle) / math.pi % 1.0, 0.45, 1.0)
        )
    return np.rint(255 * np.clip(light, 0.0, 1.0) ** (1 / 2.2)).astype(np.uint8)


def _check_size(size: int) -> None:
    if size < 1:
        raise ValueError(f"size of the stages is {size}; expected 1 or more.")


def _even_cells(rng: np.random.Generator) -> NDArray[np.float32]:
    """Features (n, 8) of round cells, as many as Worley's Poisson process happens to have."""
    shapes = np.zeros((max(1, int(rng.poisson(_CELLS**2))), 8), np.float32)
    shapes[:, [X, Y]] = rng.random((len(shapes), 2))
    shapes[:, COSINE] = 1.0
    shapes[:, [HALF_LENGTH, HALF_WIDTH]] = 1.0 / _CELLS
    return shapes


def _noise(shapes: NDArray[np.float32], threshold: float, size: int) -> NDArray[np.float64]:
    """F1 (size, size) in cells, at most WHITE: the threshold times the normalised distance."""
    squared = np.full((size, size), (WHITE / threshold) ** 2)
    _lower(shapes, WHITE / threshold, squared)
    return threshold * np.sqrt(squared)


@njit(cache=True, nogil=True, error_model="numpy")
def _lower(shapes: NDArray[np.float32], reach: float, squared: NDArray[np.float64]) -> None:
    """Lower ``squared`` to the square of the normalised distance to the nearest feature.

    Only distances below ``reach`` are sought. Pixels beyond the tile are those of its other side.
    """
    size = len(squared)
    for i in range(len(shapes)):
        curvature = shapes[i, CURVATURE]
        half_length, half_width = shapes[i, HALF_LENGTH], shapes[i, HALF_WIDTH]
        cosine, sine = shapes[i, COSINE], shapes[i, SINE]
        x, y = shapes[i, X], 1.0 - shapes[i, Y]  # downwards
        if curvature == 0.0:
            wide = reach * math.hypot(cosine * half_length, sine * half_width)
            high = reach * math.hypot(sine * half_length, cosine * half_width)
        else:
            wide = high = reach * (half_length + half_width)
        for row in range(math.floor((y - high) * size), math.ceil((y + high) * size)):
            dy = y - (row + 0.5) / size
            for column in range(math.floor((x - wide) * size), math.ceil((x + wide) * size)):
                dx = (column + 0.5) / size - x
                u, v = arc_coordinates(
                    cosine * dx + sine * dy, cosine * dy - sine * dx, curvature
                )  # fmt: skip
                distance = (u / half_length) ** 2 + (v / half_width) ** 2
                if distance < squared[row % size, column % size]:
                    squared[row % size, column % size] = distance
