"""The sky's map against a panorama that cameras photographed, and its pixels behind foreground."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb, to_8bit
from pipelines.geometry.cameras import project_points
from pipelines.street_billboards.capture.sky import (
    SkyView,
    pixel_rays,
    sky_along,
    sky_map,
    sky_pixels,
)
from tests.pipelines.street_billboards.compressed_street import placed_camera

WIDTH, HEIGHT = 160, 120


def radiance(rays: NDArray[np.float64]) -> NDArray[np.float64]:
    """A sky that is brighter towards the north-east and bluer at the top."""
    azimuth = np.arctan2(rays[..., 1], rays[..., 0])
    side = 0.06 * np.cos(azimuth - 0.8) * np.sqrt(np.maximum(1 - rays[..., 2] ** 2, 0))
    top = rays[..., 2]
    return np.stack([0.4 - 0.2 * top, 0.5 - 0.1 * top, 0.6 + 0.1 * top], axis=-1) + side[..., None]


def photograph(azimuth: float, *, rim: int = 4, seed: int = 0) -> tuple[SkyView, NDArray[np.bool_]]:
    """A view upwards with textured houses, ``rim`` pixels too wide in depth; and the true sky."""
    rng = np.random.default_rng(seed)
    angle = np.radians(azimuth)
    target = (np.cos(angle), np.sin(angle), 0.4)
    lens, pose = placed_camera((0.0, 0.0, 0.0), target, (WIDTH, HEIGHT), 90.0)
    pixels = to_8bit(radiance(pixel_rays(lens, pose, WIDTH, HEIGHT)))
    sky = np.ones((HEIGHT, WIDTH), bool)
    sky[85:] = False
    for left in (10, 90):
        sky[60 - left // 4 :, left : left + 35] = False
    grain = rng.integers(10, 110, (HEIGHT // 4, WIDTH // 4, 3)).repeat(4, axis=0).repeat(4, axis=1)
    pixels[~sky] = grain[~sky]
    claimed = cv2.dilate((~sky).astype(np.uint8), np.ones((2 * rim + 1,) * 2, np.uint8)) > 0
    depth = np.where(claimed, 15.0, np.nan).astype(np.float32)
    return SkyView(pixels, depth, lens, pose), sky


def directions(height: int) -> NDArray[np.float64]:
    """Unit vectors (height, 2 height, 3) of a map's texels; the middle column is +x, left is +y."""
    polar = (np.arange(height) + 0.5) / height * np.pi
    azimuth = np.pi - (np.arange(2 * height) + 0.5) / (2 * height) * 2 * np.pi
    return np.stack(
        [
            np.sin(polar)[:, None] * np.cos(azimuth),
            np.sin(polar)[:, None] * np.sin(azimuth),
            np.broadcast_to(np.cos(polar)[:, None], (height, 2 * height)),
        ],
        axis=-1,
    )


@pytest.mark.parametrize("height", [32, 64])
def test_the_map_is_the_panorama(height: int) -> None:
    shots = [photograph(azimuth, seed=azimuth) for azimuth in range(0, 360, 40)]
    found = sky_map([view for view, _ in shots], height)
    assert found.shape == (height, 2 * height, 3)
    assert found.dtype == np.float32
    ways = directions(height)
    shown = np.zeros(ways.shape[:2], bool)
    for view, sky in shots:
        pixels, depth = project_points(view.intrinsics, view.to_world, ways)
        x, y = np.moveaxis(np.rint(pixels).clip(-1, 400).astype(int), -1, 0)
        inside = (depth > 0) & (x > 2) & (x < WIDTH - 3) & (y > 2) & (y < HEIGHT - 3)
        far_from_houses = cv2.erode(sky.astype(np.uint8), np.ones((31, 31), np.uint8)) > 0
        shown |= inside & far_from_houses[y * inside, x * inside]
    shown[height // 2 - 1 :] = False
    assert shown.mean() > 0.15
    truth = radiance(ways)
    # Within a texel it changes by up to this much; codes are 0.008 of white apart at most.
    assert np.abs(found - truth)[shown].max() < 0.009 + 0.5 / height
    assert np.abs((found - truth)[shown].mean()) < 0.002
    # The zenith, which nobody photographed, is near what is around it; no house is in the map.
    assert np.abs(found - truth)[: height // 2 - 1].max() < 0.2
    # Below the horizon is the mean of what the photographs have there: their lower rows.
    low = []
    for view, _ in shots:
        rows, columns = np.mgrid[:HEIGHT, :WIDTH]
        lens = view.intrinsics
        rays = np.stack(
            [
                (columns - lens[0, 2]) / lens[0, 0],
                (rows - lens[1, 2]) / lens[1, 1],
                np.ones((HEIGHT, WIDTH)),
            ],
            axis=-1,
        )
        down = (rays @ view.to_world[:3, :3].T)[..., 2] < 0
        low.append(decode_srgb(view.pixels[down] / 255.0))
    mean = np.concatenate(low).mean(axis=0)
    np.testing.assert_allclose(
        found[height // 2 :], np.broadcast_to(mean, (height // 2, 2 * height, 3)), rtol=1e-5
    )


def test_a_false_rim_of_depth_is_sky_again() -> None:
    for rim in (3, 6):
        view, sky = photograph(30.0, rim=rim)
        found = sky_pixels(view)
        # Depth alone loses the rims.
        assert (np.isnan(view.depth) & sky).sum() < 0.93 * sky.sum()
        assert (found & sky).sum() > 0.97 * sky.sum()
        assert (found & sky).sum() > 0.995 * found.sum()


def test_unknown_depth_on_a_house_is_not_the_sky() -> None:
    view, sky = photograph(30.0)
    view.depth[95:115, 20:150] = np.nan  # below the horizon's houses, and textured
    found = sky_pixels(view)
    assert (found & sky).sum() > 0.97 * sky.sum()
    assert not found[95:115, 20:150].any()


def test_something_sky_coloured_elsewhere_is_not_the_sky() -> None:
    view, sky = photograph(30.0)
    view.pixels[62:80, 100:115] = view.pixels[20, 60]  # a window in a house
    assert not sky[62:80, 100:115].any()
    assert not sky_pixels(view)[64:78, 102:113].any()


def test_without_sky_there_is_none() -> None:
    view, _ = photograph(30.0)
    indoors = view._replace(depth=np.full_like(view.depth, 4.0))
    assert not sky_pixels(indoors).any()
    np.testing.assert_array_equal(sky_map([indoors], 8), np.zeros((8, 16, 3)))
    np.testing.assert_array_equal(sky_map([], 8), np.zeros((8, 16, 3)))


def test_rays_are_unit_vectors_through_the_pixels() -> None:
    lens, pose = placed_camera((3.0, 1.0, 2.0), (0.0, 4.0, 5.0), (20, 14), 15.0)
    rays = pixel_rays(lens, pose, 20, 14)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=-1), 1.0)
    pixels, depth = project_points(lens, pose, pose[:3, 3] + 7.0 * rays)
    assert (depth > 0).all()
    np.testing.assert_allclose(
        pixels, np.stack(np.meshgrid(np.arange(20), np.arange(14)), axis=-1), atol=1e-9
    )


def test_looking_up_a_map_finds_its_texels() -> None:
    sky = np.random.default_rng(0).random((8, 16, 3)).astype(np.float32)
    np.testing.assert_allclose(sky_along(sky, directions(8)), sky, atol=2e-3)
    # Across the seam behind the viewer it is interpolated, too.
    seam = directions(8)[:, :1].copy()
    seam[..., 0] = -np.hypot(seam[..., 0], seam[..., 1])
    seam[..., 1] = 0.0
    expected = (sky[:, :1] + sky[:, -1:]) / 2
    np.testing.assert_allclose(sky_along(sky, seam), expected, atol=2e-2)
