"""Figures of streets, each computed apart from what made it.

Of drives (exposure, detail, spacing), of depth and points against the truth, of billboards against
the points, of pictures against photographs. Textures have theirs in `textures.figures`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb, encode_srgb
from pipelines.drawing.picture_metrics import Picture, psnr
from pipelines.geometry.cameras import project_points

RAW_BYTES = 98_304
"""Of a billboard: 32 views of 32 x 32 pixels of 3 bytes."""
_FARTHEST = 20.0
"""Metres, up to which depth is judged."""
_JUDGED = 25.0
"""Metres, up to which the depth of a photograph is judged where it is known."""
_TOLERANCE = 0.05
"""Of a depth: what is off by less is right."""


# ---- drives ----------------------------------------------------------------------------------


def path_length(places: NDArray[np.floating]) -> float:
    """Length of a way along places (f, 3), in their unit.

    >>> path_length(np.array([[0.0, 0, 0], [3, 4, 0], [3, 4, 1]]))
    6.0
    """
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def frame_spacing(places: NDArray[np.floating]) -> float:
    """Median distance from one place (f, 3) to the next, in their unit."""
    return float(np.median(np.linalg.norm(np.diff(places, axis=0), axis=1)))


def exposure_spread(means: NDArray[np.floating]) -> float:
    """Standard deviation of photographs' mean codes (any shape) over their mean."""
    return float(means.std() / means.mean())


def neighbour_difference(greys: NDArray[np.floating]) -> float:
    """Mean difference of pixels (…, y, x) from the next in their row: what stereo lives on."""
    return float(np.abs(np.diff(greys, axis=-1)).mean())


# ---- depth and points ------------------------------------------------------------------------


def bad_pixel_share(
    disparity: NDArray[np.floating], truth: NDArray[np.floating], threshold: float = 0.5
) -> float:
    """Share of the pixels of finite truth that are missing or off by more than ``threshold``.

    Disparities (y, x) in pixels (bad-0.5 and the like of Scharstein and Szeliski's benchmark).

    >>> bad_pixel_share(np.array([1.0, 2.0, np.nan, 4.0]), np.array([1.2, 3.0, 3.0, np.inf]))
    0.6666666666666667
    """
    known = np.isfinite(truth)
    right = np.abs(disparity[known] - truth[known]) <= threshold
    return float(1 - right.mean())


def depth_error(depth: NDArray[np.floating], truth: NDArray[np.floating]) -> float:
    """Share of the pixels (y, x) up to 20 m away that are unknown or off by more than 5 %."""
    asked = truth < _FARTHEST
    with np.errstate(invalid="ignore"):
        right = np.abs(depth - truth) <= _TOLERANCE * truth
    return float(1.0 - right[asked].mean())


def known_share(depth: NDArray[np.floating], truth: NDArray[np.floating]) -> float:
    """Share of the pixels (y, x) up to 25 m away whose depth is known, right or wrong."""
    return float(np.isfinite(depth[truth < _JUDGED]).mean())


def bad_depth_share(depth: NDArray[np.floating], truth: NDArray[np.floating]) -> float:
    """Share of the depths known that are off by more than 5 % of them: up to 25 m, by either.

    >>> known = np.array([10.0, 20, np.nan, 9, 90])
    >>> round(bad_depth_share(known, np.array([10.2, 30, 5, 40, 80])), 3)
    0.667
    """
    asked = np.isfinite(depth) & ((truth < _JUDGED) | (depth < _JUDGED))
    # An infinite truth, the sky, is no tolerance: what is known there is bad.
    right = np.abs(depth[asked] - truth[asked]) / depth[asked] <= _TOLERANCE
    return float(1.0 - right.mean())


def deviation_honest(
    depth: NDArray[np.floating], deviation: NDArray[np.floating], truth: NDArray[np.floating]
) -> float:
    """Share of the depths known (as for ``bad_depth_share``) that are off by < 2 deviations.

    0.954 of errors that are normally distributed, and of whatever else is less.
    """
    asked = np.isfinite(depth) & ((truth < _JUDGED) | (depth < _JUDGED))
    return float((np.abs(depth - truth)[asked] < 2 * deviation[asked]).mean())


def stray_share(
    positions: NDArray[np.floating],
    intrinsics: NDArray[np.float64],
    poses: NDArray[np.float64],
    truths: NDArray[np.floating],
) -> float:
    """Share of points (n, 3) up to 20 m before a camera that are nearer than the true surface.

    By more than 5 % of its depth. intrinsics (3, 3), poses (k, 4, 4) and true depths (k, y, x) of
    cameras. Points behind the surface are hidden and tell nothing.
    """
    asked = strays = 0
    _, height, width = truths.shape
    for pose, truth in zip(poses, truths, strict=True):
        pixels, depth = project_points(intrinsics, pose, np.asarray(positions, np.float64))
        before = (depth > 1.0) & (depth < _FARTHEST)
        x, y = np.rint(pixels[before]).astype(np.int64).T
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        there, depth = truth[y[inside], x[inside]], depth[before][inside]
        asked += int((depth < there * (1 + _TOLERANCE)).sum())
        strays += int((depth < there * (1 - _TOLERANCE)).sum())
    return strays / max(asked, 1)


def largest_log_gain(gains: NDArray[np.floating]) -> float:
    """Largest logarithm, either way, of factors (any shape) by which photographs are brighter."""
    return float(np.abs(np.log(gains)).max())


# ---- billboards ------------------------------------------------------------------------------


def share_in_voxels(
    positions: NDArray[np.floating], voxels: NDArray[np.floating], side: float
) -> float:
    """Share of points (n, 3) in some cube of this side around voxels' middles (b, 3), metres.

    By a tree of the middles instead of the octree that the voxels came from.

    >>> share_in_voxels(np.array([[0.1, 0, 0], [0.9, 0, 0]]), np.zeros((1, 3)), 1.0)
    0.5
    """
    from scipy.spatial import cKDTree

    half = side / 2 * (1 + 1e-6)
    away, _ = cKDTree(voxels).query(positions, p=np.inf)
    return float(np.mean(away <= half))


def off_plane(
    positions: NDArray[np.floating],
    voxels: NDArray[np.floating],
    side: float,
    *,
    centre: NDArray[np.floating],
    normal: NDArray[np.floating],
    turns: NDArray[np.bool_],
) -> float:
    """Median distance of points (n, 3) from the plane of the billboard in their voxel, metres.

    voxels (b, 3): middles of cubes of this side; centre, normal (b, 3), of any length: planes of
    the billboards; those that turn (b,) have none. 0 where all turn.
    """
    from scipy.spatial import cKDTree

    still = ~turns
    if not still.any():
        return 0.0
    away, nearest = cKDTree(voxels).query(positions, p=np.inf)
    inside = (away <= side / 2) & still[nearest]
    normal = normal[nearest[inside]]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    offset = positions[inside] - centre[nearest[inside]]
    return float(np.median(np.abs((offset * normal).sum(axis=1))))


# ---- textures --------------------------------------------------------------------------------


def excess_rank(ranks: NDArray[np.integer], first: NDArray[np.integer]) -> int:
    """By how much a billboard has more eigen-images of a channel than views, at most; or 0.

    ranks (b, 3); first (b + 1,): where a billboard's views begin.

    >>> excess_rank(np.array([[3, 1, 0], [2, 2, 2]]), np.array([0, 2, 4]))
    1
    """
    excess = ranks.astype(int).max(axis=1) - np.diff(first)
    return int(max(excess.max(), 0))


# ---- pictures --------------------------------------------------------------------------------


def match_exposure(picture: Picture, truth: Picture, where: NDArray[np.bool_]) -> Picture:
    """The picture (y, x, 3) at the exposure of the true one: one factor of linear light a channel.

    The factor is the ratio of the sums over ``where`` (y, x).
    """
    mine, theirs = decode_srgb(picture[where] / 255.0), decode_srgb(truth[where] / 255.0)
    factor = theirs.sum(axis=0) / np.maximum(mine.sum(axis=0), 1e-9)
    linear = decode_srgb(picture / 255.0) * factor
    return np.rint(encode_srgb(linear) * 255.0).astype(np.uint8)


def mean_psnr(pictures: Picture, truths: Picture, where: NDArray[np.bool_]) -> float:
    """Mean of the PSNRs of pictures (k, y, x, 3) over their pixels ``where`` (k, y, x), dB."""
    return float(np.mean([psnr(*one) for one in zip(pictures, truths, where, strict=True)]))


def differing_share(picture: Picture, other: Picture, most: int = 1) -> float:
    """Share of the pixels (y, x, 3) in which some channel differs by more than ``most`` codes."""
    apart = np.abs(picture.astype(int) - other)
    return float((apart.max(axis=-1) > most).mean())


def dilated(mask: NDArray[np.bool_], pixels: int) -> NDArray[np.bool_]:
    """Pixels (y, x) within a distance of some of the mask."""
    from scipy.ndimage import distance_transform_edt

    if not mask.any():
        return np.zeros_like(mask)
    return np.asarray(distance_transform_edt(~mask) <= pixels)
