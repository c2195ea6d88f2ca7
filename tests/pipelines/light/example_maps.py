"""Maps to test environments with, and what their integrals are."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance
from pipelines.light.environment_maps import solid_angles


def direction(azimuth: float, elevation: float) -> tuple[float, float, float]:
    a, e = math.radians(azimuth), math.radians(elevation)
    return math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)


def one_light(height: int, row: int, column: int) -> NDArray[np.float32]:
    light = np.zeros((height, 2 * height, 3), np.float32)
    light[row, column] = 1.0
    return light


def rough_map(height: int, seed: int = 0) -> NDArray[np.float32]:
    """Radiance over many powers of ten, black texels among it."""
    rng = np.random.default_rng(seed)
    light = np.exp(rng.normal(0.0, 3.0, (height, 2 * height, 3)))
    light[rng.random((height, 2 * height)) < 0.2] = 0.0
    return light.astype(np.float32)


def integral(values: NDArray[np.floating]) -> float:
    """Over the sphere, of values (H, W)."""
    return float((solid_angles(len(values))[:, None] * values).sum(dtype=np.float64))


def power_of_sun(light: NDArray[np.float32]) -> float:
    """Luminance times steradians above the horizon, less the dome's 2 pi."""
    bright = luminance(light.astype(np.float64))
    bright[len(light) // 2 :] = 0.0
    return integral(bright) - 2 * math.pi
