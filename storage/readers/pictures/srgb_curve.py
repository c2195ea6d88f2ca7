"""The curve between codes of sRGB and linear light (IEC 61966-2-1, 5.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def light_of_srgb(encoded: NDArray[np.floating]) -> NDArray[np.floating]:
    """Linear light in [0, 1] of sRGB values in [0, 1], of their type."""
    curved = ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    light: NDArray[np.floating] = np.where(encoded <= 0.04045, encoded / 12.92, curved)
    return light


def srgb_of_light(light: NDArray[np.floating]) -> NDArray[np.float64]:
    """sRGB values in [0, 1] of linear light; what is less or more is clipped."""
    clipped = np.clip(light.astype(np.float64), 0, 1)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
