"""The BSDF of a scratch as a table: reflection and transmission, from both sides of the surface.

Rows and columns are bins of phi on both sides: bins 0 to M - 1 outside, from the normal towards v;
bins M to 2 M - 1 inside the glass, from the inward normal towards v. There is a table for each of a
few *leans*: the component of a direction along the scratch, times the refractive index where it is,
without its sign. What a view in bin o gets from bin i is the part rho[o, i] w[i] r[i] / pi of it
(radiance over n²), where w is the integral of cos phi over the bin, and r is 1 outside; inside it
is the ratio of the two sides' étendue: n² where walls forget the lean, k_inside / k_outside with
k = sqrt(n² - lean²) where they keep it; from a lean of 1 on, where there is only the inside, 1. So
rho is symmetric where light is reciprocal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_weights


class BsdfTable(NamedTuple):
    """Tables of S leans of a scratch in glass.

    ``rho``, ``standard_error`` (S, 2 M view, 2 M light) float64, the error 0 where it was solved
    for; ``absorbed`` (S, 2 M) float64: part of a beam that walls keep; ``across`` (S, places, 2 M
    view, 2 M light) float32: rho by the place where the view's ray crosses the opening, from its
    left end, the mean of which is rho; ``leans`` (S,) float64, rising; ``keeps``: whether walls
    keep the lean: the last table, of lean 1, is then that from 1 on; ``refractive_index`` of the
    glass.
    """

    rho: NDArray[np.float64]
    standard_error: NDArray[np.float64]
    absorbed: NDArray[np.float64]
    across: NDArray[np.float32]
    leans: NDArray[np.float64]
    keeps: bool
    refractive_index: float


def side_ratio(lean: float, index: float, *, keeps: bool) -> float:
    """r of the inside: étendue there over that outside, of a lean (or of all of them)."""
    if not keeps:
        return index**2
    if lean >= 1.0:
        return 1.0
    return float(np.sqrt((index**2 - lean**2) / (1.0 - lean**2)))


def side_weights(bins: int, ratio: float) -> NDArray[np.float64]:
    """w r / pi (2 M,) of the bins of both sides: rho times this is the part of a beam."""
    weight = bin_weights(bins) / np.pi
    return np.concatenate([weight, ratio * weight])


def lean_weights(
    bins: int, leans: NDArray[np.float64], index: float, *, keeps: bool
) -> NDArray[np.float64]:
    """`side_weights` (S, 2 M) for each of the leans of a table."""
    return np.stack(
        [side_weights(bins, side_ratio(float(lean), index, keeps=keeps)) for lean in leans]
    )


def beam_shares(table: BsdfTable) -> NDArray[np.float64]:
    """Part (S, 2 M) of the light of each view that the walls let through or give back."""
    bins, index = table.rho.shape[-1] // 2, table.refractive_index
    weights = lean_weights(bins, table.leans, index, keeps=table.keeps)
    return np.einsum("sl,svl->sv", weights, table.rho)


def energy_error(table: BsdfTable) -> float:
    """Largest part of a beam that neither leaves nor stays; from a lean of 1 on there is no beam
    outside."""
    off = np.abs(beam_shares(table) + table.absorbed - 1.0)
    if table.keeps:
        off[-1, : off.shape[1] // 2] = 0.0
    return float(off.max())


def asymmetry(table: BsdfTable) -> float:
    """Largest |rho(o, i) - rho(i, o)| over the largest rho: generalised reciprocity, radiance over
    n²."""
    return float(np.abs(table.rho - table.rho.transpose(0, 2, 1)).max() / table.rho.max())


def coarser(rho: NDArray[np.float64], bins: int) -> NDArray[np.float64]:
    """Tables (S, 2 M, 2 M) with ``bins`` bins a side at most: means, weighted as beams are.

    Raises ValueError where M is no multiple of fewer bins.

    >>> coarser(np.ones((1, 32, 32)), 8).shape
    (1, 16, 16)
    """
    count = rho.shape[-1] // 2
    if count <= bins:
        return rho
    if count % bins:
        raise ValueError(f"bins is {bins}; expected a divisor of the table's {count}.")
    weight = np.tile(bin_weights(count), 2)
    share = weight.reshape(2 * bins, -1) / weight.reshape(2 * bins, -1).sum(axis=1, keepdims=True)
    blocks = rho.reshape(len(rho), 2 * bins, count // bins, 2 * bins, count // bins)
    mean: NDArray[np.float64] = np.einsum("svalb,va,lb->svl", blocks, share, share)
    return mean
