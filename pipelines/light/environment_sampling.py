"""Directions drawn from an environment in proportion to its luminance, and their density.

The density is constant in each texel as the radiance is, so sampling and evaluation agree to the
last bit: the density of a drawn direction is the one that is looked up for it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from pipelines.drawing.colour import luminance
from pipelines.light.environment_lookup import as_rows, texel_of_direction
from pipelines.light.environment_maps import FloatArray, Radiance, check_environment, solid_angles

_FLOOR = 0.01  # of the mean luminance, added to every texel's
# Samples keep off their texel's borders by this part of it, so that rounding moves none across,
# and off the poles, where the azimuth would be lost. Enough for heights up to some ten thousand.
_MARGIN = 1e-9


class EnvironmentSampler(NamedTuple):
    """An environment, ready for drawing directions from it.

    radiance: (H, W, 3) float32, the map.
    row_cdf: (H + 1,) float64, from 0 to 1, of the rows.
    column_cdf: (H, W + 1) float64, from 0 to 1, of the columns in each row.
    density: (H, W) float64, per steradian, constant in each texel and nowhere 0.
    """

    radiance: Radiance
    row_cdf: FloatArray
    column_cdf: FloatArray
    density: FloatArray


# ---- whole arrays ----------------------------------------------------------------------------


def make_environment_sampler(radiance: NDArray[np.floating]) -> EnvironmentSampler:
    """Make a map ready for drawing directions in proportion to its luminance.

    1 % of the mean luminance is added everywhere, so that no light is missed, be it as faint to
    the eye as blue. Raises ValueError for a map that ``check_environment`` refuses.

    >>> from pipelines.light.built_in_environments import lamps
    >>> sampler = make_environment_sampler(lamps(32))
    >>> sampler.density.shape
    (32, 64)
    >>> round(float((sampler.density * solid_angles(32)[:, None]).sum()), 9)
    1.0
    """
    check_environment(radiance)
    with np.errstate(over="ignore"):
        kept = np.ascontiguousarray(radiance, dtype=np.float32)
    check_environment(kept)  # again: doubles may be too large or too small for float32
    height = len(kept)
    solid_angle = solid_angles(height)[:, None]
    weights = luminance(kept.astype(np.float64))
    weights += _FLOOR * (solid_angle * weights).sum() / (4.0 * math.pi)
    density = weights / (solid_angle * weights).sum()
    chances = solid_angle * density
    return EnvironmentSampler(kept, _cdf(chances.sum(axis=1)), _cdf(chances), density)


def _cdf(chances: FloatArray) -> FloatArray:
    """Sums (..., n + 1) of the last axis (..., n), from 0 to exactly 1."""
    sums = np.cumsum(chances, axis=-1)
    sums /= sums[..., -1:]
    return np.concatenate([np.zeros_like(sums[..., :1]), sums], axis=-1)


def sample_directions(sampler: EnvironmentSampler, u: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Draw N directions from numbers (N, 2) in [0, 1].

    Returns unit vectors (N, 3) and their densities (N,) per steradian, both float64.
    Raises ValueError for another shape and for numbers outside.
    """
    numbers = as_rows(u, 2, "u")
    if not ((numbers >= 0) & (numbers <= 1)).all():
        raise ValueError("u: found numbers outside [0, 1] or NaN, expected them inside.")
    directions, found = np.empty((len(numbers), 3)), np.empty(len(numbers))
    _fill_samples(sampler.row_cdf, sampler.column_cdf, sampler.density, numbers, directions, found)
    return directions, found


def direction_pdfs(sampler: EnvironmentSampler, directions: ArrayLike) -> FloatArray:
    """Density (N,) per steradian with which ``sample_directions`` draws directions (N, 3).

    Raises ValueError for another shape.
    """
    ways = as_rows(directions, 3, "directions")
    found = np.empty(len(ways))
    _fill_density(sampler.density, ways, found)
    return found


# ---- compiled --------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def _drawn(cdf: FloatArray, u: float) -> tuple[int, float]:
    """Interval of a cdf (n + 1,) that holds u, and the place in it, off its ends."""
    low, high = 0, cdf.shape[0] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if cdf[middle] <= u:
            low = middle
        else:
            high = middle
    place = (u - cdf[low]) / (cdf[low + 1] - cdf[low])
    if not place > _MARGIN:  # NaN is not
        place = _MARGIN
    return low, min(place, 1.0 - _MARGIN)


@njit(cache=True, nogil=True, error_model="numpy")
def sample_direction(
    row_cdf: FloatArray, column_cdf: FloatArray, density: FloatArray, u1: float, u2: float
) -> tuple[float, float, float, float]:
    """Draw a direction from two numbers in [0, 1]: unit vector x, y, z and its density.

    The arrays are those of ``EnvironmentSampler``. Inside a texel directions are uniform in solid
    angle. ``texel_of_direction`` finds the texel again, in double precision: of a direction rounded
    to single precision the density has to be looked up anew.
    """
    height, width = density.shape
    row, down = _drawn(row_cdf, u1)
    column, along = _drawn(column_cdf[row], u2)
    # From the nearer pole, to be accurate there: 1 - cos of its two borders.
    sign, steps = 1.0, row
    if 2 * row >= height:
        sign, steps, down = -1.0, height - 1 - row, 1.0 - down
    near = math.sin(steps * (0.5 * math.pi / height))
    far = math.sin((steps + 1) * (0.5 * math.pi / height))
    near, far = 2.0 * near * near, 2.0 * far * far
    lack = near + down * (far - near)
    radius = math.sqrt(lack * (2.0 - lack))
    azimuth = math.pi * (1.0 - 2.0 * (column + along) / width)
    z = sign * (1.0 - lack)
    return radius * math.cos(azimuth), radius * math.sin(azimuth), z, density[row, column]


@njit(cache=True, nogil=True, error_model="numpy")
def direction_pdf(density: FloatArray, x: float, y: float, z: float) -> float:
    """Density per steradian of ``sample_direction`` at a direction; ``density`` is (H, W)."""
    row, column = texel_of_direction(density.shape[0], density.shape[1], x, y, z)
    return density[row, column]


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_samples(
    row_cdf: FloatArray,
    column_cdf: FloatArray,
    density: FloatArray,
    u: FloatArray,
    directions: FloatArray,
    found: FloatArray,
) -> None:
    for i in range(len(u)):
        x, y, z, p = sample_direction(row_cdf, column_cdf, density, u[i, 0], u[i, 1])
        directions[i, 0], directions[i, 1], directions[i, 2], found[i] = x, y, z, p


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_density(density: FloatArray, directions: FloatArray, found: FloatArray) -> None:
    for i in range(len(directions)):
        x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
        found[i] = direction_pdf(density, x, y, z)
