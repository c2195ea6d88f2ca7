"""The scratch paper's model as a table of both sides: what walls reflect, and the rest.

A scratch reflects F rho_m, F by Eq. 2 to 4 for the view's lean. What it does not reflect, 1 - F,
goes on into the glass, scattered evenly; the paper has no table for it. From inside a scratch lets
(1 - mean F) / n² out, the mean over the leans, and gives the rest back, both evenly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_weights
from pipelines.glass_scratches.tables.bsdf_table import BsdfTable
from pipelines.glass_scratches.tables.fresnel import FresnelFactors, interpolated_fresnel
from pipelines.glass_scratches.tables.table_2d import Table2D

LEANS = (0.0, 0.3, 0.5, 0.65, 0.76, 0.85, 0.91, 0.95, 0.975, 0.99, 1.0)
"""Sines of theta at which the interpolation along the scratch is tabulated."""


def paper_bsdf_table(table: Table2D, fresnel: FresnelFactors, index: float) -> BsdfTable:
    """The table of both sides of rho_m (M, M) with Fresnel's factor along the scratch.

    >>> from pipelines.glass_scratches.tables.fresnel import fresnel_factors
    >>> flat = np.full((8, 8), np.pi / 2)
    >>> white = Table2D(flat, 0 * flat, np.zeros(8), np.full((2, 8, 8), np.pi / 2, np.float32))
    >>> both = paper_bsdf_table(white, fresnel_factors(8, 1.5, "paper"), 1.5)
    >>> both.rho.shape, both.across.shape
    ((11, 16, 16), (11, 2, 16, 16))
    """
    leans = np.array(LEANS)
    factor = interpolated_fresnel(fresnel, np.arcsin(leans))  # (S, M)
    mean = _mean_over_leans(fresnel)
    even = np.pi / 2 / index**2
    inside = 1.0 - float(bin_weights(len(mean)) @ (1.0 - mean)) / 2 / index**2
    across = np.stack(
        [_both_sides(place, factor, mean, even, inside) for place in table.across], axis=1
    )
    rho = _both_sides(table.rho.T, factor, mean, even, inside)
    error = np.zeros_like(rho)
    bins = len(mean)
    error[:, :bins, :bins] = factor[..., None] * table.standard_error.T
    absorbed = np.zeros(rho.shape[:2])
    absorbed[:, :bins] = factor * table.absorbed
    return BsdfTable(rho, error, absorbed, across.astype(np.float32), leans, False, index)


def _mean_over_leans(fresnel: FresnelFactors) -> NDArray[np.float64]:
    """F (M,) over theta, weighted by étendue: (2 / pi) cos² theta dtheta."""
    theta = (np.arange(512) + 0.5) / 512 * np.pi / 2
    weight = np.cos(theta) ** 2
    mean: NDArray[np.float64] = weight @ interpolated_fresnel(fresnel, theta) / weight.sum()
    return mean


def _both_sides(
    rho: NDArray[np.floating],
    factor: NDArray[np.float64],
    mean: NDArray[np.float64],
    even: float,
    inside: float,
) -> NDArray[np.float64]:
    """Tables (S, 2 M view, 2 M light) of what is reflected outside, (M view, M light)."""
    bins = len(rho)
    both = np.empty((len(factor), 2 * bins, 2 * bins))
    both[:, :bins, :bins] = factor[..., None] * rho
    both[:, :bins, bins:] = (1.0 - factor)[..., None] * even
    both[:, bins:, :bins] = (1.0 - mean) * even
    both[:, bins:, bins:] = inside * even
    return both
