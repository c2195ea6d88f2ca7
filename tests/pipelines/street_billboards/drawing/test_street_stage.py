"""Flights along a drive."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipelines.street_billboards.drawing.street_stage import flight_poses


def drive(count: int) -> NDArray[np.float64]:
    """Poses of a car that goes north and turns to the east."""
    poses = np.tile(np.eye(4), (count, 1, 1))
    for number in range(count):
        north = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
        turn = Rotation.from_euler("z", -3.0 * number, degrees=True).as_matrix()
        poses[number, :3, :3] = turn @ north
        poses[number, :3, 3] = [0.05 * number**2, 1.5 * number, 1.8]
    return poses


@pytest.mark.parametrize(("count", "frames"), [(2, 5), (8, 8), (8, 41), (30, 7)])
def test_a_flight_begins_and_ends_as_the_drive(count: int, frames: int) -> None:
    poses = drive(count)
    made = flight_poses(poses, frames, 1.4)
    assert made.shape == (frames, 4, 4)
    np.testing.assert_allclose(made[[0, -1]], poses[[0, -1]], atol=1e-9)
    product = made[:, :3, :3] @ made[:, :3, :3].transpose(0, 2, 1)
    np.testing.assert_allclose(product, np.tile(np.eye(3), (frames, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(made[:, 3], np.tile([0, 0, 0, 1.0], (frames, 1)))


def test_a_flight_without_swerving_passes_through_the_poses() -> None:
    poses = drive(6)
    np.testing.assert_allclose(flight_poses(poses, 26, 0.0)[::5], poses, atol=1e-9)


@pytest.mark.parametrize("swerve", [1.4, -0.6])
def test_a_flight_swerves_to_the_left_by_so_much(swerve: float) -> None:
    poses = drive(9)
    straight, made = flight_poses(poses, 33, 0.0), flight_poses(poses, 33, swerve)
    own = np.linalg.inv(straight) @ made
    np.testing.assert_allclose(own[:, 1:3, 3], 0.0, atol=1e-9)
    left = -own[:, 0, 3] / swerve
    assert left.max() == pytest.approx(1.0)
    assert left.argmax() == 16
    assert (left >= -1e-12).all()
    np.testing.assert_allclose(left, left[::-1], atol=1e-9)
