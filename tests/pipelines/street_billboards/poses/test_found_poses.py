"""Poses and focal length of a film whose truth is known, from its pictures alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.street_billboards.poses import found_poses, joined_pieces
from pipelines.street_billboards.poses.found_poses import (
    FoundPoses,
    find_poses,
    focal_sentence,
    guessed_pinhole,
)
from pipelines.street_billboards.poses.joined_pieces import pose_similarity
from pipelines.street_billboards.poses.mapping import Pinhole
from pipelines.street_billboards.poses.scale import by_road, road_below
from tests.pipelines.street_billboards.poses.corridor import (
    HEIGHT,
    HEIGHT_ABOVE_ROAD,
    WIDTH,
    lens,
    photograph,
    swerving,
)

FRAMES = 16
TRUTH = swerving(FRAMES, 0.6)
FOCAL = float(lens()[0, 0])


@pytest.fixture(scope="module")
def film() -> list[NDArray[np.uint8]]:
    return [photograph(pose, lens()) for pose in TRUTH]


@pytest.fixture(scope="module")
def found(film: list[NDArray[np.uint8]]) -> FoundPoses:
    return find_poses(iter(film), guessed_pinhole(WIDTH, HEIGHT))


def _trajectory_error(poses: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    """Root mean square of places after a similarity, metres."""
    moved = pose_similarity(poses, truth).points(poses[:, :3, 3])
    return float(np.sqrt(((moved - truth[:, :3, 3]) ** 2).sum(axis=1).mean()))


def test_every_frame_has_its_pose(found: FoundPoses) -> None:
    assert found.registered.all()
    assert _trajectory_error(found.poses, TRUTH) < 0.02
    straight = TRUTH.copy()
    straight[:, :3, 3] = np.linspace(TRUTH[0, :3, 3], TRUTH[-1, :3, 3], FRAMES)
    assert _trajectory_error(straight, TRUTH) > 0.1  # what knows nothing
    assert found.notes == ()


def test_the_focal_length_is_found_with_an_honest_deviation(found: FoundPoses) -> None:
    off = abs(found.intrinsics[0, 0] - FOCAL)
    assert found.intrinsics[1, 1] == found.intrinsics[0, 0]
    assert 0 < found.focal_deviation < 0.03 * FOCAL
    assert off < 3 * found.focal_deviation
    assert abs(guessed_pinhole(WIDTH, HEIGHT).focal - FOCAL) > 0.05 * FOCAL  # what knows nothing


def test_points_lie_on_the_walls_and_know_their_frames(found: FoundPoses) -> None:
    into = pose_similarity(found.poses, TRUTH)
    places = into.points(found.points)
    walls = np.stack(
        [places[:, 0] + 5, places[:, 0] - 6, places[:, 1] - HEIGHT_ABOVE_ROAD, places[:, 2] - 60]
    )
    off = np.abs(walls).min(axis=0)
    assert np.median(off) < 0.05
    assert len(found.points) > 500
    assert found.colours.shape == (len(found.points), 3)
    assert found.colours.std() > 20
    assert (found.sightings >= 2).all()
    assert np.median(found.errors) < 0.5
    # No other frame that may have seen a point is much nearer: the way is forward.
    away = np.linalg.norm(found.points - found.poses[found.nearest, :3, 3], axis=1)
    others = np.linalg.norm(found.points - found.poses[0, :3, 3], axis=1)
    assert np.mean(away <= others * 1.05) > 0.95


def test_the_road_gives_the_unit(found: FoundPoses) -> None:
    road = road_below(found.poses, found.points, found.nearest)
    into = by_road(found.poses, road, HEIGHT_ABOVE_ROAD)
    true = pose_similarity(found.poses, TRUTH).scale
    assert into.scale == pytest.approx(true, rel=0.02)


def test_a_given_lens_is_used_and_pieces_are_joined(
    film: list[NDArray[np.uint8]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(found_poses, "PIECE", 10)
    monkeypatch.setattr(found_poses, "OVERLAP", 5)
    joined: list[int] = []
    join = joined_pieces.join_pieces

    def counting(pieces: list[joined_pieces.Piece], *, fixed_focal: bool) -> object:
        joined.append(len(pieces))
        return join(pieces, fixed_focal=fixed_focal)

    monkeypatch.setattr(found_poses, "join_pieces", counting)
    k = lens()
    given = Pinhole(WIDTH, HEIGHT, FOCAL, (float(k[0, 2]), float(k[1, 2])), is_known=True)
    told: list[float] = []
    found = find_poses(iter(film), given, progress=told.append)
    assert joined == [3]
    assert told == list(range(1, FRAMES + 1))
    assert found.registered.all()
    np.testing.assert_allclose(found.intrinsics, k)
    assert found.focal_deviation == 0.0
    assert _trajectory_error(found.poses, TRUTH) < 0.04


def test_pictures_without_a_street_are_refused(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    noise = [random.integers(0, 255, (96, 128)).astype(np.uint8) for _ in range(9)]
    with pytest.raises(ValueError, match="found poses of 0 of 9 frames; expected at least 8"):
        find_poses(noise, guessed_pinhole(128, 96))
    with pytest.raises(ValueError, match="found poses of 0 of 0 frames"):
        find_poses([], guessed_pinhole(128, 96))


def test_what_is_said_of_a_focal_length() -> None:
    assert "800 pixels with a standard deviation of 32%" in focal_sentence(800, 256)
    assert "which is a guess" in focal_sentence(800, np.inf)
    assert "Give `focal`" in focal_sentence(800, 256)
