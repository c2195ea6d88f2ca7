"""The 2-D scratch table of any roughness by one interface, and what it becomes along the scratch.

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
from pipelines.glass_scratches.tables.exact import exchange, seen_facets, solve
from pipelines.glass_scratches.tables.monte_carlo import PLACES, blur_of, shoot, table

Method = Literal["exact", "paths"]
Fresnel = Literal["paper", "physical"]

LEANS = (0.0, np.pi / 3, np.pi / 2)
"""The theta_o of the table (section 3.1)."""
_FINE = 16


class Table2D(NamedTuple):
    """One profile's table: rows are the bins of phi_o, columns those of phi_i.

    ``rho`` (M, M) float64; ``standard_error`` (M, M) float64, 0 for the exact one; ``absorbed``
    (M,) float64, part of each bin's beam that stays; ``across`` (places, M, M) float32: rho by the
    place at which the view's ray enters the opening, from its left end, rows being the view: its
    mean is rho transposed, which is rho but for the paths' noise.
    """

    rho: NDArray[np.float64]
    standard_error: NDArray[np.float64]
    absorbed: NDArray[np.float64]
    across: NDArray[np.float32]


def scratch_table(
    profile: NDArray[np.float64],
    *,
    bins: int,
    albedo: float,
    roughness: float,
    method: Method,
    facets: int,
    rays: int,
    paths_per_ray: int,
    seed: int,
) -> Table2D:
    """The table of a profile (P, 2) whose walls have this albedo and roughness.

    ``method`` exact solves the linear system of diffuse walls with ``facets`` facets; ``paths``
    shoots ``rays`` rays a bin, ``paths_per_ray`` paths each (the paper's N, Nr). Raises ValueError
    for an exact table of walls that are not diffuse, and as the two methods do.
    """
    blur_of(roughness)
    check_method(method, roughness)
    if method == "exact":
        lit = exchange(profile, bins, facets)
        solved = solve(lit, albedo)
        seen = seen_facets(lit, bins, PLACES * _FINE)
        return Table2D(
            solved.rho,
            np.zeros_like(solved.rho),
            solved.absorbed,
            _across(solved.radiosity, seen, solved.rho),
        )
    made = table(
        shoot(
            profile,
            bins=bins,
            rays=rays,
            paths_per_ray=paths_per_ray,
            albedo=albedo,
            roughness=roughness,
            seed=seed,
        )
    )
    return Table2D(made.rho, made.standard_error, made.absorbed, made.across.astype(np.float32))


def check_method(method: Method | None, roughness: float) -> None:
    """Raises ValueError for an exact table of walls that are not diffuse."""
    if method == "exact" and roughness != 1.0:
        raise ValueError(
            f"roughness is {roughness:g} with the method exact; expected 1, or the method paths."
        )


def _across(
    radiosity: NDArray[np.float64], seen: NDArray[np.int64], rho: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Radiosity of what is seen at each place; scaled so that the places' mean is exactly rho."""
    bins = len(rho)
    across = np.empty((PLACES, bins, bins), np.float32)
    for view in range(bins):
        shown = radiosity[seen[:, view]].reshape(PLACES, _FINE, bins).mean(axis=1)
        mean = shown.mean(axis=0)
        scale = np.divide(rho[view], mean, out=np.zeros(bins), where=mean > 0)
        across[:, view] = shown * scale
    return across


# ---- along the scratch -------------------------------------------------------------------------


def schlick(index: float, cosine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Schlick's reflectance (Eq. 2) for a refractive index and cosines in [0, 1].

    Raises ValueError for an index that is not positive.
    """
    check_index(index)
    grazing = (1.0 - cosine) ** 5
    return ((index - 1) ** 2 + 4 * index * grazing) / (index + 1) ** 2


def check_index(index: float) -> None:
    """Raises ValueError for a refractive index that is not positive and finite."""
    if not (np.isfinite(index) and index > 0):
        raise ValueError(f"refractive index is {index:g}; expected more than 0.")


class Lean(NamedTuple):
    """How the table depends on theta_o: factors on rho_m, for each bin of phi_o.

    ``factor`` (3, M): F at theta_o 0, pi/3, pi/2; ``gamma`` (M,): the exponent of Eq. 4.
    """

    factor: NDArray[np.float64]
    gamma: NDArray[np.float64]


def lean_factors(bins: int, index: float, variant: Fresnel) -> Lean:
    """F at the tabulated theta_o and the exponent that Eq. 3 and 4 give at pi/3.

    ``paper``: F(cos theta), as printed: gamma is 8.5476 for every phi and index. ``physical``: the
    cosine to the surface's normal, cos theta cos phi.
    """
    flat = np.ones(bins) if variant == "paper" else np.cos(bin_centres(bins))
    factor = np.stack([schlick(index, np.cos(lean) * flat) for lean in LEANS])
    # Not from the factors: for an index of 1 they leave 0 / 0.
    low, middle, high = ((1 - np.cos(lean) * flat) ** 5 for lean in LEANS)
    quotient = (middle - low) / (high - low)
    return Lean(factor, np.log(quotient) / np.log(2 / 3))


def interpolated_factor(lean: Lean, theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Eq. 3 and 4 for theta_o (K,), radians: the factor on rho_m, (K, M)."""
    share = (2 * np.abs(theta[:, None]) / np.pi) ** lean.gamma
    return share * lean.factor[2] + (1 - share) * lean.factor[0]


def interpolation_error(bins: int, index: float, variant: Fresnel) -> Mapping[str, float]:
    """Largest and mean relative error of Eq. 3 against F itself, over 2001 theta_o in [0, pi/2]
    (mean over all bins)."""
    theta = np.linspace(0.0, np.pi / 2, 2001)
    flat = np.ones(bins) if variant == "paper" else np.cos(bin_centres(bins))
    true = schlick(index, np.cos(theta)[:, None] * flat)
    error = np.abs(interpolated_factor(lean_factors(bins, index, variant), theta) / true - 1)
    return {"largest": float(error.max()), "mean": float(error.mean())}
