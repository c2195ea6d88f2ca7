"""The drive as COLMAP's models: written by pycolmap, and by hand as older versions wrote them."""

from __future__ import annotations

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
    bent_rays,
    pinhole_rays,
    quaternion,
    save,
    scenery,
    true_pictures,
    true_poses,
)

_CENTRE = K[0, 2] + 0.5, K[1, 2] + 0.5  # counted from the first pixel's outer corner
_PINHOLE = [float(value) for value in (K[0, 0], K[1, 1], *_CENTRE)]
_NAMES = tuple(f"{side}/frame" for side in SIDES)


def write_rig_binary(folder: Path) -> Written:
    """Binary, by pycolmap: a rig of two cameras, photographs that its names alone do not pair."""
    (folder / "sparse/0").mkdir(parents=True)
    name = "cam_{side}_{odd:03d}.png"
    model = _reconstruction("PINHOLE", _PINHOLE, name, rig=True)
    model.write_binary(str(folder / "sparse/0"))
    written = _saved(folder, name)
    return written._replace(names=("camera 1", "camera 2"))


def write_text(folder: Path) -> Written:
    """Text, by pycolmap: each camera for itself, an undistorted workspace; folders are cameras."""
    (folder / "sparse").mkdir(parents=True)
    name = "{side}/frame{instant:04d}.png"
    _reconstruction("PINHOLE", _PINHOLE, name, rig=False).write_text(str(folder / "sparse"))
    return _saved(folder, name)


def write_two_pieces(folder: Path) -> Written:
    """Two models of one capture, the first of them the smaller; distorted (SIMPLE_RADIAL)."""
    focal, k1 = 42.0, -0.2
    k = np.array([[focal, 0, K[0, 2]], [0, focal, K[1, 2]], [0, 0, 1]])

    def bend(points: Array) -> Array:
        return points * (1 + k1 * (points**2).sum(axis=1, keepdims=True))

    return _bent(
        folder, "SIMPLE_RADIAL", [focal, *_CENTRE, k1], k, bent_rays(bend, k, WIDTH, HEIGHT)
    )


def write_fisheye(folder: Path) -> Written:
    """RADIAL_FISHEYE, whose two terms are the first of OpenCV's four."""
    focal, k1, k2 = 42.0, 0.03, -0.01
    k = np.array([[focal, 0, K[0, 2]], [0, focal, K[1, 2]], [0, 0, 1]])

    def bend(points: Array) -> Array:
        radius = np.linalg.norm(points, axis=1)
        angle = np.arctan(radius)
        bent = angle * (1 + k1 * angle**2 + k2 * angle**4)
        return points * (bent / np.maximum(radius, 1e-12))[:, None]

    return _bent(
        folder, "RADIAL_FISHEYE", [focal, *_CENTRE, k1, k2], k, bent_rays(bend, k, WIDTH, HEIGHT)
    )


def write_older_text(folder: Path) -> Written:
    """Text by hand, as before rigs: without their files, one camera whose photographs differ in
    names only, cameras that nobody used, and empty lines of keypoints."""
    model = folder / "colmap" / "sparse" / "0"
    model.mkdir(parents=True)
    cameras = ["# Camera list", f"4 PINHOLE {WIDTH} {HEIGHT} " + " ".join(map(repr, _PINHOLE))]
    cameras.append("9 FOV 640 480 500 500 320 240 0.9")
    images = ["# Image list with two lines of data per image:"]
    for instant, row in enumerate(true_poses()):
        to_camera = np.linalg.inv(row[0])
        numbers = [*quaternion(to_camera[:3, :3]), *to_camera[:3, 3]]
        words = " ".join(repr(float(number)) for number in numbers)
        images += [f"{instant + 7} {words} 4 IMG {instant + 98}.png", ""]
    (model / "cameras.txt").write_text("\n".join(cameras) + "\n")
    (model / "images.txt").write_text("\n".join(images) + "\n")
    (model / "points3D.txt").write_text("# none\n")
    pictures = [[row[0]] for row in true_pictures()]
    for instant, (picture,) in enumerate(pictures):
        save(folder / "images" / f"IMG {instant + 98}.png", picture)
    return Written(folder, ("IMG",), true_poses()[:, :1], pictures, K[None])


def _bent(folder: Path, model: str, parameters: list[float], k: Array, rays: Array) -> Written:
    """Models 0, of two photographs, and 1, of all; their photographs see along ``rays``."""
    name = "{side}/frame{instant:04d}.png"
    for number, instants in ((0, 2), (1, None)):
        (folder / "sparse" / str(number)).mkdir(parents=True)
        piece = _reconstruction(model, parameters, name, rig=True, instants=instants)
        piece.write_binary(str(folder / "sparse" / str(number)))
    flat = pinhole_rays(k, WIDTH, HEIGHT)
    pictures = []
    for instant in range(len(true_poses())):
        pictures.append([scenery(instant, camera, flat) for camera in range(2)])
        for camera, side in enumerate(SIDES):
            picture = scenery(instant, camera, rays)
            save(folder / "images" / name.format(side=side, instant=instant), picture)
    return Written(folder, _NAMES, true_poses(), pictures, np.stack([k, k]), 2, ("Model 1",))


def _saved(folder: Path, name: str) -> Written:
    pictures = true_pictures()
    for instant, row in enumerate(pictures):
        for camera, (side, picture) in enumerate(zip(SIDES, row, strict=True)):
            file = name.format(side=side, instant=instant, odd=_odd(instant, camera))
            save(folder / "images" / file, picture)
    return Written(folder, _NAMES, true_poses(), pictures, np.stack([K, K]))


def _odd(instant: int, camera: int) -> int:
    """Numbers that run on through both cameras: they pair nothing."""
    return 10 + 2 * instant + camera


def _reconstruction(
    model: str, parameters: list[float], name: str, *, rig: bool, instants: int | None = None
) -> Any:
    """pycolmap's model of the drive: a point, and keypoints that see nothing."""
    import pycolmap

    made = pycolmap.Reconstruction()
    for number in (1, 2):
        lens = pycolmap.Camera(
            camera_id=number, model=model, width=WIDTH, height=HEIGHT, params=parameters
        )
        if rig:
            made.add_camera(lens)
        else:
            made.add_camera_with_trivial_rig(lens)
    poses = true_poses()[:instants]
    sensors = [pycolmap.sensor_t(type=pycolmap.SensorType.CAMERA, id=number) for number in (1, 2)]
    if rig:
        pair = pycolmap.Rig(rig_id=1)
        pair.add_ref_sensor(sensors[0])
        pair.add_sensor(sensors[1], _rigid(poses[0, 1], poses[0, 0]))
        made.add_rig(pair)
    for instant, row in enumerate(poses):
        images = []
        for camera, (side, pose) in enumerate(zip(SIDES, row, strict=True)):
            file = name.format(side=side, instant=instant, odd=_odd(instant, camera))
            image = pycolmap.Image(
                image_id=2 * instant + camera + 1,
                camera_id=camera + 1,
                name=file,
                keypoints=np.array([[3.0, 4.0], [11.0, 6.0]]),
            )
            if rig:
                image.frame_id = 50 - instant
                images.append(image)
            else:
                made.add_image_with_trivial_frame(image, _rigid(pose))
        if rig:
            frame = pycolmap.Frame(frame_id=50 - instant, rig_id=1)
            for sensor, image in zip(sensors, images, strict=True):
                frame.add_data_id(pycolmap.data_t(sensor_id=sensor, id=image.image_id))
            frame.rig_from_world = _rigid(row[0])
            made.add_frame(frame)
            for image in images:
                made.add_image(image)
            made.register_frame(50 - instant)
    colour: Any = np.zeros((3, 1), np.uint8)
    made.add_point3D(np.array([1.0, 2.0, 3.0]), pycolmap.Track(), colour)
    return made


def _rigid(pose: Array, reference: Array | None = None) -> Any:
    """World to camera; or the reference camera's axes to the camera's."""
    import pycolmap

    motion = np.linalg.inv(pose) @ (np.eye(4) if reference is None else reference)
    return pycolmap.Rigid3d(motion[:3])
