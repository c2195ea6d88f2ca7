"""Worlds read from points that photographs share: made up ones, so that all is known exactly."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.geometry.cameras import moved_left, project_points
from pipelines.street_billboards.poses.road_plane import find_road, sweep_road
from pipelines.street_billboards.poses.sight_stars import (
    Star,
    confirmed_share,
    find_stars,
    mean_residual,
    sights,
)
from pipelines.street_billboards.poses.worlds import (
    along_the_way,
    check_rigid,
    read_world,
    right_world,
    windows,
)
from tests.pipelines.street_billboards.stereo_street import frame_at

FloatArray = NDArray[np.float64]
FRAMES = 10
SIZE = (640, 400)
LENS = np.array([[417.0, 0, 319.5], [0, 417, 199.5], [0, 0, 1]])
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])


def _poses(cameras: int = 2) -> FloatArray:
    """A bend to the left at 1.7 m above the road."""
    made = []
    for number in range(FRAMES):
        heading = 0.02 * number
        s, c = np.sin(heading), np.cos(heading)
        place = [2.0 * number, 0.02 * number**2, 1.7]
        pose = np.eye(4)
        pose[:3, :3] = np.array([[s, 0, c], [-c, 0, s], [0, -1, 0]])
        pose[:3, 3] = place
        made.append([moved_left(pose, 0.4 - 0.8 * camera) for camera in range(cameras)])
    return np.array(made)


def _stars(poses: FloatArray, noise: float = 0.2) -> list[Star]:
    """Points of a road and two walls, seen with noise of so many pixels."""
    random = np.random.default_rng(3)
    n = 1500
    along = random.uniform(0, 45, n)
    aside = random.uniform(-6, 6, n)
    high = np.where(np.abs(aside) > 4, random.uniform(0, 6, n), 0.0)
    points = np.stack([along, np.where(np.abs(aside) > 4, 6 * np.sign(aside), aside), high], axis=1)
    lenses = [LENS] * poses.shape[1]
    shown = {}
    for place in np.ndindex(poses.shape[:2]):
        pixels, depth = project_points(lenses[place[1]], poses[place], points)
        seen = (depth > 1.5) & (pixels > 0).all(axis=1) & (pixels < SIZE).all(axis=1)
        shown[place] = np.where(
            seen[:, None], pixels + noise * random.standard_normal(pixels.shape), np.nan
        )
    stars = []
    for window in windows(FRAMES):
        every = [(frame, camera) for frame in window for camera in range(poses.shape[1])]
        for camera in range(poses.shape[1]):
            own = (window[0], camera)
            others = tuple(one for one in every if one != own)
            seen = np.stack([shown[one] for one in others], axis=1)
            kept = np.isfinite(shown[own][:, 0]) & (np.isfinite(seen[..., 0]).sum(axis=1) > 1)
            kept[np.flatnonzero(kept)[300:]] = False
            stars.append(Star(own, others, shown[own][kept], seen[kept]))
    return stars


def _relative(poses: FloatArray) -> FloatArray:
    found: FloatArray = np.linalg.inv(poses[0, 0]) @ poses
    return found


def _mirrored(poses: FloatArray, axis: int) -> FloatArray:
    flip = np.eye(4)
    flip[axis, axis] = -1
    made: FloatArray = flip @ poses @ flip
    return made


def _rolling(poses: FloatArray) -> FloatArray:
    """With cameras that lean more and more."""
    made = poses.copy()
    for number, frame in enumerate(made):
        s, c = np.sin(0.02 * number), np.cos(0.02 * number)
        frame[:] = frame @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    return made


def _scaled(poses: FloatArray, factor: float) -> FloatArray:
    made = poses.copy()
    made[..., :3, 3] *= factor
    return made


LENSES = np.stack([LENS, LENS])
TURNED = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""From z up to y up."""


def test_right_poses_leave_the_noise_and_wrong_ones_do_not() -> None:
    poses = _poses()
    stars = _stars(poses)
    right = [sights(star, poses, LENSES) for star in stars]
    wrong = [sights(star, poses @ OPENGL, LENSES) for star in stars]
    assert confirmed_share(right) > 0.98
    assert mean_residual(right) < 0.4
    assert confirmed_share(wrong) < 0.3
    depth = 1 / right[0].inverse_depth
    pixels, _ = project_points(LENS, poses[stars[0].view], np.zeros((1, 3)))
    assert pixels.shape == (1, 2)
    assert (depth > 0).mean() > 0.98


def test_a_right_world_stays_as_it_is() -> None:
    poses = _poses()
    world = read_world(_stars(poses), poses, LENSES, camera_height=1.5)
    np.testing.assert_array_equal(world.poses, poses)
    np.testing.assert_array_equal(world.intrinsics, LENSES)
    assert world.notes == ()


@pytest.mark.parametrize(
    ("given", "note"),
    [
        (lambda poses: poses @ OPENGL, "OpenGL"),
        (lambda poses: np.linalg.inv(poses), "from the world to the camera"),
        (lambda poses: poses[::-1].copy(), "reverse order"),
        # A drive in a plane, mirrored, is the one that is seen from below.
        (lambda poses: _mirrored(poses, 0), "it is turned"),
        (lambda poses: _mirrored(poses, 1), "it is turned"),
        (lambda poses: _mirrored(poses, 0), "mirrored"),
        (lambda poses: TURNED @ poses, "up is y, not z"),
        (lambda poses: OPENGL @ poses, "up is -z, not z"),
        (lambda poses: TURNED @ poses @ OPENGL, "OpenGL"),
        (lambda poses: _scaled(poses, 1000.0), "millimetres"),
        (lambda poses: _scaled(poses, 100.0), "centimetres"),
        (lambda poses: _scaled(poses, 0.2), "camera_height"),
    ],
)
def test_what_is_given_otherwise_is_mended_and_said(given, note) -> None:  # type: ignore[no-untyped-def]
    poses = _poses()
    poses = _rolling(poses) if note == "mirrored" else poses
    world = read_world(_stars(poses), given(poses), LENSES, camera_height=1.7)
    assert note in " ".join(world.notes)
    np.testing.assert_allclose(_relative(world.poses), _relative(poses), atol=0.05)
    # z is up: the same in each camera's axes.
    np.testing.assert_allclose(world.poses[0, 0, 2, :3], poses[0, 0, 2, :3], atol=0.02)
    assert np.linalg.det(world.poses[0, 0, :3, :3]) == pytest.approx(1.0)


@pytest.mark.parametrize("factor", [0.9, 0.95, 1.05, 1.1])
def test_a_wrong_focal_length_is_told(factor: float) -> None:
    poses = _poses()
    lenses = LENSES.copy()
    lenses[:, (0, 1), (0, 1)] *= factor
    world = read_world(_stars(poses), poses, lenses, camera_height=1.7)
    assert world.intrinsics[0, 0, 0] == pytest.approx(417.0, rel=0.015)
    assert "focal length" in world.notes[0]


def test_a_focal_length_that_a_straight_road_does_not_tell_is_left_and_said() -> None:
    poses = _poses(1)
    poses[:, 0, 1, 3] = 0.0
    poses[:, 0, :3, :3] = poses[0, 0, :3, :3]
    lenses = LENSES[:1].copy()
    lenses[:, (0, 1), (0, 1)] *= 1.1
    world = read_world(_stars(poses), poses, lenses, camera_height=1.7)
    np.testing.assert_array_equal(world.intrinsics, lenses)
    assert "cannot be told" in world.notes[0]


def test_frames_out_of_order_are_put_in_order_of_their_way() -> None:
    places = _poses(1)[:, 0, :3, 3]
    shuffled = np.random.default_rng(0).permutation(FRAMES)
    order = along_the_way(places[shuffled])
    found = shuffled[order]
    assert found.tolist() in (list(range(FRAMES)), list(range(FRAMES))[::-1])
    np.testing.assert_array_equal(along_the_way(places), np.arange(FRAMES))


def test_poses_of_other_photographs_are_refused() -> None:
    poses = _poses()
    stars = _stars(poses[np.random.default_rng(1).permutation(FRAMES)])
    with pytest.raises(ValueError, match=r"confirm \d+%; expected 55% at least: .*another order"):
        read_world(stars, poses, LENSES, camera_height=1.5)


def test_poses_that_are_off_are_refused_for_that() -> None:
    poses = _poses()
    random = np.random.default_rng(2)
    rough = poses.copy()
    rough[..., :3, 3] += 0.03 * random.standard_normal(rough[..., :3, 3].shape)
    s = 0.012 * random.standard_normal(rough.shape[:2])
    for place in np.ndindex(rough.shape[:2]):
        c, d = np.cos(s[place]), np.sin(s[place])
        rough[place][:3, :3] = np.array([[c, -d, 0], [d, c, 0], [0, 0, 1]]) @ rough[place][:3, :3]
    with pytest.raises(ValueError, match="off by some pixels"):
        read_world(_stars(poses), rough, LENSES, camera_height=1.5)


def test_poses_that_are_none_are_refused() -> None:
    poses = _poses()
    poses[2, 0, 0, 3] = np.nan
    with pytest.raises(ValueError, match="1 poses are missing"):
        check_rigid(poses)
    with pytest.raises(ValueError, match="no rotations"):
        check_rigid(_poses() * np.array([1.3, 1, 1, 1])[:, None])


def test_the_road_is_below_the_cameras() -> None:
    poses = _poses()
    road = find_road(_stars(poses), poses, LENSES)
    assert road is not None
    assert road.height == pytest.approx(1.7, rel=0.03)
    assert road.up[2] > 0.999


def test_photographs_of_a_street_tell_as_much() -> None:
    """Rendered ones: features are found and matched, and OpenGL's axes are seen.

    Its walls repeat every three metres, which no whole number of frames comes.
    """
    frames = [frame_at(1.1 * number) for number in range(5)]
    poses = np.stack([frame.poses for frame in frames])
    world = right_world(
        lambda frame: frames[frame].photographs, poses @ OPENGL, frames[0].intrinsics
    )
    np.testing.assert_allclose(world.poses, poses, atol=1e-9)
    road = sweep_road(lambda frame: frames[frame].photographs, poses, frames[0].intrinsics)
    assert road is not None
    assert road.height == pytest.approx(2.0, rel=0.05)
    assert road.up[2] > 0.999
    blank = np.full_like(frames[0].photographs, 90)
    with pytest.raises(ValueError, match="share too few features"):
        right_world(lambda frame: blank, poses, frames[0].intrinsics)
    stars = find_stars(lambda frame: frames[frame].photographs, windows(5))
    assert {star.view[1] for star in stars} == {0, 1, 2}
