"""What the scratch table becomes along the scratch: Fresnel's factor F of the view.

Angles (section 3, figure 5): phi lies in the cross-section (v, n), theta between a direction and
that plane, in the plane (u, n). The paper writes Fresnel's factor with theta_i and tabulates over
theta_o; here both are theta_o, the view's: what a scratch reflects and lets through then add up to
one for every view, whatever the light.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_centres

Fresnel = Literal["paper", "physical"]

TABULATED_THETA = (0.0, np.pi / 3, np.pi / 2)
"""The theta_o of the table (section 3.1)."""


def schlick(index: float, cosine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Schlick's reflectance (Eq. 2) for a refractive index and cosines in [0, 1].

    Raises ValueError for an index that is not positive.
    """
    check_refractive_index(index)
    grazing = (1.0 - cosine) ** 5
    return ((index - 1) ** 2 + 4 * index * grazing) / (index + 1) ** 2


def check_refractive_index(index: float) -> None:
    """Raises ValueError for a refractive index that is not positive and finite."""
    if not (np.isfinite(index) and index > 0):
        raise ValueError(f"refractive index is {index:g}; expected more than 0.")


class FresnelFactors(NamedTuple):
    """F on rho_m as it depends on theta_o, for each bin of phi_o.

    ``factor`` (3, M): F at theta_o 0, pi/3, pi/2; ``gamma`` (M,): the exponent of Eq. 4.
    """

    factor: NDArray[np.float64]
    gamma: NDArray[np.float64]


def fresnel_factors(bins: int, index: float, variant: Fresnel) -> FresnelFactors:
    """F at the tabulated theta_o and the exponent that Eq. 3 and 4 give at pi/3.

    ``paper``: F(cos theta), as printed: gamma is 8.5476 for every phi and index. ``physical``: the
    cosine to the surface's normal, cos theta cos phi.

    >>> glass = fresnel_factors(bins=8, index=1.5, variant="paper")
    >>> glass.factor.shape
    (3, 8)
    >>> round(float(glass.factor[0, 0]), 6), round(float(glass.gamma[0]), 4)
    (0.04, 8.5476)
    """
    flat = np.ones(bins) if variant == "paper" else np.cos(bin_centres(bins))
    factor = np.stack([schlick(index, np.cos(theta) * flat) for theta in TABULATED_THETA])
    # Not from the factors: for an index of 1 they leave 0 / 0.
    low, middle, high = ((1 - np.cos(theta) * flat) ** 5 for theta in TABULATED_THETA)
    quotient = (middle - low) / (high - low)
    return FresnelFactors(factor, np.log(quotient) / np.log(2 / 3))


def interpolated_fresnel(
    fresnel: FresnelFactors, theta: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Eq. 3 and 4 for theta_o (K,), radians: the factor on rho_m, (K, M)."""
    share = (2 * np.abs(theta[:, None]) / np.pi) ** fresnel.gamma
    return share * fresnel.factor[2] + (1 - share) * fresnel.factor[0]


def interpolation_error(bins: int, index: float, variant: Fresnel) -> Mapping[str, float]:
    """Largest and mean relative error of Eq. 3 against F itself, over 2001 theta_o in [0, pi/2]
    (mean over all bins)."""
    theta = np.linspace(0.0, np.pi / 2, 2001)
    flat = np.ones(bins) if variant == "paper" else np.cos(bin_centres(bins))
    true = schlick(index, np.cos(theta)[:, None] * flat)
    error = np.abs(interpolated_fresnel(fresnel_factors(bins, index, variant), theta) / true - 1)
    return {"largest": float(error.max()), "mean": float(error.mean())}
