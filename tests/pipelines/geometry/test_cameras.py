"""Cameras: projection there and back, axes, moving aside."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipelines.geometry.cameras import moved_left, project_points, unproject_depth

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
    pixels, found = project_points(lens, pose, unproject_depth(lens, pose, depth))
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
    pixels, depth = project_points(lens, pose, points)
    np.testing.assert_allclose(depth, image[2], atol=1e-9)
    np.testing.assert_allclose(pixels, (image[:2] / image[2]).T, rtol=1e-7, atol=1e-7)


def test_axes_of_a_camera() -> None:
    # Looks north from the origin: east is to the right, up is up, which is to smaller rows.
    pose = np.eye(4)
    pose[:3, :3] = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
    lens = np.array([[10.0, 0, 5], [0, 10.0, 4], [0, 0, 1]])
    pixels, depth = project_points(lens, pose, np.array([[1.0, 10, 0], [0, 10, 1.0], [0, -3.0, 0]]))
    np.testing.assert_allclose(pixels[:2], [[6, 4], [5, 3]])
    np.testing.assert_allclose(depth, [10, 10, -3])


@pytest.mark.parametrize("offset", [0.0, 0.7, -2.0])
def test_moved_goes_along_the_row_axis(offset: float) -> None:
    pose = any_pose(np.random.default_rng(4))
    before = pose.copy()
    made = moved_left(pose, offset)
    np.testing.assert_array_equal(pose, before)
    np.testing.assert_array_equal(made[:3, :3], pose[:3, :3])
    # In the axes of the camera, left is -x.
    own = np.linalg.inv(pose) @ made
    np.testing.assert_allclose(own[:3, 3], [-offset, 0, 0], atol=1e-9)
