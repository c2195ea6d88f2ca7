"""Depth maps of points against a loop over all points and pixels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipelines.geometry.cameras import project_points
from pipelines.street_billboards.capture.point_fusion import RgbdViews
from pipelines.street_billboards.capture.surface_depth import fill_unknown_depth, surface_depth
from tests.pipelines.street_billboards.compressed_street import placed_camera

WIDTH, HEIGHT = 24, 17


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 10_000), size=st.floats(0.01, 1.5))
def test_splats_by_brute_force(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    lens, pose = placed_camera((0.3, -4.0, 0.5), (0, 0, 0), (WIDTH, HEIGHT), 15.0)
    points = rng.uniform(-6, 6, (60, 3))
    found = surface_depth(points, size, lens, pose, WIDTH, HEIGHT, farthest=7.0)
    expected = np.full((HEIGHT, WIDTH), np.inf)
    pixels, depth = project_points(lens, pose, points)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    for (across, down), z in zip(pixels, depth, strict=True):
        if 0.3 <= z <= 7.0:
            reach = max(size * 15.0 / z / 2, 1.0)
            inside = (np.abs(x - across) <= reach) & (np.abs(y - down) <= reach)
            expected[inside] = np.minimum(expected[inside], z)
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert found.dtype == np.float32


def test_a_dense_wall_leaves_no_hole() -> None:
    lens, pose = placed_camera((0, -4.0, 0), (0, 0, 0), (WIDTH, HEIGHT), 15.0)
    x, z = np.meshgrid(np.arange(-5, 5, 0.1), np.arange(-4, 4, 0.1))
    wall = np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])
    behind = wall + np.array([0, 2.0, 0])
    found = surface_depth(
        np.concatenate([behind, wall]), 0.1, lens, pose, WIDTH, HEIGHT, farthest=50.0
    )
    np.testing.assert_allclose(found, 4.0, rtol=1e-6)


@pytest.mark.parametrize("y", [-9.0, -4.2, 80.0])
def test_what_is_behind_too_near_or_too_far_hides_nothing(y: float) -> None:
    lens, pose = placed_camera((0, -4.0, 0), (0, 0, 0), (WIDTH, HEIGHT), 15.0)
    found = surface_depth(np.array([[0.0, y, 0.0]]), 1.0, lens, pose, WIDTH, HEIGHT, farthest=50.0)
    assert np.isinf(found).all()


def test_no_points_no_depth() -> None:
    lens, pose = placed_camera((0, -4.0, 0), (0, 0, 0), (WIDTH, HEIGHT), 15.0)
    found = surface_depth(np.empty((0, 3)), 1.0, lens, pose, WIDTH, HEIGHT, farthest=50.0)
    assert np.isinf(found).all()


# ---- what stereo left open -------------------------------------------------------------------


def _views(depth: float) -> RgbdViews:
    """Two cameras before a wall, of whose depths every third is unknown."""
    lens, pose = placed_camera((0, -4.0, 0), (0, 0, 0), (WIDTH, HEIGHT), 15.0)
    known = np.full((2, HEIGHT, WIDTH), depth, np.float32)
    known[:, ::3] = np.nan
    known[:, 1::3] = np.inf
    deviation = np.full_like(known, 0.02)
    beside = pose.copy()
    beside[0, 3] += 0.5
    photographs = np.zeros((2, HEIGHT, WIDTH, 3), np.uint8)
    return RgbdViews(
        known, deviation, photographs, np.stack([lens, lens]), np.stack([pose, beside])
    )


def test_only_unknown_depths_become_those_of_points() -> None:
    x, z = np.meshgrid(np.arange(-5, 5, 0.05), np.arange(-4, 4, 0.05))
    wall = np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])
    views = _views(3.0)
    fill_unknown_depth(views, wall, farthest=40.0)
    np.testing.assert_allclose(views.depth[:, ::3], 4.0, rtol=1e-6)
    np.testing.assert_array_equal(views.depth[:, 2::3], 3.0)
    assert np.isinf(views.depth[:, 1::3]).all()
    np.testing.assert_allclose(views.deviation[:, ::3], 0.1)
    np.testing.assert_allclose(views.deviation[:, 2::3], 0.02)


def test_points_a_little_beyond_the_farthest_billboard_count_and_others_do_not() -> None:
    x, z = np.meshgrid(np.arange(-30, 30, 0.2), np.arange(-30, 30, 0.2))
    for away, seen in ((14.0, True), (17.0, False)):
        wall = np.column_stack([x.ravel(), np.full(x.size, away - 4.0), z.ravel()])
        views = _views(3.0)
        fill_unknown_depth(views, wall, farthest=5.0)
        assert np.isfinite(views.depth[:, ::3]).any() == seen
