"""Figures of depth, against what is true."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.cameras import projected

_FARTHEST = 20.0
_TOLERANCE = 0.05


def depth_error(depth: NDArray[np.floating], truth: NDArray[np.floating]) -> float:
    """Share of the pixels (y, x) up to 20 m away that are unknown or off by more than 5 %."""
    asked = truth < _FARTHEST
    with np.errstate(invalid="ignore"):
        right = np.abs(depth - truth) <= _TOLERANCE * truth
    return float(1.0 - right[asked].mean())


def stray_share(
    positions: NDArray[np.floating],
    intrinsics: NDArray[np.float64],
    poses: NDArray[np.float64],
    truths: NDArray[np.floating],
) -> float:
    """Share of points (n, 3) up to 20 m before a camera that are nearer than the true surface.

    By more than 5 % of its depth. intrinsics (3, 3), poses (k, 4, 4) and true depths (k, y, x) of
    cameras. Points behind the surface are hidden and tell nothing.
    """
    asked = strays = 0
    _, height, width = truths.shape
    for pose, truth in zip(poses, truths, strict=True):
        pixels, depth = projected(intrinsics, pose, np.asarray(positions, np.float64))
        before = (depth > 1.0) & (depth < _FARTHEST)
        x, y = np.rint(pixels[before]).astype(np.int64).T
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        there, depth = truth[y[inside], x[inside]], depth[before][inside]
        asked += int((depth < there * (1 + _TOLERANCE)).sum())
        strays += int((depth < there * (1 - _TOLERANCE)).sum())
    return strays / max(asked, 1)
