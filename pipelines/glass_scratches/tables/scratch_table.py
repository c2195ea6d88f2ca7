"""The scratch paper's 2-D table, exact or by paths, by one interface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.monte_carlo import PLACES, shoot_paths, table_of_counts
from pipelines.glass_scratches.tables.radiosity import (
    seen_facets,
    solve_radiosity,
    view_factors,
)
from pipelines.glass_scratches.tables.table_2d import Table2D
from pipelines.glass_scratches.tables.walls import Method

_FINE = 16


def scratch_brdf_table(
    profile: NDArray[np.float64],
    *,
    bins: int,
    albedo: float = 1.0,
    method: Method | None = None,
    facets: int = 128,
    rays: int = 20_000,
    paths_per_ray: int = 1,
    seed: int = 0,
) -> Table2D:
    """The table of a profile (P, 2) whose walls have this albedo.

    ``method`` exact, the default, solves the linear system with ``facets`` facets; ``paths`` shoots
    ``rays`` rays a bin, ``paths_per_ray`` paths each (the paper's N, Nr). Raises ValueError as the
    two methods do.

    >>> from pipelines.glass_scratches.tables.profiles import built_in_profile
    >>> groove = built_in_profile("v", 10.0, 4.0)
    >>> counted = scratch_brdf_table(groove, bins=16, method="paths", rays=100)
    >>> counted.rho.shape, counted.across.shape
    ((16, 16), (16, 16, 16))
    >>> bool((counted.standard_error > 0).any())
    True
    """
    if method != "paths":
        factors = view_factors(profile, bins, facets)
        solved = solve_radiosity(factors, albedo)
        seen = seen_facets(factors, bins, PLACES * _FINE)
        return Table2D(
            solved.rho,
            np.zeros_like(solved.rho),
            solved.absorbed,
            _across(solved.radiosity, seen, solved.rho),
        )
    counted = table_of_counts(
        shoot_paths(
            profile,
            bins=bins,
            rays=rays,
            paths_per_ray=paths_per_ray,
            albedo=albedo,
            seed=seed,
        )
    )
    across = counted.across.astype(np.float32)
    return Table2D(counted.rho, counted.standard_error, counted.absorbed, across)


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
