"""The paper's paths against the exact table, and what no scratch may break."""

from __future__ import annotations

import hashlib
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from pipelines.glass_scratches.tables.bins import bin_weights
from pipelines.glass_scratches.tables.monte_carlo import (
    PLACES,
    PathCounts,
    shoot_paths,
    table_of_counts,
)
from pipelines.glass_scratches.tables.profiles import built_in_profile, cut_profile
from pipelines.glass_scratches.tables.radiosity import solve_radiosity, view_factors

Floats = NDArray[np.float64]

BINS = 16
V = built_in_profile("v", 10.0, 4.0)
RIGHT_ANGLE = built_in_profile("v", 2.0, 1.0)
KEYHOLE = cut_profile(
    [(-1, 0), (-1, -1), (-2, -2), (-2, -3), (2, -3), (2, -2), (1.2, -0.7), (1.2, 0)], "keyhole"
)
PROFILES = {"v": V, "keyhole": KEYHOLE}


def paths(
    profile: Floats = V,
    *,
    bins: int = BINS,
    rays: int = 10_000,
    each: int = 1,
    albedo: float = 1.0,
    seed: int = 1,
    incidence: NDArray[np.int64] | None = None,
) -> PathCounts:
    return shoot_paths(
        profile,
        bins=bins,
        rays=rays,
        paths_per_ray=each,
        albedo=albedo,
        seed=seed,
        incidence=incidence,
    )


def usual(statistic: float, freedom: int) -> bool:
    return bool(1e-4 < chi2.sf(statistic, freedom) < 1 - 1e-4)


# ---- diffuse walls ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize("albedo", [1.0, 0.5])
def test_diffuse_paths_are_counted_as_the_exact_table_has_them(name: str, albedo: float) -> None:
    """Multinomial: chi square of each incidence's counts, the walls' included."""
    facets = {"v": 200, "keyhole": 400}[name]
    exact = solve_radiosity(view_factors(PROFILES[name], BINS, facets), albedo)
    counts = paths(PROFILES[name], albedo=albedo, seed=2)
    share = np.vstack([exact.rho * bin_weights(BINS)[:, None] / np.pi, exact.absorbed])
    found = np.vstack([counts.leaving.sum(axis=1).T, counts.kept])
    np.testing.assert_array_equal(found.sum(axis=0), 10_000)
    expected = 10_000 * share / share.sum(axis=0)
    common = expected > 8
    z = (found - expected)[common] / np.sqrt(expected[common])
    # A multinomial's cells: one less for each incidence.
    assert usual((z**2).sum(), common.sum() - BINS)
    # Neighbours together: what is a little wrong in many cells.
    off, level = (four_by_four(a[:-1]) for a in (found - expected, expected))
    assert np.abs(off / np.sqrt(level)).max() < 4.5


def four_by_four(values: Floats) -> Floats:
    return values.reshape(4, BINS // 4, 4, BINS // 4).sum(axis=(1, 3))


@pytest.mark.parametrize("name", PROFILES)
def test_walls_of_albedo_a_half_keep_what_the_exact_table_says(name: str) -> None:
    exact = solve_radiosity(view_factors(PROFILES[name], BINS, 200), 0.5)
    counts = paths(PROFILES[name], albedo=0.5, seed=3)
    np.testing.assert_array_equal(counts.kept + counts.leaving.sum(axis=(1, 2)), 10_000)
    z = (counts.kept / 10_000 - exact.absorbed) / np.sqrt(
        exact.absorbed * (1 - exact.absorbed) / 10_000
    )
    assert usual((z**2).sum(), BINS)
    np.testing.assert_array_equal(table_of_counts(counts).absorbed, counts.kept / 10_000)


def test_black_walls_keep_everything() -> None:
    counts = paths(albedo=0.0, rays=100, each=3)
    assert not counts.leaving.any()
    np.testing.assert_array_equal(counts.kept, 300)


# ---- the table of counts ---------------------------------------------------------------------


def test_a_table_is_normalised_as_the_exact_one() -> None:
    """Counts written down by hand: 8 bins, two rays of 5 paths each, all into bin 2."""
    leaving = np.zeros((8, PLACES, 8), np.int64)
    leaving[:, 0, 2], leaving[:, 3, 2] = 5, 5
    squares = np.zeros((8, 8), np.int64)
    squares[:, 2] = 50
    made = table_of_counts(PathCounts(leaving, squares, np.zeros(8, np.int64), 2, 5))
    weight = bin_weights(8)
    np.testing.assert_allclose(made.rho[2], np.pi / weight[2])
    assert not np.delete(made.rho, 2, axis=0).any()
    # Both rays alike: no spread between them.
    np.testing.assert_array_equal(made.standard_error, 0.0)
    np.testing.assert_allclose(made.across.mean(axis=0), made.rho.T)
    np.testing.assert_allclose(made.across[3, :, 2], PLACES / 2 * np.pi / weight[2])


def test_the_standard_error_is_that_of_repeated_tables() -> None:
    """Paths of one ray start at one place, so they are not independent; the errors know."""
    seeds, rays, each = 120, 150, 40
    made = [
        table_of_counts(paths(bins=8, rays=rays, each=each, seed=seed)) for seed in range(seeds)
    ]
    variance = np.var([one.rho for one in made], axis=0, ddof=1)
    reported = np.mean([one.standard_error**2 for one in made], axis=0)
    # Relative error of a variance: sqrt(2 / 119) = 0.13 for each of 64 entries.
    assert np.mean(variance / reported) == pytest.approx(1.0, abs=0.06)
    assert np.abs(np.log(variance / reported)).max() < 0.6
    mean = np.mean([one.rho for one in made], axis=0) * bin_weights(8)[:, None] / np.pi
    if_independent = mean * (1 - mean) / (rays * each) * (np.pi / bin_weights(8)[:, None]) ** 2
    assert np.mean(variance / if_independent) > 1.15


def test_several_paths_a_ray_have_the_same_mean() -> None:
    exact = solve_radiosity(view_factors(V, 8, 200), 1.0)
    made = table_of_counts(paths(bins=8, rays=3000, each=10, seed=4))
    z = (made.rho - exact.rho) / made.standard_error
    # 7 free entries an incidence; nearly, since errors are estimated.
    assert 20 < (z**2).sum() < 110


# ---- laws ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PROFILES)
def test_white_walls_let_every_path_out(name: str) -> None:
    counts = paths(PROFILES[name], rays=3000, each=2)
    np.testing.assert_array_equal(counts.leaving.sum(axis=(1, 2)), 6000)
    assert not counts.kept.any()
    # Rays enter everywhere: the same number in each place but for chance.
    entered = counts.leaving.sum(axis=(0, 2)) / 2
    expected = BINS * 3000 / PLACES
    assert usual(((entered - expected) ** 2 / expected).sum(), PLACES - 1)


@pytest.mark.parametrize("name", PROFILES)
def test_light_and_view_may_be_swapped(name: str) -> None:
    """Of a beam's paths rho w / pi leave: so counts over w are symmetric in the mean."""
    counts = paths(PROFILES[name], rays=20_000, albedo=0.9, seed=5)
    gone = counts.leaving.sum(axis=1) / bin_weights(BINS)
    spread = counts.leaving.sum(axis=1) / bin_weights(BINS) ** 2
    upper = np.triu_indices(BINS, 1)
    difference, variance = (gone - gone.T)[upper], (spread + spread.T)[upper]
    often = np.minimum(counts.leaving.sum(axis=1), counts.leaving.sum(axis=1).T)[upper] >= 8
    assert often.sum() > 60
    z = difference[often] / np.sqrt(variance[often])
    assert usual((z**2).sum(), int(often.sum()))


# ---- seeds and threads -----------------------------------------------------------------------


def test_equal_seeds_give_equal_counts() -> None:
    one, again = (paths(rays=500, each=3, seed=10) for _ in range(2))
    other = paths(rays=500, each=3, seed=11)
    for left, right in zip(one, again, strict=True):
        np.testing.assert_array_equal(left, right)
    assert (one.leaving != other.leaving).any()
    # Other seeds, other bins: no two incidences share their numbers.
    mirrored = one.leaving[::-1, ::-1, ::-1]
    assert (one.leaving != mirrored).any()


def test_a_part_of_the_incidences_has_the_counts_of_all() -> None:
    whole = paths(rays=500, each=2, seed=12)
    chosen = np.array([11, 2, 3])
    part = paths(rays=500, each=2, seed=12, incidence=chosen)
    rest = np.setdiff1d(np.arange(BINS), chosen)
    for all_, some in zip(whole[:3], part[:3], strict=True):
        np.testing.assert_array_equal(some[chosen], all_[chosen])
        assert not some[rest].any()


_SCRIPT = """
import numba
from tests.pipelines.glass_scratches.tables import test_monte_carlo as here
numba.set_num_threads(int({threads}))
assert numba.get_num_threads() == int({threads})
print(here.digest())
"""


def digest() -> str:
    counts = paths(rays=400, each=3, albedo=0.9, seed=13)
    return hashlib.sha256(counts.leaving.tobytes() + counts.kept.tobytes()).hexdigest()


def test_the_number_of_threads_does_not_matter() -> None:
    """In a process of its own: this one may have been given one thread."""
    root = Path(__file__).parents[4]
    run = subprocess.run(
        [sys.executable, "-c", _SCRIPT.format(threads=3)],
        env={**os.environ, "NUMBA_NUM_THREADS": "3", "OMP_NUM_THREADS": "3"},
        cwd=root,
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stdout.split() == [digest()]


# ---- refusals --------------------------------------------------------------------------------


@pytest.mark.parametrize("albedo", [-0.1, 1.1, math.nan])
def test_an_albedo_outside_0_to_1_is_refused(albedo: float) -> None:
    with pytest.raises(ValueError, match=rf"^albedo is {albedo:g}; expected 0 to 1\.$"):
        paths(rays=1, albedo=albedo)


def test_odd_bins_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^bins is 9; expected an even number"):
        paths(rays=1, bins=9)
