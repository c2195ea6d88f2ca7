"""The drive as `transforms.json`, in the forms that nerfstudio, instant-ngp and Blender write."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.written_drives.truth import (
    HEIGHT,
    INSTANTS,
    SIDES,
    WIDTH,
    Array,
    K,
    Written,
    bent_rays,
    pinhole_rays,
    rigid,
    save,
    scenery,
    true_pictures,
    true_poses,
)

_TO_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
_LENS = {
    "fl_x": K[0, 0], "fl_y": K[1, 1], "cx": K[0, 2] + 0.5, "cy": K[1, 2] + 0.5,
    "w": WIDTH, "h": HEIGHT,
}  # fmt: skip
"""The file counts from the first pixel's outer corner."""
_MIDDLE = np.array([[36.0, 0, (WIDTH - 1) / 2], [0, 36.0, (HEIGHT - 1) / 2], [0, 0, 1]])
_BOTH = np.stack([K, K])

Json = dict[str, Any]
Pictures = list[list[NDArray[np.uint8]]]


def write_fields(folder: Path) -> Written:
    """Cameras and times in fields of their own, in milliseconds that differ a little."""
    frames = []
    for instant, row in enumerate(true_poses()):
        for side, pose in zip(SIDES, row, strict=True):
            time = 1000.0 + 100 * instant + (3 if side == "right" else 0)
            frames.append(_frame(f"{side}_{instant}.png", pose) | {"camera": side, "time": time})
    _write(folder, _LENS | {"frames": frames})
    return _saved(folder, "{side}_{instant}.png", SIDES)


def write_nerfstudio(folder: Path) -> Written:
    """As `ns-process-data` writes: names alone, intrinsics by frame, a world that was turned."""
    turned = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    frames = []
    for instant, row in enumerate(true_poses()):
        for side, pose in zip(SIDES, row, strict=True):
            name = f"images/{side}/frame_{instant + 1:05d}.png"
            frames.append(_frame(name, turned @ pose) | _LENS | {"colmap_im_id": instant})
    top = {"camera_model": "OPENCV", "applied_transform": turned[:3].tolist(), "frames": frames}
    _write(folder, top | {"ply_file_path": "sparse_pc.ply"})
    names = tuple(f"{side}/frame" for side in SIDES)
    written = _saved(folder, "images/{side}/frame_{number:05d}.png", names)
    names = tuple(f"images/{side}/frame" for side in SIDES)
    return written._replace(names=names, notes=("applied_transform", "ply_file_path", "names"))


def write_instant_ngp(folder: Path) -> Written:
    """Matrices of three rows, an angle in place of the lens, names without endings."""
    frames = []
    for instant, row in enumerate(true_poses()):
        for side, pose in zip(SIDES, row, strict=True):
            frame = _frame(f".\\images\\{side}{instant:04d}", pose)
            frames.append(frame | {"transform_matrix": frame["transform_matrix"][:3]})
    angle = 2 * math.atan(WIDTH / 2 / _MIDDLE[0, 0])
    _write(folder, {"camera_angle_x": angle, "aabb_scale": 16, "frames": frames})
    names = tuple(f"images/{side}" for side in SIDES)
    written = _saved(folder, "images/{side}{instant:04d}.png", names)
    return written._replace(intrinsics=np.stack([_MIDDLE, _MIDDLE]))


def write_blender(folder: Path) -> Written:
    """One camera in `transforms_train.json`, as Blender's scripts write it, its axes scaled."""
    frames = []
    for instant, row in enumerate(true_poses()):
        pose = row[0].copy()
        pose[:3, :3] *= 2.5
        frames.append(_frame(f"./train/r_{instant}", pose) | {"rotation": 0.0125})
    angles = [2 * math.atan(side / 2 / _MIDDLE[0, 0]) for side in (WIDTH, HEIGHT)]
    top = {"camera_angle_x": angles[0], "camera_angle_y": angles[1], "frames": frames}
    _write(folder, top, "transforms_train.json")
    pictures = [[row[0]] for row in true_pictures()]
    for instant, (picture,) in enumerate(pictures):
        save(folder / f"train/r_{instant}.png", picture)
    return Written(
        folder, ("train/r",), true_poses()[:, :1], pictures, _MIDDLE[None], notes=("scaled",)
    )


def write_distorted(folder: Path) -> Written:
    """OpenCV's radial and tangential distortion."""
    k1, k2, p1, p2, k3 = -0.12, 0.03, 0.004, -0.003, 0.002

    def bend(points: Array) -> Array:
        x, y = points.T
        square = x**2 + y**2
        radial = 1 + k1 * square + k2 * square**2 + k3 * square**3
        return np.column_stack(
            [
                x * radial + 2 * p1 * x * y + p2 * (square + 2 * x**2),
                y * radial + p1 * (square + 2 * y**2) + 2 * p2 * x * y,
            ]
        )

    lens = {"camera_model": "OPENCV", "k1": k1, "k2": k2, "p1": p1, "p2": p2, "k3": k3}
    return _bent(folder, lens, bent_rays(bend, K, WIDTH, HEIGHT))


def write_fisheye(folder: Path) -> Written:
    """OpenCV's fisheye: an angle, bent by a polynomial, is the distance from the middle."""
    k1, k2, k3, k4 = 0.04, -0.02, 0.005, -0.001

    def bend(points: Array) -> Array:
        radius = np.linalg.norm(points, axis=1)
        angle = np.arctan(radius)
        square = angle**2
        bent = angle * (1 + square * (k1 + square * (k2 + square * (k3 + square * k4))))
        return points * (bent / np.maximum(radius, 1e-12))[:, None]

    lens = {"camera_model": "OPENCV_FISHEYE", "k1": k1, "k2": k2, "k3": k3, "k4": k4}
    return _bent(folder, lens, bent_rays(bend, K, WIDTH, HEIGHT))


def write_panorama(folder: Path) -> Written:
    """Equirectangular pictures of one camera: they are four pinholes' pictures when read."""
    width, height = 192, 96
    rows, columns = np.mgrid[:height, :width]
    longitude = ((columns + 0.5) / width - 0.5) * 2 * np.pi
    latitude = (0.5 - (rows + 0.5) / height) * np.pi
    rays = np.stack(
        [
            np.sin(longitude) * np.cos(latitude),
            -np.sin(latitude),
            np.cos(longitude) * np.cos(latitude),
        ],
        axis=-1,
    )
    poses = true_poses()[:, 0]
    frames = [_frame(f"pano/{i:03d}.png", pose) for i, pose in enumerate(poses)]
    top = {"camera_model": "EQUIRECTANGULAR", "w": width, "h": height, "frames": frames}
    _write(folder, top)
    side = round(width / np.pi)
    k = np.array([[side / 2, 0, (side - 1) / 2], [0, side / 2, (side - 1) / 2], [0, 0, 1]])
    square = pinhole_rays(k, side, side)
    turns = []
    for degrees in (0, 90, 180, 270):
        ahead = np.array([math.sin(math.radians(degrees)), 0, math.cos(math.radians(degrees))])
        turns.append(np.column_stack([np.cross([0, 1, 0], ahead), [0, 1, 0], ahead]))
    pictures: Pictures = []
    for instant in range(INSTANTS):
        save(folder / f"pano/{instant:03d}.png", scenery(instant, 0, rays))
        pictures.append([scenery(instant, 0, square @ turn.T) for turn in turns])
    views = np.stack([[pose @ rigid(turn, np.zeros(3)) for turn in turns] for pose in poses])
    names = tuple(f"pano-{degrees:03d}" for degrees in (0, 90, 180, 270))
    return Written(folder, names, views, pictures, np.stack([k] * 4), 2, ("equirectangular",))


def _bent(folder: Path, lens: Json, rays: Array) -> Written:
    """Photographs through a lens whose pixels see along ``rays``."""
    frames = []
    pictures: Pictures = []
    flat = pinhole_rays(K, WIDTH, HEIGHT)
    for instant, row in enumerate(true_poses()):
        pictures.append([scenery(instant, camera, flat) for camera in range(2)])
        for camera, (side, pose) in enumerate(zip(SIDES, row, strict=True)):
            save(folder / f"{side}_{instant}.png", scenery(instant, camera, rays))
            frames.append(_frame(f"{side}_{instant}.png", pose))
    _write(folder, _LENS | lens | {"frames": frames})
    return Written(folder, SIDES, true_poses(), pictures, _BOTH, 2)


def _saved(folder: Path, name: str, names: Sequence[str]) -> Written:
    pictures = true_pictures()
    for instant, row in enumerate(pictures):
        for side, picture in zip(SIDES, row, strict=True):
            file = name.format(side=side, instant=instant, number=instant + 1)
            save(folder / file, picture)
    return Written(folder, tuple(names), true_poses(), pictures, _BOTH)


def _frame(name: str, pose: Array) -> Json:
    return {"file_path": name, "transform_matrix": (pose @ _TO_OPENGL).tolist()}


def _write(folder: Path, top: Json, name: str = "transforms.json") -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(json.dumps(top, indent=1))
