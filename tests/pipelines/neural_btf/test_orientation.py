"""Which way up photographs lie, by virtual cloths; their relief against closed forms."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from assets_defs.neural_btf.photographs import ImageSettings
from benchmarks.captures.orientations import Photographed, laid, photographed, scores_of
from pipelines.light.directions import Pairs, all_pairs, hemisphere_table
from pipelines.neural_btf import relief
from pipelines.neural_btf.orientation import (
    ORIENTATIONS,
    central_patch,
    orientation_scores,
    turned_upright,
)

LIGHTS = hemisphere_table(41)
RINGS = [np.flatnonzero(np.isclose(LIGHTS[:, 0], np.radians(theta))) for theta in (30, 45)]


def waves(amplitude: float) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Heights (32, 40) of oblique waves, and their slopes (2, y, x): x to the right, y up."""
    x, y = np.meshgrid(np.arange(40), -np.arange(32))
    a, b = 2 * np.pi * 5 / 40, 2 * np.pi * 4 / 32
    phase = a * x + b * y
    slope = amplitude * np.cos(phase) * np.array([a, b])[:, None, None]
    return (amplitude * np.sin(phase)).astype(np.float32), slope


def matt(slope: NDArray[np.float64]) -> NDArray[np.float32]:
    """Photographs (light, y, x) from above of a white matt surface with these slopes."""
    theta, phi = LIGHTS.T[..., None, None]
    along = slope[0] * np.cos(phi) + slope[1] * np.sin(phi)
    return (np.cos(theta) - np.sin(theta) * along).clip(0).astype(np.float32)


@pytest.fixture(scope="module")
def cloth() -> Photographed:
    return photographed("corduroy", texels=32)


@pytest.mark.slow  # a cloth is photographed
def test_every_orientation_of_a_cloth_is_found(cloth: Photographed) -> None:
    for orientation in ORIENTATIONS:
        scores = scores_of(cloth, orientation)
        assert scores.best == orientation
        assert scores.are_clear


@pytest.mark.slow
def test_photographs_of_other_lights_say_nothing(cloth: Photographed) -> None:
    for seed in range(3):
        dealt = np.random.default_rng(seed).permutation(len(cloth.photographs))
        mixed = cloth._replace(photographs=cloth.photographs[dealt])
        assert not scores_of(mixed, "upright").are_clear


def test_a_flat_print_says_nothing() -> None:
    pattern = np.random.default_rng(0).random((32, 32, 3)).astype(np.float32)
    pairs = all_pairs(LIGHTS[:19], LIGHTS)
    cosine = np.cos(pairs.light[:, 0]).astype(np.float32)
    scores = orientation_scores(
        pairs, lambda images: cosine[images, None, None, None] * pattern[None]
    )
    assert scores is not None
    assert not scores.are_clear


@pytest.mark.parametrize(
    ("pairs", "size"),
    [
        (all_pairs(LIGHTS, LIGHTS), 20),  # too few texels
        (all_pairs(LIGHTS[1:], LIGHTS), 40),  # none from above
        (all_pairs(LIGHTS, LIGHTS[:1]), 40),  # no ring of lights
        (all_pairs(LIGHTS, LIGHTS[7:13]), 40),  # no grazing light
        (all_pairs(LIGHTS, LIGHTS[LIGHTS[:, 1] < np.pi]), 40),  # lights from one side
    ],
)
def test_too_little_to_see(pairs: Pairs, size: int) -> None:
    grey = np.ones((size, size, 3), np.float32)
    assert orientation_scores(pairs, lambda images: np.stack([grey] * len(images))) is None


@pytest.mark.slow
def test_without_oblique_views_the_lights_decide(cloth: Photographed) -> None:
    above = np.flatnonzero(cloth.pairs.view[:, 0] == 0)
    pairs = Pairs(cloth.pairs.light[above], cloth.pairs.view[above])
    lying = laid(cloth.photographs, "mirrored, turned 90")[above]
    scores = orientation_scores(pairs, lambda images: lying[images])
    assert scores is not None
    assert scores.best == "mirrored, turned 90"


def test_photographs_are_turned_back() -> None:
    photographs = np.random.default_rng(0).random((2, 4, 5, 3)).astype(np.float32)
    for orientation in ORIENTATIONS:
        lying = laid(photographs, orientation)
        np.testing.assert_array_equal(turned_upright(lying, orientation), photographs)


def test_the_middle_is_looked_at() -> None:
    assert central_patch(800, 300) == (22, 272, 256, 256)
    assert central_patch(40, 50) == (0, 0, 50, 40)


def test_slopes_and_heights_of_waves_come_back() -> None:
    height, slope = waves(0.4)
    found = relief.slopes(matt(slope), LIGHTS, RINGS)
    np.testing.assert_allclose(found, slope, atol=0.01)
    np.testing.assert_allclose(relief.heights(found), height, atol=0.04)


def test_a_wall_throws_a_shadow_away_from_the_light() -> None:
    wall = np.zeros((20, 30), np.float32)
    wall[:, 15:18] = 6.0
    light = np.array([[np.radians(45.0), 0.0]])  # from the right: the shadow is 6 texels long
    brightness = relief.shaded(wall, light)[0]
    assert brightness[:, 10:14].max() == 0
    np.testing.assert_allclose(brightness[:, [5, 22]], np.cos(np.radians(45.0)), rtol=1e-5)
    from_above = relief.shaded(np.rot90(wall).copy(), np.array([[np.radians(45.0), np.pi / 2]]))[0]
    np.testing.assert_allclose(from_above, np.rot90(brightness), atol=1e-5)


def test_what_stands_out_moves_towards_the_viewer_s_far_side() -> None:
    """A spot of height h is seen at h tan(theta) from its place, away from the viewer."""
    height, texture = np.zeros((21, 21), np.float32), np.zeros((21, 21), np.float32)
    height[8:13, 8:13] = 4.0
    texture[10, 10] = 1.0
    view = np.array([np.radians(45.0), 0.0])  # the viewer is on the right
    distance = relief.parallax(height, view)
    assert distance[10, 6] == pytest.approx(4.0, abs=1e-3)
    assert distance[10, 2] == 0
    picture = relief.moved(texture, distance, 0.0)
    assert picture[10, 6] == pytest.approx(1.0, abs=1e-3)
    assert picture[:, 7:].max() == 0


def test_every_orientation_can_be_set() -> None:
    offered = get_args(ImageSettings.model_fields["orientation"].annotation)
    assert offered == ("auto", *ORIENTATIONS)
