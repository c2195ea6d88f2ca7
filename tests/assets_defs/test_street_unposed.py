"""Drives without poses, with masks, and in worlds of their own: what the first two assets make."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from assets_defs.sources import Source
from assets_defs.street_billboards.depth import DepthSettings, depth_maps
from assets_defs.street_billboards.drive import DriveSettings, drive_frames
from assets_defs.street_billboards.poses import PoseSettings, drive_poses
from pipelines.virtual.city.bend import road_bend
from pipelines.virtual.city.city import make_city
from pipelines.virtual.city.drive import SimulatedDrive, expose_photograph, plan_drive
from pipelines.virtual.city.drive_photographs import EXPOSURE
from pipelines.virtual.city.photographing import CityStage
from storage.readers.street_photographs import street_photographs

METRES, FRAMES = 60.0, 60


def silent(fraction: float) -> None:
    """Nobody watches."""


def photographed(drive: SimulatedDrive, size: tuple[int, int], bend: float) -> list[Any]:
    """The first camera's pictures of a drive."""
    random = np.random.default_rng(3)
    city = make_city(METRES, 0, road_bend(METRES, bend))
    with CityStage(city, street_photographs(), *size) as stage:
        return [
            expose_photograph(
                stage.shoot(drive.intrinsics[0], pose[0]).radiance, 1.0, EXPOSURE, 0.004, random
            )
            for pose in drive.poses
        ]


def write_film(path: Path, pictures: list[NDArray[np.uint8]]) -> None:
    """An H.264 film of ten frames a second."""
    height, width = pictures[0].shape[:2]
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=10)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"crf": "14"}
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


@pytest.mark.slow
def test_a_film_of_one_camera_becomes_a_drive(tmp_path: Path) -> None:
    size = 640, 400
    bend = road_bend(METRES, 30.0)
    drive = plan_drive(FRAMES, METRES / FRAMES, *size, cameras=1, bend=bend)
    write_film(tmp_path / "ride.mp4", photographed(drive, size, 30.0))
    source = Source.of(tmp_path / "ride.mp4")
    found, _ = drive_poses(PoseSettings(camera_height=1.9), source, silent)
    numbers = found["instant"].values
    assert len(numbers) > 0.7 * FRAMES  # those between have hardly any parallax
    truth, made = drive.poses[numbers, 0, :3, 3], found["poses"].values[:, 0, :3, 3]
    # Metres by the road below: the lengths of the ways agree.
    length = np.linalg.norm(np.diff(made, axis=0), axis=1).sum()
    true_length = np.linalg.norm(np.diff(truth, axis=0), axis=1).sum()
    assert length == pytest.approx(true_length, rel=0.05)
    assert off_after_fit(made, truth) < 0.1
    straight = np.linspace(made[0], made[-1], len(made))
    assert off_after_fit(straight, truth) > 0.3  # a way that knows nothing of the bend
    heights = made[:, 2]
    assert np.ptp(heights) < 0.5  # z is up
    focal, deviation = found["intrinsics"].values[0, 0, 0], float(found["focal_deviation"][0])
    assert abs(focal - drive.intrinsics[0, 0, 0]) < 3 * deviation + 0.03 * focal
    frames, _ = drive_frames(DriveSettings(), source, silent, found)
    shown = frames["photographs"][0, 0].values
    assert shown.shape == (400, 640, 3)


def off_after_fit(made: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    """Root mean square distance after the best similarity (Umeyama 1991), metres."""
    first, second = made - made.mean(axis=0), truth - truth.mean(axis=0)
    left, values, right = np.linalg.svd(second.T @ first)
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    turn = left @ sign @ right
    scale = (values * np.diag(sign)).sum() / (first**2).sum()
    return float(np.sqrt(((scale * first @ turn.T - second) ** 2).sum(axis=1).mean()))


def write_rig(
    folder: Path, mask: NDArray[np.uint8] | None = None, size: tuple[int, int] = (256, 160)
) -> None:
    """Eight frames of the city's three cameras as transforms.json."""
    drive = plan_drive(8, 3.0, *size)
    city = make_city(24.0, 0)
    folder.mkdir()
    if mask is not None:
        cv2.imwrite(str(folder / "mask.png"), mask)
    rows = []
    lens = drive.intrinsics[0]
    random = np.random.default_rng(0)
    with CityStage(city, street_photographs(), *size) as stage:
        for frame, poses in enumerate(drive.poses):
            for camera, pose in enumerate(poses):
                light = stage.shoot(lens, pose).radiance
                picture = expose_photograph(light, 1.0, EXPOSURE, 0.004, random)
                name = f"{frame:03d}-{camera}.png"
                cv2.imwrite(str(folder / name), picture[..., ::-1])
                opengl = pose @ np.diag([1.0, -1.0, -1.0, 1.0])
                row = {"file_path": name, "transform_matrix": opengl.tolist()}
                row |= {"camera": camera, "time": frame}
                rows.append(row | ({"mask_path": "mask.png"} if mask is not None else {}))
    about = {"fl_x": lens[0, 0], "fl_y": lens[1, 1], "w": size[0], "h": size[1]}
    about |= {"cx": size[0] / 2, "cy": size[1] / 2, "frames": rows}
    (folder / "transforms.json").write_text(json.dumps(about))


def test_what_a_mask_has_black_gets_no_depth(tmp_path: Path) -> None:
    mask = np.full((160, 256), 255, np.uint8)
    mask[120:] = 0
    write_rig(tmp_path / "masked", mask)
    source = Source.of(tmp_path / "masked")
    poses, _ = drive_poses(PoseSettings(), source, silent)
    frames, _ = drive_frames(DriveSettings(), source, silent, poses)
    used = frames["used"].values[0, 1]
    assert not used[122:].any()
    assert used[:118].all()
    depths, _ = depth_maps(DepthSettings(), silent, frames)
    known = np.isfinite(depths["depth"][0, 1].values)
    assert not known[122:].any()
    assert known[:118].mean() > 0.2


def test_a_world_with_y_up_and_in_millimetres_is_put_right(tmp_path: Path) -> None:
    turn = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # z up to y up
    rig = tmp_path / "rig"
    write_rig(rig, size=(480, 300))
    listed = json.loads((rig / "transforms.json").read_text())
    plain, _ = drive_poses(PoseSettings(), Source.of(rig), silent)
    for row in listed["frames"]:
        pose = np.array(row["transform_matrix"])
        pose[:3] = turn @ pose[:3]
        pose[:3, 3] *= 1000.0
        row["transform_matrix"] = pose.tolist()
    (rig / "transforms.json").write_text(json.dumps(listed))
    made, shown = drive_poses(PoseSettings(), Source.of(rig), silent)
    said = " ".join(shown["notes"])
    assert "up is" in said
    assert "millimetres" in said
    true, found = plain["poses"].values[..., :3, 3], made["poses"].values[..., :3, 3]
    apart = np.linalg.norm(true[:, None] - true[None], axis=-1)
    np.testing.assert_allclose(
        np.linalg.norm(found[:, None] - found[None], axis=-1), apart, atol=1e-6
    )
    np.testing.assert_allclose(found[..., 2].std(), true[..., 2].std(), atol=1e-6)
