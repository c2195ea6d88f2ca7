"""What comes from a direction: the texel of an environment map that holds it, and its radiance."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from pipelines.light.environment_maps import FloatArray, Radiance


@njit(cache=True, nogil=True, error_model="numpy")
def texel_of_direction(height: int, width: int, x: float, y: float, z: float) -> tuple[int, int]:
    """Row and column that hold a direction; it need not be a unit vector.

    Always inside the map: what has no azimuth or no direction at all (zero, NaN) gets some texel.
    """
    # In single precision a sample near a border would end up in the neighbouring texel.
    x, y, z = np.float64(x), np.float64(y), np.float64(z)
    # The arc cosine would be inaccurate at the poles, and differ by the vector's length.
    down = math.atan2(math.sqrt(x * x + y * y), z) * (height / math.pi)
    along = (0.5 - math.atan2(y, x) / (2.0 * math.pi)) * width
    row, column = height - 1, width - 1
    if down < row:  # NaN is not
        row = int(down)
    if along < column:
        column = int(along)
    return row, column


@njit(cache=True, nogil=True, error_model="numpy")
def radiance_from_direction(
    radiance: Radiance, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Radiance from a direction: that of its texel; ``radiance`` is (H, W, 3)."""
    row, column = texel_of_direction(radiance.shape[0], radiance.shape[1], x, y, z)
    return radiance[row, column, 0], radiance[row, column, 1], radiance[row, column, 2]


@njit(cache=True, nogil=True, error_model="numpy")
def smooth_radiance_from_direction(
    radiance: Radiance, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Radiance from a direction, linear between the middles of texels, as a picture of the map is
    looked at: over the azimuth's border the map goes on, at the poles it ends.

    Not what samples of the map see (`environment_sampling`), for which texels are even.
    """
    height, width, _ = radiance.shape
    down = math.atan2(math.sqrt(x * x + y * y), z) * (height / math.pi) - 0.5
    along = (0.5 - math.atan2(y, x) / (2.0 * math.pi)) * width - 0.5
    down = min(max(down, 0.0), height - 1.0)
    row, column = int(down), math.floor(along)
    lower, right = down - row, along - column
    below = min(row + 1, height - 1)
    first, second = int(column) % width, int(column + 1) % width
    r = g = b = 0.0
    for line, part in ((row, 1.0 - lower), (below, lower)):
        for place, share in ((first, 1.0 - right), (second, right)):
            r += part * share * radiance[line, place, 0]
            g += part * share * radiance[line, place, 1]
            b += part * share * radiance[line, place, 2]
    return r, g, b


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_radiance(
    radiance: Radiance, directions: FloatArray, smooth: bool, found: Radiance
) -> None:
    for i in range(len(directions)):
        x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
        if smooth:
            found[i, 0], found[i, 1], found[i, 2] = smooth_radiance_from_direction(
                radiance, x, y, z
            )
        else:
            found[i, 0], found[i, 1], found[i, 2] = radiance_from_direction(radiance, x, y, z)


def radiance_from_directions(
    radiance: Radiance, directions: ArrayLike, *, smooth: bool = False
) -> Radiance:
    """Radiance (N, 3) float32 from directions (N, 3), which need not be unit vectors: of the texels
    that hold them, or, ``smooth``, linear between the texels' middles, to be looked at.

    Raises ValueError for another shape of the directions and for a map that is not (H, 2 H, 3).
    """
    ways = as_rows(directions, 3, "directions")
    if radiance.ndim != 3 or radiance.shape[1:] != (2 * len(radiance), 3) or not len(radiance):
        raise ValueError(f"environment: found shape {radiance.shape}, expected (H, 2 H, 3).")
    found = np.empty((len(ways), 3), np.float32)
    _fill_radiance(radiance, ways, smooth, found)
    return found


def as_rows(values: ArrayLike, length: int, name: str) -> FloatArray:
    """Values as (N, length) float64. Raises ValueError that begins with ``name`` otherwise."""
    rows = np.ascontiguousarray(values, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != length:
        raise ValueError(f"{name}: found shape {rows.shape}, expected (N, {length}).")
    return rows
