"""Depth from cameras in a row: semi-global matching of neighbours, checked from both sides."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

Photograph = NDArray[np.uint8]
Map = NDArray[np.float32]

_STEP = 16  # OpenCV's disparities are sixteenths of a pixel, their number a multiple of 16
_AGREES = 1.0  # pixels between both sides' disparities of one point


class DisparityMap(NamedTuple):
    """Where each pixel of one photograph lies in the other."""

    disparity: Map
    """(h, w), pixels; nan where there is none."""
    confidence: Map
    """(h, w) in [0, 1]; 0 where there is no disparity."""


class DepthMaps(NamedTuple):
    """What c cameras see of one frame."""

    depth: Map
    """(c, h, w), metres along each camera's axis; nan where unknown."""
    deviation: Map
    """(c, h, w), the standard deviation to expect, metres; nan where unknown."""


def match(
    left: Photograph, right: Photograph, most: int, *, block: int = 3, speckle: int = 60
) -> tuple[DisparityMap, DisparityMap]:
    """Disparities of the left and of the right photograph of a rectified pair."""
    greys = _greys(left, right)
    ours = _matched(*greys, most, block, speckle)
    theirs = _matched(greys[1][:, ::-1], greys[0][:, ::-1], most, block, speckle)[:, ::-1]
    return _checked(ours, theirs, -1), _checked(theirs, ours, 1)


def disparity_defaults(left: Photograph, right: Photograph, most: int) -> Map:
    """Disparities (h, w) of the left photograph by OpenCV with its default parameters."""
    matcher = cv2.StereoSGBM.create()
    matcher.setNumDisparities(_rounded(most))
    found = matcher.compute(np.ascontiguousarray(left), np.ascontiguousarray(right))
    return np.where(found < 0, np.nan, found.astype(np.float32) / _STEP).astype(np.float32)


def bad_share(disparity: Map, truth: Map, threshold: float = 0.5) -> float:
    """Share of the pixels of known truth that are missing or off by more than the threshold."""
    known = np.isfinite(truth)
    right = np.abs(disparity[known] - truth[known]) <= threshold
    return float(1 - right.mean())


def depth_maps(
    photographs: Photograph,
    intrinsics: NDArray[np.floating],
    poses: NDArray[np.floating],
    *,
    nearest: float = 2.0,
    farthest: float = 40.0,
) -> DepthMaps:
    """Depth of each camera of one frame."""
    count, height, width = photographs.shape[:3]
    depth = np.full((count, height, width), np.nan, np.float32)
    deviation = np.full((count, height, width), np.nan, np.float32)
    for i in range(count - 1):
        pair = slice(i, i + 2)
        found = _pair_depth(photographs[pair], intrinsics[pair], poses[pair], nearest)
        for camera, one in zip((i, i + 1), found, strict=True):
            depth[camera], deviation[camera] = _merged(
                depth[camera], deviation[camera], one[0], one[1]
            )
    unknown = ~((depth >= nearest) & (depth <= farthest))
    depth[unknown] = np.nan
    deviation[unknown] = np.nan
    return DepthMaps(depth, deviation)


def _rounded(most: int) -> int:
    return -(-most // _STEP) * _STEP


def _greys(left: Photograph, right: Photograph) -> tuple[Photograph, Photograph]:
    """Both in grey, the right one at the left one's exposure."""
    ours, theirs = (
        cv2.cvtColor(np.ascontiguousarray(i), cv2.COLOR_RGB2GRAY) for i in (left, right)
    )
    gain = np.median(
        np.percentile(ours, range(20, 81, 5))
        / np.maximum(np.percentile(theirs, range(20, 81, 5)), 1)
    )
    return ours, cv2.convertScaleAbs(theirs, alpha=float(gain))


def _matched(left: Photograph, right: Photograph, most: int, block: int, speckle: int) -> Map:
    number = _rounded(most)
    # OpenCV leaves the first `number` columns empty; padded, it finds what is there.
    padded = [cv2.copyMakeBorder(i, 0, 0, number, 0, cv2.BORDER_REPLICATE) for i in (left, right)]
    matcher = cv2.StereoSGBM.create(
        0,
        number,
        block,
        8 * block * block,
        32 * block * block,
        -1,
        0,
        0,
        speckle,
        1,
        cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    found = matcher.compute(*padded)[:, number:]
    return np.where(found < 0, np.nan, found.astype(np.float32) / _STEP).astype(np.float32)


def _checked(ours: Map, theirs: Map, sign: int) -> DisparityMap:
    """What both sides agree on; sign: which way the other picture's point lies."""
    height, width = ours.shape
    columns = np.arange(width, dtype=np.float32)[None, :] + sign * ours
    other = cv2.remap(
        theirs,
        np.nan_to_num(columns, nan=-10),
        np.broadcast_to(np.arange(height, dtype=np.float32)[:, None], ours.shape).copy(),
        cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=-1000,
    )
    apart = np.abs(ours - other)
    good = apart <= _AGREES
    disparity = np.where(good, ours, np.nan).astype(np.float32)
    confidence = np.where(good, 1 - 0.5 * apart / _AGREES, 0).astype(np.float32)
    return DisparityMap(disparity, confidence)


def _pair_depth(
    photographs: Photograph,
    intrinsics: NDArray[np.floating],
    poses: NDArray[np.floating],
    nearest: float,
) -> list[tuple[Map, Map]]:
    height, width = photographs.shape[1:3]
    to_left = np.linalg.inv(poses[0]) @ poses[1]
    if to_left[0, 3] < 0:  # the second stands left of the first
        return _pair_depth(photographs[::-1], intrinsics[::-1], poses[::-1], nearest)[::-1]
    baseline = float(np.linalg.norm(to_left[:3, 3]))
    straight = (
        np.allclose(intrinsics[0], intrinsics[1], atol=1e-3)
        and np.allclose(to_left[:3, :3], np.eye(3), atol=1e-5)
        and np.allclose(to_left[1:3, 3], 0, atol=1e-4 * baseline)
    )
    if straight:
        focal = float(intrinsics[0, 0, 0])
        shown = photographs
    else:
        turns, plane = _rectification(intrinsics, poses)
        focal = float(plane[0, 0])
        shown = np.stack(
            [
                cv2.remap(
                    photographs[i],
                    *cv2.initUndistortRectifyMap(
                        intrinsics[i].astype(float),
                        np.zeros(5),
                        turns[i],
                        plane,
                        (width, height),
                        cv2.CV_32FC1,
                    ),
                    cv2.INTER_CUBIC,
                    borderMode=cv2.BORDER_REPLICATE,
                )
                for i in range(2)
            ]
        )
    maps = match(shown[0], shown[1], int(np.ceil(focal * baseline / nearest)))
    answer = []
    for i, found in enumerate(maps):
        disparity, confidence = found
        scale = np.ones((1, 1), np.float32)
        if not straight:
            disparity, confidence, scale = _unrectified(
                found, intrinsics[i].astype(float), turns[i], plane
            )
        with np.errstate(divide="ignore"):
            axial = focal * baseline / disparity
        spread = axial**2 / (focal * baseline) * (0.15 + 0.35 * (1 - confidence))
        answer.append(((axial * scale).astype(np.float32), (spread * scale).astype(np.float32)))
    return answer


def _rectification(
    intrinsics: NDArray[np.floating], poses: NDArray[np.floating]
) -> tuple[list[NDArray[np.float64]], NDArray[np.float64]]:
    """Rotations of two cameras' axes to common ones whose x is the baseline, and a common K."""
    along = poses[1, :3, 3] - poses[0, :3, 3]
    across = along / np.linalg.norm(along)
    forward = poses[0, :3, 2] + poses[1, :3, 2]
    down = np.cross(forward, across)
    down /= np.linalg.norm(down)
    axes = np.stack([across, down, np.cross(across, down)])
    return [axes @ pose[:3, :3] for pose in poses], intrinsics.mean(axis=0, dtype=np.float64)


def _unrectified(
    found: DisparityMap,
    intrinsics: NDArray[np.float64],
    turn: NDArray[np.float64],
    plane: NDArray[np.float64],
) -> tuple[Map, Map, Map]:
    """Disparity and confidence in the camera's own pixels, its depth over the rectified one's."""
    height, width = found.disparity.shape
    across, down = np.meshgrid(np.arange(width), np.arange(height))
    rays = np.stack([across, down, np.ones_like(across)], axis=-1) @ np.linalg.inv(intrinsics).T
    turned = rays @ turn.T
    pixels = (turned / turned[..., 2:]) @ plane.T
    where = pixels[..., :2].astype(np.float32)
    disparity, confidence = (
        cv2.remap(
            np.nan_to_num(i),
            where[..., 0],
            where[..., 1],
            cv2.INTER_NEAREST,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=0,
        )
        for i in found
    )
    disparity[disparity == 0] = np.nan
    return disparity, confidence, (1 / turned[..., 2]).astype(np.float32)


def _merged(first: Map, first_spread: Map, second: Map, second_spread: Map) -> tuple[Map, Map]:
    """Two measurements of the same pixels: their mean where they agree, else the surer one."""
    ours, theirs = np.isfinite(first), np.isfinite(second)
    with np.errstate(invalid="ignore"):
        one, two = 1 / first_spread**2, 1 / second_spread**2
        agree = np.abs(first - second) <= 3 * np.sqrt(first_spread**2 + second_spread**2)
        take_second = ~agree & theirs & (~ours | (second_spread < first_spread))
        mean = (first * one + second * two) / (one + two)
    depth = np.where(agree, mean, np.where(take_second, second, first))
    spread = np.where(
        agree, 1 / np.sqrt(one + two), np.where(take_second, second_spread, first_spread)
    )
    return depth.astype(np.float32), spread.astype(np.float32)
