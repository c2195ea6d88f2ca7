"""Parked cars: a body swept along the car, windows, wheels, lamps."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from pipelines.virtual.city.parts import Look, Part, box, grid_surface, join_parts, panel, tube

Generator = np.random.Generator

_PAINTS = (
    (0.45, 0.46, 0.48), (0.30, 0.03, 0.03), (0.03, 0.07, 0.22), (0.04, 0.04, 0.045),
    (0.62, 0.62, 0.60), (0.10, 0.20, 0.12), (0.40, 0.30, 0.06),
)  # fmt: skip
# Stations from rear to front: x, half width, height of the belt, of the top, half width of the top.
_STATIONS = np.array([
    [-2.15, 0.66, 0.62, 0.64, 0.60], [-2.10, 0.76, 0.80, 0.84, 0.66],
    [-1.95, 0.83, 0.90, 0.98, 0.70], [-1.70, 0.86, 0.92, 1.14, 0.68],
    [-1.35, 0.88, 0.93, 1.36, 0.63], [-1.05, 0.88, 0.93, 1.45, 0.61],
    [-0.55, 0.88, 0.92, 1.49, 0.61], [-0.05, 0.88, 0.91, 1.48, 0.61],
    [0.30, 0.88, 0.90, 1.42, 0.61], [0.65, 0.88, 0.90, 1.21, 0.65],
    [1.00, 0.87, 0.89, 0.97, 0.71], [1.40, 0.86, 0.82, 0.90, 0.70],
    [1.80, 0.82, 0.74, 0.82, 0.66], [2.05, 0.74, 0.64, 0.70, 0.60],
    [2.15, 0.64, 0.52, 0.54, 0.56],
])  # fmt: skip
_CABIN = slice(4, 9)
"""Cells between stations with side windows."""
_GLASS = Look("paint", (0.02, 0.022, 0.025), gloss=1.0)
_FINER = 2
"""Cells of the body for each cell between stations."""


def car(generator: Generator) -> Part:
    """A car that stands on the origin, its front towards +x: 4.3 x 1.76 x 1.49 m."""
    paint = Look("paint", _PAINTS[generator.integers(len(_PAINTS))], gloss=0.7)
    rings = np.stack([_ring(*station[1:]) for station in _STATIONS])
    x = np.broadcast_to(_STATIONS[:, :1], rings.shape[:2])
    points = np.concatenate([x[..., None], rings], axis=-1)
    glass = np.zeros((rings.shape[0] - 1, rings.shape[1] - 1), np.bool_)
    sides = [_BELT, _mirrored_cell(_BELT, rings.shape[1])]
    glass[_CABIN, sides] = True
    glass[6, sides] = False  # the pillar between the doors
    top = slice(_BELT + 2, rings.shape[1] - 3 - _BELT)
    glass[8:10, top] = True
    glass[2:4, top] = True
    points, glass = _smoothed(points), np.kron(glass, np.ones((_FINER, _FINER), np.bool_))
    # Columns must run to the right as seen from outside: rows along x, columns down the left side.
    points, glass = points[:, ::-1], glass[:, ::-1]
    uvs = points[..., [0, 2]] / 2.5
    parts = [
        grid_surface(points, uvs, paint, kept=~glass),
        grid_surface(points, uvs, _GLASS, kept=glass),
    ]
    parts += [_end(points[0], -1.0, paint), _end(points[-1], 1.0, paint)]
    parts += [_wheel(x, side) for x in (-1.3, 1.35) for side in (-1.0, 1.0)]
    red, white = Look("paint", (0.45, 0.02, 0.02), gloss=1.0), Look("paint", (0.8, 0.8, 0.78), 1.0)
    plate, black = Look("page", (0.9, 0.9, 0.9)), Look("paint", (0.03, 0.03, 0.03))
    for y in (-0.70, 0.42):
        parts.append(box((-2.14, y, 0.66), (-2.05, y + 0.28, 0.82), red))
        parts.append(box((2.0, y, 0.55), (2.12, y + 0.28, 0.67), white))
    parts.append(panel((-2.19, 0.26, 0.45), (0, -0.52, 0), (0, 0, 0.11), plate, fitted=True))
    parts.append(box((-2.17, -0.7, 0.3), (-2.1, 0.7, 0.4), black))
    parts.append(box((2.1, -0.65, 0.3), (2.18, 0.65, 0.45), black))
    for y in (-0.98, 0.86):
        parts.append(box((0.55, y, 0.92), (0.68, y + 0.12, 1.05), paint))
    return join_parts(parts)


_BELT = 4
"""Cell of a ring, from the sill up, that is the side window."""


def _ring(wide: float, belt: float, top: float, top_wide: float) -> np.ndarray:
    """Outline (y, z) of a cross-section over the top, from the right sill to the left."""
    shoulder = top - min(0.05, 0.5 * (top - belt))
    half = np.array([
        [0.86 * wide, 0.22], [0.97 * wide, 0.30], [wide, 0.5 * (belt + 0.22)],
        [0.99 * wide, belt - 0.08], [0.95 * wide, belt], [top_wide + 0.02, shoulder],
        [0.85 * top_wide, top], [0.45 * top_wide, top + 0.01],
    ])  # fmt: skip
    return np.concatenate([half * [-1, 1], half[::-1]])


def _mirrored_cell(cell: int, points: int) -> int:
    return points - 2 - cell


def _smoothed(points: np.ndarray) -> np.ndarray:
    """A surface through the same points, ``_FINER`` times as fine, without overshoot."""
    for axis in (0, 1):
        number = np.arange(points.shape[axis])
        finer = np.linspace(0, number[-1], _FINER * number[-1] + 1)
        points = PchipInterpolator(number, points, axis=axis)(finer)
    return points


def _end(outline: np.ndarray, towards: float, look: Look) -> Part:
    """The flat end of a body."""
    closed = np.concatenate([outline, outline[:1]])
    middle = np.broadcast_to(outline.mean(axis=0), closed.shape)
    rows = np.stack([middle, closed] if towards < 0 else [closed, middle])
    normals = np.broadcast_to(np.array([towards, 0.0, 0.0]), rows.shape)
    return grid_surface(rows, rows[..., 1:] / 2.5, look, normals=normals)


def _wheel(x: float, side: float) -> Part:
    tyre, rim = Look("metal", (0.03, 0.03, 0.03)), Look("metal", (0.4, 0.4, 0.42))
    inner, outer = 0.6 * side, 0.89 * side
    parts = [tube((x, inner, 0.31), (x, outer, 0.31), 0.31, tyre, sides=20)]
    angle = np.linspace(0.0, 2 * np.pi, 21) * side
    normal = np.array([0.0, side, 0.0])
    for large, small, look in ((0.31, 0.2, tyre), (0.2, 0.01, rim)):
        radii = np.array([large, small])[:, None]
        disc = np.stack(
            np.broadcast_arrays(
                x + radii * -np.cos(angle), outer - 0.02 * side * (radii < 0.1), 0.31
            ),
            axis=-1,
        ).copy()
        disc[..., 2] = 0.31 + radii * np.sin(angle)
        parts.append(
            grid_surface(
                disc, disc[..., [0, 2]] * 1.5, look, normals=np.broadcast_to(normal, disc.shape)
            )
        )
    return join_parts(parts)
