"""Traced pictures without their noise: Open Image Denoise (Áfra 2023), told where scratches are.

A denoiser knows fine detail from noise by what else it is shown of each pixel. Of glass neither
colour nor depth says much: what is seen is the room, bent, and scratches over it. So it is shown
the picture that smooth glass alone makes, which has little noise, with scratches as white as they
are dense; and the normals.

The estimate is biased: where paths are rare (light that finds its way out of thick glass by chance)
their few bright samples are spread over their surroundings or taken for noise and lost.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance
from pipelines.glass_scratches.drawing.path_tracing import TracedPicture


def denoised(picture: TracedPicture) -> NDArray[np.float32]:
    """The picture's radiance (H, W, 3) float32 without noise, never negative.

    >>> from pipelines.glass_scratches.drawing.path_tracing import TracedPicture
    >>> grey = np.full((32, 32, 3), 0.5, np.float32)
    >>> flat = np.zeros((32, 32), np.float32)
    >>> traced = TracedPicture(grey, flat, flat, grey, np.zeros_like(grey), 0)
    >>> bool(np.allclose(denoised(traced), 0.5, atol=0.02))
    True
    """
    import pyoidn

    found = pyoidn.denoise(picture.radiance, scratch_feature(picture), picture.normal, hdr=True)
    return np.maximum(found, np.float32(0.0))


def scratch_feature(picture: TracedPicture) -> NDArray[np.float32]:
    """What stands for the albedo, (H, W, 3) float32 in [0, 1]: smooth glass's picture, tone-mapped,
    under white scratches.

    Of the paths that met no scratch, and so of the share that they are of all, the mean radiance
    L shows as L / (L + median luminance), the rest as 1.
    """
    share = picture.scratched[..., None]
    scale = np.median(luminance(picture.radiance)) + np.float32(1e-6)
    clear = np.maximum(1 - share, np.float32(1e-3))
    seen = picture.smooth / clear
    return np.clip((1 - share) * seen / (seen + scale) + share, 0.0, 1.0).astype(np.float32)
