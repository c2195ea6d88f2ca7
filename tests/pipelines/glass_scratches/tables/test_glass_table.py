"""Walls of glass: closed forms of planes and prisms, paths against the solved table, laws."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_centres, bin_edges
from pipelines.glass_scratches.tables.bsdf_table import (
    asymmetry,
    beam_shares,
    coarser,
    energy_error,
    lean_weights,
    side_ratio,
    side_weights,
)
from pipelines.glass_scratches.tables.glass_paths import shoot_glass_paths
from pipelines.glass_scratches.tables.glass_radiosity import diffuse_reflectance
from pipelines.glass_scratches.tables.glass_table import (
    LEANS,
    glass_table,
    table_of_glass_paths,
)
from pipelines.glass_scratches.tables.groove_walls import groove_points, groove_walls
from pipelines.glass_scratches.tables.profiles import Shape, built_in_profile

Floats = NDArray[np.float64]

BINS, INDEX = 32, 1.5
SHAPES: list[Shape] = ["v", "u", "trapezoid", "raised"]
SHALLOW = np.array([(-5.0, 0.0), (0.0, -1e-4), (5.0, 0.0)])
"""As good as a plane."""


def fresnel(cosine: Floats, ratio: float) -> Floats:
    """Unpolarised reflectance by its textbook form; ratio: index in front over index behind."""
    sine2 = ratio**2 * (1 - cosine**2)
    behind = np.sqrt(np.maximum(1 - sine2, 0))
    s = (ratio * cosine - behind) / (ratio * cosine + behind)
    p = (cosine - ratio * behind) / (cosine + ratio * behind)
    return np.where(sine2 >= 1, 1.0, (s**2 + p**2) / 2)


def beams(profile: Floats, lean: float, rays: int = 20_000, **given: float) -> Floats:
    """Parts of beams (2 M in, 2 M out) by counted paths."""
    paths = shoot_glass_paths(
        groove_walls(profile), lean, bins=BINS, index=INDEX, rays=rays, **given
    )
    return paths.leaving.sum(axis=1) / paths.rays


# ---- planes and prisms -----------------------------------------------------------------------


@pytest.mark.parametrize("lean", [0.0, 0.6])
def test_a_plane_reflects_and_bends_as_fresnel_and_snell_have_it(lean: float) -> None:
    """In space: the cosine to the normal is cos theta cos phi, whatever goes along the scratch."""
    found = beams(SHALLOW, lean)
    phi, edges = bin_centres(BINS), np.sin(bin_edges(BINS))
    share = (np.arange(2000)[:, None] + 0.5) / 2000
    cosines = np.sqrt(1 - (edges[:-1] + share * np.diff(edges)) ** 2)  # of a bin's beam
    outer = np.sqrt(1 - lean**2)
    reflected = found[:BINS, :BINS].sum(axis=1)
    expected = fresnel(outer * cosines, 1 / INDEX).mean(axis=0)
    np.testing.assert_allclose(reflected, expected, atol=0.01)
    for number in range(4, BINS - 4):
        assert np.argmax(found[number, :BINS]) == BINS - 1 - number
        bent = np.arcsin(-outer * np.sin(phi[number]) / np.sqrt(INDEX**2 - lean**2))
        went = np.argmax(found[number, BINS:])
        assert abs(bin_centres(BINS)[went] - bent) < np.pi / BINS
    inner = np.sqrt(INDEX**2 - lean**2) / INDEX
    expected = fresnel(inner * cosines, INDEX).mean(axis=0)
    np.testing.assert_allclose(found[BINS:, BINS:].sum(axis=1), expected, atol=0.01)


def test_from_a_lean_of_one_on_all_is_reflected_inside() -> None:
    found = beams(SHALLOW, 1.2)
    assert found[:BINS].sum() == 0
    assert (found[BINS:, :BINS] == 0).all()
    np.testing.assert_allclose(np.diag(found[BINS:, BINS:][:, ::-1]), 1.0, atol=1e-3)


def test_right_angles_send_light_back_inside() -> None:
    """Straight up it meets a wall at 45 degrees, over the critical angle of 41.8, then another."""
    prism = groove_walls(np.array([(-5.0, 0.0), (0.0, -5.0), (5.0, 0.0)]))
    middle = np.array([64 + 31, 64 + 32])  # up to 2.8 degrees off
    paths = shoot_glass_paths(prism, 0.0, bins=64, index=INDEX, rays=2000, incidence=middle)
    for number in middle:
        # But for a few that pass below the other.
        assert paths.leaving[number, :, number].sum() > 0.95 * 2000


def test_glass_of_the_index_of_air_is_not_there() -> None:
    """All goes straight on: out of the bin across."""
    paths = shoot_glass_paths(
        groove_walls(built_in_profile("v", 10.0, 4.0)), 0.3, bins=BINS, index=1.0 + 1e-9, rays=2000
    )
    found = paths.leaving.sum(axis=1) / 2000
    for number in range(BINS):
        assert found[number, BINS + BINS - 1 - number] == pytest.approx(1.0, abs=1e-3)


def test_the_mean_reflectance_is_fresnels_over_the_half_space() -> None:
    """By the midpoints of a million sines; 0.0918 is the textbooks' for glass."""
    sine2 = (np.arange(1_000_000) + 0.5) / 1_000_000
    for index in (1.2, 1.5, 2.4):
        mean = fresnel(np.sqrt(1 - sine2), 1 / index).mean()
        assert diffuse_reflectance(index) == pytest.approx(mean, abs=2e-5)
    assert diffuse_reflectance(1.5) == pytest.approx(0.0918, abs=5e-5)


# ---- laws ------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("roughness", [0.0, 0.4, 1.0])
def test_all_light_goes_on_and_may_go_back(shape: Shape, roughness: float) -> None:
    made = glass_table(
        built_in_profile(shape, 10.0, 4.0), bins=16, index=INDEX, roughness=roughness, rays=2000
    )
    assert energy_error(made) < 1e-11
    assert asymmetry(made) < 1e-14
    assert (made.rho >= 0).all()
    np.testing.assert_allclose(
        made.across.mean(axis=1, dtype=np.float64),
        made.rho.transpose(0, 2, 1),
        atol=1e-5 * made.rho.max(),
    )
    assert made.keeps == (roughness < 1.0)


def test_a_table_of_radiance_itself_is_not_symmetric() -> None:
    """Without n², reciprocity fails: the test can."""
    made = glass_table(built_in_profile("v", 10.0, 4.0), bins=16, index=INDEX, facets=40)
    weights = side_weights(16, 1.0)
    parts = made.rho[0] * lean_weights(16, made.leans, INDEX, keeps=False)[0]
    radiance = parts / weights
    assert np.abs(radiance - radiance.T).max() / radiance.max() > 0.2


@pytest.mark.parametrize("slope", [0.0, 0.3])
@pytest.mark.parametrize("lean", [0.0, 0.55])
def test_counts_are_reciprocal_as_far_as_noise_goes(slope: float, lean: float) -> None:
    """Before the table is made symmetric: étendue times part, there and back. Stratified paths have
    less noise than the binomial's."""
    walls = groove_walls(built_in_profile("u", 10.0, 4.0), slope)
    rays = 20_000
    paths = shoot_glass_paths(walls, lean, bins=BINS, index=INDEX, rays=rays)
    part = paths.leaving.sum(axis=1) / rays
    assert (paths.leaving.sum(axis=(1, 2)) == rays).all()
    etendue = side_weights(BINS, side_ratio(lean, INDEX, keeps=True))
    there = part * etendue[:, None]
    variance = etendue[:, None] ** 2 * part * (1 - part) / rays
    often = (part + part.T) * rays > 40
    z = (there - there.T)[often] / np.sqrt(variance + variance.T)[often]
    assert 0.3 < np.sqrt(np.mean(z**2)) < 1.1
    wrong = part * np.tile(etendue[:BINS], 2)[:, None]
    z = (wrong - wrong.T)[often] / np.sqrt(variance + variance.T)[often]
    assert np.sqrt(np.mean(z**2)) > 3


@pytest.mark.parametrize("shape", SHAPES)
def test_paths_find_the_solved_table(shape: Shape) -> None:
    """Walls that scatter evenly: 4096 z-scores, sigma from the solved probabilities."""
    profile = built_in_profile(shape, 10.0, 4.0)
    solved = glass_table(profile, bins=BINS, index=INDEX, facets=128)
    rays = 60_000
    paths = shoot_glass_paths(
        groove_walls(profile), 0.0, bins=BINS, index=INDEX, rays=rays, even=True, seed=3
    )
    chance = (solved.rho[0] * side_weights(BINS, INDEX**2)[:, None]).T
    z = (paths.leaving.sum(axis=1) / rays - chance) / np.sqrt(chance * (1 - chance) / rays)
    assert np.sqrt(np.mean(z**2)) < 1.1
    deeper = glass_table(profile * [1.0, 1.2], bins=BINS, index=INDEX, facets=128)
    other = (deeper.rho[0] * side_weights(BINS, INDEX**2)[:, None]).T
    z = (paths.leaving.sum(axis=1) / rays - other) / np.sqrt(other * (1 - other) / rays)
    assert np.sqrt(np.mean(z**2)) > 3


@pytest.mark.parametrize("roughness", [0.0, 1.0])
def test_what_walls_keep_is_counted(roughness: float) -> None:
    made = glass_table(
        built_in_profile("v", 10.0, 4.0),
        bins=16,
        index=INDEX,
        roughness=roughness,
        albedo=0.7,
        rays=2000,
    )
    assert energy_error(made) < 1e-9
    there = beam_shares(made)[0]
    assert (there < 0.75).all()
    assert (there > 0.2).all()


# ---- walls -----------------------------------------------------------------------------------


def test_ground_walls_stay_within_their_groove_and_scatter_more() -> None:
    walls = groove_walls(built_in_profile("trapezoid", 10.0, 4.0), 0.3, seed=1)
    points = groove_points(walls)
    assert len(points) == 32
    assert points[..., 1].max() < 1e-12
    np.testing.assert_allclose(points[:, -1], [[1.0, 0.0]] * 32, atol=1e-12)
    slopes = np.arctan2(walls.along_y, walls.along_x)
    assert slopes.std(axis=0).mean() > 0.15

    def entropy(slope: float) -> float:
        made = groove_walls(built_in_profile("v", 10.0, 4.0), slope)
        paths = shoot_glass_paths(made, 0.0, bins=BINS, index=INDEX, rays=4000)
        part = paths.leaving.sum(axis=1) / 4000
        return float(-(part * np.log(np.maximum(part, 1e-12))).sum(axis=1).mean())

    assert entropy(0.0) + 0.3 < entropy(0.15) < entropy(0.45)


def test_the_same_seed_makes_the_same_walls_and_paths() -> None:
    profile = built_in_profile("v", 10.0, 4.0)
    one, same, other = (groove_walls(profile, 0.2, seed).y for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert (one != other).any()
    a, b = (
        shoot_glass_paths(groove_walls(profile), 0.0, bins=8, index=INDEX, rays=500, seed=4).leaving
        for _ in range(2)
    )
    np.testing.assert_array_equal(a, b)


def test_walls_that_cannot_be_are_refused() -> None:
    profile = built_in_profile("v", 10.0, 4.0)
    with pytest.raises(ValueError, match=r"^slope of the walls is -1; expected 0 or more\.$"):
        groove_walls(profile, -1.0)
    with pytest.raises(ValueError, match=r"cross each other in this profile; expected smoother"):
        groove_walls(np.array([(0, 0), (4.99, -40.0), (5.01, -40.0), (10.0, 0.0)]), 30.0)
    with pytest.raises(ValueError, match=r"^lean is 1\.5; expected 0 to less than"):
        shoot_glass_paths(groove_walls(profile), 1.5, bins=8, index=1.5, rays=1)
    with pytest.raises(ValueError, match=r"^roughness is 0\.5 with the method exact"):
        glass_table(profile, bins=8, index=1.5, roughness=0.5, method="exact")


@pytest.mark.parametrize("roughness", [0.0, 1.0])
def test_a_groove_wider_than_its_opening_is_refused(roughness: float) -> None:
    bulb = np.array([(-2.0, 0.0), (-3.0, -2.0), (0.0, -4.0), (3.0, -2.0), (2.0, 0.0)])
    with pytest.raises(ValueError, match=r"^the profile is wider below than its opening; expected"):
        glass_table(bulb, bins=8, index=INDEX, roughness=roughness, rays=10)


# ---- leans and bins --------------------------------------------------------------------------


def test_between_leans_the_table_is_nearly_what_is_interpolated() -> None:
    """Total variation of a view's light at leans in the middle, of blocks of 11 degrees."""
    profile = built_in_profile("v", 10.0, 4.0)
    made = glass_table(profile, bins=BINS, index=INDEX, roughness=0.5, rays=20_000)
    walls = groove_walls(profile, 0.3)
    for number in (0, 2, 4):
        lean = (LEANS[number] + LEANS[number + 1]) / 2
        ratio = side_ratio(lean, INDEX, keeps=True)
        paths = shoot_glass_paths(walls, lean, bins=BINS, index=INDEX, rays=20_000)
        true = table_of_glass_paths(paths, ratio)[0] * side_weights(BINS, ratio)
        weights = lean_weights(BINS, made.leans, INDEX, keeps=True)
        parts = made.rho * weights[:, None]
        between = (parts[number] + parts[number + 1]) / 2
        shape = (2 * BINS, BINS, 2)
        off = np.abs((between - true).reshape(shape).sum(axis=2)).sum(axis=1) / 2
        assert off.mean() < 0.12
        null = np.abs((parts[-2] - true).reshape(shape).sum(axis=2)).sum(axis=1) / 2
        assert null.mean() > 2 * off.mean()


def test_coarser_tables_keep_the_laws() -> None:
    made = glass_table(built_in_profile("v", 10.0, 4.0), bins=BINS, index=INDEX, facets=40)
    rough = made._replace(rho=coarser(made.rho, 8), absorbed=np.zeros((1, 16)))
    assert energy_error(rough) < 1e-11
    assert asymmetry(rough) < 1e-14
    with pytest.raises(ValueError, match=r"^bins is 12; expected a divisor of the table's 32\.$"):
        coarser(made.rho, 12)
