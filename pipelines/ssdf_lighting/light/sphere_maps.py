"""Maps of radiance averaged down, blurred, summed up: what lights are fitted to."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pipelines.light.environment_maps import solid_angles, texel_directions

FloatArray = NDArray[np.float64]


def downsampled(radiance: NDArray[np.floating], height: int) -> FloatArray:
    """A map's means over the texels of a map of another height: (height, 2 height, 3) float64.

    Means are over solid angle, so the flux stays. Raises ValueError for height < 1.
    """
    if height < 1:
        raise ValueError(f"height is {height}; expected 1 or more.")
    down = _overlaps(_falling(len(radiance)), _falling(height))
    along = _overlaps(np.linspace(0, 1, 2 * len(radiance) + 1), np.linspace(0, 1, 2 * height + 1))
    rows = np.tensordot(down, radiance.astype(np.float64), axes=1)
    return np.einsum("ab,rbc->rac", along, rows, optimize=True)


def _falling(height: int) -> FloatArray:
    """Borders of the rows as shares of the sphere, from 0 at the zenith to 1."""
    return np.sin(np.linspace(0.0, 0.5 * math.pi, height + 1)) ** 2


def _overlaps(old: FloatArray, new: FloatArray) -> FloatArray:
    """Shares (new, old) that old intervals have in new ones; of both the borders are given."""
    ends = np.minimum(new[1:, None], old[1:])
    shared = np.maximum(ends - np.maximum(new[:-1, None], old[:-1]), 0.0)
    return shared / shared.sum(axis=1, keepdims=True)


def fluxes(map_: FloatArray) -> FloatArray:
    """Integral (3,) over the sphere."""
    return np.tensordot(solid_angles(len(map_)), map_.sum(axis=1), axes=1)


def blurred(map_: FloatArray, sharpness: float) -> FloatArray:
    """A map (H, 2 H, 3), each texel replaced by its surroundings' mean, weighted by an SG."""
    height, width, _ = map_.shape
    ways = texel_directions(height)
    weights = solid_angles(height)[:, None]
    spectrum = np.fft.rfft(map_, axis=1)
    soft = np.empty(map_.shape)
    # Turned about the axis the kernel is the same: columns are a circular convolution.
    for row in range(height):
        kernel = np.exp(sharpness * (ways @ ways[row, 0] - 1.0)) * weights
        turned = np.fft.rfft(kernel / kernel.sum(), axis=1)
        soft[row] = np.fft.irfft((turned[..., None] * spectrum).sum(axis=0), n=width, axis=0)
    return np.maximum(soft, 0.0)  # the transform's rounding
