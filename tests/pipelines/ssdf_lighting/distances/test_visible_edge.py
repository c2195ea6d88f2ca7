"""The refined edge of visibility against occluders whose edge is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.geometry.rays import build_scene, occluded
from pipelines.ssdf_lighting.distances.octahedral import (
    delaunay_sides,
    solid_angles,
    texel_directions,
)
from pipelines.ssdf_lighting.distances.signed_distance import (
    distances_to_arcs,
    distances_to_samples,
)
from pipelines.ssdf_lighting.distances.visible_edge import (
    VisibleEdge,
    visible_edge,
)

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

AXIS = np.array([0.31, -0.47, 0.83])
AXIS /= np.linalg.norm(AXIS)


def disc(radius: float, corners: int = 2000) -> tuple[Floats, NDArray[np.int32]]:
    """A fan at distance 1 from the origin, at right angles to the axis."""
    one = np.cross(AXIS, [1.0, 0.0, 0.0])
    one /= np.linalg.norm(one)
    turn = np.arange(corners)[:, None] * 2 * math.pi / corners
    around = np.cos(turn) * one + np.sin(turn) * np.cross(AXIS, one)
    vertices = np.concatenate([AXIS[None], AXIS + radius * around])
    number = np.arange(corners)
    fan = np.stack([0 * number, 1 + number, 1 + (number + 1) % corners], axis=-1)
    return vertices, fan.astype(np.int32)


def wall() -> tuple[Floats, NDArray[np.int32]]:
    """Nearly a plane through the origin: it reaches up to a hundred thousandth below its horizon,
    so that the lower half of the sphere is hidden."""
    one = np.cross(AXIS, [1.0, 0.0, 0.0])
    one /= np.linalg.norm(one)
    other = np.cross(AXIS, one)
    corners = [1e3 * (u * one + v * other) for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return np.array(corners) - 1e-2 * AXIS, np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def square() -> tuple[Floats, NDArray[np.int32]]:
    corners = [(-0.6, -0.4, 0.7), (0.5, -0.5, 0.7), (0.6, 0.5, 0.7), (-0.4, 0.6, 0.7)]
    return np.array(corners), np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def seen_from(mesh: tuple[Floats, NDArray[np.int32]], origins: Floats, n: int) -> Bools:
    ways = texel_directions(n)
    scene = build_scene(*mesh)
    return np.stack([~occluded(scene, origin, ways) for origin in origins])


def edge_of(
    mesh: tuple[Floats, NDArray[np.int32]], n: int, rounds: int, origins: Floats | None = None
) -> tuple[VisibleEdge, Bools]:
    starts = np.zeros((1, 3)) if origins is None else origins
    visible = seen_from(mesh, starts, n)
    found = visible_edge(build_scene(*mesh), starts.astype(np.float32), visible, rounds=rounds)
    return found, visible


def angle(one: Floats, other: Floats) -> Floats:
    return 2 * np.arctan2(
        np.linalg.norm(one - other, axis=-1), np.linalg.norm(one + other, axis=-1)
    )


def longest_side(n: int) -> float:
    ends = texel_directions(n)[delaunay_sides(n).ends]
    return float(angle(ends[:, 0], ends[:, 1]).max())


@pytest.mark.parametrize("n", [4, 16])
def test_sides_are_those_of_the_triangles(n: int) -> None:
    sides = delaunay_sides(n)
    assert len(sides.ends) == 3 * n * n - 6  # Euler
    assert len({frozenset(ends) for ends in sides.ends.tolist()}) == len(sides.ends)
    for corners, numbers in zip(sides.triangles.tolist(), sides.of_triangle, strict=True):
        for k in range(3):
            between = {corners[k], corners[(k + 1) % 3]}
            assert set(sides.ends[numbers[k]].tolist()) == between


@pytest.mark.parametrize("rounds", [0, 1, 4, 10])
@pytest.mark.parametrize("radius", [0.3, 1.5])
def test_crossings_lie_on_the_edge_of_a_disc(radius: float, rounds: int) -> None:
    n = 32
    edge, visible = edge_of(disc(radius), n, rounds)
    assert len(edge.crossings) > 20
    np.testing.assert_allclose(np.linalg.norm(edge.crossings, axis=1), 1, atol=1e-6)
    away = angle(edge.crossings.astype(np.float64), AXIS) - math.atan(radius)
    # Half of what is left of the side, and the fan's own sagitta.
    assert np.abs(away).max() < longest_side(n) / 2 ** (rounds + 1) * 1.02 + 5e-6
    if rounds < 10:  # not better than it can be
        assert np.abs(away).max() > longest_side(n) / 2 ** (rounds + 4)
    assert 0 < visible.mean() < 1


@pytest.mark.parametrize("rounds", [4, 8])
def test_crossings_lie_on_the_edge_of_a_half_space(rounds: int) -> None:
    edge, visible = edge_of(wall(), 16, rounds)
    np.testing.assert_array_equal(visible[0], texel_directions(16) @ AXIS > 0)
    off = np.arcsin(np.abs(edge.crossings @ AXIS))
    assert off.max() < longest_side(16) / 2 ** (rounds + 1) * 1.02 + 2e-5


def test_crossings_lie_on_the_edges_of_a_square() -> None:
    """Each side of it is an arc of a great circle."""
    vertices, _ = square()
    edge, _ = edge_of(square(), 32, 10)
    normals = np.cross(vertices, np.roll(vertices, -1, axis=0))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    off = np.abs(edge.crossings @ normals.T)
    assert (off.min(axis=1) < longest_side(32) / 2**11 * 1.02 + 1e-6).all()
    assert (np.bincount(off.argmin(axis=1), minlength=4) > 3).all()  # all four are found


def test_each_crossing_begins_one_arc_and_ends_one() -> None:
    origins = np.array([[0, 0, 0], [0.2, 0.1, 0.3], [0, 0, 5.0], [-0.3, 0.2, -0.4]])
    edge, visible = edge_of(square(), 16, 4, origins)
    assert visible[2].mean() > 0.9
    assert edge.starts.tolist()[0] == 0
    assert edge.starts[-1] == len(edge.crossings) == len(edge.arcs)
    ends = delaunay_sides(16).ends
    for point, seen in enumerate(visible):
        own = np.arange(edge.starts[point], edge.starts[point + 1])
        assert len(own) == np.count_nonzero(seen[ends[:, 0]] != seen[ends[:, 1]])
        for end in (0, 1):
            np.testing.assert_array_equal(np.sort(edge.arcs[own, end]), own)


@pytest.mark.parametrize("seed", range(4))
def test_arcs_of_any_scene_are_closed_loops_around_the_visible(seed: int) -> None:
    """A soup of triangles around the origin: as many loops as connected regions less one, and
    every arc has its triangle's visible corners on one side and the hidden ones on the other."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n = 16
    random = np.random.default_rng(seed)
    middles = random.standard_normal((12, 1, 3))
    middles /= np.linalg.norm(middles, axis=2, keepdims=True)
    corners = (middles + 0.4 * random.standard_normal((12, 3, 3))).reshape(-1, 3)
    edge, visible = edge_of((corners, np.arange(36, dtype=np.int32).reshape(-1, 3)), n, 6)
    seen, sides = visible[0], delaunay_sides(n)
    alike = sides.ends[seen[sides.ends[:, 0]] == seen[sides.ends[:, 1]]]
    graph = coo_array((np.ones(len(alike)), alike.T), shape=(n * n, n * n))
    regions, _ = connected_components(graph, directed=False)
    graph = coo_array((np.ones(len(edge.arcs)), edge.arcs.T), shape=(len(edge.arcs),) * 2)
    found, _ = connected_components(graph, directed=True, connection="strong")
    assert found == regions - 1
    ways = texel_directions(n)
    mixed = [c for c in sides.triangles if seen[c].any() and not seen[c].all()]
    for corner, (begin, end) in zip(mixed, edge.arcs, strict=True):
        a, b = edge.crossings[begin].astype(np.float64), edge.crossings[end].astype(np.float64)
        side = ways[corner] @ np.cross(a, b)
        assert (side[seen[corner]] > -1e-9).all()
        assert (side[~seen[corner]] < 1e-9).all()


def test_where_all_is_alike_there_is_no_edge() -> None:
    n = 8
    scene = build_scene(*disc(0.2))
    visible = np.stack([np.ones(n * n, bool), np.zeros(n * n, bool)])
    edge = visible_edge(scene, np.zeros((2, 3), np.float32), visible)
    assert edge.crossings.shape == (0, 3)
    assert edge.arcs.shape == (0, 2)
    assert edge.starts.tolist() == [0, 0, 0]


@pytest.mark.parametrize("rounds", [4, 30])
@pytest.mark.parametrize(("radius", "n"), [(0.35, 16), (0.35, 64), (2.0, 32)])
def test_distances_to_the_edge_of_a_disc(radius: float, n: int, rounds: int) -> None:
    """With rounds to the last bit, too: crossings then meet where a circle passes a direction."""
    edge, visible = edge_of(disc(radius), n, rounds)
    exact = angle(texel_directions(n), AXIS) - math.atan(radius)
    np.testing.assert_array_equal(exact > 0, visible[0])
    weights = solid_angles(n) / (4 * math.pi)
    refined, samples = (
        math.sqrt(float(weights @ (found[0] - exact) ** 2))
        for found in (distances_to_arcs(visible, edge), distances_to_samples(visible))
    )
    assert refined < 0.12 * samples
    assert samples < longest_side(n)
