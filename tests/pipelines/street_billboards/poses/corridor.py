"""A street between two painted walls, photographed from known poses: exact, and quick to make.

The world's axes are those of a camera at its beginning: x right, y down, z along the street. The
road lies at y = 1.5, walls stand at x = -5 and x = 6 up to y = -5, a third closes the street.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

WIDTH, HEIGHT = 320, 192
HEIGHT_ABOVE_ROAD = 1.5
_SAMPLES = 2
_END = 60.0
_TEXELS_A_METRE = 24


def lens(focal: float = 210.0) -> FloatArray:
    return np.array([[focal, 0, (WIDTH - 1) / 2], [0, focal, (HEIGHT - 1) / 2], [0, 0, 1.0]])


def path(places: FloatArray, headings: FloatArray) -> FloatArray:
    """Poses (f, 4, 4) at places (f, 3), turned to the right by headings (f,), radians."""
    poses = np.tile(np.eye(4), (len(places), 1, 1))
    turn = np.column_stack([np.zeros(len(places)), headings, np.zeros(len(places))])
    poses[:, :3, :3] = Rotation.from_rotvec(turn).as_matrix()
    poses[:, :3, 3] = places
    return poses


def swerving(frames: int, step: float) -> FloatArray:
    """A drive that turns to and fro by 20 degrees."""
    along = step * np.arange(frames)
    heading = np.radians(20) * np.sin(2 * np.pi * np.arange(frames) / 24)
    x = np.concatenate([[0], np.cumsum(step * np.sin(heading))[:-1]])
    return path(np.column_stack([x, np.zeros(frames), along]), heading)


@functools.cache
def _paint(seed: int) -> NDArray[np.float32]:
    """(1024, 1024) noise of all sizes that repeats, codes."""
    import cv2

    random = np.random.default_rng(seed)
    paint = np.zeros((1024, 1024), np.float32)
    for size in (32, 64, 128, 256, 512):
        octave = random.normal(size=(size, size)).astype(np.float32)
        paint += cv2.resize(octave, (1024, 1024), interpolation=cv2.INTER_LINEAR)
    return np.clip(128 + 28 * paint, 0, 255)


def photograph(pose: FloatArray, k: FloatArray) -> NDArray[np.uint8]:
    """(192, 320) uint8: what a camera with K sees from a pose, camera to world."""
    across, down = np.meshgrid(
        (np.arange(WIDTH * _SAMPLES) + 0.5) / _SAMPLES - 0.5,
        (np.arange(HEIGHT * _SAMPLES) + 0.5) / _SAMPLES - 0.5,
    )
    rays = np.stack([(across - k[0, 2]) / k[0, 0], (down - k[1, 2]) / k[1, 1], 0 * down + 1], -1)
    rays = (rays.reshape(-1, 3) @ pose[:3, :3].T).astype(np.float32)
    eye = pose[:3, 3].astype(np.float32)
    # Of a convex room each ray leaves by the wall that it meets first.
    walls = np.array([-5.0, 6.0, HEIGHT_ABOVE_ROAD, _END], np.float32)
    axes = np.array([0, 0, 1, 2])
    with np.errstate(divide="ignore"):
        ways = (walls - eye[axes]) / rays[:, axes]
    ways[~(ways > 0)] = np.inf
    wall = ways.argmin(axis=1)
    places = eye + np.take_along_axis(ways, wall[:, None], axis=1) * rays
    shown = np.full(len(rays), 220.0, np.float32)
    for number, axis in enumerate(axes):
        hit = np.flatnonzero((wall == number) & (places[:, 1] > -5))
        shown[hit] = _sampled(_paint(number), np.delete(places[hit], axis, axis=1))
    picture = shown.reshape(HEIGHT, _SAMPLES, WIDTH, _SAMPLES).mean(axis=(1, 3))
    return np.rint(picture).astype(np.uint8)


def _sampled(paint: NDArray[np.float32], metres: FloatArray) -> NDArray[np.float32]:
    at = metres * _TEXELS_A_METRE
    low = np.floor(at).astype(int)
    part = (at - low).astype(np.float32)
    rows, columns = low[:, 0], low[:, 1]
    size = len(paint)
    corner = [paint[(rows + a) % size, (columns + b) % size] for a in (0, 1) for b in (0, 1)]
    left = corner[0] * (1 - part[:, 0]) + corner[2] * part[:, 0]
    right = corner[1] * (1 - part[:, 0]) + corner[3] * part[:, 0]
    return left * (1 - part[:, 1]) + right * part[:, 1]
