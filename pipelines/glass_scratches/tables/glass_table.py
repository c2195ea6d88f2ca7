"""The table of a scratch whose walls are glass: what it reflects and lets through, both sides.

Walls that scatter evenly are solved for (`glass_radiosity`). Of clear and ground ones paths are
counted (`glass_paths`), a table for each of a few leans. Counts lose nothing, but are reciprocal
only as far as noise goes: the table is their mean with their transpose, its rows and columns scaled
alike until each beam is whole again.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bsdf_table import BsdfTable, side_ratio, side_weights
from pipelines.glass_scratches.tables.glass_paths import GlassPaths, shoot_glass_paths
from pipelines.glass_scratches.tables.glass_radiosity import (
    facets_of_views,
    factors_of_both_sides,
    solve_glass,
)
from pipelines.glass_scratches.tables.groove_walls import GrooveWalls, groove_walls
from pipelines.glass_scratches.tables.monte_carlo import PLACES
from pipelines.glass_scratches.tables.walls import Method, check_roughness, table_method

LEANS = (0.0, 0.35, 0.55, 0.7, 0.82, 0.91, 0.97)
"""That tables of walls which keep the lean are made for; and one from 1 on."""
STEEPEST = 0.6
"""Slope of the ridges of walls of roughness just below 1."""
_FINE = 16
_CLOSED = 1e-13
_ROUNDS = 10_000
_FITS = 20


def table_walls(profile: NDArray[np.float64], roughness: float, seed: int = 0) -> GrooveWalls:
    """The walls that a table of this roughness is of; those that scatter evenly have no ridges.

    Raises ValueError as `groove_walls` for a profile (P, 2) that cannot have them.
    """
    return groove_walls(profile, 0.0 if roughness == 1.0 else STEEPEST * roughness, seed)


def glass_table(
    profile: NDArray[np.float64],
    *,
    bins: int,
    index: float,
    roughness: float = 1.0,
    albedo: float = 1.0,
    method: Method | None = None,
    facets: int = 128,
    rays: int = 40_000,
    seed: int = 0,
    progress: Callable[[float], None] = lambda fraction: None,
) -> BsdfTable:
    """The table of a profile (P, 2) in glass of this index, M = ``bins``.

    roughness: 1 walls scatter evenly (the paper's), solved for with ``facets`` facets; 0 they are
    clear; between, ground to ridges with slopes of standard deviation 0.6 roughness. Of those
    ``rays`` paths a bin are counted. albedo: what walls do not keep of light each time. method:
    ``paths`` counts those of walls that scatter evenly, too.

    Raises ValueError for a roughness or an albedo outside [0, 1], for an exact table of walls that
    do not scatter evenly, and where walls as rough would cross.

    >>> from pipelines.glass_scratches.tables.profiles import built_in_profile
    >>> even = glass_table(built_in_profile("v", 10.0, 4.0), bins=8, index=1.5, facets=20)
    >>> even.rho.shape, even.leans.tolist()
    ((1, 16, 16), [0.0])
    >>> from pipelines.glass_scratches.tables.bsdf_table import beam_shares
    >>> bool(np.allclose(beam_shares(even), 1.0))  # all light goes on, on one side or the other
    True
    """
    check_roughness(roughness)
    even = roughness == 1.0
    if table_method(method, roughness) == "exact":
        return _even_table(profile, bins, index, albedo, facets)
    walls = table_walls(profile, roughness, seed)
    tables = []
    leans = (0.0,) if even else (*LEANS, 1.0)
    for number, lean in enumerate(leans):
        counted = shoot_glass_paths(
            walls,
            lean,
            bins=bins,
            index=index,
            rays=rays,
            albedo=albedo,
            even=even,
            seed=seed + number,
        )
        tables.append(table_of_glass_paths(counted, side_ratio(lean, index, keeps=not even)))
        progress((number + 1) / len(leans))
    rho, error, absorbed, across = (np.stack(part) for part in zip(*tables, strict=True))
    return BsdfTable(rho, error, absorbed, across, np.array(leans), not even, index)


def _even_table(
    profile: NDArray[np.float64], bins: int, index: float, albedo: float, facets: int
) -> BsdfTable:
    factors = factors_of_both_sides(profile, bins, facets)
    solved = solve_glass(factors, index, albedo)
    weights = side_weights(bins, index**2)
    rho = solved.leaving / weights[:, None]
    rho = (rho + rho.T) / 2  # to the last bit
    seen = facets_of_views(factors, bins, PLACES * _FINE)
    across = np.empty((PLACES, 2 * bins, 2 * bins))
    for view in range(2 * bins):
        shown = solved.from_facets[:, seen[:, view]] / weights[:, None]
        across[:, view] = shown.reshape(2 * bins, PLACES, _FINE).mean(axis=2).T
    return BsdfTable(
        rho[None],
        np.zeros((1, *rho.shape)),
        solved.kept[None],
        _with_mean(across, rho, weights)[None],
        np.zeros(1),
        False,
        index,
    )


def table_of_glass_paths(
    paths: GlassPaths, ratio: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float32]]:
    """rho, its standard error, what walls keep, and rho across the opening, of counted paths.

    The error is that of independent paths in both directions; stratified ones have less.
    """
    weights = side_weights(paths.leaving.shape[-1] // 2, ratio)
    left = paths.leaving.sum(axis=2)
    from_places = (left + paths.kept).T  # (places, in)
    shot = from_places.sum(axis=0) > 0
    mean = paths.leaving.sum(axis=1) / paths.rays
    error2 = mean * (1.0 - mean) / paths.rays
    counted = (mean / weights).T  # (out, in)
    variance = (error2 / weights**2).T
    kept = paths.kept.sum(axis=1) / paths.rays
    rho = np.where(np.outer(shot, shot), (counted + counted.T) / 2, 0.0)
    rho = _closed(rho, weights, np.where(shot, 1.0 - kept, 0.0))
    with np.errstate(invalid="ignore"):
        across = paths.leaving.transpose(1, 0, 2) / from_places[..., None] / weights
    across = _with_mean(np.nan_to_num(across), rho, weights)
    return rho, np.sqrt(variance + variance.T) / 2, kept, across


def _closed(
    rho: NDArray[np.float64], weights: NDArray[np.float64], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    """A symmetric table with rows and columns scaled alike so that beams leave by their shares.

    Sinkhorn and Knopp's iteration, of a symmetric matrix.
    """
    scale = np.sqrt(np.where(shares > 0, 1.0, 0.0))
    for _ in range(_ROUNDS):
        sums = scale * (rho @ (weights * scale))
        off = np.divide(shares, sums, out=np.zeros_like(sums), where=sums > 0)
        scale = scale * np.sqrt(off)
        if np.abs(sums - shares).max() < _CLOSED:
            break
    closed: NDArray[np.float64] = rho * scale[:, None] * scale
    return closed


def _with_mean(
    across: NDArray[np.float64], rho: NDArray[np.float64], weights: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Tables of places (P, 2 M view, 2 M light), scaled so that their mean is exactly rho, and that
    a view's beam leaves by its share from each place, as nearly as both can be.

    Places and lights are scaled in turns (iterative proportional fitting).
    """
    # Where no path of this direction was counted, but one of the other was, no place is known.
    fitted = np.where(across.mean(axis=0) > 0, across, rho)
    shares = across @ weights
    for _ in range(_FITS):
        sums = fitted @ weights
        fitted *= np.divide(shares, sums, out=np.zeros_like(sums), where=sums > 0)[..., None]
        mean = fitted.mean(axis=0)
        fitted *= np.divide(rho, mean, out=np.zeros_like(rho), where=mean > 0)
    return fitted.astype(np.float32)
