"""The grid that finds scratches, compiled: which features may cover which cells of a tile."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.glass_scratches.layers.arcs import across_arc, along_arc, arc_point
from pipelines.glass_scratches.layers.feature_search import (
    COSINE,
    CURVATURE,
    HALF_LENGTH,
    HALF_WIDTH,
    SINE,
    X,
    Y,
)


@njit(cache=True, nogil=True, error_model="numpy")
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
        ax, ay = arc_point(-half_length + piece * step, 0.0, curvature)
        bx, by = arc_point(-half_length + (piece + 1) * step, 0.0, curvature)
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
                u = along_arc(px, py, curvature)
                nearest = min(max(u, -half_length), half_length)
                if min(int((nearest + half_length) / step), pieces - 1) != piece:
                    continue
                if u == nearest:
                    away = abs(across_arc(px, py, curvature))
                else:
                    ex, ey = arc_point(nearest, 0.0, curvature)
                    away = math.hypot(px - ex, py - ey)
                if away <= reach:
                    cell = (row % cells) * cells + column % cells
                    if len(items) > 0:
                        items[cursor[cell]] = item
                    cursor[cell] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def count_cells(
    shapes: NDArray[np.float32], layer: NDArray[np.int32], cells: int, count: NDArray[np.int64]
) -> None:
    """Add to count (L, G * G) the features that may cover each cell."""
    nothing = np.empty(0, np.int32)
    for i in range(len(shapes)):
        _list_cells(shapes[i], i, cells, count[layer[i]], nothing)


@njit(cache=True, nogil=True, error_model="numpy")
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
