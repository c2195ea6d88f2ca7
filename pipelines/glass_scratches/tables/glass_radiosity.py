"""Walls of glass that scatter evenly, both ways, as a linear system: no paths, no noise.

A facet of such a wall forgets where light came from, but not from which side. Of light from the air
it gives back R, the mean of Fresnel's reflectance over the half space by the cosine, and lets the
rest into the glass, evenly; of light in the glass it lets out (1 - R) / n², which makes it
reciprocal, and gives the rest back. On each side facets see each other by the factors of
:mod:`pipelines.glass_scratches.tables.radiosity`. Of grooves side by side (`groove_walls`) the
glass between two is a groove upside down, which opens downwards.

With the flux h that facets receive on both sides, F = view factors of both, and K what a facet
does,

    h = F K h + E      and      P = G K h,

E being the part of each beam that a facet meets first, and G the same the other way round.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_centres, bin_weights
from pipelines.glass_scratches.tables.facets import facet_ends
from pipelines.glass_scratches.tables.fresnel import check_refractive_index
from pipelines.glass_scratches.tables.groove_walls import check_within_opening
from pipelines.glass_scratches.tables.radiosity import (
    ViewFactors,
    facets_along,
    factors_of_ends,
)
from pipelines.glass_scratches.tables.walls import check_albedo


class BothSides(NamedTuple):
    """Factors of J facets from the air and from the glass: facet j of the air's is facet
    (j - ``first``) mod J of the glass's. ``depth`` of the lowest point, ``lowest``: its v."""

    air: ViewFactors
    glass: ViewFactors
    first: int
    depth: float
    lowest: float


class EvenlyScattered(NamedTuple):
    """``leaving`` (2 M out, 2 M in): part of a bin's beam that leaves into a bin; ``kept`` (2 M,):
    that walls keep; ``from_facets`` (2 M out, 2 J): the same of light that meets a facet, from the
    air for the first J, from the glass for the others."""

    leaving: NDArray[np.float64]
    kept: NDArray[np.float64]
    from_facets: NDArray[np.float64]


def factors_of_both_sides(profile: NDArray[np.float64], bins: int, facets: int) -> BothSides:
    """Factors of a profile (P, 2) between its crests, and of the glass between it and the next.

    Raises ValueError as `check_within_opening`.
    """
    check_within_opening(profile)
    low = int(np.argmin(profile[:, 1]))
    width = profile[-1, 0] - profile[0, 0]
    ends = facet_ends(profile, facets)
    first = int(np.argmin(np.hypot(*(ends - profile[low]).T)))
    return BothSides(
        factors_of_ends(profile, ends, bins),
        factors_of_ends(_below(profile, low, width), _below(ends, first, width), bins),
        first,
        float(-profile[low, 1]),
        float(profile[low, 0]),
    )


def _below(points: NDArray[np.float64], low: int, width: float) -> NDArray[np.float64]:
    """What lies between a lowest point and the next groove's, upside down."""
    around = np.concatenate([points[low:], points[1 : low + 1] + np.array([width, 0.0])])
    return np.stack([around[:, 0] - around[0, 0], around[0, 1] - around[:, 1]], axis=-1)


def diffuse_reflectance(index: float) -> float:
    """Mean over the half space, by the cosine, of Fresnel's reflectance of unpolarised light from
    outside.

    Raises ValueError for an index that is not positive.

    >>> round(diffuse_reflectance(1.5), 4)
    0.0918
    """
    check_refractive_index(index)
    # Gauss's points in the square of the sine, in which the cosine's weight is even.
    points, weights = np.polynomial.legendre.leggauss(256)
    cosine = np.sqrt(1.0 - (points + 1.0) / 2.0)
    inner2 = index * index - 1.0 + cosine * cosine
    inner = np.sqrt(np.maximum(inner2, 0.0))
    across = (cosine - inner) / (cosine + inner)
    along = (index * index * cosine - inner) / (index * index * cosine + inner)
    reflected = np.where(inner2 > 0.0, (across**2 + along**2) / 2.0, 1.0)
    return float(weights @ reflected / 2.0)


def solve_glass(factors: BothSides, index: float, albedo: float) -> EvenlyScattered:
    """What becomes of beams from both sides. Raises ValueError for an albedo outside [0, 1]."""
    check_albedo(albedo)
    reflected = diffuse_reflectance(index)
    let_out = (1.0 - reflected) / index**2
    facets = len(factors.air.lengths)
    order = (np.arange(facets) - factors.first) % facets  # the glass's facets, as the air's
    lengths = factors.air.lengths
    air = factors.air.facets / lengths
    glass = factors.glass.facets[np.ix_(order, order)] / lengths
    entering = factors.glass.entering[order]
    zero = np.zeros((facets, facets))
    between = np.block([[air, zero], [zero, glass]])
    one = albedo * np.eye(facets)
    wall = np.block(
        [
            [reflected * one, let_out * one],
            [(1.0 - reflected) * one, (1.0 - let_out) * one],
        ]
    )
    nothing = np.zeros_like(entering)
    beams = np.block([[factors.air.entering, nothing], [nothing, entering]])
    bins = entering.shape[1]
    share = factors.air.width * np.tile(bin_weights(bins), 2) / 2.0
    out = (beams / np.tile(lengths, 2)[:, None]).T * share[:, None]
    received = np.linalg.inv(np.eye(2 * facets) - between @ wall)
    met = received @ beams
    return EvenlyScattered(
        out @ wall @ met, (1.0 - albedo) * met.sum(axis=0), out @ wall @ received
    )


def facets_of_views(factors: BothSides, bins: int, places: int) -> NDArray[np.int64]:
    """Rows of ``from_facets`` that views of both sides meet, at points across the opening,
    (places, 2 M)."""
    facets = len(factors.air.lengths)
    width = factors.air.width
    across = width * ((np.arange(places) + 0.5) / places - 0.5)
    above = facets_along(
        factors.air, np.repeat(across[:, None] + factors.air.ends[:1, 0] + width / 2, bins, axis=1)
    )
    # Where the way to a place of the opening comes up between the lowest points.
    start = factors.air.ends[0, 0] + width / 2 - factors.lowest
    below = (across[:, None] + start + factors.depth * np.tan(bin_centres(bins))) % width
    seen = (facets_along(factors.glass, below) + factors.first) % facets
    return np.concatenate([above, seen + facets], axis=1)
