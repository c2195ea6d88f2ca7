"""Frames of films whose motion is planted: driving, standing, turning, blurred, cut."""

from __future__ import annotations

import functools

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.street_billboards.poses.frame_choice import (
    FEWEST,
    PARALLAX,
    choose_frames,
    median_parallax,
)
from tests.pipelines.street_billboards.poses.corridor import HEIGHT, WIDTH, lens, path, photograph

Film = list[NDArray[np.uint8]]
STEP = 0.12


@functools.cache
def _shown(along: float, heading: float = 0.0) -> NDArray[np.uint8]:
    pose = path(np.array([[0.0, 0.0, along]]), np.array([heading]))[0]
    return photograph(pose, lens())


def _driving(frames: int, begin: float = 0.0) -> Film:
    return [_shown(begin + STEP * number) for number in range(frames)]


def _chosen(film: Film) -> NDArray[np.int64]:
    return choose_frames(enumerate(film)).frames


def test_frames_are_as_far_apart_as_is_asked() -> None:
    film = _driving(40)
    choice = choose_frames(enumerate(film))
    assert choice.frames[0] == 0
    assert (np.diff(choice.frames) > 0).all()
    # The window in which the sharpest is taken begins at 0.7 of what is asked.
    assert 0.7 * PARALLAX <= np.median(choice.parallax) <= 1.6 * PARALLAX
    wider = choose_frames(enumerate(film), parallax=0.75 * PARALLAX)
    assert len(wider.frames) > len(choice.frames)


def test_standing_still_is_left_out() -> None:
    film = _driving(20) + [_shown(19 * STEP)] * 15 + _driving(20, 20 * STEP)
    frames = _chosen(film)
    waiting = (frames >= 20) & (frames < 35)
    assert waiting.sum() <= 1
    assert (frames < 20).sum() >= 4
    assert (frames >= 35).sum() >= 4


def test_a_camera_that_stands_is_refused() -> None:
    with pytest.raises(ValueError, match="stands still"):
        choose_frames(enumerate([_shown(0.0)] * 30))
    with pytest.raises(ValueError, match="found no frame"):
        choose_frames(iter(()))


def test_turning_on_the_spot_is_no_parallax() -> None:
    turning = [_shown(0.0, np.radians(angle)) for angle in np.linspace(0, 8, 10)]
    with pytest.raises(ValueError, match=rf"expected at least {FEWEST}"):
        choose_frames(enumerate(turning))


def test_a_turn_is_taken_off_and_a_shift_is_not() -> None:
    """Directions of a rotated camera, exact, with a focal length other than is supposed."""
    random = np.random.default_rng(0)
    k = lens()
    points = np.column_stack(
        [random.uniform(-8, 8, 300), random.uniform(-5, 2, 300), random.uniform(6, 30, 300)]
    )

    def shown(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return points[:, :2] / points[:, 2:] * k[0, 0] + k[:2, 2]

    turn, _ = cv2.Rodrigues(np.radians([1.0, 3.0, -1.0]))
    size = (WIDTH, HEIGHT)
    assert median_parallax(shown(points), shown(points @ turn.T), size) < 0.5
    moved = points - [0, 0, 1.0]
    ahead = np.median(np.linalg.norm(shown(moved) - shown(points), axis=1))
    found = median_parallax(shown(points), shown(moved @ turn.T), size)
    assert found == pytest.approx(ahead, rel=0.35)
    assert median_parallax(points[:0, :2], points[:0, :2], size) == 0.0


def test_blurred_frames_are_passed_over() -> None:
    film = _driving(48)
    blurred = {number for number in range(48) if number % 2}
    for number in blurred:
        film[number] = np.asarray(cv2.GaussianBlur(film[number], (0, 0), 2.5), np.uint8)
    finer = choose_frames(enumerate(film), parallax=2 * PARALLAX).frames
    share = np.mean([number in blurred for number in finer[1:-1]])
    assert share < 0.25  # a chance choice: a half


def test_of_a_film_that_is_cut_the_shot_with_most_motion_is_kept_and_said() -> None:
    other = [picture[:, ::-1] for picture in _driving(12, 20.0)]
    film = other + _driving(36) + other
    choice = choose_frames(enumerate(film))
    assert choice.frames[0] == 12
    assert choice.frames[-1] < 48
    assert any("cut into 3 shots" in note for note in choice.notes)
    whole = choose_frames(enumerate(_driving(36)))
    assert not any("cut" in note for note in whole.notes)
    assert f"{len(whole.frames)} of 36 frames" in whole.notes[-1]
