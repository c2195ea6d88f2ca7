"""Cameras, directions around billboards, poses along a drive, photographs taken anew."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import center_of_mass
from scipy.spatial.transform import Rotation

from pipelines.geometry.cameras import lateral, points_at, projected
from pipelines.street_billboards.capture.centred_pictures import centred, centred_intrinsics
from pipelines.street_billboards.drawing.frames import flight
from pipelines.street_billboards.textures.view_directions import (
    CIRCLE,
    DIRECTIONS,
    SPACING,
    fan_position,
)

WIDTH, HEIGHT = 12, 9


def any_lens(rng: np.random.Generator, width: int, height: int) -> NDArray[np.float64]:
    fx, fy = width * rng.uniform(0.6, 1.5, 2)
    cx, cy = width * rng.uniform(0.35, 0.65), height * rng.uniform(0.35, 0.65)
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


def any_pose(rng: np.random.Generator) -> NDArray[np.float64]:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    pose[:3, 3] = rng.uniform(-50, 50, 3)
    return pose


# ---- cameras ---------------------------------------------------------------------------------


@given(seed=st.integers(0, 10_000))
def test_points_of_a_depth_map_are_projected_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lens, pose = any_lens(rng, WIDTH, HEIGHT), any_pose(rng)
    depth = rng.uniform(0.5, 60, (HEIGHT, WIDTH))
    pixels, found = projected(lens, pose, points_at(lens, pose, depth))
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    np.testing.assert_allclose(pixels, np.stack([x, y], axis=-1), atol=1e-8)
    np.testing.assert_allclose(found, depth, rtol=1e-9)


@given(seed=st.integers(0, 10_000))
def test_projection_is_the_matrix_product(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lens, pose = any_lens(rng, WIDTH, HEIGHT), any_pose(rng)
    points = rng.uniform(-60, 60, (20, 3))
    homogeneous = np.column_stack([points, np.ones(20)])
    image = lens @ (np.linalg.inv(pose) @ homogeneous.T)[:3]
    pixels, depth = projected(lens, pose, points)
    np.testing.assert_allclose(depth, image[2], atol=1e-9)
    np.testing.assert_allclose(pixels, (image[:2] / image[2]).T, rtol=1e-7, atol=1e-7)


def test_axes_of_a_camera() -> None:
    # Looks north from the origin: east is to the right, up is up, which is to smaller rows.
    pose = np.eye(4)
    pose[:3, :3] = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
    lens = np.array([[10.0, 0, 5], [0, 10.0, 4], [0, 0, 1]])
    pixels, depth = projected(lens, pose, np.array([[1.0, 10, 0], [0, 10, 1.0], [0, -3.0, 0]]))
    np.testing.assert_allclose(pixels[:2], [[6, 4], [5, 3]])
    np.testing.assert_allclose(depth, [10, 10, -3])


# ---- directions ------------------------------------------------------------------------------


@given(
    first=st.integers(0, CIRCLE - 1),
    place=st.floats(-14.49, 45.49),
    away=st.floats(0.1, 100),
    height=st.floats(-5, 5),
)
def test_fan_positions_of_known_azimuths(
    first: int, place: float, away: float, height: float
) -> None:
    angle = np.radians((first + place) * SPACING)
    offset = np.array([away * np.cos(angle), away * np.sin(angle), height])
    assert fan_position(offset, first) == pytest.approx(place, abs=1e-6)
    assert fan_position(offset[:2], first) == pytest.approx(place, abs=1e-6)


@given(seed=st.integers(0, 1000))
def test_what_is_outside_is_put_on_its_nearer_side(seed: int) -> None:
    rng = np.random.default_rng(seed)
    first = rng.integers(0, CIRCLE, 50)
    found = fan_position(rng.normal(size=(50, 3)), first)
    assert ((found >= -14.5) & (found <= 45.5)).all()
    before, behind = np.maximum(-found, 0), np.maximum(found - (DIRECTIONS - 1), 0)
    # The gap of the circle is 29 steps wide: nobody is farther than half of it from the fan.
    assert np.maximum(before, behind).max() <= 14.5


# ---- poses along a drive ---------------------------------------------------------------------


def drive(count: int) -> NDArray[np.float64]:
    """Poses of a car that goes north and turns to the east."""
    poses = np.tile(np.eye(4), (count, 1, 1))
    for number in range(count):
        north = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
        turn = Rotation.from_euler("z", -3.0 * number, degrees=True).as_matrix()
        poses[number, :3, :3] = turn @ north
        poses[number, :3, 3] = [0.05 * number**2, 1.5 * number, 1.8]
    return poses


@pytest.mark.parametrize("offset", [0.0, 0.7, -2.0])
def test_moved_goes_along_the_row_axis(offset: float) -> None:
    pose = any_pose(np.random.default_rng(4))
    before = pose.copy()
    made = lateral(pose, offset)
    np.testing.assert_array_equal(pose, before)
    np.testing.assert_array_equal(made[:3, :3], pose[:3, :3])
    # In the axes of the camera, left is -x.
    own = np.linalg.inv(pose) @ made
    np.testing.assert_allclose(own[:3, 3], [-offset, 0, 0], atol=1e-9)


@pytest.mark.parametrize(("count", "frames"), [(2, 5), (8, 8), (8, 41), (30, 7)])
def test_a_flight_begins_and_ends_as_the_drive(count: int, frames: int) -> None:
    poses = drive(count)
    made = flight(poses, frames, 1.4)
    assert made.shape == (frames, 4, 4)
    np.testing.assert_allclose(made[[0, -1]], poses[[0, -1]], atol=1e-9)
    product = made[:, :3, :3] @ made[:, :3, :3].transpose(0, 2, 1)
    np.testing.assert_allclose(product, np.tile(np.eye(3), (frames, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(made[:, 3], np.tile([0, 0, 0, 1.0], (frames, 1)))


def test_a_flight_without_swerving_passes_through_the_poses() -> None:
    poses = drive(6)
    np.testing.assert_allclose(flight(poses, 26, 0.0)[::5], poses, atol=1e-9)


@pytest.mark.parametrize("swerve", [1.4, -0.6])
def test_a_flight_swerves_to_the_left_by_so_much(swerve: float) -> None:
    poses = drive(9)
    straight, made = flight(poses, 33, 0.0), flight(poses, 33, swerve)
    own = np.linalg.inv(straight) @ made
    np.testing.assert_allclose(own[:, 1:3, 3], 0.0, atol=1e-9)
    left = -own[:, 0, 3] / swerve
    assert left.max() == pytest.approx(1.0)
    assert left.argmax() == 16
    assert (left >= -1e-12).all()
    np.testing.assert_allclose(left, left[::-1], atol=1e-9)


# ---- photographs taken anew ------------------------------------------------------------------


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 10_000))
def test_the_widest_centred_photograph_lies_inside(seed: int) -> None:
    lens = any_lens(np.random.default_rng(seed), WIDTH, HEIGHT)
    wanted = centred_intrinsics(lens, WIDTH, HEIGHT)
    assert wanted[0, 0] == wanted[1, 1]
    np.testing.assert_allclose(wanted[:2, 2], [(WIDTH - 1) / 2, (HEIGHT - 1) / 2])
    corners = np.array([[x, y, 1.0] for x in (0, WIDTH - 1) for y in (0, HEIGHT - 1)]).T
    before = lens @ np.linalg.inv(wanted) @ corners
    x, y = before[0] / before[2], before[1] / before[2]
    slack = np.array([x.min(), WIDTH - 1 - x.max(), y.min(), HEIGHT - 1 - y.max()])
    assert slack.min() == pytest.approx(0.0, abs=1e-9)


def test_a_point_lands_where_the_new_lens_says() -> None:
    rng = np.random.default_rng(2)
    width, height = 90, 60
    lens = any_lens(rng, width, height)
    wanted = centred_intrinsics(lens, width, height)
    for pixel in [(30.0, 25.0), (60.3, 40.6)]:
        ray = np.linalg.inv(wanted) @ [*pixel, 1.0]
        before = lens @ ray
        y, x = np.mgrid[:height, :width]
        spot = np.exp(-((x - before[0]) ** 2 + (y - before[1]) ** 2) / (2 * 2.0**2))
        picture = np.rint(200 * spot)[..., None].repeat(3, axis=2).astype(np.uint8)
        made = centred(picture[None], lens[None])[0]
        row, column = center_of_mass(made[..., 0].astype(float))
        assert (column, row) == pytest.approx(pixel, abs=0.05)


def test_a_centred_photograph_stays_as_it_is() -> None:
    rng = np.random.default_rng(3)
    pictures = rng.integers(0, 256, (2, 40, 60, 3), dtype=np.uint8)
    lens = np.array([[50.0, 0, 29.5], [0, 50.0, 19.5], [0, 0, 1]])
    other = lens.copy()
    other[0, 2] += 3
    np.testing.assert_allclose(centred_intrinsics(lens, 60, 40), lens)
    made = centred(pictures, np.stack([lens, other]))
    np.testing.assert_array_equal(made[0], pictures[0])
    assert (made[1] != pictures[1]).any()
