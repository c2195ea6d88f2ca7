"""Measured BTFs between texels and directions, against formulas and a plain loop."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.light.directions import (
    Pairs,
    all_pairs,
    hemisphere_table,
    stereographic,
    stereographic_of_vectors,
    unit_vectors,
)
from pipelines.neural_btf.material import FlatColour, MeasuredBtf, mean_colour, surface_radiance

TABLE = hemisphere_table(41)
PAIRS = all_pairs(TABLE, TABLE)
RNG = np.random.default_rng(0)
IMAGES = RNG.random((len(PAIRS.light), 3, 4, 3)).astype(np.float16)


def some(count: int, theta: float, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return unit_vectors(np.stack([theta * rng.random(count), 6.28 * rng.random(count)], -1))


def test_at_texels_middles_and_measured_directions_a_value_is_the_photographs() -> None:
    btf = MeasuredBtf(IMAGES, PAIRS)
    image = RNG.integers(len(IMAGES), size=200)
    row, column = RNG.integers(3, size=200), RNG.integers(4, size=200)
    places = np.stack([(column + 0.5) / 4 + 7, 1 - (row + 0.5) / 3 - 2], axis=-1)
    found = btf.radiance_at(
        places, unit_vectors(PAIRS.light[image]), unit_vectors(PAIRS.view[image])
    )
    np.testing.assert_allclose(found, IMAGES[image, row, column], atol=2e-3)


def test_what_is_linear_on_the_stereographic_plane_is_kept() -> None:
    """Inside of the measured directions; linear in light and view each, so bilinear in both."""
    x, y = stereographic(PAIRS.light), stereographic(PAIRS.view)
    values = (1 + x[:, 0] - 0.5 * x[:, 1]) * (2 + 0.3 * y[:, 0] + y[:, 1])
    images = np.broadcast_to(values[:, None, None, None], (len(values), 2, 2, 3)).copy()
    light, view = some(300, np.radians(70), 1), some(300, np.radians(70), 2)
    found = MeasuredBtf(images, PAIRS).radiance_at(np.zeros((300, 2)), light, view)
    x, y = stereographic_of_vectors(light), stereographic_of_vectors(view)
    expected = (1 + x[:, 0] - 0.5 * x[:, 1]) * (2 + 0.3 * y[:, 0] + y[:, 1])
    np.testing.assert_allclose(found[:, 0], expected, rtol=1e-4)


def test_between_texels_values_are_bilinear_and_repeat() -> None:
    btf = MeasuredBtf(IMAGES, PAIRS)
    places = RNG.uniform(-2, 2, (50, 2))
    image = 77
    up = np.repeat(unit_vectors(PAIRS.light[image])[None], 50, axis=0)
    view = np.repeat(unit_vectors(PAIRS.view[image])[None], 50, axis=0)
    found = btf.radiance_at(places, up, view)
    for number, (u, v) in enumerate(places):
        expected = np.zeros(3)
        for row in range(-9, 12):
            for column in range(-12, 15):
                across = 1 - abs(u * 4 - 0.5 - column)
                down = 1 - abs((1 - v) * 3 - 0.5 - row)
                if across > 0 and down > 0:
                    expected += across * down * IMAGES[image, row % 3, column % 4]
        np.testing.assert_allclose(found[number], expected, atol=2e-3)


def test_beyond_what_was_measured_values_stay_between_the_measured_ones() -> None:
    light, view = some(500, np.radians(90), 3), some(500, np.radians(90), 4)
    found = MeasuredBtf(IMAGES, PAIRS).radiance_at(RNG.random((500, 2)), light, view)
    assert found.min() >= IMAGES.min() - 1e-3
    assert found.max() <= IMAGES.max() + 1e-3


@pytest.mark.parametrize("count", [1, 2])
def test_one_or_two_directions_are_enough(count: int) -> None:
    pairs = all_pairs(TABLE[:1], TABLE[:count])
    images = np.full((count, 1, 1, 3), 0.25)
    light = some(100, np.radians(90), 5)
    found = MeasuredBtf(images, pairs).radiance_at(np.zeros((100, 2)), light, light)
    np.testing.assert_allclose(found, 0.25, rtol=1e-5)


def test_pairs_that_are_no_grid_are_refused() -> None:
    light = PAIRS.light.copy()
    light[[50, 51]] = light[[51, 50]]
    with pytest.raises(ValueError, match="the same lights for every view"):
        MeasuredBtf(IMAGES, Pairs(light, PAIRS.view))
    with pytest.raises(ValueError, match="the same lights for every view"):
        MeasuredBtf(IMAGES[:-1], Pairs(PAIRS.light[:-1], PAIRS.view[:-1]))


def test_the_mean_colour_of_a_matt_material_is_its_albedo() -> None:
    albedo = np.array([0.2, 0.5, 0.8])
    images = np.cos(PAIRS.light[:, 0])[:, None, None, None] * albedo * np.ones((1, 2, 3, 1))
    np.testing.assert_allclose(mean_colour(images, PAIRS).albedo, albedo, rtol=1e-6)


def test_a_matt_surface_is_its_cosine_down_to_the_horizon_and_dark_below() -> None:
    """Held at 75 degrees and dimmed by the cosine, a cosine stays one."""
    light = unit_vectors(np.radians([[0, 0], [60, 0], [80, 10], [89, 200], [100, 0]]))
    view = some(5, np.radians(90), 6)
    found = surface_radiance(FlatColour((1.0, 0.5, 0.0)), np.zeros((5, 2)), light, view)
    expected = np.maximum(light[:, 2:], 0) * [1.0, 0.5, 0.0]
    np.testing.assert_allclose(found, expected, atol=1e-6)
