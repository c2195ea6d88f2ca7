"""What the benchmark of one camera's depth judges by: nulls, files, pictures from depth alone."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.drives_depth import (
    Photographed,
    depth_figures,
    kitti_frames,
    road_and_distance,
)
from benchmarks.drives_ibr import DepthPhotograph, rendered
from pipelines.drawing.picture_metrics import psnr
from pipelines.street_billboards.capture.drive_depth import DriveFrames, RigFrame
from tests.pipelines.street_billboards.stereo_street import frame_at


def _alone(place: float) -> RigFrame:
    frame = frame_at(place)
    return RigFrame(frame.photographs[1:2], frame.intrinsics[1:2], frame.poses[1:2])


def test_a_depth_that_knows_nothing_is_worse_in_each_figure() -> None:
    frames = [_alone(float(number)) for number in range(7)]
    poses = np.stack([frame.poses for frame in frames])
    truth = np.stack([frame_at(float(number)).depth[1] for number in range(7)])
    drive = DriveFrames(frames.__getitem__, poses, np.arange(7))
    found = depth_figures(Photographed(drive, np.nan_to_num(truth, nan=np.inf)))
    assert found["one_camera_known"] > 0.5
    assert found["one_camera_bad"] < 0.3 * found["one_camera_bad_null"]
    assert found["deviation_honest"] > found["deviation_honest_null"]


def test_the_road_of_a_depth_that_knows_nothing_is_the_plane_below() -> None:
    frame = _alone(0.0)
    depth = road_and_distance(frame)
    lens = frame.intrinsics[0]
    for row in (130, 180):  # 2 m above the road, looking ahead
        assert depth[row, 160] == pytest.approx(2.0 * lens[1, 1] / (row - lens[1, 2]), rel=1e-5)
    assert depth[20, 160] == depth[150, 5] == 15.0


def test_a_view_between_photographs_is_made_of_their_depths() -> None:
    places = (0.0, 1.0, 3.0, 4.0)
    shown = []
    for place in places:
        depth = np.nan_to_num(frame_at(place).depth[1], nan=np.inf)
        frame = _alone(place)
        shown.append(
            DepthPhotograph(frame.photographs[0], depth, frame.intrinsics[0], frame.poses[0])
        )
    truth = _alone(2.0)
    made = rendered(shown, truth.intrinsics[0], truth.poses[0])
    everywhere = np.ones(made.shape[:2], bool)
    assert psnr(made, truth.photographs[0], everywhere) > 22
    nearest = psnr(shown[1].pixels, truth.photographs[0], everywhere)
    assert psnr(made, truth.photographs[0], everywhere) > nearest + 4


def test_kittis_layout_is_read_with_z_up(tmp_path: Path) -> None:
    (tmp_path / "image_l").mkdir()
    rows = []
    for number in range(3):
        picture = np.full((20, 40), 40 * number, np.uint8)
        assert cv2.imwrite(str(tmp_path / "image_l" / f"{number:06d}.png"), picture)
        rows.append([1, 0, 0, 0, 0, 1, 0, -0.1 * number, 0, 0, 1, 1.2 * number])
    np.savetxt(tmp_path / "poses.txt", rows)
    np.savetxt(tmp_path / "calib.txt", [[30, 0, 19.5, 0, 0, 30, 9.5, 0, 0, 0, 1, 0]])
    drive = kitti_frames(tmp_path)
    np.testing.assert_allclose(drive.poses[2, 0, :3, 3], [2.4, 0, 0.2])  # ahead, and up
    np.testing.assert_allclose(drive.poses[0, 0, :3, 1], [0, 0, -1])
    frame = drive.load(2)
    assert frame.photographs.shape == (1, 20, 40, 3)
    assert (frame.photographs == 80).all()
    np.testing.assert_allclose(frame.intrinsics[0], [[30, 0, 19.5], [0, 30, 9.5], [0, 0, 1]])
