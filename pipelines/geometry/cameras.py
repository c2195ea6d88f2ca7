"""Pinhole cameras in the world: x east, y north, z up, metres.

A camera looks along its own +z, x to the right of the picture and y down (OpenCV's axes); the
middle of the first pixel is at (0, 0).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class Cameras(NamedTuple):
    """n cameras that take photographs of one size."""

    intrinsics: FloatArray
    """(n, 3, 3), K in pixels, no skew."""
    to_world: FloatArray
    """(n, 4, 4), from the camera's axes to the world's: a rotation and the camera's place."""
    width: int
    height: int


def project_points(
    intrinsics: FloatArray, to_world: FloatArray, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Pixels (…, 2) and depths (…,) along the optical axis, in metres, of points (…, 3).

    intrinsics (3, 3), to_world (4, 4) of one camera. Pixels of points behind it (depth <= 0) mean
    nothing.

    >>> lens = np.array([[100.0, 0.0, 50.0], [0.0, 100.0, 40.0], [0.0, 0.0, 1.0]])
    >>> pixel, depth = project_points(lens, np.eye(4), np.array([1.0, 0.0, 10.0]))
    >>> pixel.tolist(), float(depth)
    ([60.0, 40.0], 10.0)
    """
    seen = (points - to_world[:3, 3]) @ to_world[:3, :3]
    depth = seen[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        across = seen[..., 0] / depth * intrinsics[0, 0] + intrinsics[0, 2]
        down = seen[..., 1] / depth * intrinsics[1, 1] + intrinsics[1, 2]
    return np.stack([across, down], axis=-1), depth


def unproject_depth(
    intrinsics: FloatArray, to_world: FloatArray, depth: NDArray[np.floating]
) -> FloatArray:
    """World positions (y, x, 3) of a depth map (y, x) in metres along the optical axis."""
    height, width = depth.shape
    across = (np.arange(width) - intrinsics[0, 2]) / intrinsics[0, 0]
    down = (np.arange(height) - intrinsics[1, 2]) / intrinsics[1, 1]
    rays = np.stack(
        [*np.broadcast_arrays(across[None, :], down[:, None]), np.ones_like(depth)], axis=-1
    )
    return (rays * depth[..., None]) @ to_world[:3, :3].T + to_world[:3, 3]


def moved_left(to_world: FloatArray, offset: float) -> FloatArray:
    """A camera's pose (4, 4) moved to its left by ``offset`` metres."""
    moved = np.array(to_world, np.float64)
    moved[:3, 3] -= offset * moved[:3, 0]
    return moved
