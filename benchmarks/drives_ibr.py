"""Pictures from elsewhere out of photographs and their depths alone: what a street is held against.

Depths of the photographs around are splatted into the wanted view, the nearest wins; each pixel
then looks into the photographs at its depth and takes the mean of those that see that surface, by
nearness. What no depth reaches takes the farthest depth beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.cameras import project_points, unproject_depth
from pipelines.street_billboards.capture.surface_depth import surface_depth

FloatArray = NDArray[np.float64]

_FAR = 300.0
"""Metres: where the sky is taken to be."""
_SAME = 0.06
"""Of the depth: what is deeper by more is hidden."""
_HOLES = 9
"""Pixels of holes between splatted points that are closed."""


class DepthPhotograph(NamedTuple):
    """A photograph that is looked into."""

    pixels: NDArray[np.uint8]
    """(h, w, 3), sRGB."""
    depth: NDArray[np.float32]
    """(h, w), metres; nan unknown, inf sky."""
    intrinsics: FloatArray
    pose: FloatArray


def rendered(
    photographs: Sequence[DepthPhotograph], intrinsics: FloatArray, pose: FloatArray
) -> NDArray[np.uint8]:
    """What a camera (K (3, 3), pose (4, 4)) sees, (h, w, 3), nearest photographs first."""
    height, width = photographs[0].depth.shape
    depth = _depth_there(photographs, intrinsics, pose)
    places = unproject_depth(intrinsics, pose, depth)
    total, weights = np.zeros((height, width, 3)), np.zeros((height, width))
    for one in photographs:
        colours, sees = _looked_up(one, places)
        away = float(np.linalg.norm(one.pose[:3, 3] - pose[:3, 3]))
        weight = np.where(sees, 1.0, 1e-3 * np.isfinite(colours[..., 0])) / (0.1 + away) ** 2
        total += np.nan_to_num(colours) * weight[..., None]
        weights += weight
    mean = total / np.maximum(weights, 1e-12)[..., None]
    blind = weights == 0
    if blind.any():
        codes = np.clip(np.rint(mean), 0, 255).astype(np.uint8)
        mean = np.asarray(cv2.inpaint(codes, blind.astype(np.uint8), 3, cv2.INPAINT_TELEA), float)
    return np.clip(np.rint(mean), 0, 255).astype(np.uint8)


def _depth_there(
    photographs: Sequence[DepthPhotograph], intrinsics: FloatArray, pose: FloatArray
) -> NDArray[np.float32]:
    from scipy.ndimage import distance_transform_edt

    height, width = photographs[0].depth.shape
    points = []
    for one in photographs:
        known = ~np.isnan(one.depth)
        far = np.where(known, np.minimum(one.depth, _FAR), 1.0)
        points.append(unproject_depth(one.intrinsics, one.pose, far)[known])
    depth = surface_depth(
        np.concatenate(points), 0.01, intrinsics, pose, width, height, farthest=2 * _FAR
    )
    holes = ~np.isfinite(depth)
    if holes.any():
        # What nobody's depth reaches lies behind what hides it: the farthest around it.
        kernel = np.ones((_HOLES, _HOLES), np.uint8)
        wide = cv2.dilate(np.where(holes, 0, depth).astype(np.float32), kernel)
        depth = np.where(holes & (wide > 0), wide, depth)
        holes = ~np.isfinite(depth)
        nearest = distance_transform_edt(holes, return_distances=False, return_indices=True)
        depth = depth[tuple(nearest)]
    return depth


def _looked_up(one: DepthPhotograph, places: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Colours (h, w, 3) at places, nan outside, and where the photograph has that depth."""
    pixels, away = project_points(one.intrinsics, one.pose, places)
    height, width = one.depth.shape
    inside = (away > 0.3) & (pixels >= 0).all(axis=-1)
    inside &= (pixels[..., 0] <= width - 1) & (pixels[..., 1] <= height - 1)
    at = np.where(inside[..., None], pixels, 0).astype(np.float32)
    looked = cv2.remap(one.pixels, at[..., 0], at[..., 1], cv2.INTER_CUBIC)
    colours = np.asarray(looked, np.float64)
    seen = cv2.remap(one.depth, at[..., 0], at[..., 1], cv2.INTER_NEAREST)
    with np.errstate(invalid="ignore"):
        sees = inside & ~(away > (1 + _SAME) * seen)
    return np.where(inside[..., None], colours, np.nan), sees
