"""Points and exposures of a whole drive, loaded frame by frame, on a street of exact depth."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.street_billboards.capture.drive_agreement import (
    LEAST_AGREEMENT,
    frames_compared,
    neighbours_agreement,
)
from pipelines.street_billboards.capture.drive_depth import RigFrame
from pipelines.street_billboards.capture.drive_points import (
    Fusion,
    LoadedByFrame,
    drive_gains,
    drive_points,
)
from pipelines.street_billboards.capture.point_fusion import (
    RgbdViews,
    consistent_points,
    fuse_points,
    photometric_agreement,
)
from pipelines.street_billboards.capture.stereo import depth_maps
from tests.pipelines.street_billboards.stereo_street import distances_to_street, frame_at, turned

PLACES = (0.0, 3.0, 6.0)
EXPOSURES = (1.0, 1.15, 0.9)


def _views(place: float, exposure: tuple[float, ...] = (1.0, 1.0, 1.0)) -> RgbdViews:
    frame = frame_at(place, exposure=exposure)
    maps = depth_maps(frame.photographs, frame.intrinsics, frame.poses)
    return RgbdViews(maps.depth, maps.deviation, frame.photographs, frame.intrinsics, frame.poses)


class _Drive:
    """A drive that remembers what was loaded."""

    def __init__(self, views: list[RgbdViews]) -> None:
        self.views = views
        self.asked: list[slice] = []

    def load(self, taken: slice) -> RgbdViews:
        self.asked.append(taken)
        some = self.views[taken]
        return RgbdViews(*(np.concatenate(columns) for columns in zip(*some, strict=True)))

    @property
    def by_frame(self) -> LoadedByFrame:
        return LoadedByFrame(len(self.views), self.load)


@pytest.fixture(scope="module")
def views() -> list[RgbdViews]:
    return [_views(place) for place in PLACES]


def test_points_are_those_of_all_frames_fused(views: list[RgbdViews]) -> None:
    drive, told = _Drive(views), []
    fusion = Fusion(support=3, farthest=15.0, step=3, cell=0.1)
    found = drive_points(drive.by_frame, fusion, progress=told.append)
    around = drive.load(slice(0, 3))
    parts = [
        consistent_points(one, around, least_support=3, farthest=15.0, step=3) for one in views
    ]
    for one, other in zip(found.points, fuse_points(parts, 0.1), strict=True):
        np.testing.assert_array_equal(one, other)
    assert np.median(distances_to_street(found.points.positions)) < 0.02
    np.testing.assert_array_equal(
        found.agreement, [photometric_agreement(one, around) for one in views]
    )
    assert told == [0.0, 1 / 3, 2 / 3]


def test_of_a_long_drive_three_frames_on_each_side_are_asked_and_some_are_measured(
    views: list[RgbdViews],
) -> None:
    small = RgbdViews(*(values[:1] for values in views[0]))
    small = small._replace(
        depth=small.depth[:, ::4, ::4].copy(),
        deviation=small.deviation[:, ::4, ::4].copy(),
        photographs=small.photographs[:, ::4, ::4].copy(),
        intrinsics=small.intrinsics / np.array([4.0, 4.0, 1.0])[:, None],
    )
    shift = np.zeros((4, 4))
    shift[1, 3] = 0.01
    drive = _Drive([small._replace(poses=small.poses + k * shift) for k in range(20)])
    found = drive_points(drive.by_frame, Fusion(step=1, cell=0.3))
    assert drive.asked[::2] == [slice(k, k + 1) for k in range(20)]
    assert drive.asked[1::2] == [slice(max(k - 3, 0), k + 4) for k in range(20)]
    assert np.isfinite(found.agreement).sum() == 8
    assert np.isfinite(found.agreement[[0, -1]]).all()


def test_what_nothing_confirms_is_an_error(views: list[RgbdViews]) -> None:
    blind = [view._replace(depth=np.full_like(view.depth, np.nan)) for view in views]
    with pytest.raises(ValueError, match="no point is confirmed by other frames"):
        drive_points(_Drive(blind).by_frame)


def test_gains_are_the_exposures_of_each_camera(views: list[RgbdViews]) -> None:
    exposed = _Drive([_views(place, EXPOSURES) for place in PLACES[:2]])
    positions = drive_points(_Drive(views).by_frame).points.positions
    found = drive_gains(positions, exposed.by_frame, 3, farthest=20.0)
    assert found.shape == (2, 3, 3)
    relative = found / found.mean(axis=1, keepdims=True)
    expected = np.array(EXPOSURES) / np.mean(EXPOSURES)
    np.testing.assert_allclose(relative, np.tile(expected[:, None], (2, 1, 3)), atol=0.03)


def test_one_cameras_frames_agree_where_their_poses_are_right() -> None:
    frames = [
        RigFrame(frame.photographs[1:2], frame.intrinsics[1:2], frame.poses[1:2])
        for frame in (frame_at(1.5 * number) for number in range(frames_compared(1)))
    ]
    assert neighbours_agreement(frames) > 0.6
    swapped = [
        one._replace(poses=frames[other].poses)
        for one, other in zip(frames, (0, 3, 1, 4, 2), strict=True)
    ]
    assert neighbours_agreement(swapped) < LEAST_AGREEMENT
    shaken = []
    for number, frame in enumerate(frames):
        turn = np.eye(4)
        turn[:3, :3] = turned(0, 3.0 * (-1) ** number, 0)
        shaken.append(frame._replace(poses=frame.poses @ turn))
    assert neighbours_agreement(shaken) < LEAST_AGREEMENT


def test_frames_of_one_world_agree_and_of_another_do_not() -> None:
    frames = [
        RigFrame(frame.photographs, frame.intrinsics, frame.poses)
        for frame in (frame_at(place) for place in PLACES)
    ]
    assert neighbours_agreement(frames) > 0.4 > LEAST_AGREEMENT
    moved = frames[2].poses.copy()
    moved[:, 1, 3] -= 1.5
    away = frames[0].poses.copy()
    away[:, 1, 3] += 1.5
    wrong = [frames[0]._replace(poses=away), frames[1], frames[2]._replace(poses=moved)]
    assert neighbours_agreement(wrong) < LEAST_AGREEMENT
