"""Traced pictures without their noise: Open Image Denoise (Áfra 2023), told where scratches are.

A pixel shows the room, bent, where its paths met no scratch, and scattered light where they did.
The first is sharp and of any colour, and has little noise; the second has all the noise, is smooth
but for the scratches' outlines, and these are in the share s of the paths that met one. So two
pictures are denoised: L, the mean radiance of the paths that met none, and S, what the others add,
with s for its albedo, for an albedo's fine detail is kept. (1 - s) L + S is what is shown. s has
noise where scratches are narrower than pixels, and a denoiser takes fine scratches for noise: of
what it takes away, as much is given back as is more than the noise of so many paths (Wiener).

The estimate is biased. What paths find by chance (light on its way out of thick glass, a window
mirrored twice) is a few bright samples at 16 or 64 paths a pixel: they are spread over their
surroundings, or taken for noise and lost. Nothing is clamped before.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.drawing.path_tracing import TracedPicture

_FEW = np.float32(0.1)
"""Share of the paths that are too few to tell what lies behind a scratch."""
_AROUND = 2.0
"""Pixels, the deviation of a Gaussian."""
_NOISE_BOX = (5, 5)
"""Pixels over which the noise of the share is told from its detail."""


def denoised(picture: TracedPicture) -> NDArray[np.float32]:
    """The picture's radiance (H, W, 3) float32 without noise, never negative.

    >>> from pipelines.glass_scratches.drawing.path_tracing import TracedPicture
    >>> grey = np.full((32, 32, 3), 0.5, np.float32)
    >>> none = np.zeros((32, 32), np.float32)
    >>> traced = TracedPicture(grey, none, none, grey, np.zeros_like(grey), 0, 16)
    >>> round(float(denoised(traced).mean()), 2)
    0.5
    """
    from pyoidn import denoise

    share = np.repeat(picture.scratched[..., None], 3, axis=2)
    scattered = np.maximum(picture.radiance - picture.smooth, np.float32(0.0))
    clear = 1 - _quiet_share(picture.scratched, picture.samples)
    found = clear[..., None] * denoise(_behind_scratches(picture), hdr=True)
    found += denoise(scattered, share, picture.normal, hdr=True)
    return np.maximum(found, np.float32(0.0))


def _quiet_share(share: NDArray[np.float32], samples: int) -> NDArray[np.float32]:
    """The share (H, W) of ``samples`` paths with less noise, and all of its detail."""
    import cv2
    from pyoidn import denoise

    smooth = np.clip(denoise(np.repeat(share[..., None], 3, axis=2))[..., 0], 0.0, 1.0)
    left = share - smooth
    noise, all_left = (
        cv2.blur(each, _NOISE_BOX) for each in (share * (1 - share) / samples, left * left)
    )
    kept = np.clip(1 - noise / np.maximum(all_left, np.float32(1e-12)), 0.0, 1.0)
    return np.asarray(smooth + kept * left)


def _behind_scratches(picture: TracedPicture) -> NDArray[np.float32]:
    """Mean radiance (H, W, 3) of the paths that met no scratch; where hardly any did, that of the
    pixels around."""
    import cv2

    clear = 1 - picture.scratched
    own = picture.smooth / np.maximum(clear, _FEW)[..., None]
    around, count = (cv2.GaussianBlur(each, (0, 0), _AROUND) for each in (picture.smooth, clear))
    filled = around / np.maximum(count, np.float32(1e-4))[..., None]
    return np.where(clear[..., None] > _FEW, own, filled).astype(np.float32)
