"""Linear light and the sRGB encoding (IEC 61966-2-1), luminance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

REC709_LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Weights of linear R, G, B in the luminance Y (ITU-R BT.709; also the sRGB primaries)."""
_AIM = 0.8
"""Radiance that the brighter part of a picture is exposed to."""


def encode_srgb(linear: ArrayLike) -> NDArray[np.float64]:
    """Linear light to sRGB code values, both in [0, 1]; values outside are clipped.

    >>> encode_srgb([0.0, 0.18, 1.0, 7.0]).round(3).tolist()
    [0.0, 0.461, 1.0, 1.0]
    """
    clipped = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(
        clipped <= 0.0031308, 12.92 * clipped, 1.055 * np.power(clipped, 1 / 2.4) - 0.055
    )


def decode_srgb(encoded: ArrayLike) -> NDArray[np.float64]:
    """sRGB code values in [0, 1] to linear light."""
    values = np.asarray(encoded, dtype=np.float64)
    return np.where(values <= 0.04045, values / 12.92, np.power((values + 0.055) / 1.055, 2.4))


def to_8bit(linear: ArrayLike) -> NDArray[np.uint8]:
    """Linear light to 8-bit sRGB, rounded to the nearest code."""
    return np.rint(encode_srgb(linear) * 255.0).astype(np.uint8)


def auto_exposure(radiance: NDArray[np.floating]) -> float:
    """Factor that brings the 99 % quantile of radiance (any shape) to 0.8."""
    bright = float(np.quantile(np.maximum(radiance.astype(np.float32), 0.0), 0.99))
    return _AIM / max(bright, 1e-6)


def luminance(rgb: NDArray[np.floating]) -> NDArray[np.floating]:
    """Rec. 709 luminance of linear RGB in the last axis; keeps the dtype."""
    return rgb @ np.asarray(REC709_LUMINANCE, dtype=rgb.dtype)
