"""The pictures that are shown, and the figure they are judged by with what it gives to nulls."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.light.directions import all_pairs, hemisphere_table
from pipelines.neural_btf.draping.frames import (
    COMPARED_SIZE,
    SUN_AZIMUTH,
    ClothFrames,
    Shots,
    daylight,
    draw_frames,
)
from pipelines.neural_btf.draping.picture_errors import error_over_flat
from pipelines.neural_btf.material import FlatColour, MeasuredBtf, mean_colour

TABLE = hemisphere_table(15)
PAIRS = all_pairs(TABLE, TABLE)
SHOTS = Shots(width=64, samples=2, frames=2, tiles=20.0)
_ALBEDO = np.random.default_rng(0).uniform(0.05, 0.9, (6, 8, 3))
IMAGES = np.cos(PAIRS.light[:, 0])[:, None, None, None] * _ALBEDO


class Sized:
    """A material with the sizes that a compressed BTF has."""

    height, width = 6, 8

    def __init__(self, material: Any) -> None:
        self.radiance_at = material.radiance_at


def drawn(material: Any) -> ClothFrames:
    return draw_frames(Sized(material), IMAGES, PAIRS, SHOTS)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def right() -> ClothFrames:
    return drawn(MeasuredBtf(IMAGES, PAIRS))


def test_what_was_measured_has_no_error_and_the_mean_colour_has_one(right: ClothFrames) -> None:
    assert error_over_flat(right.compared) == 0
    null = drawn(mean_colour(IMAGES, PAIRS))
    assert error_over_flat(null.compared) == pytest.approx(1.0)
    assert error_over_flat(drawn(FlatColour((0, 0, 0))).compared) > 1


def test_texels_in_another_order_are_worse_than_their_mean_colour() -> None:
    mixed = np.random.default_rng(1).permutation(IMAGES.reshape(len(IMAGES), 48, 3), axis=1)
    found = drawn(MeasuredBtf(mixed.reshape(IMAGES.shape), PAIRS))
    assert error_over_flat(found.compared) > 1.1


def test_the_camera_goes_around_and_so_does_the_sun(right: ClothFrames) -> None:
    assert right.orbit.shape == right.moving_light.shape == (2, 48, 64, 3)
    assert right.closeup.shape == (48, 64, 3)
    assert right.compared.shape == (3, *COMPARED_SIZE[::-1], 3)
    np.testing.assert_array_equal(right.orbit[0], right.moving_light[0])

    def change(pictures: NDArray[np.uint8], *part: slice) -> float:
        one, other = pictures[(slice(None), *part)].astype(float)
        return float(np.abs(one - other).mean())

    assert change(right.orbit) > 5
    assert change(right.moving_light) > 5
    # The shadow lies on the floor on one side, then on the other.
    left, shaded_right = (slice(26, 44), slice(0, 16)), (slice(26, 44), slice(48, 64))
    first, second = right.moving_light.astype(float)
    assert first[left].mean() > first[shaded_right].mean() + 5
    assert second[left].mean() < second[shaded_right].mean() - 5


def test_the_sun_is_where_it_is_said_to_be() -> None:
    for turn in (0.0, 135.0):
        bright = daylight(turn).sum(axis=-1)
        column = np.unravel_index(bright.argmax(), bright.shape)[1]
        azimuth = 180.0 - (column + 0.5) * 360.0 / bright.shape[1]
        assert (azimuth - SUN_AZIMUTH - turn + 180.0) % 360.0 - 180.0 == pytest.approx(0, abs=4)
