"""Depth from cameras in a row: semi-global matching of neighbours, checked from both sides.

Hirschmüller, Stereo processing by semiglobal matching and mutual information, PAMI 2008; the three
paths of OpenCV's MODE_SGBM_3WAY were as good as its five or eight on a real pair, in a third of the
time. At twice the width, thin poles weigh twice as much against smoothness.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.capture.depth_refinement import (
    Partner,
    rectified_partner,
    refine_disparities,
)

FloatArray = NDArray[np.float64]
Photograph = NDArray[np.uint8]
Map = NDArray[np.float32]

_SIXTEENTHS = 16
"""OpenCV's disparities are sixteenths of a pixel; their number is a multiple of 16."""
_AGREES = 1.0
"""Pixels between both sides' disparities of one point, at most."""
_BLOCK = 3
_SMALL, _LARGE = 8 * _BLOCK**2, 32 * _BLOCK**2
"""What a step of one and of more disparities costs, P1 and P2 of grey photographs."""
_SPECKLE = 60
"""Pixels of the smallest patch that stays."""
_FINE, _COARSE = 0.1, 0.5
"""Pixels, standard deviation of a disparity where photographs tell most, and at most."""


class DisparityMap(NamedTuple):
    """Where each pixel of one photograph lies in the other."""

    disparity: Map
    """(h, w), pixels; nan where there is none."""
    confidence: Map
    """(h, w) in [0, 1]: how well both sides agree; 0 where there is no disparity."""


class DepthMaps(NamedTuple):
    """What c cameras see of one frame."""

    depth: Map
    """(c, h, w), metres along each camera's axis; nan where unknown."""
    deviation: Map
    """(c, h, w), the standard deviation to expect, metres; nan where unknown."""


class _Inverse(NamedTuple):
    """One camera's inverse depths (h, w), 1 / m, and standard deviations; nan where unknown."""

    value: Map
    spread: Map


# ---- a rectified pair ------------------------------------------------------------------------


def match_rectified_pair(
    left: Photograph, right: Photograph, largest_disparity: int, *, fine: bool = True
) -> tuple[DisparityMap, DisparityMap]:
    """Disparities of the left and of the right photograph of a rectified pair.

    left, right: (h, w, 3) sRGB, whose exposures may differ; largest_disparity: pixels, what is
    looked for. What only one of the two sees has none: ``fill_disparity_holes`` makes one up. fine:
    match at twice the width. Thin things stay, fractions of a pixel are better, and it takes three
    times as long. Raises ValueError for photographs of different sizes.
    """
    if left.shape != right.shape or left.ndim != 3:
        raise ValueError(
            f"photographs: found {left.shape}, {right.shape}; expected (h, w, 3) both."
        )
    greys = _greys(left, right)
    found = _both_sides(*greys, largest_disparity, fine)
    ways = ((left, 0, -1), (right, 1, 1))
    answer = []
    for one, (photograph, side, sign) in zip(found, ways, strict=True):
        partner = rectified_partner(greys[1 - side].astype(np.float32), sign)
        grey = greys[side].astype(np.float32)
        disparity, _ = refine_disparities(
            one.disparity, np.ascontiguousarray(photograph), grey, [partner]
        )
        answer.append(DisparityMap(disparity, one.confidence))
    return answer[0], answer[1]


def opencv_disparities(left: Photograph, right: Photograph, largest_disparity: int) -> Map:
    """Disparities (h, w) of the left photograph by OpenCV with its default parameters."""
    matcher = cv2.StereoSGBM.create()
    matcher.setNumDisparities(_rounded(largest_disparity))
    found = matcher.compute(np.ascontiguousarray(left), np.ascontiguousarray(right))
    return _pixels(found, 1)


def _rounded(most: int) -> int:
    return -(-most // _SIXTEENTHS) * _SIXTEENTHS


def _pixels(found: NDArray[np.integer | np.floating], times: int) -> Map:
    disparity = found.astype(np.float32) / np.float32(_SIXTEENTHS * times)
    return np.where(found < 0, np.float32(np.nan), disparity)


def _grey(photograph: Photograph) -> Photograph:
    grey = cv2.cvtColor(np.ascontiguousarray(photograph), cv2.COLOR_RGB2GRAY)
    return np.asarray(grey, np.uint8)


def _greys(left: Photograph, right: Photograph) -> tuple[Photograph, Photograph]:
    """Both in grey, the right one at the left one's exposure."""
    ours = _grey(left)
    return ours, _exposed_as(ours, _grey(right))


def _exposed_as(ours: Photograph, theirs: Photograph) -> Photograph:
    """Their greys (h, w) at our exposure, a factor: 8-bit sRGB is nearly a power law."""
    shares = np.arange(0.2, 0.81, 0.05)
    levels = [
        np.searchsorted(np.cumsum(np.bincount(i.ravel(), minlength=256)) / i.size, shares)
        for i in (ours, theirs)
    ]
    gain = np.median(levels[0] / np.maximum(levels[1], 1))
    return np.asarray(cv2.convertScaleAbs(theirs, alpha=float(gain)), np.uint8)


def _both_sides(
    left: Photograph, right: Photograph, most: int, fine: bool
) -> tuple[DisparityMap, DisparityMap]:
    """Of greys (h, w); mirrored, the right photograph is a left one."""
    ours = _matched(left, right, most, fine)
    theirs = _matched(right[:, ::-1], left[:, ::-1], most, fine)[:, ::-1]
    return _checked(ours, theirs, -1), _checked(theirs, ours, 1)


def _matched(left: Photograph, right: Photograph, most: int, fine: bool) -> Map:
    """Disparities of the left greys, unchecked."""
    number, times = _rounded(most), 2 if fine else 1
    # OpenCV leaves the first `number` columns empty; padded, it finds what is there.
    wide = [cv2.copyMakeBorder(i, 0, 0, number, 0, cv2.BORDER_REPLICATE) for i in (left, right)]
    if fine:
        wide = [cv2.resize(i, None, fx=2, fy=1, interpolation=cv2.INTER_CUBIC) for i in wide]
    matcher = cv2.StereoSGBM.create(
        numDisparities=number * times,
        blockSize=_BLOCK,
        P1=_SMALL,
        P2=_LARGE,
        disp12MaxDiff=-1,
        speckleWindowSize=_SPECKLE * times,
        speckleRange=1,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    return _pixels(matcher.compute(*wide)[:, number * times :: times], times)


def _checked(ours: Map, theirs: Map, sign: int) -> DisparityMap:
    """What both sides agree on; sign: which way the other picture's point lies."""
    height, width = ours.shape
    columns = np.arange(width, dtype=np.float32)[None, :] + sign * ours
    rows = np.repeat(np.arange(height, dtype=np.float32)[:, None], width, axis=1)
    other = cv2.remap(
        np.ascontiguousarray(theirs),
        np.nan_to_num(columns, nan=-1000.0),
        rows,
        cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=-1000.0,
    )
    apart = np.abs(ours - other)
    good = apart <= _AGREES
    disparity = np.where(good, ours, np.float32(np.nan))
    confidence = np.where(good, 1 - 0.5 * apart / _AGREES, 0).astype(np.float32)
    return DisparityMap(disparity, confidence)


# ---- a frame ---------------------------------------------------------------------------------


def depth_maps(
    photographs: Photograph,
    intrinsics: NDArray[np.floating],
    poses: NDArray[np.floating],
    *,
    nearest: float = 2.0,
    farthest: float = 40.0,
    fine: bool = True,
) -> DepthMaps:
    """Depth of each of c cameras of one frame, in a row from left to right or right to left.

    photographs (c, h, w, 3) sRGB, of exposures that may differ; intrinsics (c, 3, 3) in pixels,
    poses (c, 4, 4) to the world, metres. Neighbours are matched, turned parallel where they are
    not; then each camera's disparities are refined with all others. nearest, farthest: metres;
    nothing nearer is looked for. fine: as for ``match_rectified_pair``. Raises ValueError for fewer
    than two cameras and for neighbours that do not stand beside each other.
    """
    lenses: FloatArray = np.array(intrinsics, np.float64)
    places: FloatArray = np.array(poses, np.float64)
    found = _inverse_depths(photographs, lenses, places, nearest, fine)
    # Inverse depth in units in which a step of 1 is a pixel between neighbours.
    baseline = float(np.linalg.norm(np.diff(places[:, :3, 3], axis=0), axis=1).mean())
    unit = float(lenses[:, 0, 0].mean()) * baseline
    greys = [_grey(one) for one in photographs]
    maps = []
    for camera, one in enumerate(found):
        partners = [
            _partner(_exposed_as(greys[camera], grey), lenses, places, (camera, other), unit)
            for other, grey in enumerate(greys)
            if other != camera
        ]
        disparity, told = refine_disparities(
            one.value * np.float32(unit),
            np.ascontiguousarray(photographs[camera]),
            greys[camera].astype(np.float32),
            partners,
        )
        depth = unit / np.maximum(disparity, 1e-3)
        spread = np.minimum(one.spread * unit, _COARSE) * (1 - told) + _FINE * told
        known = (depth >= nearest) & (depth <= farthest)
        maps.append([np.where(known, i, np.nan) for i in (depth, depth**2 / unit * spread)])
    depths, deviations = np.array(maps, np.float32).swapaxes(0, 1)
    return DepthMaps(depths, deviations)


def _inverse_depths(
    photographs: Photograph,
    intrinsics: FloatArray,
    poses: FloatArray,
    nearest: float,
    fine: bool,
) -> list[_Inverse]:
    count = len(photographs)
    if count < 2:
        raise ValueError(f"photographs: found {count} cameras; expected two in a row at least.")
    found: list[_Inverse | None] = [None] * count
    for i in range(count - 1):
        pair = slice(i, i + 2)
        seen = _pair_inverse(photographs[pair], intrinsics[pair], poses[pair], nearest, fine)
        for camera, one in zip((i, i + 1), seen, strict=True):
            before = found[camera]
            found[camera] = one if before is None else _merged(before, one)
    return [one for one in found if one is not None]


def _pair_inverse(
    photographs: Photograph,
    intrinsics: FloatArray,
    poses: FloatArray,
    nearest: float,
    fine: bool,
) -> Sequence[_Inverse]:
    """Of two cameras, in either order."""
    place = (np.linalg.inv(poses[0]) @ poses[1])[:3, 3]
    baseline = float(np.linalg.norm(place))
    if not abs(place[0]) > 0.5 * baseline:
        raise ValueError(
            f"poses: neighbours are {np.round(place, 3).tolist()} m apart in the first one's axes; "
            "expected cameras beside each other, along x."
        )
    if place[0] < 0:  # the second stands at the left of the first
        found = _pair_inverse(photographs[::-1], intrinsics[::-1], poses[::-1], nearest, fine)
        return found[::-1]
    turns, lens = _rectification(intrinsics, poses)
    # Parallel ones are not resampled, which would blur them.
    straight = all(np.allclose(turn, np.eye(3), atol=1e-5) for turn in turns) and np.allclose(
        intrinsics, lens, atol=1e-3
    )
    shown = photographs
    if not straight:
        both = zip(photographs, intrinsics, turns, strict=True)
        shown = np.stack([_turned(*one, lens) for one in both])
    unit = float(lens[0, 0]) * baseline
    greys = _greys(shown[0], shown[1])
    maps = _both_sides(*greys, _most_there(*greys, int(np.ceil(unit / nearest))), fine)
    answer = []
    for one, own, turn in zip(maps, intrinsics, turns, strict=True):
        seen, over = (
            (one, np.ones((1, 1), np.float32)) if straight else (_turned_back(one, own, turn, lens))
        )
        value = seen.disparity * over / unit
        spread = (0.15 + 0.35 * (1 - seen.confidence)) * over / unit
        answer.append(_Inverse(value.astype(np.float32), spread.astype(np.float32)))
    return answer


def _most_there(left: Photograph, right: Photograph, most: int) -> int:
    """The largest disparity that half the size shows, with room to spare: it may be far less."""
    small = [
        np.asarray(cv2.resize(i, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8)
        for i in (left, right)
    ]
    ours, _ = _both_sides(small[0], small[1], most // 2 + 1, fine=False)
    known = ours.disparity[np.isfinite(ours.disparity)]
    if len(known) == 0:
        return most
    return min(most, int(2.1 * np.percentile(known, 99.9)) + 3)


def _rectification(
    intrinsics: FloatArray, poses: FloatArray
) -> tuple[list[FloatArray], FloatArray]:
    """Rotations of two cameras' axes to common ones whose x is the baseline, and a common K."""
    along = poses[1, :3, 3] - poses[0, :3, 3]
    across = along / np.linalg.norm(along)
    down = np.cross(poses[0, :3, 2] + poses[1, :3, 2], across)
    down /= np.linalg.norm(down)
    axes = np.stack([across, down, np.cross(across, down)])
    return [axes @ pose[:3, :3] for pose in poses], intrinsics.mean(axis=0)


def _turned(
    photograph: Photograph, intrinsics: FloatArray, turn: FloatArray, lens: FloatArray
) -> Photograph:
    height, width = photograph.shape[:2]
    maps = cv2.initUndistortRectifyMap(
        intrinsics, np.zeros(5), turn, lens, (width, height), cv2.CV_32FC1
    )
    seen = cv2.remap(
        np.ascontiguousarray(photograph), *maps, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(seen, np.uint8)


def _turned_back(
    found: DisparityMap, intrinsics: FloatArray, turn: FloatArray, lens: FloatArray
) -> tuple[DisparityMap, Map]:
    """Disparity and confidence in the camera's own pixels; its inverse depth over the turned's."""
    height, width = found.disparity.shape
    across, down = np.meshgrid(np.arange(width), np.arange(height))
    rays = np.stack([across, down, np.ones_like(across)], axis=-1) @ np.linalg.inv(intrinsics).T
    turned = rays @ turn.T
    pixels = ((turned / turned[..., 2:]) @ lens.T).astype(np.float32)
    # Disparities are not mixed: between two surfaces there is none.
    disparity, confidence = (
        np.asarray(
            cv2.remap(
                np.nan_to_num(one),
                pixels[..., 0],
                pixels[..., 1],
                cv2.INTER_NEAREST,
                borderMode=cv2.BORDER_CONSTANT,
                borderValue=0,
            ),
            np.float32,
        )
        for one in found
    )
    disparity = np.where(confidence > 0, disparity, np.float32(np.nan))
    return DisparityMap(disparity, confidence), turned[..., 2].astype(np.float32)


def _merged(first: _Inverse, second: _Inverse) -> _Inverse:
    """Two measurements of the same pixels: their mean where they agree, else the surer one."""
    one, two = 1 / first.spread**2, 1 / second.spread**2
    apart = np.abs(first.value - second.value)
    agree = apart <= 3 * np.sqrt(first.spread**2 + second.spread**2)
    mean = (first.value * one + second.value * two) / (one + two)
    take_second = np.isfinite(second.value) & (
        np.isnan(first.value) | (second.spread < first.spread)
    )
    value = np.where(agree, mean, np.where(take_second, second.value, first.value))
    spread = np.where(
        agree, 1 / np.sqrt(one + two), np.where(take_second, second.spread, first.spread)
    )
    return _Inverse(value.astype(np.float32), spread.astype(np.float32))


def _partner(
    grey: Photograph,
    intrinsics: FloatArray,
    poses: FloatArray,
    cameras: tuple[int, int],
    unit: float,
) -> Partner:
    """The second of two cameras of a frame, for disparities of ``unit`` over depth in the first."""
    camera, other = cameras
    way = np.linalg.inv(poses[other]) @ poses[camera]
    turn = intrinsics[other] @ way[:3, :3] @ np.linalg.inv(intrinsics[camera])
    shift = intrinsics[other] @ way[:3, 3] / unit
    return Partner(grey.astype(np.float32), turn.astype(np.float32), shift.astype(np.float32))
