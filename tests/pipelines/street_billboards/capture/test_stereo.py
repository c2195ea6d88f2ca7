"""Stereo: a real pair against OpenCV's defaults, a street against ray-cast depth."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import skimage.data
from numpy.typing import NDArray

from pipelines.street_billboards.capture.stereo import (
    DepthMaps,
    depth_maps,
    match_rectified_pair,
    opencv_disparities,
)
from pipelines.street_billboards.capture.weighted_median import fill_disparity_holes
from pipelines.street_billboards.figures import bad_pixel_share
from tests.pipelines.street_billboards.stereo_street import Frame, frame_at

Pair = tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.float32]]


@pytest.fixture(scope="module")
def motorcycle() -> Pair:
    left, right, truth = skimage.data.stereo_motorcycle()
    return left, right, np.where(np.isfinite(truth), truth, np.nan).astype(np.float32)


@pytest.fixture(scope="module")
def straight() -> tuple[Frame, DepthMaps]:
    frame = frame_at(3.0)
    return frame, depth_maps(frame.photographs, frame.intrinsics, frame.poses)


def _relative_error(maps: DepthMaps, frame: Frame) -> NDArray[np.float32]:
    return np.abs(maps.depth / frame.depth - 1)


def test_a_real_pair_is_matched_better_than_by_opencv_as_it_comes(motorcycle: Pair) -> None:
    left, right, truth = motorcycle
    found, _ = match_rectified_pair(left, right, 64)
    defaults = bad_pixel_share(opencv_disparities(left, right, 64), truth)
    assert bad_pixel_share(found.disparity, truth) < 0.65 * defaults
    assert bad_pixel_share(fill_disparity_holes(found.disparity, left), truth) < 0.45 * defaults
    known = np.isfinite(found.disparity)
    assert bad_pixel_share(found.disparity, np.where(known, truth, np.nan)) < 0.1
    assert ((found.confidence > 0) == known).all()
    assert found.disparity.dtype == found.confidence.dtype == np.float32


def test_half_the_width_is_coarser_and_not_bad(motorcycle: Pair) -> None:
    left, right, truth = motorcycle
    fine, coarse = (
        match_rectified_pair(left, right, 64, fine=way)[0].disparity for way in (True, False)
    )
    assert (
        bad_pixel_share(fill_disparity_holes(fine, left), truth)
        < bad_pixel_share(fill_disparity_holes(coarse, left), truth)
        < 0.2
    )


def test_the_right_photograph_has_disparities_of_its_own(motorcycle: Pair) -> None:
    left, right, _ = motorcycle
    ours, theirs = match_rectified_pair(left, right, 64)
    rows, columns = np.nonzero(np.isfinite(ours.disparity))
    there = np.rint(columns - ours.disparity[rows, columns]).astype(int)
    apart = ours.disparity[rows, columns] - theirs.disparity[rows, np.maximum(there, 0)]
    assert np.nanmean(np.abs(apart) < 1.5) > 0.97


def test_photographs_of_one_pair_may_be_exposed_differently(motorcycle: Pair) -> None:
    left, right, truth = motorcycle
    darker = np.rint(right * 0.87).astype(np.uint8)
    same, other = (match_rectified_pair(left, one, 64)[0].disparity for one in (right, darker))
    assert bad_pixel_share(other, truth) < bad_pixel_share(same, truth) + 0.01


def test_a_shift_by_a_fraction_of_a_pixel_is_found() -> None:
    size = 160
    noise = np.random.default_rng(0).normal(size=(size, size))
    grey = np.asarray(cv2.GaussianBlur(noise, (0, 0), 1.5))
    grey = 128 + 40 * grey / grey.std()
    shifts = np.array([[1, 0, -7.25], [0, 1, 0]], np.float32)
    moved = cv2.warpAffine(grey, shifts, (size, size), flags=cv2.INTER_CUBIC)
    pair = [np.repeat(np.clip(np.rint(i), 0, 255).astype(np.uint8)[..., None], 3, 2)
            for i in (grey, moved)]  # fmt: skip
    found, _ = match_rectified_pair(pair[0], pair[1], 16)
    inside = found.disparity[20:-20, 30:-20]
    assert np.isfinite(inside).mean() > 0.98
    assert abs(np.nanmedian(inside) - 7.25) < 0.03
    assert np.nanstd(inside) < 0.06


def test_nothing_to_match_has_no_disparity_or_is_flat() -> None:
    left = np.random.default_rng(1).integers(0, 255, (60, 90, 3)).astype(np.uint8)
    right = np.random.default_rng(2).integers(0, 255, (60, 90, 3)).astype(np.uint8)
    found, _ = match_rectified_pair(left, right, 32)
    assert np.isfinite(found.disparity).mean() < 0.3


def test_holes_take_the_far_side() -> None:
    disparity = np.full((12, 30), 3, np.float32)
    disparity[:, 15:] = 9
    disparity[:, 10:15] = np.nan
    disparity[5] = np.nan
    dense = fill_disparity_holes(disparity, np.full((12, 30, 3), 90, np.uint8))
    assert (dense[:, :14] == 3).all()
    assert (dense[:, 16:] == 9).all()
    assert np.isnan(
        fill_disparity_holes(np.full((4, 5), np.nan, np.float32), np.zeros((4, 5, 3), np.uint8))
    ).all()


def test_depth_is_right_to_a_few_thousandths(straight: tuple[Frame, DepthMaps]) -> None:
    frame, maps = straight
    near = frame.depth <= 12
    error = _relative_error(maps, frame)
    known = np.isfinite(maps.depth)
    assert np.median(error[near & known]) < 0.003
    assert (error[near] < 0.02).mean() > 0.78
    assert (error[near & known] > 0.05).mean() < 0.02


def test_deviations_are_what_depths_deviate(straight: tuple[Frame, DepthMaps]) -> None:
    frame, maps = straight
    known = np.isfinite(maps.depth)
    assert (np.isfinite(maps.deviation) == known).all()
    known &= frame.depth <= 15
    scores = np.abs(maps.depth - frame.depth)[known] / maps.deviation[known]
    # A normal distribution has 0.68 and 0.954.
    assert 0.6 < (scores < 1).mean() < 0.95
    assert (scores < 2).mean() > 0.85


def test_thin_poles_stay_and_do_not_spread(straight: tuple[Frame, DepthMaps]) -> None:
    frame, maps = straight
    pole = frame.pole & (frame.depth < 9)  # two to four pixels wide
    assert (_relative_error(maps, frame)[pole] < 0.05).mean() > 0.55
    beside = np.stack(
        [cv2.dilate(one.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0 for one in pole]
    )
    beside &= ~frame.pole & np.isfinite(frame.depth)
    assert (maps.depth[beside] < 0.9 * frame.depth[beside]).mean() < 0.1


def test_cameras_may_be_crooked_and_expose_differently() -> None:
    frame = frame_at(3.0, crooked=True, exposure=(1.0, 1.1, 0.9))
    maps = depth_maps(frame.photographs, frame.intrinsics, frame.poses)
    near = frame.depth <= 12
    error = _relative_error(maps, frame)
    known = np.isfinite(maps.depth)
    assert np.median(error[near & known]) < 0.005
    assert (error[near] < 0.02).mean() > 0.74
    assert (error[near & known] > 0.05).mean() < 0.03


def test_the_order_of_cameras_does_not_matter(straight: tuple[Frame, DepthMaps]) -> None:
    frame, maps = straight
    turned = depth_maps(frame.photographs[::-1], frame.intrinsics[::-1], frame.poses[::-1])
    same = np.abs(turned.depth[::-1] / maps.depth - 1) < 0.01
    assert same[np.isfinite(maps.depth)].mean() > 0.97


def test_two_cameras_are_enough_and_one_is_not(straight: tuple[Frame, DepthMaps]) -> None:
    frame, _ = straight
    maps = depth_maps(frame.photographs[:2], frame.intrinsics[:2], frame.poses[:2])
    near = frame.depth[:2] <= 12
    assert (np.abs(maps.depth / frame.depth[:2] - 1)[near] < 0.02).mean() > 0.65
    with pytest.raises(ValueError, match="found 1 cameras; expected two"):
        depth_maps(frame.photographs[:1], frame.intrinsics[:1], frame.poses[:1])


def test_neighbours_one_above_the_other_are_refused(straight: tuple[Frame, DepthMaps]) -> None:
    frame, _ = straight
    poses = frame.poses.copy()
    poses[:, :3, 3] = [[0, 0, 1], [0, 0, 2], [0, 0, 3]]
    with pytest.raises(ValueError, match=r"poses: neighbours are .* expected cameras beside"):
        depth_maps(frame.photographs, frame.intrinsics, poses)


def test_depths_are_where_they_are_asked_for(straight: tuple[Frame, DepthMaps]) -> None:
    frame, _ = straight
    maps = depth_maps(
        frame.photographs, frame.intrinsics, frame.poses, nearest=5.0, farthest=9.0, fine=False
    )
    known = np.isfinite(maps.depth)
    assert known.any()
    assert maps.depth[known].min() >= 5.0
    assert maps.depth[known].max() <= 9.0
    assert maps.depth.dtype == maps.deviation.dtype == np.float32


def test_photographs_of_different_sizes_are_refused() -> None:
    one, other = np.zeros((20, 30, 3), np.uint8), np.zeros((20, 31, 3), np.uint8)
    with pytest.raises(ValueError, match="expected \\(h, w, 3\\) both"):
        match_rectified_pair(one, other, 16)
