"""Distances to the edge of visibility against all pairs, sampled arcs and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.ssdf_lighting.distances.octahedral import (
    NO_EDGE,
    delaunay_sides,
    solid_angles,
    texel_directions,
)
from pipelines.ssdf_lighting.distances.signed_distance import (
    distances_to_arcs,
    distances_to_samples,
)
from pipelines.ssdf_lighting.distances.visible_edge import VisibleEdge

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

POLE = np.array([0.3, -0.5, 0.81])
POLE /= np.linalg.norm(POLE)


def unit_vectors(count: int, seed: int = 0) -> Floats:
    vectors = np.random.default_rng(seed).standard_normal((count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def between(one: Floats, other: Floats) -> Floats:
    """Angles of all pairs, accurate near 0 and near pi alike."""
    apart = np.linalg.norm(one[:, None] - other[None], axis=-1)
    together = np.linalg.norm(one[:, None] + other[None], axis=-1)
    return 2 * np.arctan2(apart, together)


def all_pairs(visible: Bools, n: int) -> Floats:
    """d of one point by its definition."""
    if visible.all() or not visible.any():
        return np.where(visible, math.pi, -math.pi)
    ways = texel_directions(n)
    found = np.empty(n * n)
    angles = between(ways[visible], ways[~visible])
    found[visible], found[~visible] = angles.min(axis=1), -angles.min(axis=0)
    return found


def caps(n: int, count: int, seed: int) -> Bools:
    """Whether directions are in some of random caps."""
    random = np.random.default_rng(seed)
    near = texel_directions(n) @ unit_vectors(count, seed).T
    return (near > np.cos(random.uniform(0.05, 1.2, count))).any(axis=1)


# ---- to samples ------------------------------------------------------------------------------


@st.composite
def maps(draw: st.DrawFn) -> tuple[int, Bools]:
    n = draw(st.sampled_from([4, 6, 10, 16, 20]))
    seed = draw(st.integers(0, 10_000))
    random = np.random.default_rng(seed)
    kind = draw(st.sampled_from(["caps", "texels", "noise", "half", "all"]))
    visible = np.zeros(n * n, bool)
    if kind == "caps":
        visible = caps(n, draw(st.integers(1, 5)), seed)
    elif kind == "texels":
        visible[random.integers(0, n * n, draw(st.integers(1, 4)))] = True
    elif kind == "noise":
        visible = random.random(n * n) < draw(st.sampled_from([0.03, 0.5, 0.97]))
    elif kind == "half":
        visible = texel_directions(n) @ unit_vectors(1, seed)[0] > 0
    return n, visible ^ draw(st.booleans())


@given(maps())
@settings(max_examples=150, deadline=None)
def test_distances_to_samples_are_those_of_all_pairs(drawn: tuple[int, Bools]) -> None:
    n, visible = drawn
    found = distances_to_samples(visible[None])
    assert found.dtype == np.float32
    np.testing.assert_allclose(found[0], all_pairs(visible, n), rtol=0, atol=1e-6)


@pytest.mark.parametrize("n", [32, 64])
def test_distances_to_samples_are_those_of_all_pairs_at_the_papers_resolution(n: int) -> None:
    single = np.zeros(n * n, bool)
    single[n * n // 3] = True
    noise = np.random.default_rng(5).random(n * n) < 0.01
    visible = np.stack([caps(n, 3, 1), ~caps(n, 6, 2), single, ~single, noise])
    found = distances_to_samples(visible)
    expected = np.stack([all_pairs(one, n) for one in visible])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


@pytest.mark.parametrize("n", [4, 16])
def test_where_all_are_alike_the_edge_is_as_far_as_can_be(n: int) -> None:
    visible = np.stack([np.ones(n * n, bool), np.zeros(n * n, bool)])
    nothing = VisibleEdge(
        np.zeros((0, 3), np.float32), np.zeros((0, 2), np.int32), np.zeros(3, np.int64)
    )
    for found in (distances_to_samples(visible), distances_to_arcs(visible, nothing)):
        np.testing.assert_array_equal(found, np.float32([[NO_EDGE], [-NO_EDGE]]) * np.ones(n * n))


def test_points_do_not_depend_on_each_other() -> None:
    visible = np.stack([caps(16, 1 + seed % 5, seed) for seed in range(8)])
    together = distances_to_samples(visible)
    for row, one in enumerate(visible):
        np.testing.assert_array_equal(distances_to_samples(one[None])[0], together[row])


@given(maps())
@settings(max_examples=50, deadline=None)
def test_distances_to_samples_change_no_faster_than_the_angle(drawn: tuple[int, Bools]) -> None:
    """|d| among directions of one kind is 1-Lipschitz; across the edge the sum is at least the
    angle, as either is an angle to a sample of the other kind."""
    n, visible = drawn
    found = distances_to_samples(visible[None])[0].astype(np.float64)
    ends = delaunay_sides(n).ends
    ways = texel_directions(n)
    angles = 2 * np.arcsin(np.linalg.norm(ways[ends[:, 0]] - ways[ends[:, 1]], axis=1) / 2)
    alike = visible[ends[:, 0]] == visible[ends[:, 1]]
    step = np.abs(found[ends[:, 0]] - found[ends[:, 1]])
    assert (step[alike] <= angles[alike] + 1e-5).all()
    assert (np.abs(found[ends[~alike]]) <= angles[~alike, None] + 1e-5).all()


# ---- to arcs ---------------------------------------------------------------------------------


def loops(points: list[Floats]) -> VisibleEdge:
    """One closed loop through each list of points (k, 3), one after another."""
    counts = [len(one) for one in points]
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    crossings = np.concatenate(points).astype(np.float32)
    following = np.concatenate(
        [
            start + np.roll(np.arange(count), -1)
            for start, count in zip(starts[:-1], counts, strict=True)
        ]
    )
    arcs = np.stack([np.arange(len(crossings)), following], axis=-1).astype(np.int32)
    return VisibleEdge(crossings, arcs, starts)


def sampled(edge: VisibleEdge, point: int, steps: int) -> Floats:
    """Points along the arcs, so many on each."""
    own = edge.arcs[edge.starts[point] : edge.starts[point + 1]]
    a, b = (edge.crossings[own[:, k]].astype(np.float64) for k in (0, 1))
    a, b = (one / np.linalg.norm(one, axis=1, keepdims=True) for one in (a, b))
    share = np.linspace(0, 1, steps)[:, None, None]
    angle = np.diagonal(between(a, b))[:, None]
    on = np.sin((1 - share) * angle) * a + np.sin(share * angle) * b
    return (on / np.linalg.norm(on, axis=-1, keepdims=True)).reshape(-1, 3)


def ring(axis: Floats, angle: float, count: int) -> Floats:
    """Points on the circle at an angle around an axis."""
    one = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.8 else [0.0, 1.0, 0.0])
    one /= np.linalg.norm(one)
    other = np.cross(axis, one)
    turn = np.arange(count)[:, None] * 2 * math.pi / count
    return math.cos(angle) * axis + math.sin(angle) * (np.cos(turn) * one + np.sin(turn) * other)


@given(
    st.sampled_from([4, 6, 16]),
    st.integers(0, 1000),
    st.integers(3, 9),
    st.sampled_from([1e-3, 0.03, 0.4, 1.5]),
)
@settings(max_examples=80, deadline=None)
def test_distances_to_arcs_are_those_to_points_along_them(
    n: int, seed: int, corners: int, size: float
) -> None:
    """Irregular loops, small to as large as the sphere. The signs are taken as they are given."""
    random = np.random.default_rng(seed)
    points = unit_vectors(1, seed) + size * random.standard_normal((corners, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    edge = loops([points])
    longest = np.diagonal(between(points, np.roll(points, -1, axis=0))).max()
    if longest > 3.0:
        return  # nearly antipodal: which way the arc goes is up to rounding
    visible = random.random((1, n * n)) < 0.5
    found = distances_to_arcs(visible, edge)[0]
    np.testing.assert_array_equal(found > 0, visible[0])
    steps = 200
    exact = between(texel_directions(n), sampled(edge, 0, steps)).min(axis=1)
    assert (np.abs(found) <= exact + 2e-5).all()
    # Sampled points miss the nearest by no more than half a step, along the arc.
    half = longest / (steps - 1) / 2
    slack = exact - np.sqrt(np.maximum(exact**2 - half**2, 0.0))
    assert (np.abs(found) >= exact - slack - 2e-5).all()


def test_points_with_and_without_edges_keep_apart() -> None:
    visible = np.stack([caps(16, 2, 3), np.ones(256, bool), caps(16, 2, 4), np.zeros(256, bool)])
    one, two = ring(POLE, 0.7, 11), ring(-POLE, 0.2, 5)
    edge = VisibleEdge(
        np.concatenate([one, two]).astype(np.float32),
        loops([one, two]).arcs,
        np.array([0, 11, 11, 16, 16]),
    )
    found = distances_to_arcs(visible, edge)
    for row, alone in [(0, loops([one])), (2, loops([two]))]:
        expected = distances_to_arcs(visible[row : row + 1], alone)[0]
        np.testing.assert_array_equal(found[row], expected)
    np.testing.assert_array_equal(found[1], np.float32(math.pi))
    np.testing.assert_array_equal(found[3], np.float32(-math.pi))


def test_an_arc_without_length_is_a_point() -> None:
    """Two crossings at one place: what many rounds of halving make near a direction."""
    corner = ring(POLE, 0.5, 3)
    doubled = np.concatenate([corner, corner[-1:]])
    visible = texel_directions(16)[None] @ POLE < math.cos(0.5)
    found = distances_to_arcs(visible, loops([doubled]))
    np.testing.assert_allclose(found, distances_to_arcs(visible, loops([corner])), atol=1e-6)


@pytest.mark.parametrize("n", [16, 64])
@pytest.mark.parametrize("radius", [0.15, 0.8, math.pi / 2, 2.4])
def test_cones_and_half_spaces_have_their_closed_form(n: int, radius: float) -> None:
    """Hidden is a cap: d is the angle from its axis less its radius. Arcs through crossings that
    lie on the circle exactly are off by their sagitta; samples by a texel."""
    ways = texel_directions(n)
    away = between(ways, POLE[None])[:, 0]
    exact = away - radius
    visible = exact[None] > 0
    sides = delaunay_sides(n)
    edge = edge_of_cap(visible[0], sides.ends, sides.triangles, sides.of_triangle, radius, n)
    weights = solid_angles(n) / (4 * math.pi)
    refined = distances_to_arcs(visible, edge)[0] - exact
    samples = distances_to_samples(visible)[0] - exact
    longest = 4.3 * 2 / n  # the longest side of a triangle (see test_octahedral.py)
    sagitta = longest**2 / 8 * abs(1 / math.tan(radius)) + 2e-5
    assert np.abs(refined).max() < 1.5 * sagitta / max(math.sin(radius), 0.1)
    errors = [math.sqrt(float(weights @ one**2)) for one in (refined, samples)]
    assert errors[0] < 0.12 * errors[1]
    assert errors[1] < longest
    assert (samples * np.sign(exact) > -1e-6).all()  # samples lie behind the edge


def edge_of_cap(
    visible: Bools,
    ends: NDArray[np.int32],
    triangles: NDArray[np.int32],
    of_triangle: NDArray[np.int32],
    radius: float,
    n: int,
) -> VisibleEdge:
    """Crossings exactly on the circle around the pole: where a side's great circle meets it."""
    ways = texel_directions(n)
    differing = np.flatnonzero(visible[ends[:, 0]] != visible[ends[:, 1]])
    a, b = ways[ends[differing, 0]], ways[ends[differing, 1]]
    low, high = np.zeros(len(a)), np.ones(len(a))
    first = visible[ends[differing, 0]]
    for _ in range(50):
        share = ((low + high) / 2)[:, None]
        at = (1 - share) * a + share * b
        seen = at @ POLE / np.linalg.norm(at, axis=1) < math.cos(radius)
        low = np.where(seen == first, share[:, 0], low)
        high = np.where(seen == first, high, share[:, 0])
    crossings = (1 - low)[:, None] * a + low[:, None] * b
    crossings /= np.linalg.norm(crossings, axis=1, keepdims=True)
    number = np.full(len(ends), -1)
    number[differing] = np.arange(len(differing))
    arcs = []
    for corners, sides in zip(triangles, of_triangle, strict=True):
        crossed = [k for k in range(3) if number[sides[k]] >= 0]
        if crossed:
            begin, end = sorted(crossed, key=lambda k: not visible[corners[k]])
            arcs.append((number[sides[begin]], number[sides[end]]))
    return VisibleEdge(
        crossings.astype(np.float32),
        np.array(arcs, np.int32),
        np.array([0, len(crossings)], np.int64),
    )
