"""Spherical Gaussians: light as a sum of them, and how much of one a straight edge leaves.

A spherical Gaussian (SG) is G(v; p, λ, μ) = μ exp(λ (v·p - 1)) of unit directions v: its axis p,
sharpness λ >= 0 and amplitude μ. Products of SGs are SGs (Wang, Ren, Gong, Snyder and Guo,
"All-frequency rendering of dynamic, spatially-varying reflectance", 2009).

Of the visibility that an SG is multiplied with only d is known: the angle from p to the nearest
edge, negative where p is hidden. The visible side is taken as the half-space whose bounding great
circle has this distance. No great circle is farther than pi/2: from there on it is a cap.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import i1e

FloatArray = NDArray[np.float64]

_QUARTER = 0.5 * math.pi
_NODES = 40  # of Gauss and Legendre: 24 already give 14 digits from λ = 0 to 1e5 and above
_FAINT = 40.0  # exponents beyond do not count: exp(-40) is 4e-18
_AT_ONCE = 16384  # elements of an array whose nodes are in memory together

_AT_EDGES = 2.0  # see ``softened``: found by pictures under a sun beside a path tracer's

_ROWS, _COLUMNS = 128, 64
_LEAST_ROWS, _LEAST_COLUMNS = 8, 4
_ENDLESS = 1e12  # the sharpness of the last column, which stands for all that is beyond


class Lights(NamedTuple):
    """An environment as the sum of N spherical Gaussians.

    axes: (N, 3) float64, unit vectors towards the light.
    sharpness: (N,) float64, above 0.
    amplitudes: (N, 3) float64, linear RGB radiance along the axes, 0 and more.
    """

    axes: FloatArray
    sharpness: FloatArray
    amplitudes: FloatArray


def evaluate(lights: Lights, directions: ArrayLike) -> FloatArray:
    """Radiance (..., 3) float64 from unit vectors (..., 3). Raises ValueError for other shapes.

    >>> lamp = Lights(np.array([[0.0, 0.0, 1.0]]), np.array([20.0]), np.array([[3.0, 2.0, 1.0]]))
    >>> evaluate(lamp, [0.0, 0.0, 1.0]).tolist()
    [3.0, 2.0, 1.0]
    """
    ways = np.asarray(directions, dtype=np.float64)
    if ways.ndim == 0 or ways.shape[-1] != 3:
        raise ValueError(f"directions: found shape {ways.shape}, expected (..., 3).")
    return np.exp(lights.sharpness * (ways @ lights.axes.T - 1.0)) @ lights.amplitudes


def integral(sharpness: ArrayLike) -> FloatArray:
    """Integral over the sphere of SGs of amplitude 1: 2 pi (1 - exp(-2λ)) / λ, float64.

    Any shape; 4 pi for λ = 0. Raises ValueError for a sharpness that is negative or not finite.
    """
    return _cap(_checked(sharpness), 2.0)


def product(
    axis_a: ArrayLike, sharpness_a: ArrayLike, axis_b: ArrayLike, sharpness_b: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The product of SGs of amplitude 1, itself an SG: axis (..., 3), sharpness and scale (...).

    Axes (..., 3) are unit vectors; leading axes are broadcast with the sharpnesses. Where the two
    cancel, the product is constant: sharpness 0, and the axis is a's. Raises ValueError for a
    sharpness that is negative or not finite.
    """
    one, other = np.asarray(axis_a, dtype=np.float64), np.asarray(axis_b, dtype=np.float64)
    a, b = _checked(sharpness_a), _checked(sharpness_b)
    joined = a[..., None] * one + b[..., None] * other
    sharpness = np.linalg.norm(joined, axis=-1)
    # λ - a - b as a quotient, which does not cancel: λ² - (a + b)² = -a b |p_a - p_b|².
    apart = np.sum((one - other) ** 2, axis=-1)
    total = sharpness + a + b
    lost = np.divide(a * b * apart, total, out=np.zeros_like(total), where=total > 0)
    some = (sharpness > 0)[..., None]
    length = np.where(some, sharpness[..., None], 1.0)
    return np.where(some, joined / length, one), sharpness, np.exp(-lost)


def rotated(lights: Lights, degrees: float) -> Lights:
    """Turn lights about z, counter-clockwise seen from above, as ``environments.rotated`` does.

    Raises ValueError for degrees that are not finite.
    """
    if not math.isfinite(degrees):
        raise ValueError(f"degrees is {degrees}; expected a finite angle.")
    angle = math.radians(degrees % 360.0)
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return lights._replace(axes=lights.axes @ turn.T)


def softened(lights: Lights, rmse: float) -> Lights:
    """Lights as distances with an error show them: none sharper than that, each with its flux.

    rmse: of d, radians. An edge that is off by some angle, now here, now there, shades on average
    as the true one does under a light that is wider by as much: variances add up, 1 / λ and the
    error's. At the edges that are seen it is larger than over all directions, by ``_AT_EDGES``.
    Raises ValueError for an error that is negative or not finite.

    >>> sun = Lights(np.array([[0.0, 0.0, 1.0]]), np.array([185_000.0]), np.ones((1, 3)))
    >>> softened(sun, 0.006).sharpness.round(-2).tolist()
    [6700.0]
    """
    if not 0.0 <= rmse < math.inf:
        raise ValueError(f"rmse is {rmse}; expected a finite angle of 0 or more.")
    sharpness = 1.0 / (1.0 / lights.sharpness + (_AT_EDGES * rmse) ** 2)
    kept = integral(lights.sharpness) / integral(sharpness)
    return lights._replace(sharpness=sharpness, amplitudes=lights.amplitudes * kept[:, None])


# ---- the visible part ------------------------------------------------------------------------


def visible_integral(distance: ArrayLike, sharpness: ArrayLike) -> FloatArray:
    """f(d, λ): integral of exp(λ (v·p - 1)) over the visible side, float64; broadcast.

    distance: d in radians, signed, from p to the nearest edge; beyond pi it counts as pi.
    sharpness: λ, 0 and more.

    Turning the half-space's edge by dt gains the integral of exp(λ (v·p - 1)) along it, weighted
    by the cosine from the nearest point: 2 pi exp(-λ) I1(λ cos t) dt. So for |d| <= pi/2

        f = pi (1 - exp(-2λ)) / λ + 2 pi exp(-λ) ∫ from 0 to d of I1(λ cos t) dt;

    for d > pi/2 it is the cap about p, for d < -pi/2 what the cap of -d leaves. Exact to 12 digits
    of the whole integral. Raises ValueError for a sharpness that is negative or not finite and for
    a distance that is NaN.

    >>> shares = visible_integral([-0.2, 0.0, 0.2], 100.0) / integral(100.0)
    >>> shares.round(3).tolist()
    [0.023, 0.5, 0.977]
    """
    angles, sharp = _pairs(distance, sharpness)
    away = np.minimum(np.abs(angles), math.pi)
    whole = _cap(sharp, 2.0)
    cap = _cap(sharp, 2.0 * np.sin(0.5 * away) ** 2)
    near = 0.5 * whole + _gained(np.minimum(away, _QUARTER), sharp)
    shown = np.where(away <= _QUARTER, near, cap)
    return np.where(angles < 0.0, whole - shown, shown)


def _cap(sharpness: FloatArray, height: ArrayLike) -> FloatArray:
    """Integral over the cap where 1 - v·p is below a height: 2 pi (1 - exp(-λ height)) / λ."""
    heights = np.asarray(height, dtype=np.float64)
    some = sharpness > 0
    positive = np.where(some, sharpness, 1.0)
    return 2.0 * math.pi * np.where(some, -np.expm1(-positive * heights) / positive, heights)


def _gained(away: FloatArray, sharpness: FloatArray) -> FloatArray:
    """2 pi exp(-λ) ∫ from 0 to d of I1(λ cos t) dt for d in [0, pi/2]; both of one shape."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    places = 0.5 * (1.0 + nodes)
    # I1(λ cos t) exp(-λ) is i1e(λ cos t) exp(-λ (1 - cos t)): nodes only where this is not faint.
    flat = np.ravel(sharpness)
    half_sine = np.sqrt(np.minimum(0.5 * _FAINT / np.maximum(flat, _FAINT), 0.5))
    last = np.minimum(np.ravel(away), 2.0 * np.arcsin(half_sine))
    gained = np.empty(flat.shape)
    for first in range(0, len(flat), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        t = last[part, None] * places
        sharp = flat[part, None]
        faded = np.exp(-2.0 * sharp * np.sin(0.5 * t) ** 2)
        gained[part] = (i1e(sharp * np.cos(t)) * faded) @ weights * last[part]
    return math.pi * gained.reshape(np.shape(sharpness))


def _pairs(distance: ArrayLike, sharpness: ArrayLike) -> tuple[FloatArray, FloatArray]:
    angles = np.asarray(distance, dtype=np.float64)
    if np.isnan(angles).any():
        raise ValueError("distance: found NaN, expected radians.")
    one, other = np.broadcast_arrays(angles, _checked(sharpness))
    return one, other


def _checked(sharpness: ArrayLike) -> FloatArray:
    values = np.asarray(sharpness, dtype=np.float64)
    wrong = ~((values >= 0) & (values < np.inf))
    if wrong.any():
        raise ValueError(
            f"sharpness: found {values[wrong][0]}, expected finite values of 0 and more."
        )
    return values


# ---- its table -------------------------------------------------------------------------------


class VisibleTable(NamedTuple):
    """values: (rows, columns) float32, f(d, λ) over the whole integral, for d >= 0: 0.5 to 1.

    With k = sqrt(1 + λ), column c belongs to 1 - 1/k = c / (columns - 1). That is every λ from 0
    to infinity, where the share depends on k d alone. Of the rows the first three quarters, up to
    row K = 3 (rows - 1) // 4, go to pi/2: row r belongs to atan(k d) / atan(k pi/2) = r / K. So
    they lie close where the SG is, and the bend at pi/2 has a row of its own. The others are even,
    the last one is pi. For d < 0 the share is 1 less that of -d.

    The default's error, linear between its entries, is at most 4e-4 for every d and λ.
    """

    values: NDArray[np.float32]


def visible_table(rows: int = _ROWS, columns: int = _COLUMNS) -> VisibleTable:
    """Make the table. Raises ValueError for fewer than 8 rows or 4 columns."""
    _check_size(rows, columns)
    knee = _knee(rows)
    part = np.arange(columns) / (columns - 1)
    k = np.minimum(1.0 / np.maximum(1.0 - part, 1e-300), math.sqrt(1.0 + _ENDLESS))
    close = np.tan(np.arange(knee + 1)[:, None] / knee * np.arctan(k * _QUARTER)) / k
    close[-1] = _QUARTER  # tan(atan(x)) is not quite x
    outer = np.arange(1, rows - knee) / (rows - 1 - knee)
    far = np.repeat(_QUARTER * (1.0 + outer)[:, None], columns, axis=1)
    distance = np.minimum(np.concatenate([close, far]), math.pi)
    sharpness = k * k - 1.0
    share = visible_integral(distance, sharpness) / integral(sharpness)
    return VisibleTable(np.clip(share, 0.5, 1.0).astype(np.float32))


def visible_share(table: VisibleTable, distance: ArrayLike, sharpness: ArrayLike) -> FloatArray:
    """Share of an SG that is visible, f(d, λ) / integral(λ) in [0, 1], float64; broadcast.

    Linear between the entries of the table. Distances in radians,
    beyond pi they count as pi. Raises ValueError as ``visible_integral`` does.
    """
    rows, columns = table.values.shape
    knee = _knee(rows)
    angles, sharp = _pairs(distance, sharpness)
    away = np.minimum(np.abs(angles), math.pi)
    k = np.sqrt(1.0 + sharp)
    row = np.where(
        away < _QUARTER,
        knee * np.arctan(k * away) / np.arctan(k * _QUARTER),
        knee + (rows - 1 - knee) * (away / _QUARTER - 1.0),
    )
    column = (columns - 1) * (1.0 - 1.0 / k)
    top = np.clip(row.astype(np.int64), 0, rows - 2)
    left = np.clip(column.astype(np.int64), 0, columns - 2)
    down, along = row - top, column - left
    values = table.values
    upper = (1.0 - along) * values[top, left] + along * values[top, left + 1]
    lower = (1.0 - along) * values[top + 1, left] + along * values[top + 1, left + 1]
    share = (1.0 - down) * upper + down * lower
    return np.where(angles < 0.0, 1.0 - share, share)


def _knee(rows: int) -> int:
    """The row of pi/2."""
    return 3 * (rows - 1) // 4


def _check_size(rows: int, columns: int) -> None:
    if rows < _LEAST_ROWS:
        raise ValueError(f"rows is {rows}; expected {_LEAST_ROWS} or more.")
    if columns < _LEAST_COLUMNS:
        raise ValueError(f"columns is {columns}; expected {_LEAST_COLUMNS} or more.")
