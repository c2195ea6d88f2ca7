"""The drive as KITTI's odometry sequences and raw recordings, by hand from their description."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.written_drives.truth import (
    Array,
    K,
    Written,
    rigid,
    save,
    true_pictures,
    true_poses,
)

_AXES = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""The first camera's world (y down) to z up, y ahead."""
_BOTH = np.stack([K, K])
_EARTH = 6378137.0


def write_sequence(folder: Path) -> Written:
    """A sequence as the benchmark lies on a disk: poses apart, times, colour cameras, and more
    poses than pictures."""
    sequence = folder / "sequences" / "07"
    labels = ("P0", "P1", "P2", "P3")
    lines = [f"{label}: {_row(_projection(_place(label)))}" for label in labels]
    _text(sequence / "calib.txt", [*lines, "Tr: " + _row(np.eye(4)[:3])])
    world = _AXES @ np.linalg.inv(true_poses()[0, 0])
    poses = np.linalg.inv(true_poses()[0, 0]) @ true_poses()[:, 0]
    beyond = [poses[-1] @ rigid(np.eye(3), [0, 0, metres]) for metres in (1, 2, 3)]
    _text(folder / "poses" / "07.txt", [_row(pose[:3]) for pose in (*poses, *beyond)])
    _text(sequence / "times.txt", [f"{0.1037 * i:e}" for i in range(len(poses) + 3)])
    folders = ("image_2", "image_3")
    written = _saved(sequence, folders, "{instant:06d}.png", world, ("has 9 poses",))
    return written._replace(path=folder)


def write_other_program(folder: Path, comma: str = "") -> Written:
    """`image_l` alone, a calibration without labels, no times; with ``comma``, decimal commas."""
    first = true_poses()[0, 0]
    poses = [_row((np.linalg.inv(first) @ pose)[:3]) for pose in true_poses()[:, 0]]
    _text(folder / "calib.txt", [_row(_projection(x)) for x in (0.0, 0.5)])
    lines = [line.replace(".", comma) if comma else line for line in poses]
    _text(folder / "poses.txt", lines)
    world = _AXES @ np.linalg.inv(first)
    notes = ("decimal points",) if comma else ()
    return _saved(folder, ("image_l", ""), "{instant:06d}.png", world, notes)


def write_commas(folder: Path) -> Written:
    """Decimal commas, as spreadsheets of some countries leave them."""
    return write_other_program(folder, comma=",")


def write_raw(folder: Path) -> Written:
    """A day of raw data with two drives, of which the longer one is ours."""
    drive = folder / "2011_09_26_drive_0015_sync"
    to_velodyne = rigid(_about(2, 0.01) @ _about(0, -0.02), [-0.81, 0.32, -0.8])
    seen = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])  # x ahead to z ahead
    to_camera = rigid(_about(1, 0.005) @ seen, [-0.004, -0.076, -0.27])
    rectified = _about(0, 0.004) @ _about(2, -0.003)
    _text(folder / "calib_imu_to_velo.txt", _calibration(to_velodyne))
    _text(folder / "calib_velo_to_cam.txt", _calibration(to_camera))
    lines = ["calib_time: 09-Jan-2012 13:57:47", "R_rect_00: " + _row(rectified)]
    for number in range(4):
        place = 0.0 if number % 2 == 0 else 0.54
        lines.append(f"P_rect_0{number}: {_row(_projection(place))}")
    _text(folder / "calib_cam_to_cam.txt", lines)
    imu_to_camera = rigid(rectified, np.zeros(3)) @ to_camera @ to_velodyne
    imu = true_poses()[:, 0] @ imu_to_camera
    scale = math.cos(math.radians(49.0)) * _EARTH
    # The projection's scale is that of the first packet's latitude.
    north = scale * math.log(math.tan(math.pi / 4 + math.radians(49.0) / 2))
    for instant, pose in enumerate(imu):
        moved = pose[:3, 3] - imu[0, :3, 3]
        longitude = math.degrees((moved[0] + 650_000.0) / scale)
        latitude = math.degrees(2 * math.atan(math.exp((north + moved[1]) / scale)) - math.pi / 2)
        turn = pose[:3, :3]
        angles = (
            math.atan2(turn[2, 1], turn[2, 2]),
            -math.asin(turn[2, 0]),
            math.atan2(turn[1, 0], turn[0, 0]),
        )
        packet = [latitude, longitude, 112.5 + moved[2], *angles, *([0.0] * 24)]
        _text(drive / "oxts" / "data" / f"{instant:010d}.txt", [_row(packet)])
    stamps = [f"2011-09-26 13:02:{25 + i // 10:02d}.{i % 10}64389445" for i in range(len(imu))]
    for number in (0, 1):
        _text(drive / f"image_0{number}" / "timestamps.txt", stamps)
    save(folder / "2011_09_26_drive_0001_sync/image_00/data/0000000000.png", true_pictures()[0][0])
    world = rigid(np.eye(3), -imu[0, :3, 3])
    folders = ("image_00/data", "image_01/data")
    written = _saved(drive, folders, "{instant:010d}.png", world, ("east, north",))
    return written._replace(path=folder, names=("image_00", "image_01"))


def _saved(
    folder: Path, folders: tuple[str, str], name: str, world: Array, notes: tuple[str, ...]
) -> Written:
    """The pictures in folders, one a camera; '' for a camera that is not there."""
    kept = [camera for camera, own in enumerate(folders) if own]
    pictures = [[row[camera] for camera in kept] for row in true_pictures()]
    for instant, row in enumerate(true_pictures()):
        for camera in kept:
            save(folder / folders[camera] / name.format(instant=instant), row[camera])
    names = tuple(folders[camera] for camera in kept)
    poses = (world @ true_poses())[:, kept]
    return Written(folder, names, poses, pictures, _BOTH[kept], notes=notes)


def _place(label: str) -> float:
    """How far right of the first camera: the colour pair's left one is where that is."""
    return 0.54 if label in ("P1", "P3") else 0.0


def _projection(right: float) -> Array:
    """K [I | t] of a camera that is ``right`` metres to the right of the first."""
    return K @ np.column_stack([np.eye(3), [-right, 0, 0]])


def _calibration(motion: Array) -> list[str]:
    return [
        "calib_time: 15-Mar-2012 11:37:16",
        "R: " + _row(motion[:3, :3]),
        "T: " + _row(motion[:3, 3]),
    ]


def _about(axis: int, angle: float) -> Array:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_euler("xyz"[axis], angle).as_matrix())


def _row(values: Any) -> str:
    return " ".join(f"{value:.15e}" for value in np.ravel(values))


def _text(path: Path, lines: Iterable[str]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")
