"""The round table under the cloth: a rounded top on a column, and how far away it is."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.geometry.meshes import Mesh, grid_triangles, make_mesh

RADIUS = 0.48
HEIGHT = 1.05
ROUNDING = 0.05
"""Radius of the top's edge: half of its thickness."""
COLUMN = 0.045
"""Radius of the column below, which widens to a foot."""
FOOT = 0.26

_SIDES = 96
_STEPS = 12


@njit(cache=True, nogil=True, error_model="numpy")
def distance_and_normal(x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Signed distance of a point to the table's top and column, and the unit vector (3) away.

    The foot is left out: the cloth does not come there. Exact outside.
    """
    across = math.sqrt(x * x + y * y)
    outward_x, outward_y = 1.0, 0.0
    if across > 1e-9:
        outward_x, outward_y = x / across, y / across
    beside, above = max(across - (RADIUS - ROUNDING), 0.0), z - (HEIGHT - ROUNDING)
    away = math.sqrt(beside * beside + above * above)
    if z < HEIGHT - ROUNDING and across - COLUMN < away - ROUNDING:
        return across - COLUMN, outward_x, outward_y, 0.0
    if away < 1e-9:
        return -ROUNDING, 0.0, 0.0, 1.0
    beside, above = beside / away, above / away
    return away - ROUNDING, outward_x * beside, outward_y * beside, above


def distances(points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Signed distances (n,) of points (n, 3).

    >>> distances(np.array([[0.0, 0.0, 1.1], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0]])).round(2).tolist()
    [0.05, -0.05, 0.52]
    """
    return np.array([distance_and_normal(*point)[0] for point in points.astype(np.float64)])


def table_mesh() -> Mesh:
    """The table as a surface of revolution that stands on the floor."""
    turn = np.linspace(-math.pi / 2, math.pi / 2, 2 * _STEPS)
    flare = np.linspace(0.0, 1.0, _STEPS)
    foot_across = COLUMN + (FOOT - COLUMN) * (1 - flare) ** 3
    across = np.concatenate(
        [[FOOT], foot_across, RADIUS - ROUNDING + ROUNDING * np.cos(turn), [0.0]]
    )
    height = np.concatenate(
        [[0.0], 0.015 + 0.2 * flare, HEIGHT - ROUNDING + ROUNDING * np.sin(turn), [HEIGHT]]
    )
    # The column up to the top's lower side.
    across = np.insert(across, _STEPS + 1, COLUMN)
    height = np.insert(height, _STEPS + 1, HEIGHT - 2 * ROUNDING)
    around = np.linspace(0.0, 2 * math.pi, _SIDES + 1)
    points = np.stack(
        [
            across[:, None] * np.cos(around),
            across[:, None] * np.sin(around),
            np.repeat(height[:, None], len(around), axis=1),
        ],
        axis=-1,
    )
    triangles = grid_triangles(*points.shape[:2])
    top = (len(across) - 1) * len(around)  # one point there: half of the last row has no area
    triangles = triangles[(triangles >= top).sum(axis=1) < 2]
    return make_mesh(points.reshape(-1, 3), triangles, np.zeros((points[..., 0].size, 2)))
