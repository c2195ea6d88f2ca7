"""The rival of equal bytes: coloured points, drawn as squares."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
_CELL = 0.05
"""Metres that points are apart before any is left out."""
_FINER = 2
"""Samples along a pixel's side, as the billboards are drawn with."""


class DrawnPoints(NamedTuple):
    """Pictures of points."""

    pictures: NDArray[np.uint8]
    """(k, y, x, 3), sRGB."""
    covered: NDArray[np.bool_]
    """(k, y, x)."""
    number: int
    """Points drawn."""


def drawn_points(
    positions: FloatArray,
    colours: NDArray[np.uint8],
    most: int,
    intrinsics: FloatArray,
    poses: FloatArray,
    size: tuple[int, int],
) -> DrawnPoints:
    """Pictures from cameras (K (3, 3), poses (k, 4, 4)) of at most ``most`` of the points.

    Points (n, 3) are thinned on a grid as coarse as it has to be; each is a square of that grid.
    """
    cell, kept = _CELL, np.arange(len(positions))
    while len(kept) > most:
        cell *= 1.02
        kept = _thinned(positions, cell)
    width, height = (_FINER * side for side in size)
    fine = intrinsics.copy()
    fine[:2] *= _FINER
    fine[:2, 2] += (_FINER - 1) / 2
    pictures, covered = [], []
    for pose in poses:
        depth = np.full((height, width), np.inf, np.float32)
        picture = np.zeros((height, width, 3), np.uint8)
        seen = (positions[kept] - pose[:3, 3]) @ pose[:3, :3]
        _splat(seen, colours[kept], cell, fine, depth, picture)
        shape = (size[1], _FINER, size[0], _FINER)
        hit = np.isfinite(depth).reshape(shape).sum(axis=(1, 3))
        total = picture.reshape(*shape, 3).sum(axis=(1, 3))
        mean = total / np.maximum(hit, 1)[..., None]
        pictures.append(np.rint(mean).astype(np.uint8))
        covered.append(hit > _FINER**2 / 2)
    return DrawnPoints(np.stack(pictures), np.stack(covered), len(kept))


def _thinned(positions: FloatArray, cell: float) -> NDArray[np.int64]:
    codes = np.floor((positions - positions.min(axis=0)) / cell).astype(np.int64)
    codes = (codes[:, 0] << 42) | (codes[:, 1] << 21) | codes[:, 2]
    return np.sort(np.unique(codes, return_index=True)[1])


@njit(cache=True, nogil=True)
def _splat(
    seen: FloatArray,
    colours: NDArray[np.uint8],
    side: float,
    k: FloatArray,
    depth: NDArray[np.float32],
    picture: NDArray[np.uint8],
) -> None:
    height, width = depth.shape
    for number in range(len(seen)):
        z = seen[number, 2]
        if z < 0.3:
            continue
        across = k[0, 0] * seen[number, 0] / z + k[0, 2]
        down = k[1, 1] * seen[number, 1] / z + k[1, 2]
        reach = max(0.5 * side * k[0, 0] / z, 0.5)
        for y in range(
            max(math.ceil(down - reach), 0), min(math.floor(down + reach), height - 1) + 1
        ):
            for x in range(
                max(math.ceil(across - reach), 0), min(math.floor(across + reach), width - 1) + 1
            ):
                if z < depth[y, x]:
                    depth[y, x] = z
                    picture[y, x] = colours[number]
