"""The scratch at a point of a tile, compiled.

A feature's own coordinates are u along it (the arc's length from its middle) and v across it, to
the left. Without fading and breaks it covers (u / half_length)² + (v / half_width)² < 1: the
Worley noise F1 below its threshold, in the metric of the feature (section 3.2).

Points and sizes are in tiles, x to the right and y up; any real x, y will do, since the tile
repeats. Angles are radians from x towards y.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.glass_scratches.layers.arcs import across_arc, along_arc
from pipelines.glass_scratches.layers.feature_noise import KNOTS, hashed, noise_along

X, Y, COSINE, SINE, HALF_LENGTH, HALF_WIDTH, CURVATURE, STRENGTH = range(8)
"""Columns of ``LayerArrays.shapes``."""

_TIP = 0.5
"""Part of the noise's range over which a scratch narrows to a tip before a gap."""

_WAVER = 0.6
"""How much of the fading's strength the noise may take away, besides the fall along the length."""


class LayerArrays(NamedTuple):
    """Layers as the kernels take them.

    angle: (L,) float32. shapes: (n, 8) float32, a row a feature, so that the search touches one
        cache line of it: middle, direction's cosine and sine, sizes, curvature, strength.
    turn: (n,) float32 direction less the layer's. seed: (n,) uint32. is_dig: (n,) bool.
    cells: G, grid cells a side. cell_start: (L * G * G + 1,) int64 rows of ``cell_items`` (int32,
        features that may cover a cell), cell (layer * G + row) * G + column.
    fading, breaks: see ``LayerSpec``.
    """

    angle: NDArray[np.float32]
    shapes: NDArray[np.float32]
    turn: NDArray[np.float32]
    seed: NDArray[np.uint32]
    is_dig: NDArray[np.bool_]
    cells: int
    cell_start: NDArray[np.int64]
    cell_items: NDArray[np.int32]
    fading: float
    breaks: float


# Numba counts references to the arrays that are taken out of a tuple, and leaves the counting out
# only of functions without branches: those that take the tuple are such, and hand the arrays on to
# others. (Three times as fast.)


class _Wear(NamedTuple):
    """What takes parts of scratches away; see ``LayerSpec``."""

    fading: float
    breaks: float


@njit(cache=True, nogil=True, error_model="numpy")
def _state_along(
    strength: float, seed: int, is_dig: bool, wear: _Wear, s: float
) -> tuple[float, float]:
    """Opacity and relative width of a feature at s = u / half_length; width 0 is a gap."""
    opacity, wide = strength, 1.0
    if is_dig:
        return opacity, wide
    place = 0.5 * KNOTS * (s + 1.0) + hashed(seed, -1)
    if wear.breaks > 0.0:
        left = (noise_along(seed, place) - wear.breaks) / (_TIP * (1.0 - wear.breaks))
        if left <= 0.0:
            return 0.0, 0.0
        if left < 1.0:
            wide = left * (2.0 - left)
    if wear.fading > 0.0:
        # Strong where it was begun, gone where the tool left the surface: one end or the other.
        way = 0.5 + 0.5 * (s if seed & 1 else -s)
        kept = (1.0 - way * way) * (1.0 - _WAVER * noise_along(seed ^ 0x5BD1E995, place))
        opacity *= 1.0 - wear.fading * (1.0 - kept)
    return opacity, wide


@njit(cache=True, nogil=True, error_model="numpy")
def _cell_span(
    cell_start: NDArray[np.int64], cells: int, layer: int, x: float, y: float
) -> tuple[int, int]:
    """Rows of ``cell_items``, from one up to another, of a layer's cell that holds a point."""
    column, row = min(int(x * cells), cells - 1), min(int(y * cells), cells - 1)
    cell = (layer * cells + row) * cells + column
    return cell_start[cell], cell_start[cell + 1]


@njit(cache=True, nogil=True, error_model="numpy")
def _nearest(
    shapes: NDArray[np.float32],
    seed: NDArray[np.uint32],
    is_dig: NDArray[np.bool_],
    cell_items: NDArray[np.int32],
    wear: _Wear,
    span: tuple[int, int],
    x: float,
    y: float,
) -> tuple[int, float, float, float]:
    best, found, opacity, across, along = 1.0, -1, 0.0, 0.0, 0.0
    for k in range(span[0], span[1]):
        i = cell_items[k]
        dx, dy = x - shapes[i, X], y - shapes[i, Y]
        dx -= math.floor(dx + 0.5)
        dy -= math.floor(dy + 0.5)
        px = shapes[i, COSINE] * dx + shapes[i, SINE] * dy
        py = shapes[i, COSINE] * dy - shapes[i, SINE] * dx
        curvature = shapes[i, CURVATURE]
        v = across_arc(px, py, curvature) / shapes[i, HALF_WIDTH]
        if v * v >= best:
            continue
        u = along_arc(px, py, curvature)
        s = u / shapes[i, HALF_LENGTH]
        if s * s + v * v >= best:
            continue
        state, wide = _state_along(shapes[i, STRENGTH], seed[i], is_dig[i], wear, s)
        if wide <= 0.0:
            continue
        distance = s * s + (v / wide) ** 2
        if distance < best:
            best, found, opacity, along = distance, i, state, u
            across = v / (wide * math.sqrt(1.0 - s * s))
    return found, opacity, max(-1.0, min(across, 1.0)), along


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def nearest_feature(
    arrays: LayerArrays, layer: int, x: float, y: float
) -> tuple[int, float, float, float]:
    """Find the feature of a layer with the smallest normalised distance (< 1) at a point.

    Returns its number or -1, opacity, place across it in [-1, 1] and u.
    """
    x -= math.floor(x)
    y -= math.floor(y)
    span = _cell_span(arrays.cell_start, arrays.cells, layer, x, y)
    wear = _Wear(arrays.fading, arrays.breaks)
    return _nearest(
        arrays.shapes, arrays.seed, arrays.is_dig, arrays.cell_items, wear, span, x, y
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _direction(
    angle: NDArray[np.float32],
    turn: NDArray[np.float32],
    shapes: NDArray[np.float32],
    layer: int,
    i: int,
    along: float,
) -> float:
    return angle[layer] + turn[i] + shapes[i, CURVATURE] * along if i >= 0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def scratch_at(arrays: LayerArrays, layer: int, x: float, y: float) -> tuple[float, float, float]:
    """Opacity in [0, 1], place across in [-1, 1] and direction (radians) of a layer at a point.

    The place is v over half the scratch's width there; the direction is that of the arc there, and
    a pit's is a random one. Where there is no scratch all three are 0.
    """
    i, opacity, across, along = nearest_feature(arrays, layer, x, y)
    turned = _direction(arrays.angle, arrays.turn, arrays.shapes, layer, i, along)
    return opacity, across, turned
