"""The built-in drive: poses against closed forms, exposure, noise."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.drawing.colour import decode_srgb, to_8bit
from pipelines.geometry.cameras import moved_left, project_points
from pipelines.virtual.city.drive import expose_photograph, plan_drive


def test_poses_are_rotations_that_look_ahead_with_the_horizon_level() -> None:
    drive = plan_drive(50, 3.0, 640, 400)
    turns = drive.poses[..., :3, :3]
    np.testing.assert_allclose(
        turns @ turns.swapaxes(-1, -2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(turns), 1.0)
    np.testing.assert_array_equal(turns[..., 2, 2], 0.0)  # pitch 0
    np.testing.assert_array_equal(turns[..., :, 1], np.broadcast_to([0, 0, -1], turns.shape[:-1]))
    assert (turns[..., 0, 2] > 0.99).all()
    np.testing.assert_array_equal(drive.poses[..., 3, :], np.broadcast_to([0, 0, 0, 1], (50, 3, 4)))


def test_one_camera_is_the_middle_one_of_three() -> None:
    alone, three = plan_drive(9, 2.0, 64, 40, seed=3, cameras=1), plan_drive(9, 2.0, 64, 40, seed=3)
    np.testing.assert_array_equal(alone.poses, three.poses[:, 1:2])
    np.testing.assert_array_equal(alone.gains, three.gains[:, 1:2])
    np.testing.assert_array_equal(alone.intrinsics, three.intrinsics[1:2])


def test_the_car_keeps_its_lane_and_heads_where_it_goes() -> None:
    drive = plan_drive(400, 0.5, 640, 400, camera_height=2.1, seed=9)
    middle = drive.poses[:, 1, :3, 3]
    np.testing.assert_allclose(middle[:, 0], np.arange(400) * 0.5)
    np.testing.assert_array_equal(middle[:, 2], 2.1)
    assert np.abs(middle[:, 1] + 1.75).max() <= 0.25
    assert np.ptp(middle[:, 1]) > 0.45
    step = middle[2:] - middle[:-2]
    step /= np.linalg.norm(step, axis=1, keepdims=True)
    np.testing.assert_allclose(step, drive.poses[1:-1, 1, :3, 2], atol=1e-4)


def test_cameras_are_in_a_row_from_left_to_right() -> None:
    drive = plan_drive(5, 3.0, 640, 400, baseline=0.6)
    for poses in drive.poses:
        left, middle, right = poses[:, :3, 3]
        np.testing.assert_allclose(left - middle, middle - right)
        np.testing.assert_allclose(np.linalg.norm(left - middle), 0.6)
        assert left[1] > middle[1]
        np.testing.assert_allclose((left - middle) @ poses[1, :3, 2], 0.0, atol=1e-12)
        np.testing.assert_allclose(moved_left(poses[1], 0.6), poses[0])


def test_what_is_at_the_left_is_at_the_left_of_the_picture() -> None:
    drive = plan_drive(1, 3.0, 640, 400)
    k, pose = drive.intrinsics[1], drive.poses[0, 1]
    ahead = pose[:3, 3] + 10 * pose[:3, 2]
    pixel, depth = project_points(k, pose, ahead + np.array([0.0, 1.0, 0.5]))
    assert depth == pytest.approx(10.0, abs=0.1)
    assert pixel[0] < 319.5
    assert pixel[1] < 199.5
    # 75 degrees across: the picture's edges are half a pixel outside of the outermost middles.
    edge = np.degrees(np.arctan((k[0, 2] + 0.5) / k[0, 0]))
    assert edge == pytest.approx(37.5)


def test_gains_are_about_1_and_drift_slowly() -> None:
    gains = plan_drive(300, 1.0, 64, 40, exposure_spread=0.12).gains
    assert gains.shape == (300, 3)
    assert np.log(gains).std() == pytest.approx(0.12, abs=0.02)
    assert abs(np.log(gains).mean()) < 0.06
    assert np.abs(np.diff(np.log(gains), axis=0)).max() < 0.06
    ratios = gains / gains[:, :1]
    np.testing.assert_allclose(ratios, np.broadcast_to(ratios[0], ratios.shape))
    assert 0.001 < ratios.std() < 0.06
    still = plan_drive(30, 1.0, 64, 40, exposure_spread=0.0).gains
    np.testing.assert_allclose(still, np.broadcast_to(still[0], still.shape))


def test_the_same_seed_gives_the_same_drive() -> None:
    for mine, theirs in zip(
        plan_drive(9, 2.0, 64, 40, seed=3), plan_drive(9, 2.0, 64, 40, seed=3), strict=True
    ):
        np.testing.assert_array_equal(mine, theirs)
    assert (
        plan_drive(9, 2.0, 64, 40, seed=4).gains != plan_drive(9, 2.0, 64, 40, seed=3).gains
    ).any()


@pytest.mark.parametrize(
    "arguments", [(0, 3.0, 64, 40), (3, 0.0, 64, 40), (3, 3.0, 0, 40), (3, 3.0, 64, 0)]
)
def test_sizes_must_be_positive(arguments: tuple[int, float, int, int]) -> None:
    with pytest.raises(ValueError, match="expected all to be more than 0"):
        plan_drive(*arguments)


# ---- the sensor --------------------------------------------------------------------------------


def test_without_noise_a_photograph_is_the_exposed_radiance() -> None:
    radiance = np.random.default_rng(0).random((7, 9, 3)).astype(np.float32)
    seen = expose_photograph(radiance, 1.1, 0.8, 0.0, np.random.default_rng(1))
    np.testing.assert_array_equal(seen, to_8bit(radiance.astype(np.float64) * (1.1 * 0.8)))


@pytest.mark.parametrize("level", [0.02, 0.2, 0.8])
def test_noise_has_the_size_that_is_said_and_no_bias(level: float) -> None:
    radiance = np.full((200, 200, 3), level, np.float32)
    light = decode_srgb(
        expose_photograph(radiance, 1.0, 1.0, 0.01, np.random.default_rng(2)) / 255.0
    )
    expected = 0.01 * np.sqrt((level + 0.1) / 1.1)
    assert light.std() == pytest.approx(expected, rel=0.06)
    assert light.mean() == pytest.approx(level, abs=2e-4)
