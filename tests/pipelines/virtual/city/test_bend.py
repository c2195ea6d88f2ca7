"""The bend in the street: an arc of the right length and turn, there and back again."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.virtual.city.bend import (
    STRAIGHT,
    Bend,
    bent_points,
    bent_poses,
    headings,
    road_bend,
    straightened_points,
    turned_vectors,
)
from pipelines.virtual.city.drive import plan_drive

BEND = road_bend(80.0, 40.0)
BOTH = pytest.mark.parametrize("degrees", [40.0, -40.0])


@BOTH
def test_the_roads_middle_keeps_its_length_and_turns(degrees: float) -> None:
    bend = road_bend(80.0, degrees)
    along = np.linspace(-10, 120, 5000)
    middle = bent_points(np.column_stack([along, 0 * along, 0 * along]), bend)
    step = np.diff(middle, axis=0)
    np.testing.assert_allclose(np.linalg.norm(step, axis=1), along[1] - along[0], rtol=1e-4)
    way = np.degrees(np.arctan2(step[:, 1], step[:, 0]))
    assert way[0] == pytest.approx(0, abs=1e-6)
    assert way[-1] == pytest.approx(degrees, abs=1e-6)
    np.testing.assert_allclose(
        way, np.degrees(headings((along[1:] + along[:-1]) / 2, bend)), atol=0.02
    )
    np.testing.assert_array_equal(middle[along < 20, 1], 0)


@BOTH
def test_places_beside_the_road_come_back(degrees: float) -> None:
    bend = road_bend(80.0, degrees)
    places = np.random.default_rng(0).uniform([-10, -17, 0], [120, 17, 10], (2000, 3))
    np.testing.assert_allclose(
        straightened_points(bent_points(places, bend), bend), places, atol=1e-9
    )


def test_what_is_at_right_angles_stays_so() -> None:
    along = np.linspace(0, 80, 50)
    left = turned_vectors(np.tile([0.0, 1, 0], (50, 1)), along, BEND)
    ahead = turned_vectors(np.tile([1.0, 0, 0], (50, 1)), along, BEND)
    np.testing.assert_allclose(np.einsum("ni,ni->n", left, ahead), 0, atol=1e-12)
    beside = bent_points(np.column_stack([along, np.full(50, 3.0), np.zeros(50)]), BEND)
    middle = bent_points(np.column_stack([along, np.zeros(50), np.zeros(50)]), BEND)
    np.testing.assert_allclose(beside - middle, 3 * left, atol=1e-12)


def test_a_straight_road_is_left_as_it_is() -> None:
    places = np.random.default_rng(1).normal(size=(20, 3))
    np.testing.assert_array_equal(bent_points(places, STRAIGHT), places)
    np.testing.assert_array_equal(straightened_points(places, STRAIGHT), places)


def test_the_drive_follows_the_bend() -> None:
    straight = plan_drive(41, 2.0, 64, 40)
    drive = plan_drive(41, 2.0, 64, 40, bend=BEND)
    np.testing.assert_allclose(drive.poses[:, 1], bent_poses(straight.poses[:, 1], BEND))
    np.testing.assert_array_equal(drive.gains, straight.gains)
    turns = drive.poses[..., :3, :3]
    np.testing.assert_allclose(
        turns @ turns.swapaxes(-1, -2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-12
    )
    apart = np.linalg.norm(drive.poses[:, 0, :3, 3] - drive.poses[:, 2, :3, 3], axis=1)
    np.testing.assert_allclose(apart, 1.6)
    turned = np.degrees(np.arccos(drive.poses[-1, 1, 0, 2] * 1.0))
    assert turned == pytest.approx(40, abs=2)
    step = drive.poses[2:, 1, :3, 3] - drive.poses[:-2, 1, :3, 3]
    step /= np.linalg.norm(step, axis=1, keepdims=True)
    assert (np.einsum("fi,fi->f", step, drive.poses[1:-1, 1, :3, 2]) > 0.9995).all()


@pytest.mark.parametrize(("length", "degrees"), [(80.0, 50.0), (20.0, 40.0)])
def test_bends_that_are_too_narrow_are_refused(length: float, degrees: float) -> None:
    with pytest.raises(ValueError, match="radius of at least 25 m"):
        road_bend(length, degrees)
    assert isinstance(BEND, Bend)
