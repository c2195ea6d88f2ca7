"""Compiled loops of scratch layers: the scratch at a point, its search grid, coverage.

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
from numba import njit, prange
from numpy.typing import NDArray

X, Y, COSINE, SINE, HALF_LENGTH, HALF_WIDTH, CURVATURE, STRENGTH = range(8)
"""Columns of ``LayerArrays.shapes``."""

KNOTS = 7.0
"""Knots of the noise along a scratch, end to end: gaps of about a seventh of it and more."""

_TIP = 0.5
"""Part of the noise's range over which a scratch narrows to a tip before a gap."""

_WAVER = 0.6
"""How much of the fading's strength the noise may take away, besides the fall along the length."""

_GOLDEN = 0.6180339887498949


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


# ---- noise -------------------------------------------------------------------------------------


@njit(cache=True, inline="always")
def _hashed(a: int, b: int) -> float:
    """Hash two numbers to [0, 1): splitmix64's output function on both halves of a word."""
    z = (np.uint64(a) << np.uint64(32)) ^ np.uint64(b & 0xFFFFFFFF)
    z += np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@njit(cache=True, error_model="numpy")
def noise_along(seed: int, place: float) -> float:
    """Smooth noise in [0, 1], one knot a unit, uniformly distributed at every place.

    Two knots' numbers a, b are mixed to (1 - w) a + w b, whose distribution is a trapezium's; its
    distribution function makes it uniform, so that "noise below q" has probability q exactly.
    """
    knot = math.floor(place)
    t = place - knot
    w = t * t * (3.0 - 2.0 * t)
    mixed = (1.0 - w) * _hashed(seed, int(knot)) + w * _hashed(seed, int(knot) + 1)
    less, more = min(w, 1.0 - w), max(w, 1.0 - w)
    low = min(mixed, 1.0 - mixed)
    below = 0.5 * low * low / (less * more) if low < less else (low - 0.5 * less) / more
    return below if mixed <= 0.5 else 1.0 - below


# ---- a feature's own coordinates ---------------------------------------------------------------


@njit(cache=True, inline="always")
def _across_arc(px: float, py: float, curvature: float) -> float:
    """Find v of a point that lies at (px, py) in the frame of the feature's middle."""
    if curvature == 0.0:
        return py
    ahead, aside = curvature * px, 1.0 - curvature * py
    # (1 - h) / curvature without the cancellation.
    h = math.sqrt(ahead * ahead + aside * aside)
    return (2.0 * py - curvature * (px * px + py * py)) / (1.0 + h)


@njit(cache=True, inline="always")
def _along_arc(px: float, py: float, curvature: float) -> float:
    """Find u of the same point."""
    if curvature == 0.0:
        return px
    return math.atan2(curvature * px, 1.0 - curvature * py) / curvature


@njit(cache=True, error_model="numpy")
def arc_coordinates(px: float, py: float, curvature: float) -> tuple[float, float]:
    """Find u, v of a point at (px, py) in the frame of the feature's middle (1 / tile)."""
    return _along_arc(px, py, curvature), _across_arc(px, py, curvature)


@njit(cache=True, inline="always")
def _arc_point(u: float, v: float, curvature: float) -> tuple[float, float]:
    """Find the point (px, py) at u, v."""
    if curvature == 0.0:
        return u, v
    turned = curvature * u
    sine, half = math.sin(turned), math.sin(0.5 * turned)
    return sine / curvature - v * sine, 2.0 * half * half / curvature + v * math.cos(turned)


# ---- the scratch at a point --------------------------------------------------------------------


# Numba counts references to the arrays that are taken out of a tuple, and leaves the counting out
# only of functions without branches: those that take the tuple are such, and hand the arrays on to
# others. (Three times as fast.)


@njit(cache=True, error_model="numpy")
def _state_along(
    strength: float, seed: int, is_dig: bool, fading: float, breaks: float, s: float
) -> tuple[float, float]:
    """Opacity and relative width of a feature at s = u / half_length; width 0 is a gap."""
    opacity, wide = strength, 1.0
    if is_dig:
        return opacity, wide
    place = 0.5 * KNOTS * (s + 1.0) + _hashed(seed, -1)
    if breaks > 0.0:
        left = (noise_along(seed, place) - breaks) / (_TIP * (1.0 - breaks))
        if left <= 0.0:
            return 0.0, 0.0
        if left < 1.0:
            wide = left * (2.0 - left)
    if fading > 0.0:
        # Strong where it was begun, gone where the tool left the surface: one end or the other.
        way = 0.5 + 0.5 * (s if seed & 1 else -s)
        kept = (1.0 - way * way) * (1.0 - _WAVER * noise_along(seed ^ 0x5BD1E995, place))
        opacity *= 1.0 - fading * (1.0 - kept)
    return opacity, wide


@njit(cache=True, error_model="numpy")
def _nearest(
    shapes: NDArray[np.float32],
    seed: NDArray[np.uint32],
    is_dig: NDArray[np.bool_],
    cells: int,
    cell_start: NDArray[np.int64],
    cell_items: NDArray[np.int32],
    fading: float,
    breaks: float,
    layer: int,
    x: float,
    y: float,
) -> tuple[int, float, float, float]:
    x -= math.floor(x)
    y -= math.floor(y)
    column, row = min(int(x * cells), cells - 1), min(int(y * cells), cells - 1)
    cell = (layer * cells + row) * cells + column
    best, found, opacity, across, along = 1.0, -1, 0.0, 0.0, 0.0
    for k in range(cell_start[cell], cell_start[cell + 1]):
        i = cell_items[k]
        dx, dy = x - shapes[i, X], y - shapes[i, Y]
        dx -= math.floor(dx + 0.5)
        dy -= math.floor(dy + 0.5)
        px = shapes[i, COSINE] * dx + shapes[i, SINE] * dy
        py = shapes[i, COSINE] * dy - shapes[i, SINE] * dx
        curvature = shapes[i, CURVATURE]
        v = _across_arc(px, py, curvature) / shapes[i, HALF_WIDTH]
        if v * v >= best:
            continue
        u = _along_arc(px, py, curvature)
        s = u / shapes[i, HALF_LENGTH]
        if s * s + v * v >= best:
            continue
        state, wide = _state_along(shapes[i, STRENGTH], seed[i], is_dig[i], fading, breaks, s)
        if wide <= 0.0:
            continue
        distance = s * s + (v / wide) ** 2
        if distance < best:
            best, found, opacity, along = distance, i, state, u
            across = v / (wide * math.sqrt(1.0 - s * s))
    return found, opacity, max(-1.0, min(across, 1.0)), along


@njit(cache=True, error_model="numpy", forceinline=True)
def nearest_feature(
    arrays: LayerArrays, layer: int, x: float, y: float
) -> tuple[int, float, float, float]:
    """Find the feature of a layer with the smallest normalised distance (< 1) at a point.

    Returns its number or -1, opacity, place across it in [-1, 1] and u.
    """
    return _nearest(
        arrays.shapes, arrays.seed, arrays.is_dig, arrays.cells, arrays.cell_start,
        arrays.cell_items, arrays.fading, arrays.breaks, layer, x, y,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _direction(
    angle: NDArray[np.float32],
    turn: NDArray[np.float32],
    shapes: NDArray[np.float32],
    layer: int,
    i: int,
    along: float,
) -> float:
    return angle[layer] + turn[i] + shapes[i, CURVATURE] * along if i >= 0 else 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def scratch_at(arrays: LayerArrays, layer: int, x: float, y: float) -> tuple[float, float, float]:
    """Opacity in [0, 1], place across in [-1, 1] and direction (radians) of a layer at a point.

    The place is v over half the scratch's width there; the direction is that of the arc there, and
    a pit's is a random one. Where there is no scratch all three are 0.
    """
    i, opacity, across, along = nearest_feature(arrays, layer, x, y)
    turned = _direction(arrays.angle, arrays.turn, arrays.shapes, layer, i, along)
    return opacity, across, turned


# ---- the search grid ---------------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
def _list_cells(
    shape: NDArray[np.float32],
    item: int,
    cells: int,
    cursor: NDArray[np.int64],
    items: NDArray[np.int32],
) -> None:
    """Count (``items`` empty) or enter a feature in the cells that it may cover.

    It lies within half its width of its middle line; so do those cells' centres, give or take half
    a diagonal. The line is walked in pieces no longer than a cell, and a cell belongs to the piece
    with the line's nearest point, so that none is met twice.
    """
    half_length, curvature = float(shape[HALF_LENGTH]), float(shape[CURVATURE])
    reach = shape[HALF_WIDTH] * (1.0 + 1e-6) + 0.70711 / cells + 1e-9
    pieces = max(1, math.ceil(2.0 * half_length * cells))
    step = 2.0 * half_length / pieces
    margin = reach + abs(curvature) * step * step + 1e-9
    for piece in range(pieces):
        ax, ay = _arc_point(-half_length + piece * step, 0.0, curvature)
        bx, by = _arc_point(-half_length + (piece + 1) * step, 0.0, curvature)
        ax, ay = shape[COSINE] * ax - shape[SINE] * ay, shape[SINE] * ax + shape[COSINE] * ay
        bx, by = shape[COSINE] * bx - shape[SINE] * by, shape[SINE] * bx + shape[COSINE] * by
        left = math.floor((shape[X] + min(ax, bx) - margin) * cells)
        right = math.floor((shape[X] + max(ax, bx) + margin) * cells)
        bottom = math.floor((shape[Y] + min(ay, by) - margin) * cells)
        top = math.floor((shape[Y] + max(ay, by) + margin) * cells)
        for row in range(bottom, top + 1):
            for column in range(left, right + 1):
                dx = (column + 0.5) / cells - shape[X]
                dy = (row + 0.5) / cells - shape[Y]
                px = shape[COSINE] * dx + shape[SINE] * dy
                py = shape[COSINE] * dy - shape[SINE] * dx
                u = _along_arc(px, py, curvature)
                nearest = min(max(u, -half_length), half_length)
                if min(int((nearest + half_length) / step), pieces - 1) != piece:
                    continue
                if u == nearest:
                    away = abs(_across_arc(px, py, curvature))
                else:
                    ex, ey = _arc_point(nearest, 0.0, curvature)
                    away = math.hypot(px - ex, py - ey)
                if away <= reach:
                    cell = (row % cells) * cells + column % cells
                    if len(items) > 0:
                        items[cursor[cell]] = item
                    cursor[cell] += 1


@njit(cache=True, error_model="numpy")
def count_cells(
    shapes: NDArray[np.float32], layer: NDArray[np.int32], cells: int, count: NDArray[np.int64]
) -> None:
    """Add to count (L, G * G) the features that may cover each cell."""
    nothing = np.empty(0, np.int32)
    for i in range(len(shapes)):
        _list_cells(shapes[i], i, cells, count[layer[i]], nothing)


@njit(cache=True, error_model="numpy")
def fill_cells(
    shapes: NDArray[np.float32],
    layer: NDArray[np.int32],
    cells: int,
    cursor: NDArray[np.int64],
    items: NDArray[np.int32],
) -> None:
    """Enter the features in ``items``, those of a cell from cursor (L, G * G) on, which moves."""
    if len(items) == 0:
        return
    for i in range(len(shapes)):
        _list_cells(shapes[i], i, cells, cursor[layer[i]], items)


# ---- coverage ----------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
def _mean_opacity(
    arrays: LayerArrays, layer: int, row: int, column: int, resolution: int, samples: int
) -> float:
    # A golden-ratio lattice, moved at random from texel to texel.
    texel = (layer * resolution + row) * resolution + column
    shift, other = _hashed(texel, 1), _hashed(texel, 2)
    total = 0.0
    for k in range(samples):
        u = (k + shift) / samples
        v = other + k * _GOLDEN
        x, y = (column + u) / resolution, (row + v - math.floor(v)) / resolution
        total += nearest_feature(arrays, layer, x, y)[1]
    return total / samples


@njit(cache=True, error_model="numpy", parallel=True)
def mean_opacities(arrays: LayerArrays, samples: int, out: NDArray[np.float32]) -> None:
    """Fill out (L, R, R) with the mean opacity of ``samples`` points in each texel."""
    resolution = out.shape[1]
    for line in prange(out.shape[0] * resolution):
        layer, row = line // resolution, line % resolution
        for column in range(resolution):
            out[layer, row, column] = _mean_opacity(
                arrays, layer, row, column, resolution, samples
            )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _visible_area(arrays: LayerArrays, layer: int, i: int, points: int) -> float:
    shape = arrays.shapes[i]
    shift, other = _hashed(arrays.seed[i], -2), _hashed(arrays.seed[i], -3)
    total = 0.0
    for k in range(points):
        radius = math.sqrt((k + shift) / points)
        around = 2.0 * math.pi * (other + k * _GOLDEN)
        u = radius * math.cos(around) * shape[HALF_LENGTH]
        v = radius * math.sin(around) * shape[HALF_WIDTH]
        px, py = _arc_point(u, v, shape[CURVATURE])
        x = shape[X] + shape[COSINE] * px - shape[SINE] * py
        y = shape[Y] + shape[SINE] * px + shape[COSINE] * py
        found, opacity, _, _ = nearest_feature(arrays, layer, x, y)
        if found == i:
            total += opacity * (1.0 - shape[CURVATURE] * v)  # of area per du dv
    return math.pi * shape[HALF_LENGTH] * shape[HALF_WIDTH] * total / points


@njit(cache=True, error_model="numpy", parallel=True)
def visible_areas(arrays: LayerArrays, layer: int, points: int, out: NDArray[np.float64]) -> None:
    """Fill out (n,) with the area, times opacity, in which each of the layer's features is nearest.

    Their sum is the layer's coverage. Points in the features themselves tell it far better than
    points in the tile, most of which meet no scratch.
    """
    for i in prange(len(out)):
        out[i] = _visible_area(arrays, layer, i, points)


@njit(cache=True)
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

    flat_pyramid, offsets: as ``flatten_pyramid`` makes them. resolution: R of level 0. level: 0 to
        log2 R, others are taken as the nearest of them.
    """
    level = max(0, min(level, len(offsets) - 2))
    size = resolution >> level
    column = min(int((x - math.floor(x)) * size), size - 1)
    row = min(int((y - math.floor(y)) * size), size - 1)
    return float(flat_pyramid[offsets[level] + (layer * size + row) * size + column])
