"""Figures of drives, depth, billboards and pictures: closed forms and brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipelines.drawing.colour import encode_srgb
from pipelines.geometry.cameras import unproject_depth
from pipelines.street_billboards.figures import (
    bad_depth_share,
    bad_pixel_share,
    depth_error,
    deviation_honest,
    differing_share,
    dilated,
    excess_rank,
    exposure_spread,
    frame_spacing,
    known_share,
    largest_log_gain,
    match_exposure,
    mean_psnr,
    neighbour_difference,
    off_plane,
    path_length,
    share_in_voxels,
    stray_share,
)
from tests.pipelines.street_billboards.compressed_street import placed_camera

ALL = np.ones((24, 30), bool)


def noise(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(20, 230, (24, 30, 3), dtype=np.uint8)


# ---- pictures --------------------------------------------------------------------------------


@given(gains=st.tuples(*[st.floats(0.3, 1.0)] * 3), seed=st.integers(0, 100))
def test_match_exposure_takes_back_a_gain(gains: tuple[float, float, float], seed: int) -> None:
    light = np.random.default_rng(seed).uniform(0.05, 0.9, (24, 30, 3))
    truth = np.rint(encode_srgb(light) * 255).astype(np.uint8)
    picture = np.rint(encode_srgb(light * gains) * 255).astype(np.uint8)
    found = match_exposure(picture, truth, ALL)
    # A code of the darker picture stands for up to this many of the brighter one.
    most = max(gain ** (-1 / 2.4) for gain in gains) / 2 + 1.5
    assert np.abs(found.astype(int) - truth).max() <= most
    np.testing.assert_array_equal(match_exposure(truth, truth, ALL), truth)


def test_match_exposure_is_not_misled_by_what_is_not_asked() -> None:
    truth = noise()
    picture = truth.copy()
    where = ALL.copy()
    where[:5] = False
    picture[:5] = 0
    np.testing.assert_array_equal(match_exposure(picture, truth, where)[5:], truth[5:])


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 1000), share=st.floats(0.0, 0.1), pixels=st.integers(0, 8))
def test_dilated_by_brute_force(seed: int, share: float, pixels: int) -> None:
    mask = np.random.default_rng(seed).random((15, 18)) < share
    y, x = np.mgrid[:15, :18]
    expected = np.zeros_like(mask)
    for row, column in np.argwhere(mask):
        expected |= (y - row) ** 2 + (x - column) ** 2 <= pixels**2
    np.testing.assert_array_equal(dilated(mask, pixels), expected)


def test_mean_psnr_is_of_pictures_not_of_pixels() -> None:
    truths = np.stack([noise(1), noise(2)])
    pictures = truths + np.array([3, 12], np.uint8)[:, None, None, None]
    where = np.stack([ALL, ALL])
    where[0, 1:] = False
    expected = (20 * math.log10(255 / 3) + 20 * math.log10(255 / 12)) / 2
    assert mean_psnr(pictures, truths, where) == pytest.approx(expected)


def test_pixels_differ_by_their_worst_channel() -> None:
    picture = noise()
    other = picture.copy()
    other[:12] += np.uint8(1)
    other[:6, :, 1] += np.uint8(1)
    assert differing_share(picture, other) == differing_share(other, picture) == 6 / 24
    assert differing_share(picture, other, most=0) == 12 / 24
    assert differing_share(picture, other, most=2) == 0.0


# ---- drives ----------------------------------------------------------------------------------


def test_a_way_is_as_long_as_its_steps() -> None:
    places = np.array([[0.0, 0, 0], [3, 4, 0], [3, 4, 2], [3, 4, 0]])
    assert path_length(places) == 9.0
    assert frame_spacing(places) == 2.0


def test_exposures_differ_relative_to_their_mean() -> None:
    means = np.array([[90.0, 110.0], [90.0, 110.0]])
    assert exposure_spread(means) == pytest.approx(0.1)
    assert exposure_spread(3 * means) == pytest.approx(0.1)
    assert exposure_spread(np.full(4, 90.0)) == 0.0


def test_detail_is_looked_for_along_rows() -> None:
    stripes = np.tile(np.array([0.0, 7.0]), (2, 5, 4))
    assert neighbour_difference(stripes) == 7.0
    assert neighbour_difference(stripes.swapaxes(1, 2)) == 0.0


def test_gains_count_either_way() -> None:
    assert largest_log_gain(np.array([[1.0, 1.1], [0.5, 1.2]])) == pytest.approx(math.log(2))


# ---- billboards ------------------------------------------------------------------------------


def test_points_in_voxels_by_brute_force() -> None:
    rng = np.random.default_rng(0)
    voxels = rng.integers(-3, 4, (30, 3)) * 0.5
    points = rng.uniform(-2, 2, (200, 3))
    inside = (np.abs(points[:, None] - voxels) <= 0.25).all(axis=2).any(axis=1)
    assert 0 < inside.mean() < 1
    assert share_in_voxels(points, voxels, 0.5) == inside.mean()


def test_points_are_off_the_plane_of_their_own_voxel() -> None:
    rng = np.random.default_rng(1)
    voxels = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    normal = np.array([[0.0, 0, 3.0], [0, 2.0, 0], [1, 0, 0]], np.float32)
    centre = voxels + np.array([0, 0.1, 0.1])
    turns = np.array([False, False, True])
    flat = rng.uniform(-0.4, 0.4, (40, 3)) * [1, 1, 0] + centre[0] + [0, -0.1, 0.2]
    steep = rng.uniform(-0.4, 0.4, (41, 3)) * [1, 0, 1] + centre[1] - [0, 0.05, 0.1]
    turning = rng.uniform(-0.4, 0.4, (300, 3)) + voxels[2]
    outside = rng.uniform(-0.4, 0.4, (300, 3)) + np.array([0, 7, 7])
    points = np.concatenate([flat, steep, turning, outside])

    def found(points: np.ndarray) -> float:
        return off_plane(points, voxels, 1.0, centre=centre, normal=normal, turns=turns)

    assert found(flat) == pytest.approx(0.2)
    assert found(points) == pytest.approx(0.05)
    assert off_plane(points, voxels, 1.0, centre=centre, normal=normal, turns=~turns | True) == 0.0


def test_eigen_images_beyond_the_views() -> None:
    first = np.array([0, 2, 2, 5])
    fitting = np.array([[2, 1, 0], [0, 0, 0], [3, 3, 1]], np.uint8)
    assert excess_rank(fitting, first) == 0
    fitting[1, 2] = 4
    assert excess_rank(fitting, first) == 4


# ---- depth -----------------------------------------------------------------------------------


def test_missing_disparities_are_bad_and_unknown_truth_does_not_count() -> None:
    truth = np.array([[1, 2, np.nan, 4]], np.float32)
    found = np.array([[1.4, np.nan, 3, 5]], np.float32)
    assert bad_pixel_share(found, truth) == pytest.approx(2 / 3)
    assert bad_pixel_share(found, truth, threshold=1) == pytest.approx(1 / 3)


def test_depth_error_by_hand() -> None:
    truth = np.array([[10.0, 10.0, 10.0, 10.0], [19.0, 21.0, np.inf, np.nan]])
    depth = np.array([[10.4, 9.6, 10.6, np.nan], [19.0, 9.0, 3.0, 3.0]])
    # Two of five up to 20 m are wrong: one by 6 %, one unknown.
    assert depth_error(depth, truth) == pytest.approx(2 / 5)
    assert depth_error(truth, truth) == 0.0


@given(share=st.floats(0.0, 1.0), seed=st.integers(0, 100))
def test_depth_error_is_the_share_that_was_spoilt(share: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = rng.uniform(2, 40, (30, 30))
    spoilt = rng.random(truth.shape) < share
    depth = truth * np.where(spoilt, rng.choice([0.9, 1.1, np.nan], truth.shape), 1.02)
    expected = spoilt[truth < 20].mean()
    assert depth_error(depth, truth) == pytest.approx(expected)


def test_what_is_known_bad_and_honest_by_hand() -> None:
    truth = np.array([10.0, 10.0, 24.0, 30.0, np.inf, 40.0, 12.0])
    depth = np.array([10.4, 11.0, np.nan, 20.0, 9.0, 39.0, 12.1])
    deviation = np.array([0.3, 0.4, np.nan, 6.0, 3.0, 0.1, 0.01])
    assert known_share(depth, truth) == pytest.approx(3 / 4)
    # Asked: 10.4 right, 11 bad, 20 for 30 bad, 9 for the sky bad, 12.1 right; 39 is too far.
    assert bad_depth_share(depth, truth) == pytest.approx(3 / 5)
    # Within two deviations: 10.4 for 10, 20 for 30.
    assert deviation_honest(depth, deviation, truth) == pytest.approx(2 / 5)


def test_deviations_are_honest_where_errors_are_as_they_say() -> None:
    rng = np.random.default_rng(3)
    deviation = rng.uniform(0.05, 0.5, 20_000)
    truth = rng.uniform(5, 20, 20_000)
    depth = truth + deviation * rng.standard_normal(20_000)
    assert deviation_honest(depth, deviation, truth) == pytest.approx(0.9545, abs=0.006)
    assert deviation_honest(depth, 0.3 * deviation, truth) < 0.5


def test_stray_points_are_those_before_the_surface() -> None:
    size = (30, 20)
    lenses, poses = zip(
        *(placed_camera((x, -8.0, 0), (x, 0, 0), size, 25.0) for x in (0.0, 1.0)), strict=True
    )
    truths = np.full((2, 20, 30), 8.0)
    rng = np.random.default_rng(0)

    def on_wall(count: int, y: float) -> np.ndarray:
        return np.column_stack(
            [rng.uniform(0, 1, count), np.full(count, y), rng.uniform(-1, 1, count)]
        )

    right, floating, hidden = on_wall(60, 0.1), on_wall(20, -1.0), on_wall(33, 2.0)
    behind = on_wall(11, -30.0)
    points = np.concatenate([right, floating, hidden, behind])
    found = stray_share(points, lenses[0], np.stack(poses), truths)
    assert found == pytest.approx(20 / 80)
    assert stray_share(behind, lenses[0], np.stack(poses), truths) == 0.0


def test_true_depth_maps_have_no_strays() -> None:
    lens, pose = placed_camera((1.0, -8.0, 2.0), (0, 0, 0), (30, 20), 25.0)
    depth = np.random.default_rng(1).uniform(2, 19, (20, 30))
    points = unproject_depth(lens, pose, depth).reshape(-1, 3)
    assert stray_share(points, lens, pose[None], depth[None]) == 0.0
    y, x = np.mgrid[:20, :30]
    forward = np.where(((x + y) % 3 == 0)[..., None], 0.9, 1.0).reshape(-1, 1)
    pulled = pose[:3, 3] + forward * (points - pose[:3, 3])
    strays = stray_share(pulled, lens, pose[None], depth[None])
    assert strays == pytest.approx(((x + y) % 3 == 0).mean())
