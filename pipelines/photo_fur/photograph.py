"""A photograph made ready for the model: exposure and size."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

HIGHLIGHT_SHARE = 0.001
"""Share of the channels' values that may clip when an HDR photograph is exposed."""


def expose(radiance: NDArray[np.floating]) -> NDArray[np.float32]:
    """Linear radiance scaled into [0, 1]; a photograph that already lies there stays as it is.

    White is the radiance that only HIGHLIGHT_SHARE of the values exceed, but never below 1: an
    HDR photograph is darkened where it must be, not brightened.
    """
    white = max(1.0, float(np.quantile(radiance, 1.0 - HIGHLIGHT_SHARE)))
    return np.clip(radiance / white, 0.0, 1.0).astype(np.float32)


def fit_size(radiance: NDArray[np.floating], largest_side: int) -> NDArray[np.float32]:
    """The photograph averaged down until its longer side has at most ``largest_side`` pixels."""
    from skimage.transform import resize_local_mean

    height, width, channels = radiance.shape
    scale = largest_side / max(height, width)
    if scale >= 1.0:
        return radiance.astype(np.float32)
    shape = (max(1, round(height * scale)), max(1, round(width * scale)), channels)
    return resize_local_mean(radiance, shape, channel_axis=2).astype(np.float32)
