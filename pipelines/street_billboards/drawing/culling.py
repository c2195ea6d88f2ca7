"""Which billboards a camera can see: rectangles against the five planes of its view, in order.

The planes are those through the picture's edges (the outer edges of its pixels) and the one at
``NEAR``. A rectangle is left out where it lies behind one of them as a whole: what shows never is.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.billboards import Billboards

NEAR = 0.05
"""Metres along the optical axis, nearer than which nothing is drawn."""
_SLACK = 1e-4
"""Metres: what is placed in float32 may be so far off."""


def visible_billboards(
    billboards: Billboards,
    intrinsics: NDArray[np.floating],
    to_world: NDArray[np.floating],
    width: int,
    height: int,
) -> NDArray[np.int64]:
    """Rows (k,) of the billboards that may show in the picture, nearest centres first.

    intrinsics (3, 3) in pixels, to_world (4, 4), of a camera of ``cameras``.
    """
    to_world = np.asarray(to_world, np.float64)
    planes = _planes(np.asarray(intrinsics, np.float64), width, height) @ to_world[:3, :3].T
    squared = np.empty(len(billboards.centre), np.float64)
    _distances(
        billboards.centre,
        billboards.turns,
        billboards.half_s,
        billboards.half_t,
        np.ascontiguousarray(to_world[:3, 3]),
        np.ascontiguousarray(planes),
        squared,
    )
    chosen = np.flatnonzero(squared >= 0)
    return chosen[np.argsort(squared[chosen], kind="stable")]


def _planes(intrinsics: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
    """Unit normals (5, 3) to the inside, in the camera's axes; the first is that of ``NEAR``."""
    across, down, middle_x, middle_y = intrinsics[[0, 1, 0, 1], [0, 1, 2, 2]]
    normals = np.array(
        [
            [0.0, 0.0, 1.0],
            [across, 0.0, middle_x + 0.5],
            [-across, 0.0, width - 0.5 - middle_x],
            [0.0, down, middle_y + 0.5],
            [0.0, -down, height - 0.5 - middle_y],
        ]
    )
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


@njit(cache=True, nogil=True, error_model="numpy")
def _distances(
    centre: NDArray[np.float64],
    turns: NDArray[np.bool_],
    half_s: NDArray[np.float32],
    half_t: NDArray[np.float32],
    eye: NDArray[np.float64],
    planes: NDArray[np.float64],
    squared: NDArray[np.float64],
) -> None:
    """Squared distances of the centres, -1 for what is outside; axes as ``axes_facing``."""
    for row in range(len(centre)):
        x, y, z = centre[row, 0] - eye[0], centre[row, 1] - eye[1], centre[row, 2] - eye[2]
        sx, sy, sz = half_s[row, 0], half_s[row, 1], half_s[row, 2]
        tx, ty, tz = half_t[row, 0], half_t[row, 1], half_t[row, 2]
        distance = math.sqrt(x * x + y * y + z * z)
        if turns[row]:
            level = math.sqrt(x * x + y * y)
            long_s, long_t = half_s[row, 0], half_t[row, 2]
            # To the eye: -(x, y, z); straight above or below, the axes may be any: take a sphere.
            sure = level > 1e-6 * distance
            if sure:
                sx, sy, sz = long_s * y / level, -long_s * x / level, 0.0
                scale = long_t / (level * distance)
                tx, ty, tz = -scale * x * z, -scale * y * z, scale * level * level
        else:
            sure, long_s, long_t = True, 0.0, 0.0
        seen = True
        for plane in range(5):
            nx, ny, nz = planes[plane, 0], planes[plane, 1], planes[plane, 2]
            if sure:
                reach = abs(nx * sx + ny * sy + nz * sz) + abs(nx * tx + ny * ty + nz * tz)
            else:
                reach = math.hypot(long_s, long_t)
            least = NEAR if plane == 0 else 0.0
            if nx * x + ny * y + nz * z + reach < least - _SLACK:
                seen = False
                break
        squared[row] = distance * distance if seen else -1.0
