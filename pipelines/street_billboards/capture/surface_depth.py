"""What the points of a street hide from a camera: their depth map, where stereo has none."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

import numba
import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.capture.point_fusion import RgbdViews

FloatArray = NDArray[np.float64]

_POINT_SIDE = 0.08
"""Metres that a point of the street is drawn with."""
_DEVIATION = 0.1
"""Metres, of a depth that is one of points."""
_BEYOND = 10.0
"""Metres beyond the farthest billboard, of points that may lie behind it."""


def fill_unknown_depth(views: RgbdViews, positions: FloatArray, *, farthest: float) -> None:
    """Give pixels without a depth the one of the street's points (n, 3), in place.

    inf where there are none, with a standard deviation of 0.1 m; farthest: metres from a camera to
    the billboards that are asked about.
    """
    places = views.poses[:, :3, 3]
    reach = farthest + _BEYOND
    near = (positions > places.min(axis=0) - reach) & (positions < places.max(axis=0) + reach)
    positions = positions[near.all(axis=1)]
    _, height, width = views.depth.shape

    def fill(number: int) -> None:
        unknown = np.isnan(views.depth[number])
        surface = surface_depth(
            positions,
            _POINT_SIDE,
            views.intrinsics[number],
            views.poses[number],
            width,
            height,
            farthest=reach,
        )
        views.depth[number][unknown] = surface[unknown]
        views.deviation[number][unknown] = _DEVIATION

    with ThreadPoolExecutor(numba.get_num_threads()) as threads:
        list(threads.map(fill, range(len(views.depth))))


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
