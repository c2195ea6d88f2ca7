"""The scratch BRDF of diffuse bounces as a linear system: no paths, no noise.

The paper shoots rays (section 3.1); with Lambertian walls of albedo a the same table solves

    rho_m = (pi / 2) a W E^T (L - a S)^-1 E

where W is the width of the opening, L the lengths of the facets, F their view factors in the plane,
S = L F, and E[j, k] the part of a beam from bin k that meets facet j first, averaged
over the bin (weighted by the cosine). L - a S is symmetric and positive definite, so with its
Cholesky factor the table is Y^T Y: reciprocal by construction.

Normalisation: a beam from bin i leaves into bin o with probability rho_m[o, i] w[o] / pi, where w
is the integral of cos phi over the bin. The paper's Eq. 1 divides by the cosine at the bin's middle
and by its width instead: see :func:`equation_1`. In space the BRDF of the same scratch is
f = 2 rho_m / pi², the same for all angles theta along the scratch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_centres, bin_edges, bin_weights
from pipelines.glass_scratches.tables.facets import facet_ends, taut_strings
from pipelines.glass_scratches.tables.walls import check_albedo


class ViewFactors(NamedTuple):
    """How much of each other the J facets of a profile see, and of the beams of M bins.

    ``lengths`` (J,); ``facets`` (J, J): L F, symmetric; ``opening`` (J,): the same to the opening;
    ``entering`` (J, M): part of a bin's beam that meets the facet first; ``width``: of the opening.
    """

    ends: NDArray[np.float64]
    lengths: NDArray[np.float64]
    facets: NDArray[np.float64]
    opening: NDArray[np.float64]
    entering: NDArray[np.float64]
    width: float


class ExactTable(NamedTuple):
    """``rho`` (M out, M in), ``absorbed`` (M in,): part of the beam that the walls keep.

    ``radiosity`` (J, M in): what a facet sends into every direction, in rho's unit: rho[o] is its
    mean over what is seen from bin o.
    """

    rho: NDArray[np.float64]
    absorbed: NDArray[np.float64]
    radiosity: NDArray[np.float64]


def view_factors(profile: NDArray[np.float64], bins: int, facets: int) -> ViewFactors:
    """All factors of a profile (P, 2) cut into about ``facets`` facets."""
    return factors_of_ends(profile, facet_ends(profile, facets), bins)


def factors_of_ends(
    profile: NDArray[np.float64], ends: NDArray[np.float64], bins: int
) -> ViewFactors:
    """All factors of a profile (P, 2) cut into facets at these ends (J + 1, 2)."""
    strings = taut_strings(profile, ends, bin_edges(bins))
    d, far = strings.between, strings.beyond
    between = (d[:-1, :-1] + d[1:, 1:] - d[:-1, 1:] - d[1:, :-1]) / 2
    np.fill_diagonal(between, 0.0)
    opening = (d[:-1, -1] + d[1:, 0] - d[:-1, 0] - d[1:, -1]) / 2
    received = far[1:, :-1] + far[:-1, 1:] - far[1:, 1:] - far[:-1, :-1]
    width = float(ends[-1, 0] - ends[0, 0])
    step = np.diff(ends, axis=0)
    return ViewFactors(
        ends,
        np.hypot(step[:, 0], step[:, 1]),
        (between + between.T) / 2,
        opening,
        received / (width * bin_weights(bins)),
        width,
    )


def solve_radiosity(factors: ViewFactors, albedo: float) -> ExactTable:
    """The table of walls with an albedo in [0, 1]. Raises ValueError outside.

    >>> from pipelines.glass_scratches.tables.profiles import built_in_profile
    >>> groove = built_in_profile("v", width=10.0, depth=4.0)
    >>> white = solve_radiosity(view_factors(groove, bins=16, facets=20), albedo=1.0)
    >>> white.rho.shape
    (16, 16)
    >>> bool(np.allclose(leaving_share(white.rho), 1.0))  # all light comes out again
    True
    """
    from scipy.linalg import cholesky, solve_triangular

    check_albedo(albedo)
    lower = cholesky(np.diag(factors.lengths) - albedo * factors.facets, lower=True)
    half = solve_triangular(lower, factors.entering, lower=True)
    rho = half.T @ half
    scale = np.pi / 2 * albedo * factors.width
    arriving = solve_triangular(lower, half, lower=True, trans="T")
    absorbed = (1 - albedo) * (factors.lengths @ arriving)
    return ExactTable(scale * rho, absorbed, scale * arriving)


def equation_1(rho: NDArray[np.float64]) -> NDArray[np.float64]:
    """The table (M out, M in) exactly as the paper's Eq. 1 counts it: M / (N cos phi_o) a ray."""
    count = len(rho)
    leaving = rho * bin_weights(count)[:, None] / np.pi
    return leaving * count / np.cos(bin_centres(count))[:, None]


def leaving_share(rho: NDArray[np.float64]) -> NDArray[np.float64]:
    """Part of the beam of each bin (M,) that leaves the scratch again."""
    return bin_weights(len(rho)) @ rho / np.pi


def seen_facets(factors: ViewFactors, bins: int, places: int) -> NDArray[np.int64]:
    """The facet seen at each of ``places`` points across the opening from each bin's middle,
    (places, bins); places count from the left end, at the middles of equal parts."""
    across = factors.ends[0, 0] + factors.width * (np.arange(places) + 0.5) / places
    return facets_along(factors, np.repeat(across[:, None], bins, axis=1))


def facets_along(factors: ViewFactors, across: NDArray[np.float64]) -> NDArray[np.int64]:
    """The facet that is seen first at places v (places, M) of the opening, one for each bin's
    middle."""
    ends = factors.ends
    bins = across.shape[1]
    seen = np.zeros(across.shape, np.int64)
    start, step = ends[:-1], np.diff(ends, axis=0)
    for column, angle in enumerate(bin_centres(bins)):
        # Sheared along the direction, every ray is a line of constant v.
        shift = np.tan(angle)
        low = start[:, 0] - shift * start[:, 1]
        width = step[:, 0] - shift * step[:, 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (across[:, column, None] - low) / width
        height = np.where(
            (along >= 0) & (along <= 1) & (width > 0), start[:, 1] + along * step[:, 1], -np.inf
        )
        seen[:, column] = np.argmax(height, axis=1)
    return seen
