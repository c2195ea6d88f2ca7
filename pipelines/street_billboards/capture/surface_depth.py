"""What the points of a street hide from a camera: their depth map."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def surface_depth(
    positions: FloatArray,
    size: float,
    intrinsics: FloatArray,
    to_world: FloatArray,
    width: int,
    height: int,
    *,
    farthest: float,
) -> NDArray[np.float32]:
    """Depth (height, width) in metres along the camera's axis of the nearest points, inf elsewhere.

    positions (n, 3): points on surfaces, each drawn as a square of side ``size``, in metres, and of
    three pixels at least, up to ``farthest``. intrinsics (3, 3), to_world (4, 4).
    """
    seen = (positions - to_world[:3, 3]) @ to_world[:3, :3]
    depth = np.full((height, width), np.inf, np.float32)
    _splat(seen, size, np.asarray(intrinsics, np.float64), farthest, depth)
    return depth


@njit(cache=True, nogil=True)
def _splat(
    seen: FloatArray, size: float, k: FloatArray, farthest: float, depth: NDArray[np.float32]
) -> None:
    height, width = depth.shape
    for number in range(len(seen)):
        z = seen[number, 2]
        if z < 0.3 or z > farthest:
            continue
        across = k[0, 0] * seen[number, 0] / z + k[0, 2]
        down = k[1, 1] * seen[number, 1] / z + k[1, 2]
        reach = max(0.5 * size * k[0, 0] / z, 1.0)
        for y in range(
            max(math.ceil(down - reach), 0), min(math.floor(down + reach), height - 1) + 1
        ):
            for x in range(
                max(math.ceil(across - reach), 0), min(math.floor(across + reach), width - 1) + 1
            ):
                if z < depth[y, x]:
                    depth[y, x] = z
