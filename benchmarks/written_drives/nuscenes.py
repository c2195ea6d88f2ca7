"""The drive as nuScenes' tables, by hand from the published schema."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.written_drives.truth import (
    HEIGHT,
    SIDES,
    WIDTH,
    Array,
    K,
    Written,
    quaternion,
    rigid,
    save,
    true_pictures,
    true_poses,
)

_CHANNELS = {side: f"CAM_FRONT_{side.upper()}" for side in SIDES}
_MOUNTED = rigid([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], [1.7, 0.27, 1.5])
"""The left camera to the car: x ahead, y left, z up."""


def write_nuscenes(folder: Path) -> Written:
    """Two scenes, of which the second has our pictures: keyframes and sweeps, lidar between."""
    tables: dict[str, list[dict[str, Any]]] = {
        "scene": [], "sample": [], "sample_data": [], "calibrated_sensor": [], "ego_pose": [],
        "sensor": [], "log": [{"token": "log", "logfile": "n015", "vehicle": "n015"}],
    }  # fmt: skip
    right = np.linalg.inv(true_poses()[0, 0]) @ true_poses()[0, 1]
    for side, mounted in zip(SIDES, (_MOUNTED, _MOUNTED @ right), strict=True):
        tables["sensor"].append({"token": side, "channel": _CHANNELS[side], "modality": "camera"})
        tables["calibrated_sensor"].append(
            {"token": f"c-{side}", "sensor_token": side, "camera_intrinsic": K.tolist()}
            | _motion(mounted)
        )
    tables["sensor"].append({"token": "top", "channel": "LIDAR_TOP", "modality": "lidar"})
    tables["calibrated_sensor"].append(
        {"token": "c-top", "sensor_token": "top", "camera_intrinsic": []} | _motion(np.eye(4))
    )
    for number, name in enumerate(("scene-0061", "scene-0103")):
        tables["scene"].append(
            {"token": name, "name": name, "log_token": "log", "nbr_samples": 40 - number,
             "first_sample_token": f"{name}-0", "last_sample_token": f"{name}-1"}
        )  # fmt: skip
        for key in (0, 1):
            tables["sample"].append(
                {"token": f"{name}-{key}", "scene_token": name, "timestamp": 10**15 + key}
            )
    for instant, poses in enumerate(true_poses()):
        for camera, side in enumerate(SIDES):
            # The car's pose at the photograph's own time, by which both cameras are where they are.
            car = poses[0] @ np.linalg.inv(_MOUNTED)
            time = 1_532_402_927_612_460 + 83_000 * instant + 24_000 * camera
            tables["ego_pose"].append(
                {"token": f"e{instant}{side}", "timestamp": time} | _motion(car)
            )
            room = "samples" if instant % 3 == 0 else "sweeps"
            name = f"{room}/{_CHANNELS[side]}/n015__{_CHANNELS[side]}__{time}.png"
            save(folder / name, true_pictures()[instant][camera])
            tables["sample_data"].append(
                {"token": f"d{instant}{side}", "sample_token": f"scene-0103-{instant // 3}",
                 "ego_pose_token": f"e{instant}{side}", "calibrated_sensor_token": f"c-{side}",
                 "filename": name, "fileformat": "png", "width": WIDTH, "height": HEIGHT,
                 "timestamp": time, "is_key_frame": instant % 3 == 0}
            )  # fmt: skip
        tables["sample_data"].append(
            {"token": f"l{instant}", "sample_token": f"scene-0103-{instant // 3}",
             "ego_pose_token": f"e{instant}left", "calibrated_sensor_token": "c-top",
             "filename": f"sweeps/LIDAR_TOP/{instant}.pcd.bin", "fileformat": "pcd",
             "width": 0, "height": 0, "timestamp": 5, "is_key_frame": False}
        )  # fmt: skip
    (folder / "v1.0-mini").mkdir(parents=True, exist_ok=True)
    for table, rows in tables.items():
        (folder / "v1.0-mini" / f"{table}.json").write_text(json.dumps(rows, indent=0))
    names = tuple(_CHANNELS.values())
    notes = ("scene-0103 is read",)
    return Written(folder, names, true_poses(), true_pictures(), np.stack([K, K]), notes=notes)


def _motion(pose: Array) -> dict[str, Any]:
    return {
        "translation": pose[:3, 3].tolist(),
        "rotation": quaternion(pose[:3, :3]).tolist(),
    }
