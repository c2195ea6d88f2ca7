"""Scratches of photographs against the layers that the photographs were made of."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.glass_scratches.layers.coverage import coverage_maps
from pipelines.glass_scratches.layers.settings import LayerSpec
from pipelines.glass_scratches.photograph.figures import (
    direction_error,
    photograph_likeness,
)
from pipelines.glass_scratches.photograph.photograph_layers import (
    direction_layers,
    layers_like,
    photograph_scratches,
)
from pipelines.glass_scratches.photograph.segments import Segments
from tests.pipelines.glass_scratches.photographs import SPEC, ground, photograph


def _away(angle: float, others: NDArray[np.floating]) -> float:
    """Degrees to the nearest direction."""
    turned = np.mod(others.astype(float) - angle + np.pi / 2, np.pi) - np.pi / 2
    return float(np.degrees(np.abs(turned).min()))


@pytest.mark.parametrize("seed", [1, 2])
def test_directions_coverage_and_width_are_those_of_the_glass(seed: int) -> None:
    layers, picture = photograph(SPEC, seed)
    found = photograph_scratches(picture)
    segments = found.segments
    # Each true direction has its part of the scratches within two degrees; chance has a 45th.
    for angle in layers.angle:
        turned = np.mod(segments.angle - angle + np.pi / 2, np.pi) - np.pi / 2
        near = np.abs(turned) < np.deg2rad(2.0)
        assert segments.length[near].sum() > 0.15 * segments.length.sum()
    assert found.coverage.sum() == pytest.approx(3 * SPEC.coverage, rel=0.25)
    width = 2 * np.pi / 4 * 384 * float(layers.features.half_width[0])
    assert np.average(segments.width, weights=segments.length) == pytest.approx(width, rel=0.3)
    assert not found.dark


def test_dark_scratches_are_found_as_bright_ones_are() -> None:
    found = photograph_scratches(photograph(SPEC, 1, contrast=-0.4)[1])
    assert found.dark
    assert found.coverage.sum() == pytest.approx(3 * SPEC.coverage, rel=0.25)


def test_what_has_no_scratches_is_refused() -> None:
    noise = np.random.default_rng(0).standard_normal((384, 384))
    with pytest.raises(ValueError, match="lines that stand out of the noise"):
        photograph_scratches(ground(384) * (1 + 0.02 * noise))
    shuffled = np.random.default_rng(0).permutation(photograph(SPEC, 1)[1].ravel())
    with pytest.raises(ValueError, match="lines that stand out of the noise"):
        photograph_scratches(shuffled.reshape(384, 384))


def test_layers_are_like_their_photograph_and_not_like_another() -> None:
    one = photograph_scratches(photograph(SPEC, 1)[1])
    few = LayerSpec(length=0.6, width=0.06, coverage=0.01, layers=1)
    other = photograph_scratches(photograph(few, 5)[1])
    made = coverage_maps(layers_like(one, 3), 384)
    likeness = photograph_likeness(one, made)
    assert likeness.direction_error < 7.0
    assert likeness.coverage_ratio == pytest.approx(1.0, abs=0.3)
    null = photograph_likeness(one, coverage_maps(layers_like(other, 3), 384))
    assert null.direction_error > 2 * likeness.direction_error
    assert abs(null.coverage_ratio - 1) > abs(likeness.coverage_ratio - 1)


def test_few_directions_make_few_layers_and_uniform_ones_a_fan() -> None:
    rng = np.random.default_rng(0)
    three = np.mod(np.repeat([0.02, 1.0, 2.0], 40) + 0.03 * rng.standard_normal(120), np.pi)
    angle, layer = direction_layers(three, np.ones(120))
    assert len(angle) == 3
    assert max(_away(true, angle) for true in (0.02, 1.0, 2.0)) < 1.0
    assert (np.bincount(layer) == 40).all()
    fan, _ = direction_layers(np.pi * (np.arange(720) + 0.5) / 720, np.ones(720))
    assert 6 <= len(fan) <= 8
    gaps = np.diff(np.sort(np.append(fan, fan.min() + np.pi)))
    assert gaps.max() < 1.3 * gaps.min()


def test_direction_error_is_the_turn_between_two_pictures() -> None:
    angle = np.mod(np.random.default_rng(1).normal(0.0, 0.1, 300), np.pi)
    ones = np.ones(300)
    still = Segments(np.zeros((300, 2)), angle, ones, ones, ones, 0 * ones)
    turned = still._replace(angle=np.mod(angle + np.deg2rad(25.0), np.pi))
    assert direction_error(still, turned) == pytest.approx(25.0, abs=0.2)
    assert direction_error(still, still) == 0.0
