"""The sky behind a street: what no surface hides, as an equirectangular map."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.colour import decode_srgb
from pipelines.street_billboards.cameras import points_at

_CLEAR = 9
"""Pixels around one of the sky that have to be sky, too."""
_SMOOTH = 1.0
"""Blur of what is filled in, in texels."""


class SkyView(NamedTuple):
    """A photograph of which something is sky."""

    pixels: NDArray[np.uint8]
    """(y, x, 3), sRGB."""
    surface: NDArray[np.float32]
    """(y, x), depth of what the street hides; inf where it hides nothing."""
    intrinsics: NDArray[np.float64]
    to_world: NDArray[np.float64]
    gains: NDArray[np.float64]
    """(3,), of its exposure."""


def sky_map(views: Iterable[SkyView], height: int = 96) -> NDArray[np.float32]:
    """Mean radiance (height, 2 height, 3), z up, laid out as ``stage.Stage`` takes it.

    Directions that no photograph shows take the nearest that one does; below the horizon, the
    horizon's mean.
    """
    from scipy.ndimage import distance_transform_edt, gaussian_filter, maximum_filter

    width = 2 * height
    total = np.zeros((height * width, 3))
    counts = np.zeros(height * width)
    for view in views:
        hidden = maximum_filter(np.isfinite(view.surface).astype(np.uint8), _CLEAR) > 0
        rays = points_at(view.intrinsics, view.to_world, np.ones(hidden.shape))
        rays = (rays - view.to_world[:3, 3])[~hidden]
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        above = rays[:, 2] > 0
        rays, seen = rays[above], view.pixels[~hidden][above]
        row = np.minimum((np.arccos(rays[:, 2]) / np.pi * height).astype(int), height - 1)
        turn = 0.5 - np.arctan2(rays[:, 1], rays[:, 0]) / (2 * np.pi)
        texel = row * width + np.mod((turn * width).astype(int), width)
        light = decode_srgb(seen / 255.0) / view.gains
        counts += np.bincount(texel, minlength=len(counts))
        for channel in range(3):
            total[:, channel] += np.bincount(texel, light[:, channel], len(counts))
    if not counts.any():
        return np.zeros((height, width, 3), np.float32)
    known = (counts > 0).reshape(height, width)
    sky = (total / np.maximum(counts, 1)[:, None]).reshape(height, width, 3)
    # Around the seam behind the viewer, too.
    wide = np.concatenate([known] * 3, axis=1)
    nearest = distance_transform_edt(~wide, return_distances=False, return_indices=True)
    filled = sky[nearest[0][:, width : 2 * width], nearest[1][:, width : 2 * width] % width]
    smooth = gaussian_filter(filled, (_SMOOTH, _SMOOTH, 0), mode=("nearest", "wrap", "nearest"))
    filled = np.where(known[..., None], filled, smooth)
    filled[height // 2 :] = filled[height // 2 - 1].mean(axis=0)
    return filled.astype(np.float32)
