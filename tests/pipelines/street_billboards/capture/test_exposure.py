"""Exposures and what they are found from: known gains, with reflections; who sees which point."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb, encode_srgb
from pipelines.geometry.cameras import unproject_depth
from pipelines.street_billboards.capture.exposure import exposure_gains, exposure_lut
from pipelines.street_billboards.capture.observations import Observations, observe_points
from pipelines.street_billboards.capture.point_fusion import RgbdViews
from tests.pipelines.street_billboards.compressed_street import placed_camera


def seen_in_a_row(
    points: int, photographs: int, each: int, seed: int = 0
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Points that ``each`` photographs in a row show, and their radiance."""
    rng = np.random.default_rng(seed)
    start = rng.integers(1 - each, photographs, points)
    photograph = start[:, None] + np.arange(each)
    inside = (photograph >= 0) & (photograph < photographs)
    point = np.broadcast_to(np.arange(points)[:, None], inside.shape)
    return point[inside], photograph[inside], rng.uniform(0.02, 0.7, (points, 3))


def relative(gains: NDArray[np.float64]) -> NDArray[np.float64]:
    return gains / np.exp(np.log(gains).mean(axis=0))


def test_known_gains_are_recovered() -> None:
    point, photograph, light = seen_in_a_row(3000, 20, 6)
    gains = np.exp(np.random.default_rng(1).normal(0, 0.4, (20, 3)))
    found = exposure_gains(point, photograph, light[point] * gains[photograph], 20)
    np.testing.assert_allclose(found, relative(gains), rtol=1e-4)
    np.testing.assert_allclose(np.log(found).mean(axis=0), 0.0, atol=1e-9)


def test_a_drift_along_many_photographs_is_recovered() -> None:
    # It is what the points between any two photographs tell the least of.
    point, photograph, light = seen_in_a_row(8000, 300, 4)
    gains = np.exp(np.linspace(-0.7, 0.7, 300))[:, None].repeat(3, axis=1)
    found = exposure_gains(point, photograph, light[point] * gains[photograph], 300)
    np.testing.assert_allclose(found, relative(gains), rtol=1e-3)


def test_reflections_count_for_less() -> None:
    point, photograph, light = seen_in_a_row(4000, 12, 5)
    rng = np.random.default_rng(2)
    gains = np.exp(rng.normal(0, 0.3, (12, 3)))
    radiance = light[point] * gains[photograph] * np.exp(rng.normal(0, 0.02, (len(point), 1)))
    # Cameras at the end of the street see windows shine more often.
    shines = rng.random(len(point)) < 0.02 + 0.2 * photograph / 12
    radiance[shines] += rng.uniform(0.3, 2.0, (shines.sum(), 1))
    found = exposure_gains(point, photograph, radiance, 12)
    off = np.abs(np.log(found / relative(gains))).max()
    logs = np.log(radiance / light[point])
    naive = np.exp([logs[photograph == k].mean(axis=0) for k in range(12)])
    assert off < 0.06
    assert off < 0.3 * np.abs(np.log(relative(naive) / relative(gains))).max()


def test_a_photograph_alone_has_a_gain_of_one() -> None:
    point, photograph, light = seen_in_a_row(500, 5, 3)
    gains = np.array([1.0, 2.0, 0.5, 1.0, 1.0])[:, None].repeat(3, axis=1)
    radiance = light[point] * gains[photograph]
    alone = np.arange(40)
    found = exposure_gains(
        np.concatenate([point, 500 + alone]),
        np.concatenate([photograph, np.full(40, 5)]),
        np.concatenate([radiance, np.full((40, 3), 0.9)]),
        7,
    )
    np.testing.assert_allclose(found[5:], 1.0, atol=1e-6)
    np.testing.assert_allclose(found[:5], relative(gains), rtol=1e-4)


def test_nothing_observed_changes_nothing() -> None:
    nothing = np.empty(0, np.int64)
    np.testing.assert_array_equal(exposure_gains(nothing, nothing, np.empty((0, 3)), 4), 1.0)


def test_codes_of_gains() -> None:
    gains = np.array([[1.0, 2.0, 0.5], [0.8, 1.0, 1.7]])
    codes = exposure_lut(gains)
    assert codes.shape == (2, 256, 3)
    np.testing.assert_array_equal(codes[0, :, 0], np.arange(256))
    np.testing.assert_array_equal(codes[1, :, 1], np.arange(256))
    for k, c, code in [(0, 1, 200), (0, 2, 90), (1, 0, 33), (1, 2, 255)]:
        light = ((code / 255 + 0.055) / 1.055) ** 2.4 / gains[k, c]
        expected = 255 * (1.055 * light ** (1 / 2.4) - 0.055)
        assert codes[k, code, c] == round(min(expected, 255))
    # Brighter than white stays white.
    assert codes[0, 255, 2] == 255
    assert (np.diff(codes.astype(int), axis=1) >= 0).all()


def test_codes_even_out_what_gains_did() -> None:
    light = np.linspace(0.01, 0.45, 50)[:, None].repeat(3, axis=1)
    gains = np.array([0.6, 1.3, 2.1])
    photographed = np.rint(encode_srgb(light * gains) * 255).astype(int)
    evened = exposure_lut(gains)[photographed, np.arange(3)]
    assert np.abs(evened - encode_srgb(light) * 255).max() < 1.5


# ---- who sees which point --------------------------------------------------------------------


def test_observed_by_brute_force() -> None:
    rng = np.random.default_rng(5)
    width, height, farthest = 20, 14, 12.0
    lenses, poses = zip(
        *(
            placed_camera((x, -6.0, 1.0), (0.2 * x, 0, 0.5), (width, height), 16.0)
            for x in (-3.0, 0.0, 2.5)
        ),
        strict=True,
    )
    depth = rng.uniform(3, 14, (3, height, width)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.2] = np.nan
    deviation = rng.uniform(0.05, 0.5, depth.shape).astype(np.float32)
    pictures = rng.integers(0, 256, (3, height, width, 3), dtype=np.uint8)
    views = RgbdViews(depth, deviation, pictures, np.stack(lenses), np.stack(poses))
    # Half of them near what the depth maps say, half anywhere, behind cameras too.
    near = unproject_depth(lenses[1], poses[1], np.nan_to_num(depth[1], nan=5.0)).reshape(-1, 3)
    points = np.concatenate([near + rng.normal(0, 0.3, near.shape), rng.uniform(-12, 12, (300, 3))])
    found = observe_points(points, views, farthest=farthest)

    expected = {}
    for k in range(3):
        for number, point in enumerate(points):
            x, y, z = poses[k][:3, :3].T @ (point - poses[k][:3, 3])
            if not 0.5 < z < farthest:
                continue
            column = round(lenses[k][0, 0] * x / z + lenses[k][0, 2])
            row = round(lenses[k][1, 1] * y / z + lenses[k][1, 2])
            if not (0 <= column < width and 0 <= row < height):
                continue
            codes = pictures[k, row, column]
            if not abs(depth[k, row, column] - z) < 2 * deviation[k, row, column]:
                continue
            if codes.min() >= 8 and codes.max() <= 247:
                expected[number, k] = decode_srgb(codes / 255)
    rows = zip(found.point.tolist(), found.photograph.tolist(), strict=True)
    assert set(rows) == set(expected)
    assert len(found.point) == len(expected) > 50
    for point, photograph, radiance in zip(*found, strict=True):
        np.testing.assert_allclose(radiance, expected[int(point), int(photograph)])


def test_shifted_observations_belong_to_later_photographs() -> None:
    one = Observations(np.array([4, 5]), np.array([0, 2]), np.ones((2, 3)))
    np.testing.assert_array_equal(one.shifted(6).photograph, [6, 8])
    np.testing.assert_array_equal(one.shifted(6).point, one.point)


@pytest.mark.parametrize("count", [0, 1])
def test_few_points_are_fine(count: int) -> None:
    lens, pose = placed_camera((0, -5.0, 0), (0, 0, 0), (8, 8), 6.0)
    flat = np.full((1, 8, 8), 5.0, np.float32)
    views = RgbdViews(
        flat, 0 * flat + 0.1, np.full((1, 8, 8, 3), 90, np.uint8), lens[None], pose[None]
    )
    assert len(observe_points(np.zeros((count, 3)), views, farthest=9.0).point) == count
