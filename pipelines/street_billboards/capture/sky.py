"""What is behind a street: an equirectangular map of it, and which pixels show the sky.

The map holds the sky and what is farther than stereo reaches. At its rim stereo takes the sky for
the house or the tree before it: what looks like the sky and hangs together with it is sky, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb
from pipelines.geometry.cameras import unproject_depth

FloatArray = NDArray[np.float64]

_CLEAR = 15
"""Pixels around one that has no depth that have none, either: sky, not a hole in the matching."""
_LIKE = 0.12
"""Relative difference of radiance that still looks like the sky."""
_SMOOTH = 8
"""Codes by which neighbouring pixels of the sky differ less."""
_LEAST_SURE = 50
"""Pixels that a sky has."""
_FARTHEST = 60.0
"""Pixels from what is surely sky."""


class SkyView(NamedTuple):
    """A photograph and where its depth is unknown."""

    pixels: NDArray[np.uint8]
    """(y, x, 3), sRGB."""
    depth: NDArray[np.float32]
    """(y, x), m; NaN where unknown."""
    intrinsics: FloatArray
    """(3, 3)."""
    to_world: FloatArray
    """(4, 4)."""


def sky_map(views: Sequence[SkyView], height: int = 256) -> NDArray[np.float32]:
    """Mean radiance (height, 2 height, 3), z up, laid out as ``stage.Stage`` takes it.

    Directions that no photograph shows take the nearest that one does; below the horizon it is the
    mean of what the photographs show there. All 0 where no photograph shows any sky.
    """
    from scipy.ndimage import distance_transform_edt, gaussian_filter

    width = 2 * height
    total = np.zeros((height * width, 3))
    counts = np.zeros(height * width)
    ground, below = np.zeros(3), 0
    for view in views:
        clear, rays = _clear(view), _rays(view)
        low = decode_srgb(view.pixels[rays[..., 2] < 0] / 255.0)
        ground, below = ground + low.sum(axis=0), below + len(low)
        rays = rays[clear]
        row = np.minimum((np.arccos(rays[:, 2]) / np.pi * height).astype(int), height - 1)
        turn = 0.5 - np.arctan2(rays[:, 1], rays[:, 0]) / (2 * np.pi)
        texel = row * width + np.mod((turn * width).astype(int), width)
        light = decode_srgb(view.pixels[clear] / 255.0)
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
    smooth = gaussian_filter(filled, (1.0, 1.0, 0.0), mode=("nearest", "wrap", "nearest"))
    filled = np.where(known[..., None], filled, smooth)
    filled[height // 2 :] = ground / below if below else filled[height // 2 - 1].mean(axis=0)
    return filled.astype(np.float32)


def sky_pixels(view: SkyView) -> NDArray[np.bool_]:
    """Pixels (y, x) that show the sky, whatever stereo says of them.

    Those that are clear and smooth are sky; and those that hang together with them and look like
    the nearest one of them.
    """
    import cv2
    from scipy.ndimage import distance_transform_edt

    greys = view.pixels.max(axis=-1)
    edges = cv2.morphologyEx(greys, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    smooth = cv2.dilate(edges, np.ones((_CLEAR, _CLEAR), np.uint8)) < _SMOOTH
    sure = _clear(view) & smooth
    if sure.sum() < _LEAST_SURE:
        return np.zeros(sure.shape, bool)
    away, nearest = distance_transform_edt(~sure, return_indices=True)
    light = decode_srgb(view.pixels / 255.0)
    expected = cv2.blur(light, (5, 5))[tuple(nearest)]
    apart = np.abs(light - expected) / np.maximum(expected, 1e-6)
    like = (apart.max(axis=-1) < _LIKE) & (_rays(view)[..., 2] > 0) & (away < _FARTHEST)
    _, piece = cv2.connectedComponents((like | sure).astype(np.uint8))
    joined = np.zeros(int(piece.max()) + 1, bool)
    joined[piece[sure]] = True
    joined[0] = False
    return np.asarray(joined[piece])


def sky_along(sky: NDArray[np.float32], rays: FloatArray) -> NDArray[np.float32]:
    """Radiance (y, x, 3) of the map along unit vectors (y, x, 3), interpolated."""
    import cv2

    rows, columns = sky.shape[:2]
    across = (0.5 - np.arctan2(rays[..., 1], rays[..., 0]) / (2 * np.pi)) * columns - 0.5
    down = np.arccos(np.clip(rays[..., 2], -1, 1)) / np.pi * rows - 0.5
    wide = np.concatenate([sky[:, -1:], sky, sky[:, :1]], axis=1)
    return np.asarray(
        cv2.remap(
            wide,
            (np.mod(across, columns) + 1.0).astype(np.float32),
            np.clip(down, 0, rows - 1).astype(np.float32),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
    )


def pixel_rays(intrinsics: FloatArray, to_world: FloatArray, width: int, height: int) -> FloatArray:
    """Unit vectors (height, width, 3) in the world along which a camera's pixels look.

    >>> lens = np.array([[2.0, 0, 2], [0, 2, 1], [0, 0, 1]])
    >>> pixel_rays(lens, np.eye(4), width=5, height=3)[1, 2]
    array([0., 0., 1.])
    """
    rays = unproject_depth(intrinsics, to_world, np.ones((height, width))) - to_world[:3, 3]
    return np.asarray(rays / np.linalg.norm(rays, axis=-1, keepdims=True))


def _rays(view: SkyView) -> FloatArray:
    height, width = view.depth.shape
    return pixel_rays(view.intrinsics, view.to_world, width, height)


def _clear(view: SkyView) -> NDArray[np.bool_]:
    """Pixels above the horizon far from all whose depth is known."""
    import cv2

    unknown = (~np.isfinite(view.depth)).astype(np.uint8)
    far = cv2.erode(unknown, np.ones((_CLEAR, _CLEAR), np.uint8), borderValue=1) > 0
    return np.asarray(far & (_rays(view)[..., 2] > 0.02))
