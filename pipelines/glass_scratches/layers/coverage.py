"""How much of a tile scratches cover: maps of the layers, their mip levels, and areas."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from pipelines.glass_scratches.layers.arcs import arc_point
from pipelines.glass_scratches.layers.feature_noise import hashed
from pipelines.glass_scratches.layers.feature_search import (
    COSINE,
    CURVATURE,
    HALF_LENGTH,
    HALF_WIDTH,
    SINE,
    LayerArrays,
    X,
    Y,
    nearest_feature,
)
from pipelines.glass_scratches.layers.features import FloatArray, Layers, layer_arrays

_GOLDEN = 0.6180339887498949


def coverage_maps(layers: Layers, resolution: int, samples: int = 16) -> FloatArray:
    """Mean opacity (L, R, R) in each texel, of ``samples`` points in it.

    Row 0 lies at y = 0, column 0 at x = 0. Raises ValueError for less than one texel or point.

    >>> from pipelines.glass_scratches.layers.scratch_layers import make_layers
    >>> from pipelines.glass_scratches.layers.settings import LayerSpec
    >>> maps = coverage_maps(make_layers(LayerSpec(length=0.6, width=0.01), seed=1), 32)
    >>> maps.shape, bool(maps.max() <= 1.0)
    ((4, 32, 32), True)
    """
    if resolution < 1:
        raise ValueError(f"resolution of the coverage is {resolution}; expected 1 or more.")
    if samples < 1:
        raise ValueError(f"samples of the coverage is {samples}; expected 1 or more.")
    out = np.empty((len(layers.angle), resolution, resolution), np.float32)
    mean_opacities(layer_arrays(layers), samples, out)
    return out


def mip_pyramid(maps: FloatArray) -> list[FloatArray]:
    """Mip levels (L, R / 2^k, R / 2^k) of maps (L, R, R), down to one texel; means are kept.

    Raises ValueError for maps that are not square or whose side is not a power of two.

    >>> [level.shape for level in mip_pyramid(np.ones((1, 4, 4), np.float32))]
    [(1, 4, 4), (1, 2, 2), (1, 1, 1)]
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


def flatten_mips(levels: list[FloatArray]) -> tuple[FloatArray, NDArray[np.int64]]:
    """All levels in one array, and where each begins, the end last (levels + 1,)."""
    offsets = np.concatenate([[0], np.cumsum([level.size for level in levels])])
    return np.concatenate([level.ravel() for level in levels]), offsets


# ---- compiled ----------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def _mean_opacity(
    arrays: LayerArrays, layer: int, row: int, column: int, resolution: int, samples: int
) -> float:
    # A golden-ratio lattice, moved at random from texel to texel.
    texel = (layer * resolution + row) * resolution + column
    shift, other = hashed(texel, 1), hashed(texel, 2)
    total = 0.0
    for k in range(samples):
        u = (k + shift) / samples
        v = other + k * _GOLDEN
        x, y = (column + u) / resolution, (row + v - math.floor(v)) / resolution
        total += nearest_feature(arrays, layer, x, y)[1]
    return total / samples


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def mean_opacities(arrays: LayerArrays, samples: int, out: NDArray[np.float32]) -> None:
    """Fill out (L, R, R) with the mean opacity of ``samples`` points in each texel."""
    resolution = out.shape[1]
    for line in prange(out.shape[0] * resolution):
        layer, row = line // resolution, line % resolution
        for column in range(resolution):
            out[layer, row, column] = _mean_opacity(
                arrays, layer, row, column, resolution, samples
            )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _visible_area(arrays: LayerArrays, layer: int, i: int, points: int) -> float:
    shape = arrays.shapes[i]
    shift, other = hashed(arrays.seed[i], -2), hashed(arrays.seed[i], -3)
    total = 0.0
    for k in range(points):
        radius = math.sqrt((k + shift) / points)
        around = 2.0 * math.pi * (other + k * _GOLDEN)
        u = radius * math.cos(around) * shape[HALF_LENGTH]
        v = radius * math.sin(around) * shape[HALF_WIDTH]
        px, py = arc_point(u, v, shape[CURVATURE])
        x = shape[X] + shape[COSINE] * px - shape[SINE] * py
        y = shape[Y] + shape[SINE] * px + shape[COSINE] * py
        found, opacity, _, _ = nearest_feature(arrays, layer, x, y)
        if found == i:
            total += opacity * (1.0 - shape[CURVATURE] * v)  # of area per du dv
    return math.pi * shape[HALF_LENGTH] * shape[HALF_WIDTH] * total / points


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def visible_areas(arrays: LayerArrays, layer: int, points: int, out: NDArray[np.float64]) -> None:
    """Fill out (n,) with the area, times opacity, in which each of the layer's features is nearest.

    Their sum is the layer's coverage. Points in the features themselves tell it far better than
    points in the tile, most of which meet no scratch.
    """
    for i in prange(len(out)):
        out[i] = _visible_area(arrays, layer, i, points)


@njit(cache=True, nogil=True)
def filtered_coverage(
    flat_pyramid: NDArray[np.float32],
    offsets: NDArray[np.int64],
    resolution: int,
    layer: int,
    level: int,
    x: float,
    y: float,
) -> float:
    """Coverage of a layer in the texel of a mip level that a point of the tile lies in.

    flat_pyramid, offsets: as ``flatten_mips`` makes them. resolution: R of level 0. level: 0 to
        log2 R, others are taken as the nearest of them.
    """
    level = max(0, min(level, len(offsets) - 2))
    size = resolution >> level
    column = min(int((x - math.floor(x)) * size), size - 1)
    row = min(int((y - math.floor(y)) * size), size - 1)
    return float(flat_pyramid[offsets[level] + (layer * size + row) * size + column])
