"""Unit and up axis: planted roads, tracks and baselines."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipelines.street_billboards.poses.joined_pieces import Similarity
from pipelines.street_billboards.poses.scale import (
    by_baseline,
    by_road,
    by_track,
    east_north_up,
    road_below,
)

FloatArray = NDArray[np.float64]
HEIGHT = 1.7
WORLD = Similarity(0.37, Rotation.from_rotvec([0.4, -1.1, 2.0]).as_matrix(), np.array([5.0, -2, 9]))
"""What the found world is of the true one."""


def _drive(frames: int = 60, hill: float = 0.0) -> FloatArray:
    """Poses in metres, z up, 1.7 m above a road that bends and, with ``hill``, rises and falls."""
    s = np.arange(frames, dtype=float)
    heading = 0.6 * np.sin(s / 25)
    slope = hill * np.cos(s / 10)
    ahead = np.column_stack(
        [np.cos(heading) * np.cos(slope), np.sin(heading) * np.cos(slope), np.sin(slope)]
    )
    right = np.column_stack([np.sin(heading), -np.cos(heading), np.zeros(frames)])
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, :3, 0], poses[:, :3, 1], poses[:, :3, 2] = right, np.cross(ahead, right), ahead
    poses[1:, :3, 3] = np.cumsum(ahead, axis=0)[:-1]
    poses[:, :3, 3] -= HEIGHT * poses[:, :3, 1]
    return poses


def _points(poses: FloatArray, seed: int = 0) -> tuple[FloatArray, NDArray[np.int64]]:
    """A third on the road before each camera, a third on pavements and cars, a third anywhere."""
    random = np.random.default_rng(seed)
    nearest = random.integers(0, len(poses), 900)
    own = np.column_stack(
        [random.uniform(-2, 2, 900), np.full(900, HEIGHT), random.uniform(3, 15, 900)]
    )
    own[300:600, 0] = random.choice([-1, 1], 300) * random.uniform(2, 8, 300)
    own[300:600, 1] = HEIGHT - random.choice([0.15, 0.8], 300)
    own[600:, :2] = random.uniform(-6, 6, (300, 2))
    own[:, 1] += random.normal(scale=0.01, size=900)
    turn = poses[nearest, :3, :3]
    return poses[nearest, :3, 3] + np.einsum("nij,nj->ni", turn, own), nearest


@pytest.mark.parametrize("hill", [0.0, 0.05])
def test_the_road_below_gives_unit_and_up(hill: float) -> None:
    poses = _drive(hill=hill)
    points, nearest = _points(poses)
    found = WORLD.poses(poses)
    found[7] = np.nan  # a frame without a pose
    kept = nearest != 7
    road = road_below(found, WORLD.points(points[kept]), nearest[kept])
    assert road.height == pytest.approx(WORLD.scale * HEIGHT, rel=0.01)
    np.testing.assert_allclose(road.normal, [0, -1, 0], atol=0.01)
    assert road.deviation < 0.02
    into = by_road(found, road, HEIGHT)
    assert into.scale == pytest.approx(1 / WORLD.scale, rel=0.01)
    back = into.poses(found)
    down = np.nanmean(back[:, :3, 1], axis=0)
    assert down[2] / np.linalg.norm(down) < -0.999
    np.testing.assert_allclose(back[0, :3, 3], [0, 0, HEIGHT], atol=1e-9)
    assert back[0, 0, 2] > 0.99  # x ahead


def test_without_a_road_nothing_is_made_up() -> None:
    poses = _drive()
    random = np.random.default_rng(2)
    nearest = random.integers(0, 60, 300)
    above = poses[nearest, :3, 3] + random.uniform([-5, -5, 0.5], [5, 5, 9], (300, 3))
    with pytest.raises(ValueError, match="no road below"):
        road_below(poses, above, nearest)
    with pytest.raises(ValueError, match="no road below"):
        road_below(poses, *(values[:20] for values in _points(poses)))


def test_a_baseline_gives_the_unit() -> None:
    found = WORLD.poses(_drive())
    up = WORLD.turn @ [0, 0, 1.0]
    into = by_baseline(found, up, found=0.54 * WORLD.scale, given=0.54, height=HEIGHT)
    assert into.scale == pytest.approx(1 / WORLD.scale)
    np.testing.assert_allclose(into.turn @ up, [0, 0, 1], atol=1e-12)


def test_a_track_gives_unit_place_and_north() -> None:
    poses = _drive()
    found = WORLD.poses(poses)
    turn = Rotation.from_rotvec([0, 0, 2.3]).as_matrix()
    north = Similarity(1.0, turn, np.array([40, -7, 120.0]))
    track = north.points(poses[:, :3, 3])
    random = np.random.default_rng(0)
    track += random.normal(scale=0.3, size=track.shape)
    track[[10, 11, 12]] += [60, 0, 0]  # a receiver jumps
    track[30:40] = np.nan
    into, off = by_track(found, WORLD.turn @ [0, 0, 1.0], track)
    apart = into.points(found[:, :3, 3]) - north.points(poses[:, :3, 3])
    assert np.linalg.norm(apart[:, :2], axis=1).max() < 0.8
    assert np.abs(apart[:, 2]).max() < 0.3
    assert 0.05 < off < 0.5
    assert into.scale * WORLD.scale == pytest.approx(1, rel=0.02)


def test_a_track_that_says_nothing_is_refused() -> None:
    poses = _drive()
    up = np.array([0, 0, 1.0])
    nowhere = np.full((60, 3), np.nan)
    with pytest.raises(ValueError, match="found 0 places"):
        by_track(poses, up, nowhere)
    noise = np.random.default_rng(1).normal(scale=5, size=(60, 3))
    with pytest.raises(ValueError, match="expected a longer way"):
        by_track(poses, up, noise)


def test_metres_of_degrees_are_those_of_the_ellipsoid() -> None:
    """A minute of latitude at 45 degrees is 1852.2 m; of longitude cos(45) and a bit more."""
    minute = 1 / 60
    places = np.array([[45.0, 7.0, 100.0], [45 + minute, 7, 110], [45, 7 + minute, np.nan]])
    metres = east_north_up(places)
    np.testing.assert_allclose(metres[0], 0, atol=1e-9)
    assert metres[1, 1] == pytest.approx(1852.2, abs=0.3)
    assert metres[1, 2] == 10.0
    assert metres[2, 0] == pytest.approx(1314.2, abs=0.5)
    assert np.isnan(metres[2, 2])


def test_a_plane_that_the_way_leads_out_of_is_no_road() -> None:
    """More points lie on a slope that goes down ahead than on the road."""
    random = np.random.default_rng(5)
    frames = 20
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, 2, 3] = np.arange(frames)
    nearest = random.integers(0, frames, 2400)
    across, ahead = random.uniform(-2, 2, 2400), random.uniform(3, 20, 2400)
    is_road = np.arange(2400) < 600
    down = np.where(is_road, 1.5, 2.6 + 0.25 * ahead) + random.normal(0, 0.005, 2400)
    points = np.column_stack([across, down, ahead + nearest])
    heights = [road_below(poses, points, nearest, seed=seed).height for seed in range(4)]
    np.testing.assert_allclose(heights, 1.5, atol=0.03)
