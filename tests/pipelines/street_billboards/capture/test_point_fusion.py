"""Points of a street against its true surfaces; what wrong calibrations leave."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.street_billboards.capture.point_fusion import (
    Points,
    RgbdViews,
    consistent_points,
    fuse_points,
    photometric_agreement,
)
from pipelines.street_billboards.capture.stereo import depth_maps
from tests.pipelines.street_billboards.stereo_street import (
    distances_to_street,
    frame_at,
    turned,
)

Array = NDArray[np.float64]
PLACES = (0.0, 3.0, 6.0)


def _views(
    intrinsics: Callable[[Array], Array] = lambda k: k,
    poses: Callable[[Array, int], Array] = lambda pose, number: pose,
) -> list[RgbdViews]:
    """Three frames as seen with other intrinsics and poses than the true ones."""
    views = []
    for number, place in enumerate(PLACES):
        frame = frame_at(place)
        lens, pose = intrinsics(frame.intrinsics), poses(frame.poses, number)
        maps = depth_maps(frame.photographs, lens, pose)
        views.append(RgbdViews(maps.depth, maps.deviation, frame.photographs, lens, pose))
    return views


def _together(*views: RgbdViews) -> RgbdViews:
    return RgbdViews(*(np.concatenate(columns) for columns in zip(*views, strict=True)))


def _first(views: RgbdViews) -> RgbdViews:
    return RgbdViews._make(column[:1] for column in views)


def _agreement(views: list[RgbdViews]) -> float:
    return photometric_agreement(views[1], _together(views[0], views[2]))


@pytest.fixture(scope="module")
def views() -> list[RgbdViews]:
    return _views()


@pytest.fixture(scope="module")
def points(views: list[RgbdViews]) -> Points:
    return consistent_points(views[1], _together(views[0], views[2]))


def test_points_lie_on_the_street(views: list[RgbdViews], points: Points) -> None:
    ahead = points.positions[:, 1] - PLACES[1]
    away = distances_to_street(points.positions)
    assert len(away) > 50_000
    assert (away[ahead <= 12] < 0.05).mean() > 0.93
    assert np.median(away) < 0.01
    # Most of what does not is not confirmed.
    taken = np.isfinite(views[1].depth) & (views[1].depth < 25)
    assert len(away) < taken.sum()


def test_asking_more_neighbours_to_agree_leaves_fewer_and_better(views: list[RgbdViews]) -> None:
    beside = _together(views[0], views[2])
    loose, strict = (
        consistent_points(views[1], beside, least_support=n, farthest=12.0) for n in (1, 4)
    )
    assert 0 < len(strict.weight) < len(loose.weight)
    shares = [(distances_to_street(p.positions) < 0.1).mean() for p in (loose, strict)]
    assert shares[1] > shares[0]


def test_points_have_their_pixels_colours_and_step_thins_them(views: list[RgbdViews]) -> None:
    beside = _together(views[0], views[2])
    few = consistent_points(views[1], beside, step=8, farthest=9.0)
    many = consistent_points(views[1], beside, step=4, farthest=9.0)
    assert len(few.weight) == pytest.approx(len(many.weight) / 4, rel=0.15)
    colours = {tuple(row) for row in views[1].photographs[:, ::8, ::8].reshape(-1, 3)}
    assert {tuple(row) for row in few.colours} <= colours
    assert few.positions.dtype == np.float64
    assert few.normals.dtype == few.weight.dtype == np.float32


def test_normals_look_at_the_cameras(points: Points) -> None:
    known = np.linalg.norm(points.normals, axis=1) > 0
    assert known.mean() > 0.8
    np.testing.assert_allclose(np.linalg.norm(points.normals[known], axis=1), 1, atol=1e-4)
    road = known & (points.positions[:, 2] < 0.05) & (points.positions[:, 1] < 12)
    assert (points.normals[road, 2] > 0.95).mean() > 0.9
    wall = known & (points.positions[:, 0] < -6.95) & (points.positions[:, 1] < 20)
    # Seen at a grazing angle, a step of a pixel is decimetres of wall.
    assert (points.normals[wall, 0] > 0.9).mean() > 0.6


def test_the_frames_own_views_confirm_nothing(views: list[RgbdViews]) -> None:
    assert len(consistent_points(views[1], views[1]).weight) == 0
    assert photometric_agreement(views[1], views[1]) == 0.0
    with_own = consistent_points(views[1], _together(*views), step=4)
    without = consistent_points(views[1], _together(views[0], views[2]), step=4)
    np.testing.assert_array_equal(with_own.positions, without.positions)


def test_what_others_look_through_goes(views: list[RgbdViews]) -> None:
    """A board in the air before one frame's cameras, which no other frame saw."""
    board = views[1].depth.copy()
    board[:, 60:100, 100:200] = 4.0
    frame = views[1]._replace(depth=board)
    found = consistent_points(frame, _together(views[0], views[2]), least_support=1)
    ahead = found.positions[:, 1] - PLACES[1]
    height = found.positions[:, 2]
    assert ((np.abs(ahead - 4.0) < 0.3) & (height > 1.5) & (height < 2.5)).sum() < 50


def test_sky_seen_behind_a_point_speaks_against_it() -> None:
    depth = np.full((2, 40, 60), 10, np.float32)
    lens = np.array([[50.0, 0, 29.5], [0, 50, 19.5], [0, 0, 1]])
    poses = np.tile(np.eye(4), (6, 1, 1))
    poses[:, 0, 3] = np.arange(6) * 0.5
    flat = RgbdViews(
        np.repeat(depth[:1], 6, axis=0),
        np.full((6, 40, 60), 0.05, np.float32),
        np.zeros((6, 40, 60, 3), np.uint8),
        np.tile(lens, (6, 1, 1)),
        poses,
    )
    frame = _first(flat)
    assert len(consistent_points(frame, flat).weight) > 1500
    flat.depth[3:] = np.inf
    assert len(consistent_points(frame, flat).weight) < 400  # those that 3 to 5 do not see


def test_points_move_to_the_mean_of_what_is_measured() -> None:
    lens = np.array([[50.0, 0, 29.5], [0, 50, 19.5], [0, 0, 1]])
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, 0, 3] = [0, 0.1, -0.1]
    depth = np.broadcast_to(np.array([10.0, 10.1, 10.2], np.float32)[:, None, None], (3, 40, 60))
    deviation = np.broadcast_to(np.array([0.2, 0.1, 0.1], np.float32)[:, None, None], (3, 40, 60))
    views = RgbdViews(
        depth, deviation, np.zeros((3, 40, 60, 3), np.uint8), np.tile(lens, (3, 1, 1)), poses
    )
    found = consistent_points(_first(views), views)
    mean = (10 / 0.04 + 10.1 / 0.01 + 10.2 / 0.01) / (1 / 0.04 + 2 / 0.01)
    np.testing.assert_allclose(found.positions[:, 2], mean, atol=1e-5)
    np.testing.assert_allclose(found.weight, 1 / (1 / 225 + 1e-4), rtol=1e-5)


# ---- agreement -------------------------------------------------------------------------------


def _scaled(factor: float) -> Callable[[Array], Array]:
    def changed(intrinsics: Array) -> Array:
        answer = intrinsics.copy()
        answer[:, :2, :2] *= factor
        return answer

    return changed


def _along(factor: float) -> Callable[[Array, int], Array]:
    def changed(poses: Array, number: int) -> Array:
        answer = poses.copy()
        answer[:, 1, 3] *= factor
        return answer

    return changed


def _drifting(*degrees: float) -> Callable[[Array, int], Array]:
    """The whole car turned, each frame by that much more than the one before."""

    def changed(poses: Array, number: int) -> Array:
        axes = frame_at(PLACES[0]).poses[0, :3, :3]
        turn = axes @ turned(*(number * np.array(degrees))) @ axes.T
        middle = poses[1, :3, 3]
        answer = poses.copy()
        answer[:, :3, :3] = turn @ poses[:, :3, :3]
        answer[:, :3, 3] = (poses[:, :3, 3] - middle) @ turn.T + middle
        return answer

    return changed


def test_right_calibrations_agree(views: list[RgbdViews]) -> None:
    assert _agreement(views) > 0.5


@pytest.mark.parametrize("factor", [1.15, 1 / 1.15, 1.1])
def test_a_wrong_focal_length_does_not(factor: float) -> None:
    assert _agreement(_views(intrinsics=_scaled(factor))) < 0.15


@pytest.mark.parametrize("factor", [1.3, -1.0])
def test_a_wrong_way_does_not(factor: float) -> None:
    assert _agreement(_views(poses=_along(factor))) < 0.15


@pytest.mark.parametrize("degrees", [(3, 0, 0), (0, 3, 0), (0, 0, 3)])
def test_wrong_rotations_do_not(degrees: tuple[float, float, float]) -> None:
    assert _agreement(_views(poses=_drifting(*degrees))) < 0.15


# ---- union -----------------------------------------------------------------------------------


def _plane(n: int, seed: int, *, y: float = 0.0) -> Points:
    positions = np.random.default_rng(seed).uniform([-2, y - 2, 0], [2, y + 2, 0.001], (n, 3))
    return Points(
        positions,
        np.full((n, 3), 100 + seed, np.uint8),
        np.tile(np.array([0, 0, 1], np.float32), (n, 1)),
        np.ones(n, np.float32),
    )


def test_the_union_has_one_point_a_cell_whatever_the_number_of_parts() -> None:
    once = fuse_points([_plane(40_000, 0)], cell=0.1)
    often = fuse_points((_plane(40_000, seed) for seed in range(8)), cell=0.1)
    assert len(once.weight) == len(often.weight) == 1596  # corners have too little company
    cells = np.floor(often.positions / 0.1).astype(int)
    assert len(np.unique(cells, axis=0)) == 1596
    assert often.weight.sum() == pytest.approx(8 * once.weight.sum(), rel=0.01)
    assert (np.abs(often.colours.astype(float) - 103.5) <= 1.5).all()
    np.testing.assert_allclose(often.normals, [[0, 0, 1]] * 1596, atol=1e-6)


def test_merging_early_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    parts = [_plane(5_000, seed) for seed in range(6)]
    late = fuse_points(parts)
    monkeypatch.setattr("pipelines.street_billboards.capture.point_fusion._PENDING", 1000)
    early = fuse_points(parts)
    np.testing.assert_allclose(early.positions, late.positions, atol=1e-12)
    np.testing.assert_array_equal(early.colours, late.colours)


def test_heavier_points_count_for_more() -> None:
    one, other = _plane(20_000, 0), _plane(20_000, 50)
    both = fuse_points([one, other._replace(weight=np.full(20_000, 99, np.float32))], cell=0.5)
    assert (np.abs(both.colours.astype(float) - 149.5) <= 1).all()


def test_points_that_stand_alone_go_and_edges_of_tiles_stay() -> None:
    road = _plane(60_000, 0, y=25.0)  # across the edge of a tile
    stray = _plane(5, 1)._replace(
        positions=np.array([[0, 0, 2], [1, 0, 3], [5, 5, 5], [1, 1, 1.5], [-1, 1, 2.0]], float)
    )
    found = fuse_points([road, stray], cell=0.1)
    assert len(found.weight) == 1596
    assert found.positions[:, 2].max() < 0.01


def test_nothing_makes_nothing() -> None:
    nothing = Points(
        np.zeros((0, 3)), np.zeros((0, 3), np.uint8), np.zeros((0, 3), np.float32),
        np.zeros(0, np.float32),
    )  # fmt: skip
    for parts in ([], [nothing]):
        assert len(fuse_points(parts).positions) == 0


def test_the_union_of_a_drive_lies_on_the_street(views: list[RgbdViews]) -> None:
    parts = [consistent_points(frame, _together(*views), farthest=12.0) for frame in views]
    found = fuse_points(parts)
    assert len(found.weight) < sum(len(part.weight) for part in parts)
    assert (distances_to_street(found.positions) < 0.05).mean() > 0.88
