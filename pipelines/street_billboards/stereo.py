"""Depth from cameras in a row: semi-global matching of neighbours, checked from both sides."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.depth_refinement import Partner, rectified_partner, refined

Photograph = NDArray[np.uint8]
Map = NDArray[np.float32]

_STEP = 16  # OpenCV's disparities are sixteenths of a pixel, their number a multiple of 16
_AGREES = 1.0  # pixels between both sides' disparities of one point
_BLOCK = 3
_SPECKLE = 60  # pixels of the smallest patch that stays
_FINE = 0.08  # pixels, the standard deviation where there is texture


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
    left: Photograph, right: Photograph, most: int, *, refine: bool = True
) -> tuple[DisparityMap, DisparityMap]:
    """Disparities of the left and of the right photograph of a rectified pair.

    left, right: (h, w, 3) sRGB, whose exposures may differ; most: the largest disparity looked for,
    pixels. What only one of the two sees has none; ``depth_refinement.filled`` makes one up.
    refine: at edges and below a pixel, with the photographs.
    """
    greys = _greys(left, right)
    found = _both_sides(*greys, most)
    if not refine:
        return found
    answer = []
    for one, photograph, i, sign in ((found[0], left, 0, -1), (found[1], right, 1, 1)):
        partner = rectified_partner(greys[1 - i].astype(np.float32), sign)
        disparity, _ = refined(
            one.disparity,
            np.ascontiguousarray(photograph),
            greys[i].astype(np.float32),
            [partner],
        )
        answer.append(DisparityMap(disparity, one.confidence))
    return answer[0], answer[1]


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
    count = len(photographs)
    intrinsics, poses = np.asarray(intrinsics, np.float64), np.asarray(poses, np.float64)
    found = [_Found(*(np.full(photographs.shape[1:3], np.nan, np.float32) for _ in range(2)))] * (
        count
    )
    for i in range(count - 1):
        pair = slice(i, i + 2)
        seen = _pair_inverse(photographs[pair], intrinsics[pair], poses[pair], nearest)
        found[i], found[i + 1] = _merged(found[i], seen[0]), _merged(found[i + 1], seen[1])
    # A unit of inverse depth in which a step of 1 is a pixel between neighbours.
    baseline = float(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1).mean())
    unit = float(intrinsics[:, 0, 0].mean()) * baseline
    greys = [cv2.cvtColor(np.ascontiguousarray(i), cv2.COLOR_RGB2GRAY) for i in photographs]
    depth, deviation = np.empty((2, *photographs.shape[:3]), np.float32)
    for i in range(count):
        partners = [
            _partner(_alike(greys[i], greys[k]), intrinsics, poses, i, k, unit)
            for k in range(count)
            if k != i
        ]
        disparity, told = refined(
            found[i].inverse * unit,
            np.ascontiguousarray(photographs[i]),
            greys[i].astype(np.float32),
            partners,
        )
        with np.errstate(divide="ignore"):
            depth[i] = unit / disparity
        spread = np.minimum(found[i].spread * unit, 0.5) * (1 - told) + _FINE * told
        deviation[i] = depth[i] ** 2 / unit * spread
    unknown = ~((depth >= nearest) & (depth <= farthest))
    depth[unknown] = np.nan
    deviation[unknown] = np.nan
    return DepthMaps(depth, deviation)


class _Found(NamedTuple):
    """One camera's inverse depths (h, w), 1 / m, and standard deviations; nan where unknown."""

    inverse: Map
    spread: Map


def _partner(
    grey: Photograph,
    intrinsics: NDArray[np.float64],
    poses: NDArray[np.float64],
    camera: int,
    other: int,
    unit: float,
) -> Partner:
    """Another camera of the frame, for disparities of ``unit`` over depth."""
    way = np.linalg.inv(poses[other]) @ poses[camera]
    turn = intrinsics[other] @ way[:3, :3] @ np.linalg.inv(intrinsics[camera])
    shift = intrinsics[other] @ way[:3, 3] / unit
    return Partner(grey.astype(np.float32), turn.astype(np.float32), shift.astype(np.float32))


def _rounded(most: int) -> int:
    return -(-most // _STEP) * _STEP


def _greys(left: Photograph, right: Photograph) -> tuple[Photograph, Photograph]:
    """Both in grey, the right one at the left one's exposure."""
    ours, theirs = (
        cv2.cvtColor(np.ascontiguousarray(i), cv2.COLOR_RGB2GRAY) for i in (left, right)
    )
    return ours, _alike(ours, theirs)


def _alike(ours: Photograph, theirs: Photograph) -> Photograph:
    """Their greys (h, w) at our exposure: in 8-bit sRGB, nearly a power law, nearly a factor."""
    shares = range(20, 81, 5)
    gains = np.percentile(ours, shares) / np.maximum(np.percentile(theirs, shares), 1)
    return np.asarray(cv2.convertScaleAbs(theirs, alpha=float(np.median(gains))))


def _both_sides(
    left: Photograph, right: Photograph, most: int
) -> tuple[DisparityMap, DisparityMap]:
    ours = _matched(left, right, most)
    theirs = _matched(right[:, ::-1], left[:, ::-1], most)[:, ::-1]
    return _checked(ours, theirs, -1), _checked(theirs, ours, 1)


def _most_there(left: Photograph, right: Photograph, most: int) -> int:
    """The largest disparity that half the size shows, with room to spare: it may be far less."""
    small = [
        cv2.resize(i, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) for i in (left, right)
    ]
    ours, _ = (one.disparity for one in _both_sides(small[0], small[1], most // 2 + 1))
    known = ours[np.isfinite(ours)]
    if len(known) == 0:
        return most
    return min(most, int(2.1 * np.percentile(known, 99.9)) + 3)


def _matched(left: Photograph, right: Photograph, most: int, *, doubled: bool = False) -> Map:
    """Disparities of the left photograph's greys, unchecked."""
    number = _rounded(most)
    # OpenCV leaves the first `number` columns empty; padded, it finds what is there.
    wide = [cv2.copyMakeBorder(i, 0, 0, number, 0, cv2.BORDER_REPLICATE) for i in (left, right)]
    times = 2 if doubled else 1
    if doubled:
        wide = [cv2.resize(i, None, fx=2, fy=1, interpolation=cv2.INTER_CUBIC) for i in wide]
    matcher = cv2.StereoSGBM.create(
        0,
        number * times,
        _BLOCK,
        8 * _BLOCK**2,
        32 * _BLOCK**2,
        -1,
        0,
        0,
        _SPECKLE * times,
        1,
        cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    found = matcher.compute(*wide)[:, number * times :: times]
    return np.where(found < 0, np.nan, found.astype(np.float32) / (_STEP * times)).astype(
        np.float32
    )


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


def _pair_inverse(
    photographs: Photograph,
    intrinsics: NDArray[np.floating],
    poses: NDArray[np.floating],
    nearest: float,
) -> list[_Found]:
    height, width = photographs.shape[1:3]
    to_left = np.linalg.inv(poses[0]) @ poses[1]
    if to_left[0, 3] < 0:  # the second stands left of the first
        return _pair_inverse(photographs[::-1], intrinsics[::-1], poses[::-1], nearest)[::-1]
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
    greys = _greys(shown[0], shown[1])
    most = _most_there(*greys, int(np.ceil(focal * baseline / nearest)))
    maps = _both_sides(*greys, most)
    answer = []
    for i, found in enumerate(maps):
        disparity, confidence = found
        scale = np.ones((1, 1), np.float32)
        if not straight:
            disparity, confidence, scale = _unrectified(
                found, intrinsics[i].astype(float), turns[i], plane
            )
        inverse = disparity / (focal * baseline * scale)
        spread = (0.15 + 0.35 * (1 - confidence)) / (focal * baseline * scale)
        answer.append(_Found(inverse.astype(np.float32), spread.astype(np.float32)))
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


def _merged(first: _Found, second: _Found) -> _Found:
    """Two measurements of the same pixels: their mean where they agree, else the surer one."""
    with np.errstate(invalid="ignore"):
        one, two = 1 / first.spread**2, 1 / second.spread**2
        apart = np.abs(first.inverse - second.inverse)
        agree = apart <= 3 * np.sqrt(first.spread**2 + second.spread**2)
        mean = (first.inverse * one + second.inverse * two) / (one + two)
        take_second = np.isfinite(second.inverse) & (
            np.isnan(first.inverse) | (second.spread < first.spread)
        )
    inverse = np.where(agree, mean, np.where(take_second, second.inverse, first.inverse))
    spread = np.where(
        agree, 1 / np.sqrt(one + two), np.where(take_second, second.spread, first.spread)
    )
    return _Found(inverse.astype(np.float32), spread.astype(np.float32))
