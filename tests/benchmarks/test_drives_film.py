"""How found poses are judged: errors that are planted, and what a ruler gets."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.drives_film import _straight_ahead, step_errors, trajectory_error
from pipelines.virtual.city.bend import road_bend
from pipelines.virtual.city.drive import plan_drive


def test_a_similarity_is_no_error_and_noise_is_what_it_is() -> None:
    random = np.random.default_rng(0)
    truth = np.cumsum(random.normal(size=(400, 3)), axis=0)
    turn = Rotation.random(random_state=1).as_matrix()
    moved = 0.3 * truth @ turn.T + [5, -2, 9]
    assert trajectory_error(moved, truth) < 1e-9
    assert trajectory_error(moved * [1, 1, -1], truth) > 1  # a mirrored world is none
    noisy = moved + 0.3 * random.normal(scale=0.02, size=truth.shape)
    assert trajectory_error(noisy, truth) == pytest.approx(0.02 * np.sqrt(3), rel=0.1)


def test_a_ruler_knows_no_bend() -> None:
    """An arc of 40 degrees and radius r, without its best line: some decimetres to metres."""
    bends = plan_drive(45, 1.5, 64, 40, bend=road_bend(67.5, 40.0)).poses[:, 1, :3, 3]
    straight = plan_drive(45, 1.5, 64, 40).poses[:, 1, :3, 3]
    assert 2 < trajectory_error(_straight_ahead(45), bends) < 4
    assert 0.05 < trajectory_error(_straight_ahead(45), straight) < 0.3


def test_steps_are_judged_in_the_cameras_own_axes() -> None:
    poses = plan_drive(6, 1.5, 64, 40).poses
    world = np.eye(4)
    world[:3, :3], world[:3, 3] = Rotation.random(random_state=2).as_matrix(), [1, 2, 3]
    way, turn = step_errors(world @ poses, poses)
    assert way < 1e-9
    assert turn < 1e-5
    off = poses.copy()
    off[3, :, 2, 3] += 0.1  # two of five steps are 10 cm off
    way, turn = step_errors(off, poses)
    assert way == pytest.approx(0.1 * np.sqrt(2 / 5))
    assert turn < 1e-5
    off = poses.copy()
    off[5:, :, :3, :3] @= Rotation.from_euler("y", 1, degrees=True).as_matrix()
    assert step_errors(off, poses)[1] == pytest.approx(np.sqrt(1 / 5), rel=1e-3)
