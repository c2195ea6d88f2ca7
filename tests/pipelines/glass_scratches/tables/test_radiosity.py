"""Facets, their exchange and the exact table against closed forms, series and ray casting."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from pipelines.glass_scratches.tables.bins import bin_centres, bin_edges, bin_weights
from pipelines.glass_scratches.tables.facets import facet_ends, taut_strings
from pipelines.glass_scratches.tables.profiles import built_in_profile, cut_profile
from pipelines.glass_scratches.tables.radiosity import (
    ViewFactors,
    equation_1,
    leaving_share,
    seen_facets,
    solve_radiosity,
    view_factors,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

PROFILES = {
    "v": built_in_profile("v", 10.0, 4.0),
    "steep v": built_in_profile("v", 2.0, 9.0),
    "u": built_in_profile("u", 10.0, 5.0),
    "trapezoid": built_in_profile("trapezoid", 10.0, 3.0),
    "raised": built_in_profile("raised", 10.0, 4.0),
    "w": cut_profile([(-4, 0), (-2, -3), (0, -0.8), (1.5, -2.2), (4, 0)], "w"),
    "keyhole": cut_profile(
        [(-1, 0), (-1, -1), (-3, -2), (-3, -4), (3, -4), (3, -2), (1.2, -0.7), (1.2, 0)], "keyhole"
    ),
}
CONVEX = ["v", "steep v", "u", "trapezoid"]
BENT = ["raised", "w", "keyhole"]
BINS, FACETS = 64, 40


@pytest.fixture(scope="module", params=PROFILES)
def lit(request: pytest.FixtureRequest) -> ViewFactors:
    return view_factors(PROFILES[request.param], BINS, FACETS)


# ---- rays ------------------------------------------------------------------------------------


def first_facet(ends: Floats, origin: Floats, way: Floats, leaves: Ints | None = None) -> Ints:
    """The facet (N,) that rays (N, 2) meet first, -1 for none; ``leaves``: where they start."""
    found = np.empty(len(origin), np.int64)
    step = np.diff(ends, axis=0)
    for first in range(0, len(origin), 20_000):
        block = slice(first, first + 20_000)
        o, d = origin[block, None], way[block, None]
        to_start = ends[None, :-1] - o
        across = d[..., 0] * step[:, 1] - d[..., 1] * step[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = (to_start[..., 0] * step[:, 1] - to_start[..., 1] * step[:, 0]) / across
            along = (to_start[..., 0] * d[..., 1] - to_start[..., 1] * d[..., 0]) / across
        meets = (along >= 0) & (along <= 1) & (distance > 0)
        if leaves is not None:
            meets[np.arange(len(meets)), leaves[block]] = False
        distance = np.where(meets, distance, np.inf)
        found[block] = np.where(meets.any(axis=1), distance.argmin(axis=1), -1)
    return found


def chi_square(counts: Floats, expected: Floats) -> tuple[float, int]:
    """Chi square and its degrees of freedom; cells that expect less than 8 are one."""
    rare = expected < 8
    if expected[rare].sum() < 8:
        rare |= expected == expected[~rare].min()
    counts = np.append(counts[~rare], counts[rare].sum())
    expected = np.append(expected[~rare], expected[rare].sum())
    return float(((counts - expected) ** 2 / expected).sum()), len(counts) - 1


def fits(found: list[tuple[float, int]]) -> bool:
    total = sum(value for value, _ in found)
    freedom = sum(number for _, number in found)
    return bool(1e-4 < chi2.sf(total, freedom) < 1 - 1e-4)


# ---- facets ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PROFILES)
def test_facets_cover_the_profile_and_keep_its_points(name: str) -> None:
    profile = PROFILES[name]
    ends = facet_ends(profile, 60)
    assert 40 <= len(ends) - 1 <= 90
    length = np.hypot(*np.diff(ends, axis=0).T)
    assert (length > 0).all()
    assert length.sum() == pytest.approx(np.hypot(*np.diff(profile, axis=0).T).sum(), rel=1e-13)
    for point in profile:
        assert np.hypot(*(ends - point).T).min() <= 1e-12


def test_facets_of_a_v_are_spaced_as_the_cosine_of_equal_angles() -> None:
    ends = facet_ends(PROFILES["v"], 20)
    share = (1 - np.cos(np.linspace(0, math.pi, 11))) / 2
    left = [-5.0, 0.0] + share[:, None] * [5.0, -4.0]
    np.testing.assert_allclose(ends[:11], left, atol=1e-12)
    np.testing.assert_allclose(ends[::-1] * [-1, 1], ends, atol=1e-12)


def test_a_string_around_the_hump_of_a_w() -> None:
    """From bottom to bottom by way of the hump, and to infinity past the border."""
    profile = PROFILES["w"]
    straight_up = np.array([0.0, math.pi / 2])
    strings = taut_strings(profile, profile, straight_up)
    first = np.hypot(2.0, 2.2) + np.hypot(1.5, 1.4)
    assert strings.between[1, 3] == pytest.approx(first, rel=1e-14)
    assert strings.between[0, 4] == pytest.approx(8.0, rel=1e-14)
    assert strings.between[1, 1] == 0.0
    np.testing.assert_allclose(strings.between, strings.between.T, rtol=1e-15)
    np.testing.assert_allclose(strings.beyond[:, 0], -profile[:, 1], atol=1e-13)
    # Towards +v: up to the right end first, then on for the rest of the way.
    assert strings.beyond[3, 1] == pytest.approx(np.hypot(2.5, 2.2) - 4.0, rel=1e-14)


# ---- view factors ----------------------------------------------------------------------------


@pytest.mark.parametrize(("width", "depth"), [(10.0, 4.0), (2.0, 9.0), (10.0, 0.5)])
def test_the_walls_of_a_v_exchange_what_crossed_strings_say(width: float, depth: float) -> None:
    lit = view_factors(built_in_profile("v", width, depth), 16, 24)
    side = math.hypot(width / 2, depth)
    left = lit.ends[1:, 0] <= 1e-12
    expected = (2 * side - width) / 2
    assert lit.facets[np.ix_(left, ~left)].sum() == pytest.approx(expected, rel=1e-12)
    assert np.abs(lit.facets[np.ix_(left, left)]).max() < 1e-13
    assert lit.opening[left].sum() == pytest.approx(width / 2, rel=1e-12)


def test_the_sides_of_a_trapezoid_exchange_what_crossed_strings_say() -> None:
    lit = view_factors(PROFILES["trapezoid"], 16, 30)
    low = lit.ends[:, 1] <= -3.0 + 1e-12
    bottom = low[1:] & low[:-1]
    left = ~bottom & (lit.ends[1:, 0] < 0)
    right = ~bottom & ~left
    wall, floor, diagonal, width = math.hypot(3, 3), 4.0, math.hypot(7, 3), 10.0

    def sent(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
        return float(lit.facets[np.ix_(one, other)].sum())

    assert sent(left, right) == pytest.approx((2 * diagonal - width - floor) / 2, rel=1e-12)
    assert sent(left, bottom) == pytest.approx((wall + floor - diagonal) / 2, rel=1e-12)
    assert sent(right, bottom) == pytest.approx((wall + floor - diagonal) / 2, rel=1e-12)
    assert abs(sent(bottom, bottom)) < 1e-13
    assert lit.opening[bottom].sum() == pytest.approx(diagonal - wall, rel=1e-12)
    assert lit.opening[left].sum() == pytest.approx((wall + width - diagonal) / 2, rel=1e-12)


@pytest.mark.parametrize("name", CONVEX)
def test_facets_that_see_each_other_exchange_the_integral_of_their_cosines(name: str) -> None:
    """Gauss's quadrature of cos cos / (2 r) over pairs of facets that do not touch."""
    lit = view_factors(PROFILES[name], 16, 16)
    nodes, weights = np.polynomial.legendre.leggauss(24)
    step = np.diff(lit.ends, axis=0)
    way = step / lit.lengths[:, None]
    normal = np.stack([-way[:, 1], way[:, 0]], axis=-1)
    points = lit.ends[:-1, None] + (nodes[:, None] + 1) / 2 * step[:, None]
    compared = 0
    for one in range(len(way)):
        for other in range(one + 3, len(way), 2):
            between = points[other][None] - points[one][:, None]
            distance = np.linalg.norm(between, axis=-1)
            kernel = (between @ normal[one]) * -(between @ normal[other]) / (2 * distance**3)
            expected = weights @ kernel @ weights / 4 * lit.lengths[one] * lit.lengths[other]
            assert lit.facets[one, other] == pytest.approx(expected, rel=1e-6, abs=1e-12)
            compared += expected > 1e-6
    assert compared > 10


def test_nothing_is_lost_between_facets_and_opening(lit: ViewFactors) -> None:
    total = lit.facets.sum(axis=1) + lit.opening
    np.testing.assert_allclose(total, lit.lengths, rtol=1e-12, atol=1e-12)
    assert lit.opening.sum() == pytest.approx(lit.width, rel=1e-12)
    assert lit.facets.min() >= -1e-12
    assert lit.opening.min() >= -1e-12
    np.testing.assert_array_equal(lit.facets, lit.facets.T)
    np.testing.assert_array_equal(np.diag(lit.facets), 0.0)


def test_every_beam_meets_the_walls_entirely(lit: ViewFactors) -> None:
    assert lit.entering.shape == (len(lit.lengths), BINS)
    assert lit.entering.min() >= -1e-11
    np.testing.assert_allclose(lit.entering.sum(axis=0), 1.0, atol=1e-11)


def test_light_from_everywhere_enters_as_the_opening_sends_it(lit: ViewFactors) -> None:
    """All beams together are an evenly bright opening: W E w / 2 is what it exchanges."""
    sent = lit.width * lit.entering @ bin_weights(BINS) / 2
    np.testing.assert_allclose(sent, lit.opening, atol=1e-11)


@pytest.mark.parametrize("name", BENT)
def test_view_factors_are_where_rays_go(name: str) -> None:
    rays = 6000
    lit = view_factors(PROFILES[name], 8, 24)
    rng = np.random.default_rng(1)
    step = np.diff(lit.ends, axis=0) / lit.lengths[:, None]
    found, hidden = [], 0
    for facet, way in enumerate(step):
        start = lit.ends[facet] + rng.random((rays, 1)) * lit.lengths[facet] * way
        sine = rng.uniform(-1, 1, (rays, 1))
        direction = sine * way + np.sqrt(1 - sine**2) * [-way[1], way[0]]
        met = first_facet(lit.ends, start, direction, np.full(rays, facet))
        counts = np.bincount(met + 1, minlength=len(step) + 1).astype(np.float64)
        factors = np.append(lit.opening[facet], lit.facets[facet]) / lit.lengths[facet]
        assert counts[factors < 1e-9].sum() <= 1  # a ray through a corner
        hidden += (factors < 1e-9).sum()
        found.append(chi_square(counts, rays * np.maximum(factors, 0.0)))
    assert hidden > len(step)
    assert fits(found)


@pytest.mark.parametrize("name", ["w", "keyhole"])
def test_beams_meet_the_facets_that_rays_meet(name: str) -> None:
    rays, bins = 20_000, 16
    lit = view_factors(PROFILES[name], bins, 24)
    edges = np.sin(bin_edges(bins))
    rng = np.random.default_rng(2)
    found = []
    for column in range(bins):
        sine = rng.uniform(edges[column], edges[column + 1], rays)
        start = np.stack([lit.ends[0, 0] + lit.width * rng.random(rays), np.zeros(rays)], axis=-1)
        met = first_facet(lit.ends, start, -np.stack([sine, np.sqrt(1 - sine**2)], axis=-1))
        counts = np.bincount(met[met >= 0], minlength=len(lit.lengths)).astype(np.float64)
        assert counts.sum() >= rays - 1
        dark = lit.entering[:, column] < 1e-9
        assert counts[dark].sum() <= 1
        found.append(chi_square(counts, rays * np.maximum(lit.entering[:, column], 0.0)))
    assert fits(found)


@pytest.mark.parametrize("name", PROFILES)
def test_the_facets_seen_are_those_that_rays_meet(name: str) -> None:
    lit = view_factors(PROFILES[name], 32, FACETS)
    places = 101
    seen = seen_facets(lit, 32, places)
    v = lit.ends[0, 0] + lit.width * (np.arange(places) + 0.5) / places
    start = np.stack([v, np.zeros(places)], axis=-1)
    different = 0
    for column, angle in enumerate(bin_centres(32)):
        way = np.broadcast_to([-math.sin(angle), -math.cos(angle)], (places, 2))
        met = first_facet(lit.ends, start, way)
        # At a corner either neighbour will do.
        apart = np.abs(met - seen[:, column])
        assert (apart[met >= 0] <= 1).all()
        different += (met != seen[:, column]).sum()
    assert different <= 3


# ---- the table -------------------------------------------------------------------------------


def test_white_walls_keep_nothing_and_swap_light_and_view(lit: ViewFactors) -> None:
    solved = solve_radiosity(lit, 1.0)
    np.testing.assert_allclose(leaving_share(solved.rho), 1.0, atol=1e-10)
    np.testing.assert_allclose(solved.rho, solved.rho.T, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(solved.absorbed, 0.0)
    assert solved.rho.min() > 0


@pytest.mark.parametrize("albedo", [0.0, 0.05, 0.6, 0.99])
def test_what_does_not_leave_stays(lit: ViewFactors, albedo: float) -> None:
    solved = solve_radiosity(lit, albedo)
    np.testing.assert_allclose(leaving_share(solved.rho) + solved.absorbed, 1.0, atol=1e-10)
    assert (solved.absorbed > 0).all()
    # Every beam is met at least once.
    assert (solved.absorbed >= 1 - albedo - 1e-12).all()


def test_the_table_is_the_sum_over_bounces(lit: ViewFactors) -> None:
    """Bounce by bounce, without a linear system: 60 of them at albedo 0.6 are enough."""
    albedo = 0.6
    arriving = lit.entering
    spread = albedo * lit.facets / lit.lengths  # of what a column's facet received
    leaving = np.zeros((BINS, BINS))
    kept = np.zeros(BINS)
    # Of what a facet sends, the part that goes into a bin: by reciprocity.
    out = lit.width * bin_weights(BINS) / 2 * lit.entering / lit.lengths[:, None]
    for _ in range(60):
        kept += (1 - albedo) * arriving.sum(axis=0)
        leaving += albedo * out.T @ arriving
        arriving = spread @ arriving
    solved = solve_radiosity(lit, albedo)
    rho = leaving * np.pi / bin_weights(BINS)[:, None]
    np.testing.assert_allclose(solved.rho, rho, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(solved.absorbed, kept, rtol=1e-9)


@pytest.mark.parametrize("name", ["v", "w", "keyhole"])
def test_dark_walls_scatter_once(name: str) -> None:
    """rho / albedo tends to (pi / 2) W sum E E / L, here with E counted from rays on a grid."""
    bins, albedo = 16, 1e-7
    lit = view_factors(PROFILES[name], bins, 16)
    edges = np.sin(bin_edges(bins))
    places, ways = 800, 40
    v = lit.ends[0, 0] + lit.width * (np.arange(places) + 0.5) / places
    counted = np.empty((len(lit.lengths), bins))
    for column in range(bins):
        sine = edges[column] + (edges[column + 1] - edges[column]) * (np.arange(ways) + 0.5) / ways
        start = np.stack([np.repeat(v, ways), np.zeros(places * ways)], axis=-1)
        way = -np.tile(np.stack([sine, np.sqrt(1 - sine**2)], axis=-1), (places, 1))
        met = first_facet(lit.ends, start, way)
        counted[:, column] = np.bincount(met[met >= 0], minlength=len(counted)) / len(met)
    once = np.pi / 2 * lit.width * counted.T @ (counted / lit.lengths[:, None])
    rho = solve_radiosity(lit, albedo).rho / albedo
    np.testing.assert_allclose(rho, once, rtol=0.01, atol=2e-3 * once.max())
    assert once.max() > 1.5 * once.min()


def test_the_radiosity_seen_is_the_table(lit: ViewFactors) -> None:
    """The mean over the opening of what is seen from a bin: at its middle, so nearly rho."""
    solved = solve_radiosity(lit, 0.8)
    shown = solved.radiosity[seen_facets(lit, BINS, 512)].mean(axis=0)
    steep = np.abs(bin_centres(BINS)) < math.radians(75)  # beyond, a bin is not like its middle
    kept = np.ix_(steep, steep)
    error = np.abs(shown - solved.rho)[kept] / solved.rho[kept].mean()
    assert np.median(error) < 1e-3
    assert np.sqrt(np.mean(error**2)) < 6e-3
    assert error.max() < 0.08


def test_the_mean_radiosity_weighted_by_the_beam_is_the_table_exactly(lit: ViewFactors) -> None:
    solved = solve_radiosity(lit, 0.8)
    np.testing.assert_allclose(lit.entering.T @ solved.radiosity, solved.rho, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["v", "trapezoid", *BENT])
def test_more_facets_change_less_and_less(name: str) -> None:
    """Within 70 degrees: light that grazes the border needs facets as fine as its spot."""
    tables = [
        solve_radiosity(view_factors(PROFILES[name], 16, n), 0.9).rho for n in (10, 20, 40, 80, 240)
    ]
    steep = np.abs(bin_centres(16)) < math.radians(70)
    fine = tables.pop()
    errors = [np.abs(rho - fine)[np.ix_(steep, steep)].max() / fine.max() for rho in tables]
    lost = [np.abs(leaving_share(rho) - leaving_share(fine)).max() for rho in tables]
    for found in (errors, lost):
        assert (np.diff(found) < 0).all()
        assert found[3] < found[0] / 8
    assert errors[3] < 2e-3
    assert lost[3] < 5e-3


def test_a_shallow_scratch_is_a_matt_plane() -> None:
    """Almost no second bounce: what leaves goes by the cosine, rho = pi a / 2."""
    solved = solve_radiosity(view_factors(built_in_profile("v", 10.0, 1e-4), 16, 16), 0.7)
    middle = np.abs(bin_centres(16)) < math.radians(60)
    np.testing.assert_allclose(solved.rho[np.ix_(middle, middle)], 0.35 * np.pi, rtol=1e-3)


def test_size_does_not_matter_and_mirrored_profiles_have_mirrored_tables() -> None:
    profile = PROFILES["w"]
    rho = solve_radiosity(view_factors(profile, 16, 30), 0.8).rho
    scaled = solve_radiosity(view_factors(profile * 1e-3, 16, 30), 0.8).rho
    np.testing.assert_allclose(scaled, rho, rtol=1e-9)
    mirrored = solve_radiosity(view_factors(profile[::-1] * [-1, 1], 16, 30), 0.8).rho
    np.testing.assert_allclose(mirrored[::-1, ::-1], rho, rtol=1e-9)
    assert np.abs(mirrored - rho).max() > 0.01


# ---- Eq. 1 -----------------------------------------------------------------------------------


def test_equation_1_counts_m_over_n_cos_for_each_path(lit: ViewFactors) -> None:
    """Drawn paths, each of which adds M / (N cos phi_o), agree within their noise."""
    rho, paths = solve_radiosity(lit, 0.9).rho, 40_000
    rng = np.random.default_rng(3)
    cosine = np.cos(bin_centres(BINS))
    share = rho * bin_weights(BINS)[:, None] / np.pi
    found = equation_1(rho)
    z = []
    for column in (0, 10, 31, 50):
        gone = rng.choice(BINS + 1, paths, p=[*share[:, column], 1 - share[:, column].sum()])
        counted = np.zeros(BINS + 1)
        np.add.at(counted, gone, BINS / (paths * np.append(cosine, 1.0)[gone]))
        error = np.sqrt(share[:, column] * (1 - share[:, column]) / paths) * BINS / cosine
        z.append((counted[:-1] - found[:, column]) / error)
    assert 1e-4 < chi2.sf((np.concatenate(z) ** 2).sum(), 4 * BINS) < 1 - 1e-4


@pytest.mark.parametrize("bins", [8, 64, 256])
def test_equation_1_is_the_table_but_for_its_quadrature(bins: int) -> None:
    """The cosine at a bin's middle against its mean: sin(d / 2) / (d / 2), for every bin alike."""
    rho = np.random.default_rng(4).random((bins, bins))
    half = np.pi / bins / 2
    np.testing.assert_allclose(equation_1(rho), rho * math.sin(half) / half, rtol=1e-12)


# ---- bins and refusals -----------------------------------------------------------------------


@pytest.mark.parametrize("bins", [8, 10, 256])
def test_bins_are_equal_and_their_weights_integrate_the_cosine(bins: int) -> None:
    edges, weights = bin_edges(bins), bin_weights(bins)
    np.testing.assert_allclose(np.diff(edges), np.pi / bins, rtol=1e-12)
    assert (edges[0], edges[-1]) == (-np.pi / 2, np.pi / 2)
    np.testing.assert_allclose(bin_centres(bins), edges[:-1] + np.pi / bins / 2, atol=1e-15)
    np.testing.assert_array_equal(weights, weights[::-1])
    assert weights.sum() == pytest.approx(2.0, rel=1e-14)
    fine = np.cos(edges[:-1, None] + np.pi / bins * (np.arange(200) + 0.5) / 200).mean(axis=1)
    np.testing.assert_allclose(weights, fine * np.pi / bins, rtol=1e-5)


@pytest.mark.parametrize("bins", [0, 6, 7, 9, 255, -8])
def test_bins_that_are_odd_or_few_are_refused(bins: int) -> None:
    message = rf"^bins is {bins}; expected an even number of at least 8 \(M\)\.$"
    with pytest.raises(ValueError, match=message):
        bin_edges(bins)
    with pytest.raises(ValueError, match=message):
        view_factors(PROFILES["v"], bins, 8)


@pytest.mark.parametrize("albedo", [-0.01, 1.01, math.nan, math.inf])
def test_an_albedo_outside_0_to_1_is_refused(albedo: float) -> None:
    lit = view_factors(PROFILES["v"], 8, 4)
    with pytest.raises(ValueError, match=rf"^albedo is {albedo:g}; expected 0 to 1\.$"):
        solve_radiosity(lit, albedo)
