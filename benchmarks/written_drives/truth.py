"""The drive that is written down: a rig of two cameras through a bend, its poses and pictures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

INSTANTS = 6
WIDTH, HEIGHT = 48, 32
K = np.array([[41.0, 0, 22.5], [0, 43.0, 16.25], [0, 0, 1]])
"""The middle of the first pixel at (0, 0)."""
BASELINE = 0.54
"""Metres between the cameras."""
SIDES = ("left", "right")

Array = NDArray[np.float64]


class Written(NamedTuple):
    """What the files of a form say of the drive.

    path: what is given to the reader.
    names: of the cameras, in the order of ``poses``.
    poses: (f, c, 4, 4), camera to world, OpenCV's axes, in the form's own world.
    pictures: f rows of c pictures (h, w, 3) uint8.
    intrinsics: (c, 3, 3).
    codes: how far a pixel may be off, where the photographs are distorted; else 0.
    notes: a word of each note that has to be given.
    """

    path: Path
    names: tuple[str, ...]
    poses: Array
    pictures: list[list[NDArray[np.uint8]]]
    intrinsics: Array
    codes: int = 0
    notes: tuple[str, ...] = ()


def true_poses() -> Array:
    """(f, 2, 4, 4): camera to world, z up, metres: a car that turns to the left, uphill."""
    poses = np.empty((INSTANTS, 2, 4, 4))
    for instant in range(INSTANTS):
        heading = 0.3 + 0.05 * instant  # radians from the east
        ahead = np.array([np.cos(heading), np.sin(heading), 0.02 * instant])
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, [0, 0, 1])
        right /= np.linalg.norm(right)
        turn = np.column_stack([right, np.cross(ahead, right), ahead])
        middle = np.array([120.0, -40.0, 2.0]) + 1.1 * instant * ahead
        for camera in range(2):
            poses[instant, camera] = rigid(turn, middle + (camera - 0.5) * BASELINE * right)
    return poses


def true_pictures() -> list[list[NDArray[np.uint8]]]:
    """f rows of two pictures of noise: (height, width, 3)."""
    chance = np.random.default_rng(23)
    shape = INSTANTS, 2, HEIGHT, WIDTH, 3
    return [list(row) for row in chance.integers(0, 256, shape).astype(np.uint8)]


def rigid(turn: Any, place: Any) -> Array:
    """(4, 4) of axes (3, 3) and a place (3,)."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, place
    return pose


def save(path: Path, picture: NDArray[np.uint8]) -> None:
    """As a PNG, its folder made."""
    from PIL import Image

    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture).save(path)


def quaternion(turn: Array) -> Array:
    """w, x, y, z of a rotation that turns by less than half a turn: scipy's."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(turn).as_quat()
    return np.array([w, x, y, z])


def scenery(instant: int, camera: int, rays: Array) -> NDArray[np.uint8]:
    """Smooth colours of directions (…, 3) in a camera's axes: (…, 3) uint8. A lens that is undone
    rightly shows them at the pinhole's own directions."""
    unit = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    phase = np.array([0.0, 2.0, 4.0]) + instant + 0.5 * camera
    waves = np.sin(2.5 * unit + phase) + 0.6 * np.cos(2 * unit[..., [1, 2, 0]])
    return np.rint(128 + 60 * waves).astype(np.uint8)


def pinhole_rays(k: Array, width: int, height: int) -> Array:
    """Directions of a pinhole's pixels: (height, width, 3)."""
    rows, columns = np.mgrid[:height, :width].astype(float)
    across, down = (columns - k[0, 2]) / k[0, 0], (rows - k[1, 2]) / k[1, 1]
    return np.stack([across, down, np.ones_like(across)], axis=-1)


def bent_rays(bend: Callable[[Array], Array], k: Array, width: int, height: int) -> Array:
    """Directions (height, width, 3) of a bent picture's pixels: those that ``bend``, which turns
    points (n, 2) at distance 1 into points on the sensor, brings there; by Newton's method."""
    rows, columns = np.mgrid[:height, :width].astype(float)
    wanted = np.column_stack(
        [((columns - k[0, 2]) / k[0, 0]).ravel(), ((rows - k[1, 2]) / k[1, 1]).ravel()]
    )
    points = wanted.copy()
    for _ in range(60):
        error = bend(points) - wanted
        jacobian = np.empty((len(points), 2, 2))
        for axis in range(2):
            step = np.zeros(2)
            step[axis] = 1e-6
            jacobian[:, :, axis] = (bend(points + step) - bend(points - step)) / 2e-6
        points = points - np.clip(np.linalg.solve(jacobian, error[..., None])[..., 0], -0.3, 0.3)
    assert np.abs(bend(points) - wanted).max() < 1e-9
    return np.column_stack([points, np.ones(len(points))]).reshape(height, width, 3)
