"""Thin things before the sky, whose distances are known in closed form or by many points."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipelines.geometry import shapes
from pipelines.ssdf_lighting.distances.octahedral import texel_directions
from pipelines.ssdf_lighting.distances.refined import (
    Occluders,
    crossing_distances,
    occluders,
    refined_distances,
)
from pipelines.ssdf_lighting.distances.thin_parts import thin_outlines
from pipelines.ssdf_lighting.distances.visibility import RayOrigins, visible_directions
from pipelines.ssdf_lighting.thin_figures import made_up_share, missed_share, said_open

Floats = NDArray[np.float64]
Mesh = tuple[Floats, NDArray[np.int64]]

N = 32
WAYS = texel_directions(N)
SIDE = math.sqrt(4.0 * math.pi) / N
UP = np.array([[0.0, 0.0, 1.0]])


def blade(degrees: float, turn: float, low: float = -0.4, high: float = 0.9) -> Mesh:
    """An upright strip at distance 1 from the origin, of two triangles, facing it."""
    out, across = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    half = math.tan(math.radians(degrees) / 2.0)
    corners = [[*(out + side * half * across), z] for z in (low, high) for side in (-1, 1)]
    return np.array(corners), np.array([[0, 1, 3], [0, 3, 2]])


def seen(mesh: Mesh, origins: Floats | None = None) -> tuple[Occluders, RayOrigins, Floats]:
    around = occluders(*mesh)
    points = np.zeros((1, 3)) if origins is None else origins
    starts = RayOrigins(points.astype(np.float32), np.zeros(len(points), bool))
    return around, starts, visible_directions(around.rays, starts, WAYS)


def both(mesh: Mesh, origins: Floats | None = None) -> tuple[Floats, Floats]:
    """Distances without and with the test of the outlines."""
    around, starts, visible = seen(mesh, origins)
    normals = np.repeat(UP, len(visible), axis=0)
    return (
        crossing_distances(around.rays, starts, normals, visible),
        refined_distances(around, starts, normals, visible),
    )


@pytest.mark.parametrize("degrees", [0.2, 0.5, 1.0, 2.0])
def test_distances_to_a_strip_are_those_to_its_four_sides(degrees: float) -> None:
    for turn in (0.3, 2.0, 4.4):
        vertices, faces = blade(degrees, turn)
        _, found = both((vertices, faces))
        _, _, visible = seen((vertices, faces))
        share = np.linspace(0.0, 1.0, 4000)[:, None]
        sides = [vertices[a] * (1 - share) + vertices[b] * share for a, b in ((0, 2), (1, 3))]
        sides += [vertices[a] * (1 - share) + vertices[b] * share for a, b in ((0, 1), (2, 3))]
        points = np.concatenate(sides)
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        exact = 2.0 * np.arcsin(cKDTree(points).query(WAYS)[0] / 2.0)
        off = np.abs(found[0] - exact)[visible[0]]
        assert off.max() < SIDE / 8.0
        assert np.sqrt((off**2).mean()) < SIDE / 40.0


@pytest.mark.parametrize("degrees", [0.5, 1.0, 2.0])
def test_no_place_of_a_thin_strip_is_said_to_be_open_which_most_are_without(degrees: float) -> None:
    lost_before, lost = [], []
    for turn in np.linspace(0.1, 6.0, 12):
        vertices, faces = blade(degrees, turn)
        before, after = both((vertices, faces))
        middle = np.stack([vertices[:2].mean(axis=0), vertices[2:].mean(axis=0)])
        ways = middle[0] + (middle[1] - middle[0]) * np.linspace(0.02, 0.98, 40)[:, None]
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        lost_before.append(said_open(before[0], ways).mean())
        lost.append(said_open(after[0], ways).mean())
    assert np.mean(lost) < 0.02
    assert np.mean(lost_before) > 0.4


def test_outlines_of_a_ball_are_known_already_and_stay_as_they_are() -> None:
    ball = shapes.sphere(24)
    before, after = both((0.3 * ball.vertices + [0.2, 0.9, 0.4], ball.triangles))
    assert np.abs(after - before).max() < SIDE / 4.0
    assert np.sqrt(((after - before) ** 2).mean()) < SIDE / 40.0


def test_nothing_is_found_in_the_dark_or_where_there_is_nothing() -> None:
    around, starts, visible = seen(blade(0.5, 1.0))
    dark = np.full(visible.shape, -0.5, np.float32)
    assert thin_outlines(starts.points, dark, around.outlines).starts.tolist() == [0, 0]
    # Where d already says how far it is, nothing is new.
    _, after = both(blade(0.5, 1.0))
    assert len(thin_outlines(starts.points, after, around.outlines).arcs) == 0


def test_arcs_go_there_and_back_point_by_point() -> None:
    origins = np.array([[0.0, 0, 0], [0, 0, 0.3], [0.1, 0, 0]])
    around, starts, visible = seen(blade(0.3, 1.2), origins)
    sky = np.where(visible, np.float32(math.pi), np.float32(-0.01)).astype(np.float32)
    sky[1] = -1.0
    found = thin_outlines(starts.points, sky, around.outlines)
    assert found.starts[1] == found.starts[2] < found.starts[3] == len(found.crossings)
    np.testing.assert_allclose(np.linalg.norm(found.crossings, axis=1), 1.0, atol=1e-6)
    np.testing.assert_array_equal(found.arcs[::2], found.arcs[1::2, ::-1])
    for end in (0, 1):
        np.testing.assert_array_equal(np.sort(found.arcs[:, end]), np.arange(len(found.arcs)))


def test_a_point_on_the_line_of_an_edge_has_finite_distances() -> None:
    vertices = np.array([[0.0, 0, 1], [0, 0, 2], [0.01, 0, 2], [0, 0, -1], [0, 0, 1.5]])
    faces = np.array([[0, 1, 2], [3, 4, 2]])  # along a ray, and through the origin
    _, after = both((vertices, faces), np.array([[0.0, 0, 0], [0, 1e-3, 0]]))
    assert np.isfinite(after).all()


def test_figures_find_what_is_missed_and_what_is_made_up() -> None:
    mesh = blade(1.0, 0.7)
    before, after = both(mesh)
    origin = np.zeros((1, 3), np.float32)
    assert missed_share(after, origin, *mesh) == 0.0
    assert missed_share(before, origin, *mesh) > 0.3
    assert made_up_share(after, origin, *mesh) == 0.0
    wrong = np.where(after > 0.0, 0.5 * after, after).astype(np.float32)
    assert made_up_share(wrong, origin, *mesh) > 0.5
    sky = np.full((1, N * N), math.pi, np.float32)
    assert made_up_share(sky, origin, *mesh) == 0.0
    assert missed_share(sky, origin, *mesh) == 1.0
