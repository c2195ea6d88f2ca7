"""Depth of a drive's frames before the sky, on a street of exact depth."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from pipelines.street_billboards.capture import drive_depth
from pipelines.street_billboards.capture.drive_depth import (
    DriveDepth,
    DriveFrames,
    RigFrame,
    frames_beside,
    stand_in_a_row,
)
from pipelines.street_billboards.capture.plane_sweep import Photograph
from pipelines.street_billboards.capture.sky import SkyView, sky_map
from pipelines.street_billboards.capture.stereo import depth_maps
from tests.pipelines.street_billboards.stereo_street import frame_at, turned

REACH = {"nearest": 2.0, "farthest": 40.0}
SPACING = 1.0


def _frame(place: float = 0.0) -> RigFrame:
    frame = frame_at(place)
    return RigFrame(frame.photographs, frame.intrinsics, frame.poses)


def _alone(number: int) -> RigFrame:
    """The middle camera's photograph, every metre."""
    frame = _frame(number * SPACING)
    return RigFrame(*(values[1:2] for values in frame))


def _drive(frames: list[RigFrame], taken: list[int] | None = None) -> DriveFrames:
    numbers = np.arange(len(frames)) if taken is None else np.array(taken)
    return DriveFrames(frames.__getitem__, np.stack([one.poses for one in frames]), numbers)


# ---- a rig -----------------------------------------------------------------------------------


def test_the_sky_is_infinitely_far_and_the_rest_as_stereo_has_it() -> None:
    frame, truth = _frame(), frame_at(0.0).depth
    stereo = depth_maps(*frame, nearest=2.0, farthest=40.0)
    found = DriveDepth(_drive([frame]), **REACH).before_sky(0)
    sky = np.isinf(found.depth)
    assert sky[np.isnan(truth)].mean() > 0.5
    assert sky[np.isfinite(truth)].mean() < 0.02
    np.testing.assert_array_equal(found.depth[~sky], stereo.depth[~sky])
    np.testing.assert_array_equal(found.deviation, stereo.deviation)
    assert found.depth.dtype == np.float32


def test_the_drives_sky_is_of_half_a_dozen_frames() -> None:
    loaded: list[int] = []

    def load(frame: int) -> RigFrame:
        loaded.append(frame)
        return _frame()._replace(photographs=np.full((3, 200, 320, 3), frame, np.uint8))

    poses = np.stack([_frame().poses] * 130)
    DriveDepth(DriveFrames(load, poses, np.arange(100, 130)), **REACH).sky()
    assert loaded == [100, 105, 110, 115, 120, 125]
    loaded.clear()
    DriveDepth(DriveFrames(load, poses, np.array([4, 7])), **REACH).sky()
    assert loaded == [4, 7]


def test_the_drives_sky_is_the_map_of_these_frames() -> None:
    views, frames = [], [_frame(0.0), _frame(3.0)]
    for frame in frames:
        maps = depth_maps(*frame, nearest=2.0, farthest=40.0)
        columns = (frame.photographs, maps.depth, frame.intrinsics, frame.poses)
        views += [SkyView(*one) for one in zip(*columns, strict=True)]
    found = DriveDepth(_drive(frames), **REACH).sky()
    np.testing.assert_array_equal(found, sky_map(views))
    assert found[20].max() > 0.3


# ---- one camera ------------------------------------------------------------------------------


def test_one_camera_finds_depth_along_the_road() -> None:
    frames = [_alone(number) for number in range(7)]
    found = DriveDepth(_drive(frames), **REACH).before_sky(3)
    truth = frame_at(3 * SPACING).depth[1]
    depth, deviation = found.depth[0], found.deviation[0]
    near = truth < 20
    known = np.isfinite(depth)
    assert known[near].mean() > 0.6
    off = np.abs(depth - truth)[near & known]
    assert (off > 0.05 * truth[near & known]).mean() < 0.05
    assert 0.85 < (off < 2 * deviation[near & known]).mean() < 0.995
    assert np.isinf(depth[np.isnan(truth)]).mean() > 0.5
    assert np.isinf(depth[np.isfinite(truth)]).mean() < 0.02


def test_cameras_that_look_different_ways_have_their_depth_along_the_road() -> None:
    """Two cameras at one place, the second turned away: each has what it would have alone."""
    frames = [_alone(number) for number in range(5)]
    turn = np.eye(4)
    turn[:3, :3] = turned(0, 40, 0)
    pairs = [
        RigFrame(
            np.concatenate([one.photographs, one.photographs[:, :, ::-1]]),
            np.concatenate([one.intrinsics] * 2),
            np.concatenate([one.poses, one.poses @ turn]),
        )
        for one in frames
    ]
    assert not stand_in_a_row(pairs[0].poses)
    assert not stand_in_a_row(frames[0].poses)
    assert stand_in_a_row(_frame().poses)
    found = DriveDepth(_drive(pairs), **REACH).maps(2)
    alone = DriveDepth(_drive(frames), **REACH).maps(2)
    assert found.depth.shape == (2, 200, 320)
    np.testing.assert_array_equal(found.depth[:1], alone.depth)


def test_what_drives_along_has_no_depth() -> None:
    """A box that overtakes: it is larger in each photograph before, and comes from behind."""
    still = [_alone(number) for number in range(7)]
    frames = [one._replace(photographs=one.photographs.copy()) for one in still]
    lens, depth = frames[0].intrinsics[0], [5.0 + 1.3 * number for number in range(7)]
    texture = np.random.default_rng(5).integers(0, 255, (40, 60, 3), np.uint8)
    boxes = []
    for frame, away in zip(frames, depth, strict=True):
        focal, middle = lens[0, 0], lens[:2, 2]
        wide, high = int(1.8 * focal / away), int(1.4 * focal / away)
        left, top = (int(middle[0] - 3.4 * focal / away), int(middle[1] + 0.6 * focal / away))
        rows = np.arange(high) * 40 // high
        columns = np.arange(wide) * 60 // wide
        box = np.s_[top : top + high, left : left + wide]
        frame.photographs[0][box] = texture[rows[:, None], columns]
        boxes.append(box)
    found = DriveDepth(_drive(frames), **REACH).maps(3)
    assert np.isfinite(found.depth[0][boxes[3]]).mean() < 0.1
    without = DriveDepth(_drive(still), **REACH).maps(3)
    assert np.isfinite(without.depth[0][boxes[3]]).mean() > 0.5


def test_frames_held_out_are_not_looked_at_and_have_depth_all_the_same() -> None:
    frames, asked = [_alone(number) for number in range(7)], []

    def load(number: int) -> RigFrame:
        asked.append(number)
        return frames[number]

    poses = np.stack([frame.poses for frame in frames])
    depth = DriveDepth(DriveFrames(load, poses, np.array([0, 1, 2, 4, 5, 6])), **REACH)
    depth.maps(2)
    assert 3 not in asked
    assert np.isfinite(depth.maps(3).depth).mean() > 0.4


def test_each_photograph_is_swept_once_whoever_asks_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    swept, lock, right = [], threading.Lock(), drive_depth.sweep_depth

    def counted(photograph: Photograph, *others: object, **reach: float) -> object:
        with lock:
            swept.append(float(photograph.pose[1, 3]))
        return right(photograph, *others, **reach)  # type: ignore[arg-type]

    monkeypatch.setattr(drive_depth, "sweep_depth", counted)
    frames = [_alone(number) for number in range(7)]
    depth = DriveDepth(_drive(frames), **REACH)
    with ThreadPoolExecutor(4) as threads:
        together = list(threads.map(depth.maps, range(7)))
    assert sorted(swept) == [float(frame.poses[0, 1, 3]) for frame in frames]
    again = DriveDepth(_drive(frames), **REACH).maps(4)
    np.testing.assert_array_equal(together[4].depth, again.depth)


def test_what_is_kept_of_a_long_drive_does_not_grow() -> None:
    small = RigFrame(np.zeros((1, 16, 24, 3), np.uint8), np.eye(3)[None] * 20.0, np.eye(4)[None])
    poses = np.tile(np.eye(4), (90, 1, 1, 1))
    poses[:, 0, 2, 3] = np.arange(90)
    depth = DriveDepth(
        DriveFrames(lambda n: small._replace(poses=poses[n]), poses, np.arange(90)), **REACH
    )
    kept = []
    for frame in range(90):
        depth.maps(frame)
        kept.append(len(depth._loaded._kept) + len(depth._swept._kept))
    assert max(kept) == kept[30] == kept[-1] < 40


def test_frames_beside_leave_out_what_hardly_moved() -> None:
    places = np.zeros((12, 3))
    places[:, 0] = [0, 1, 1.1, 1.2, 1.3, 2, 3, 4, 5, 6, 7, 8]
    taken = np.delete(np.arange(12), 7)  # held out
    assert frames_beside(places, taken, 5, 0.5) == [0, 4, 6, 8, 9, 10]
    assert frames_beside(places, taken, 0, 0.5) == [1, 5, 6, 8, 9, 10]
    with pytest.raises(ValueError, match=r"frame 0: no other frame was taken 9 m from it"):
        frames_beside(places, taken, 0, 9.0)
