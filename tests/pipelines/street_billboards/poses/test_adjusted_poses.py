"""Given poses with planted noise, adjusted by what two cameras on one car show."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipelines.street_billboards.poses.adjusted_poses import adjust_poses, mean_rig
from tests.pipelines.street_billboards.poses.corridor import (
    HEIGHT,
    WIDTH,
    lens,
    photograph,
    swerving,
)

FloatArray = NDArray[np.float64]
FRAMES = 8
BASELINE = 0.6
CENTIMETRES, DEGREES = 0.02, 0.1


def _truth() -> FloatArray:
    """(f, 2, 4, 4), far from the world's zero."""
    rig = np.tile(np.eye(4), (2, 1, 1))
    rig[1, 0, 3] = BASELINE
    return swerving(FRAMES, 0.5)[:, None] @ rig[None]


TRUTH = _truth()
KS = np.stack([lens(), lens()])


@pytest.fixture(scope="module")
def frames() -> list[NDArray[np.uint8]]:
    return [np.stack([photograph(pose, lens()) for pose in row]) for row in TRUTH]


def _with_noise(poses: FloatArray, seed: int) -> FloatArray:
    random = np.random.default_rng(seed)
    noisy = poses.copy()
    noisy[..., :3, 3] += random.normal(scale=CENTIMETRES, size=(*poses.shape[:2], 3))
    turns = random.normal(scale=np.radians(DEGREES), size=(poses.shape[0] * poses.shape[1], 3))
    noisy[..., :3, :3] @= Rotation.from_rotvec(turns).as_matrix().reshape(*poses.shape[:2], 3, 3)
    return noisy


def _errors(poses: FloatArray) -> tuple[float, float]:
    """Of neighbouring frames' ways and turns, which depth along the road needs: m, degrees."""
    steps = np.linalg.inv(poses[:-1]) @ poses[1:]
    true = np.linalg.inv(TRUTH[:-1]) @ TRUTH[1:]
    way = np.linalg.norm(steps[..., :3, 3] - true[..., :3, 3], axis=-1)
    traces = np.einsum("fcij,fcij->fc", steps[..., :3, :3], true[..., :3, :3])
    turn = np.degrees(np.arccos(np.clip((traces - 1) / 2, -1, 1)))
    return float(np.sqrt((way**2).mean())), float(np.sqrt((turn**2).mean()))


def test_noise_of_centimetres_goes(frames: list[NDArray[np.uint8]]) -> None:
    given = _with_noise(TRUTH, 0)
    found = adjust_poses(iter(frames), given, KS)
    way, turn = _errors(found.poses)
    way_given, turn_given = _errors(given)
    assert way < 0.35 * way_given
    assert turn < 0.25 * turn_given
    # Place, direction and scale stay those given, as well as their means tell.
    apart = found.poses[..., :3, 3].mean(axis=(0, 1)) - given[..., :3, 3].mean(axis=(0, 1))
    assert np.linalg.norm(apart) < 0.02
    assert 0.001 < found.moved.mean() < 3 * CENTIMETRES
    assert found.residual[1] < 0.5 * found.residual[0]
    assert found.notes == ()
    # One rigid rig.
    between = np.linalg.inv(found.poses[:, 0]) @ found.poses[:, 1]
    np.testing.assert_allclose(between, np.broadcast_to(between[0], between.shape), atol=1e-9)
    assert between[0, 0, 3] == pytest.approx(BASELINE, abs=0.03)


def test_right_poses_hardly_change(frames: list[NDArray[np.uint8]]) -> None:
    found = adjust_poses(iter(frames), TRUTH, KS)
    assert found.moved.max() < 0.01
    assert np.degrees(found.turned).max() < 0.05


def test_a_wrong_focal_length_is_no_noise_of_poses(frames: list[NDArray[np.uint8]]) -> None:
    wrong = KS.copy()
    wrong[:, [0, 1], [0, 1]] *= 1.6
    with pytest.raises(ValueError, match="a wrong focal length"):
        adjust_poses(iter(frames), TRUTH, wrong)
    blank = [np.zeros((2, HEIGHT, WIDTH), np.uint8)] * FRAMES
    with pytest.raises(ValueError, match="found 0 sightings"):
        adjust_poses(iter(blank), TRUTH, KS)


def test_the_rig_is_the_mean_of_what_poses_say() -> None:
    rig, path = mean_rig(TRUTH)
    np.testing.assert_allclose(path[:, None] @ rig[None], TRUTH, atol=1e-12)
    rough, rough_path = mean_rig(_with_noise(TRUTH, 1))
    assert np.abs(rough[1, :3, 3] - rig[1, :3, 3]).max() < 4 * CENTIMETRES * np.sqrt(2 / FRAMES)
    np.testing.assert_allclose(rough[0], np.eye(4), atol=1e-12)
    assert np.abs(rough_path[:, :3, 3] - path[:, :3, 3]).max() < 4 * CENTIMETRES
