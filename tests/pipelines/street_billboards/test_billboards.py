"""Rectangles laid through points: in the plane, over all of it, towards the road; what turns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.geometry.cameras import Cameras
from pipelines.street_billboards.billboards import (
    OVERLAP,
    Billboards,
    axes_facing,
    fit_billboards,
    plane_axes,
)
from pipelines.street_billboards.octree import octree_leaves
from pipelines.street_billboards.textures.view_directions import CIRCLE, DIRECTIONS, fan_position
from tests.pipelines.street_billboards.compressed_street import placed_camera

SIDE = 0.5
Points = NDArray[np.float64]


def cameras_at(spots: Points, target: Points | None = None) -> Cameras:
    """Wide cameras at places (n, 3) that look at the target, else at the origin."""
    aim = np.zeros(3) if target is None else target
    made = [placed_camera(spot, aim, (200, 160), 60.0) for spot in spots]
    return Cameras(np.stack([m[0] for m in made]), np.stack([m[1] for m in made]), 200, 160)


def on_plane(
    normal: Points, count: int, seed: int, *, noise: float = 0.0, reach: float = 1.2
) -> Points:
    """Points of a plane through (nearly) the origin."""
    rng = np.random.default_rng(seed)
    normal = normal / np.linalg.norm(normal)
    axes = np.linalg.svd(normal[None])[2][1:]
    flat = rng.uniform(-reach, reach, (count, 2)) @ axes
    return flat + 0.03 * normal + rng.normal(0, noise, (count, 1)) * normal


def coordinates(made: Billboards, number: int, points: Points) -> tuple[Points, Points, Points]:
    """(s, t) of points in a still rectangle, and how far they are from its plane."""
    offset = points - made.centre[number]
    half_s = made.half_s[number].astype(np.float64)
    half_t = made.half_t[number].astype(np.float64)
    normal = np.cross(half_s, half_t)
    return (
        offset @ half_s / (half_s @ half_s),
        offset @ half_t / (half_t @ half_t),
        np.abs(offset @ normal) / np.linalg.norm(normal),
    )


def shown(made: Billboards, points: Points, off: float) -> NDArray[np.bool_]:
    """Which points lie on some still rectangle, up to ``off`` metres from its plane."""
    found = np.zeros(len(points), bool)
    for number in np.flatnonzero(~made.turns):
        s, t, away = coordinates(made, number, points)
        found |= (np.abs(s) <= 1) & (np.abs(t) <= 1) & (away <= off)
    return found


directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.3)


# ---- rectangles ------------------------------------------------------------------------------


@settings(deadline=None, max_examples=25)
@given(direction=directions, seed=st.integers(0, 1000))
def test_rectangles_lie_in_the_plane_and_cover_it(
    direction: tuple[float, float, float], seed: int
) -> None:
    normal = np.array(direction) / np.linalg.norm(direction)
    points = on_plane(normal, 6000, seed)
    leaves = octree_leaves(points, SIDE, 5)
    viewers = cameras_at(
        np.array([3.0 * normal + [0.01, 0.2, 0.1], 4.0 * normal + [-0.3, 0.1, 0.2]])
    )
    made = fit_billboards(leaves, points, viewers)
    # Only where the plane cuts little of a voxel may its points look like a line.
    assert made.turns.mean() < 0.2
    half = SIDE * (0.5 + OVERLAP)
    more = on_plane(normal, 6000, seed + 1)
    for number in np.flatnonzero(~made.turns):
        own = more[(np.abs(more - made.voxel[number]) <= half).all(axis=1)]
        s, t, away = coordinates(made, number, own)
        assert away.max(initial=0.0) < 1e-5
        assert np.abs([s, t]).max(initial=0.0) <= 1 + 1e-5
        # It is not larger than the voxel's cross-section needs, either.
        assert np.linalg.norm(made.half_s[number]) <= np.sqrt(3) * half + 1e-6
        facing = np.cross(made.half_s[number], made.half_t[number])
        assert facing / np.linalg.norm(facing) @ normal == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("behind", [False, True])
def test_normals_face_the_cameras(behind: bool) -> None:
    points = on_plane(np.array([0.2, 1.0, 0.1]), 4000, 0, noise=0.01)
    y = 5.0 if behind else -5.0
    viewers = cameras_at(np.array([[-2.0, y, 0.3], [0.0, y, 0.3], [2.0, y, 0.3]]))
    made = fit_billboards(octree_leaves(points, SIDE, 10), points, viewers)
    still = ~made.turns
    normal = np.cross(made.half_s, made.half_t)[still]
    for place in viewers.to_world[:, :3, 3]:
        assert ((place - made.centre[still]) * normal).sum(axis=1).min() > 0
    # Columns go up, rows are level.
    assert (made.half_t[still, 2] > 0).all()
    np.testing.assert_allclose(made.half_s[still, 2], 0.0, atol=1e-6)


def test_poles_wires_and_bushes_turn() -> None:
    rng = np.random.default_rng(0)
    pole = np.column_stack([rng.normal(0, 0.01, (500, 2)) + 0.2, rng.uniform(0, 3, 500)])
    wire = np.column_stack([rng.uniform(5, 8, 500), rng.normal(0, 0.01, (500, 2)) + 0.2])
    bush = rng.uniform([0, 12, 0], [2, 14, 2], (6000, 3))
    points = np.concatenate([pole, wire, bush])
    viewers = cameras_at(np.array([[-4.0, 1.0, 1.0], [-4.0, 4.0, 1.0]]))
    made = fit_billboards(octree_leaves(points, SIDE, 5), points, viewers)
    assert made.turns.all()
    np.testing.assert_array_equal(made.centre, made.voxel)
    # A sphere around the enlarged voxel fits into the square, whichever way it is turned.
    np.testing.assert_allclose(made.half_s[:, 0], np.sqrt(3) / 2 * SIDE * (1 + 2 * OVERLAP))
    np.testing.assert_array_equal(made.half_s[:, 0], made.half_t[:, 2])


def test_all_of_them_turn_in_the_paper() -> None:
    points = on_plane(np.array([0.0, 1.0, 0.0]), 2000, 0)
    leaves = octree_leaves(points, SIDE, 5)
    made = fit_billboards(leaves, points, cameras_at(np.array([[0.0, -5, 1]])), all_turn=True)
    assert made.turns.all()
    np.testing.assert_array_equal(made.centre, leaves.middle)


@settings(deadline=None, max_examples=30)
@given(
    offset=st.floats(-0.12, 0.12),
    noise=st.floats(0.0, 0.05),
    tilt=st.tuples(st.floats(-0.08, 0.08), st.floats(-0.08, 0.08)),
    seed=st.integers(0, 1000),
)
def test_a_wall_along_a_border_of_voxels_has_no_hole(
    offset: float, noise: float, tilt: tuple[float, float], seed: int
) -> None:
    rng = np.random.default_rng(seed)

    def wall(count: int, off: float, reach: float) -> Points:
        x, z = rng.uniform(-reach, reach, (2, count))
        y = (offset + rng.normal(0, off, count)) * SIDE + tilt[0] * x + tilt[1] * z
        return np.column_stack([x, y, z])

    points = wall(16_000, noise, 1.5)
    viewers = cameras_at(np.array([[-1.0, -5.0, 0.2], [1.0, -5.0, 0.2]]))
    made = fit_billboards(octree_leaves(points, SIDE, 12), points, viewers)
    assert shown(made, wall(2000, 0.0, 1.2), 0.12 * SIDE).all()


def test_one_plane_is_not_shown_twice() -> None:
    # Stereo noise puts points of one wall into two layers of voxels.
    rng = np.random.default_rng(1)
    x, z = rng.uniform(-1.5, 1.5, (2, 20_000))
    points = np.column_stack([x, 0.1 * SIDE + rng.normal(0, 0.05 * SIDE, len(x)), z])
    leaves = octree_leaves(points, SIDE, 12)
    assert (leaves.middle[:, 1] < 0).any()
    made = fit_billboards(leaves, points, cameras_at(np.array([[0.0, -5.0, 0.1]])))
    assert (made.voxel[:, 1] > 0).all()
    assert shown(made, np.column_stack([x, np.full(len(x), 0.1 * SIDE), z]), 0.03).all()


# ---- axes ------------------------------------------------------------------------------------


@given(centre=st.tuples(*[st.floats(-9, 9)] * 3), way=directions, away=st.floats(0.2, 50))
def test_axes_face_the_eye(
    centre: tuple[float, float, float], way: tuple[float, float, float], away: float
) -> None:
    if np.hypot(way[0], way[1]) < 1e-3:
        return  # straight above it nothing is level and to the right
    unit = np.array(way) / np.linalg.norm(way)
    row, column = axes_facing(np.array(centre), np.array(centre) + away * unit)
    axes = np.stack([row, column, unit])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(np.cross(row, column), unit, atol=1e-9)
    assert row[2] == 0
    assert column[2] > 0


def test_axes_of_many() -> None:
    rng = np.random.default_rng(0)
    centres, eye = rng.normal(size=(5, 3)), np.array([3.0, 4.0, 1.0])
    row, column = axes_facing(centres, eye)
    for number, centre in enumerate(centres):
        one = axes_facing(centre, eye)
        np.testing.assert_allclose(row[number], one[0])
        np.testing.assert_allclose(column[number], one[1])


@given(way=directions)
def test_plane_axes_are_level_and_to_the_right(way: tuple[float, float, float]) -> None:
    normal = np.array(way) / np.linalg.norm(way)
    row, column = (axis[0] for axis in plane_axes(normal[None]))
    axes = np.stack([row, column, normal])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(np.cross(row, column), normal, atol=1e-9)
    if abs(normal[2]) < 0.79:
        assert row[2] == pytest.approx(0.0, abs=1e-12)
        assert column[2] > 0
    elif abs(normal[2]) > 0.81:
        assert column[0] > 0


# ---- fans ------------------------------------------------------------------------------------


def fans_hold(made: Billboards, spots: Points) -> bool:
    places_in_fan = fan_position(spots[None] - made.voxel[:, None], made.fan[:, None])
    return bool(((places_in_fan >= -0.5) & (places_in_fan <= DIRECTIONS - 0.5)).all())


@settings(deadline=None, max_examples=40)
@given(
    middle=st.floats(-180, 180),
    span=st.floats(0, 89),
    seed=st.integers(0, 1000),
    turning=st.booleans(),
)
def test_fans_hold_cameras_of_a_right_angle_however_near(
    middle: float, span: float, seed: int, turning: bool
) -> None:
    rng = np.random.default_rng(seed)
    angles = np.radians(middle + rng.uniform(-span / 2, span / 2, 6))
    away = rng.uniform(4, 30, 6)
    spots = np.column_stack([away * np.cos(angles), away * np.sin(angles), rng.uniform(0, 1, 6)])
    points = np.random.default_rng(0).uniform(-0.2, 0.2, (40, 3)) * [1, 0.01, 1]
    leaves = octree_leaves(points + 0.21, SIDE, 5)
    aim = leaves.middle[0]
    made = fit_billboards(leaves, points + 0.21, cameras_at(spots + aim, aim), all_turn=turning)
    assert made.fan.min() >= 0
    assert made.fan.max() < CIRCLE
    assert fans_hold(made, spots + aim)


@pytest.mark.parametrize("middle", [0.0, 77.0, -123.0, 180.0])
@pytest.mark.parametrize("span", [120.0, 176.0])
def test_fans_hold_half_a_circle_of_cameras_at_one_distance(middle: float, span: float) -> None:
    angles = np.radians(middle + np.linspace(-span / 2, span / 2, 9))
    spots = np.column_stack([9 * np.cos(angles), 9 * np.sin(angles), np.full(9, 0.5)])
    points = np.full((10, 3), 0.1)
    leaves = octree_leaves(points, SIDE, 5)
    aim = leaves.middle[0]
    made = fit_billboards(leaves, points, cameras_at(spots + aim, aim), all_turn=True)
    assert fans_hold(made, spots + aim)


def test_fans_count_only_cameras_that_have_it_in_their_picture() -> None:
    points = np.full((10, 3), 0.1)
    leaves = octree_leaves(points, SIDE, 5)
    spots = np.array([[0.0, -6.0, 0.5], [0.0, 4.0, 0.5], [1.0, 4.0, 0.5]])
    # Two of the three look away from it.
    there = cameras_at(spots)
    there.to_world[1:, :3, 0] *= -1
    there.to_world[1:, :3, 2] *= -1
    made = fit_billboards(leaves, points, there, all_turn=True)
    place = fan_position(spots[0] - made.voxel, made.fan)
    np.testing.assert_allclose(place, (DIRECTIONS - 1) / 2, atol=0.51)
