"""The figures of the checks against brute force, and mistakes that each must find."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from pipelines.photo_fur.attenuation import Attenuation, Tails, make_shell_stack
from pipelines.photo_fur.figures import (
    clipped_share,
    contrast,
    decay_error,
    depth_rank_correlation,
    estimated_depth,
    interval_error,
    kept_share,
    mean_brightness,
    outward_share,
    partition_error,
    step_error,
)
from pipelines.photo_fur.shells import shell_vertices

MEDIUM = Attenuation(0.9, 0.05)

# ---- the photograph --------------------------------------------------------------------------


def test_contrast_is_michelsons_of_all_but_the_extremes() -> None:
    luminance = np.concatenate([np.full(500, 0.2), np.full(500, 0.6), [0.0, 100.0]])
    assert contrast(luminance) == pytest.approx((0.6 - 0.2) / (0.6 + 0.2))
    assert contrast(np.full((4, 4), 0.3)) == 0.0


def test_a_pixel_is_clipped_where_all_its_channels_are_white() -> None:
    radiance = np.array([[[1.0, 1.0, 1.0], [1.0, 1.0, 0.9]], [[1.2, 1.0, 3.0], [0.0, 0.0, 0.0]]])
    assert clipped_share(radiance) == 0.5


# ---- the medium ------------------------------------------------------------------------------


def test_the_kept_share_is_the_layers_part_of_the_histogram() -> None:
    assert kept_share(np.array([3, 0, 6]), np.array([0, 4, 5, 3])) == 0.75


def test_decay_error_is_the_largest_relative_step_from_equation_1() -> None:
    boundaries = MEDIUM.boundaries(8)
    assert decay_error(boundaries, MEDIUM.brightest, MEDIUM.coefficient) < 1e-12
    boundaries[3] *= 1.25
    boundaries[5] *= 0.9
    found = decay_error(boundaries, MEDIUM.brightest, MEDIUM.coefficient)
    assert found == pytest.approx(0.25)


def test_the_estimated_depth_inverts_equation_1_and_ends_at_the_extremes() -> None:
    depth = np.linspace(0.0, 1.0, 12).reshape(3, 4)
    assert estimated_depth(MEDIUM.luminance_at(depth), MEDIUM) == pytest.approx(depth)
    beyond = np.array([[0.0, MEDIUM.darkest / 2, 1.0]])
    assert estimated_depth(beyond, MEDIUM).tolist() == [[1.0, 1.0, 0.0]]


def brute_force_ranks(values: list[float]) -> list[float]:
    """Average ranks: those below, and half of those that tie."""
    return [
        sum(other < value for other in values) + (values.count(value) - 1) / 2 for value in values
    ]


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(1, 8), st.integers(0, 8)), min_size=4, max_size=40))
def test_depth_rank_correlation_is_pearson_of_the_ranks(pairs: list[tuple[int, int]]) -> None:
    darkness, depth = [-float(pair[0]) for pair in pairs], [float(pair[1]) for pair in pairs]
    assume(len(set(darkness)) > 1)
    assume(len(set(depth)) > 1)
    expected = np.corrcoef(brute_force_ranks(darkness), brute_force_ranks(depth))[0, 1]
    found = depth_rank_correlation(-np.array(darkness)[None], np.array(depth)[None])
    assert found == pytest.approx(expected, abs=1e-12)


def test_brightness_that_orders_the_depth_has_correlation_1() -> None:
    depth = np.random.default_rng(0).random((8, 8))
    luminance = Attenuation(0.9, 0.02).luminance_at(depth)
    assert depth_rank_correlation(luminance, depth) == pytest.approx(1.0)
    assert depth_rank_correlation(-luminance, depth) == pytest.approx(-1.0)


# ---- the layers ------------------------------------------------------------------------------


@pytest.mark.parametrize("tails", ["end layers", "dropped"])
def test_a_right_stack_has_no_error_and_each_wrong_pixel_its_share(tails: Tails) -> None:
    luminance = np.random.default_rng(2).random((10, 10))
    layer, masks = make_shell_stack(luminance, MEDIUM, 6, tails=tails)
    boundaries = MEDIUM.boundaries(6)
    assert partition_error(layer, masks) == 0.0
    assert interval_error(layer, luminance, boundaries, tails) == 0.0
    twice, none, moved = masks.copy(), masks.copy(), layer.copy()
    y, x = np.argwhere(layer == 3)[0]
    twice[5, y, x] = True
    none[:, y, x] = False
    moved[y, x] = 4
    assert partition_error(layer, twice) == 0.01
    assert partition_error(layer, none) == 0.01
    assert partition_error(moved, masks) == 0.01
    assert interval_error(moved, luminance, boundaries, tails) == 0.01


def test_a_pixel_inside_the_medium_may_not_be_dropped_and_one_outside_must_be() -> None:
    boundaries = MEDIUM.boundaries(4)
    luminance = np.array([[0.95, 0.9, 0.05, 0.01]])  # too bright, Imax, Imin, too dark
    right = np.array([[0, 1, 4, 0]], np.uint8)
    assert interval_error(right, luminance, boundaries, "dropped") == 0.0
    assert interval_error(right, luminance, boundaries, "end layers") == 0.5
    kept = np.array([[1, 1, 4, 4]], np.uint8)
    assert interval_error(kept, luminance, boundaries, "end layers") == 0.0
    assert interval_error(kept, luminance, boundaries, "dropped") == 0.5
    assert interval_error(np.zeros_like(right), luminance, boundaries, "dropped") == 0.5


# ---- the shells ------------------------------------------------------------------------------


def test_step_error_is_the_largest_distance_from_equation_3() -> None:
    rng = np.random.default_rng(8)
    normals = rng.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    shells = shell_vertices(rng.normal(size=(30, 3)), normals, 0.5, 6).astype(np.float64)
    assert step_error(shells, normals, 0.5) < 1e-6
    shells[2, 7] += [0.03, 0.04, 0.0]
    assert step_error(shells, normals, 0.5) == pytest.approx(0.1, abs=1e-6)


# ---- the pictures ----------------------------------------------------------------------------


def test_transparent_pixels_must_be_in_no_layer() -> None:
    luminance = np.linspace(0.2, 0.9, 100).reshape(10, 10)
    opaque = np.ones((10, 10), bool)
    opaque[:2] = False
    layer, masks = make_shell_stack(luminance, MEDIUM, 6, tails="end layers", opaque=opaque)
    boundaries = MEDIUM.boundaries(6)
    assert partition_error(layer, masks, opaque) == 0.0
    assert interval_error(layer, luminance, boundaries, "end layers", opaque) == 0.0
    wrong, masks = make_shell_stack(luminance, MEDIUM, 6, tails="end layers")
    assert partition_error(wrong, masks, opaque) == 0.2
    assert interval_error(wrong, luminance, boundaries, "end layers", opaque) == 0.2
    assert interval_error(layer, luminance, boundaries, "end layers") == 0.2


def test_mean_brightness_is_that_of_the_fur_alone() -> None:
    pictures = np.random.default_rng(17).integers(0, 256, (3, 40, 30, 3), dtype=np.uint8)
    background = np.array([94, 97, 104], np.uint8)
    expected = sum(pictures.ravel().tolist()) / pictures.size / 255
    assert mean_brightness(pictures, background) == pytest.approx(expected, rel=1e-12)
    around = np.tile(background, (3, 60, 90, 1))
    around[:, 10:50, 20:50] = pictures
    assert mean_brightness(around, background) == pytest.approx(expected, rel=1e-12)
    assert mean_brightness(np.tile(background, (2, 9, 9, 1)), background) == 0


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(
    ("name", "kept", "least", "most"),
    [
        ("ball", 320, 0.999, 1.0),
        ("ball with a hole", 316, 0.98, 1.0),
        ("half a ball", 160, 0.55, 0.95),
        ("sheet", 2, 0.45, 0.55),
    ],
)
def test_outward_share(name: str, kept: int, least: float, most: float, size: float) -> None:
    """Hair along the normals of balls and sheets, and against them: the null."""
    ball = trimesh.creation.icosphere(2)
    points = np.array(ball.vertices)
    faces = np.array(ball.faces)[np.argsort(points[ball.faces][:, :, 2].mean(axis=1))][:kept]
    normals = points.copy()
    if name == "sheet":
        points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
        faces, normals = np.array([[0, 1, 2], [0, 2, 3]]), np.tile([0.0, 0.0, 1.0], (4, 1))
    place = np.array([3.0, -8.0, 5.0]) * size
    for sign in (1, -1):
        shells = place + size * np.stack([points + h * sign * normals for h in (0.06, 0.03, 0)])
        share = outward_share(shells.astype(np.float32), faces)
        assert least <= (share if sign > 0 else 1 - share) <= most
