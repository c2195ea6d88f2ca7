"""Photographs that textures are sampled from, and which of them see a billboard best (4.2.1)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.geometry.cameras import Cameras
from pipelines.street_billboards.billboards import Billboards
from pipelines.street_billboards.textures.view_directions import CIRCLE, DIRECTIONS

FloatArray = NDArray[np.float64]

_NEAREST = 1.0
"""Metres from the camera from which on a billboard is photographed well."""
_LEAST_FACING = 0.02
"""Cosine to a still rectangle's normal; flatter looks tell nothing."""


class Photographs(NamedTuple):
    """k photographs with what is known of them."""

    pixels: NDArray[np.uint8]
    """(k, y, x, 3), sRGB."""
    depth: NDArray[np.float32]
    """(k, y, x), m along the axis; nan where it is not known, inf in the sky."""
    deviation: NDArray[np.float32]
    """(k, y, x), m, its standard deviation."""
    intrinsics: FloatArray
    """(k, 3, 3)."""
    to_world: FloatArray
    """(k, 4, 4)."""
    exposure_lut: NDArray[np.uint8]
    """(k, 256, 3), code that evens out the exposure, by the photograph's code and channel."""


def best_photographs(
    billboards: Billboards, photographs: Photographs, tried: int, farthest: float
) -> NDArray[np.int32]:
    """Photographs (b, 32, tried) for each direction, the best first, -1 where there is none.

    The best shows a metre of the billboard with most pixels, from near the direction. farthest:
    metres from the camera.
    """
    _, height, width = photographs.depth.shape
    chosen = np.full((len(billboards.centre), DIRECTIONS, tried), -1, np.int32)
    normal = np.cross(billboards.half_s, billboards.half_t).astype(np.float64)
    cameras = Cameras(photographs.intrinsics, photographs.to_world, width, height)
    _choose(billboards, normal, cameras, farthest, chosen)
    return chosen


@njit(cache=True, nogil=True)
def _choose(
    billboards: Billboards,
    normal: FloatArray,
    cameras: Cameras,
    farthest: float,
    chosen: NDArray[np.int32],
) -> None:
    tried = chosen.shape[2]
    scores = np.empty((DIRECTIONS, tried))
    for b in range(len(billboards.centre)):
        scores[:] = 0.0
        for k in range(len(cameras.to_world)):
            away, position = _place_in_fan(billboards, b, normal[b], cameras, k, farthest)
            if away < 0.0:
                continue
            d = min(max(round(position), 0), DIRECTIONS - 1)
            # Pixels that a metre of it covers, fewer the farther from the view's own direction.
            score = cameras.intrinsics[k, 0, 0] / away * (1.0 - 0.5 * abs(position - d))
            for place in range(tried):
                if score > scores[d, place]:
                    for later in range(tried - 1, place, -1):
                        scores[d, later] = scores[d, later - 1]
                        chosen[b, d, later] = chosen[b, d, later - 1]
                    scores[d, place] = score
                    chosen[b, d, place] = k
                    break


@njit(cache=True, nogil=True)
def _place_in_fan(
    billboards: Billboards,
    b: int,
    normal: FloatArray,
    cameras: Cameras,
    k: int,
    farthest: float,
) -> tuple[float, float]:
    """Metres from camera k to billboard b, and where it stands in the fan (``fan_position``).

    -1 and 0 where it does not see the middle from the front, near enough, from inside the fan.
    """
    nothing = -1.0, 0.0
    centre, lens, pose = billboards.centre[b], cameras.intrinsics[k], cameras.to_world[k]
    ox, oy, oz = pose[0, 3] - centre[0], pose[1, 3] - centre[1], pose[2, 3] - centre[2]
    away = math.sqrt(ox * ox + oy * oy + oz * oz)
    if away > farthest or away < _NEAREST:
        return nothing
    x = -(ox * pose[0, 0] + oy * pose[1, 0] + oz * pose[2, 0])
    y = -(ox * pose[0, 1] + oy * pose[1, 1] + oz * pose[2, 1])
    z = -(ox * pose[0, 2] + oy * pose[1, 2] + oz * pose[2, 2])
    if z < 0.5 * _NEAREST:
        return nothing
    across, down = lens[0, 0] * x / z + lens[0, 2], lens[1, 1] * y / z + lens[1, 2]
    width, height = cameras.width, cameras.height
    if not (-0.5 <= across <= width - 0.5 and -0.5 <= down <= height - 0.5):
        return nothing
    if not billboards.turns[b]:
        length = math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
        along = ox * normal[0] + oy * normal[1] + oz * normal[2]
        if along / (length * away) < _LEAST_FACING:
            return nothing
    position = math.degrees(math.atan2(oy, ox)) * CIRCLE / 360.0 - billboards.fan[b]
    outside = (CIRCLE - DIRECTIONS + 1) / 2
    position = (position + outside) % CIRCLE - outside
    if position < -0.5 or position > DIRECTIONS - 0.5:
        return nothing
    return away, position
