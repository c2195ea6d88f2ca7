"""Looking up directions: where a hand computes the texel, and at the borders of the map."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pipelines.drawing.colour import luminance
from pipelines.light.environment_lookup import (
    radiance_from_directions,
    texel_of_direction,
)
from pipelines.light.environment_maps import (
    texel_directions,
)
from tests.pipelines.light.example_maps import (
    direction,
    one_light,
    rough_map,
)

anything = st.floats(allow_nan=True, allow_infinity=True)


def test_texels_lie_where_a_hand_computes_them() -> None:
    """Of 4 x 8 texels, row 1 lies 22.5 degrees up, column 2 at azimuth 180 - 2.5 * 45."""
    np.testing.assert_allclose(texel_directions(4)[1, 2], direction(67.5, 22.5), atol=1e-15)
    np.testing.assert_allclose(texel_directions(4)[3, 7], direction(-157.5, -67.5), atol=1e-15)
    assert texel_of_direction(4, 8, *direction(67.5, 22.5)) == (1, 2)


@pytest.mark.parametrize(
    ("azimuth", "elevation", "row", "column"),
    [
        (0.5, 0.5, 31, 63), (-0.5, -0.5, 32, 64), (90.5, 1.0, 31, 31), (89.5, 1.0, 31, 32),
        (179.5, 89.0, 0, 0), (-179.5, -89.0, 63, 127), (-90.5, 45.5, 15, 96),
    ],
)  # fmt: skip
def test_the_map_is_seen_from_inside_with_x_in_the_middle_and_y_a_quarter_from_the_left(
    azimuth: float, elevation: float, row: int, column: int
) -> None:
    assert texel_of_direction(64, 128, *direction(azimuth, elevation)) == (row, column)
    light = one_light(64, row, column)
    assert radiance_from_directions(light, [direction(azimuth, elevation)]).tolist() == [
        [1.0, 1.0, 1.0]
    ]
    assert (
        luminance(radiance_from_directions(light, texel_directions(64).reshape(-1, 3))).sum() > 0.99
    )


@pytest.mark.parametrize("height", [1, 3, 8, 65])
def test_every_texel_holds_the_direction_to_its_centre(height: int) -> None:
    ways = texel_directions(height)
    np.testing.assert_allclose(np.linalg.norm(ways, axis=-1), 1.0, rtol=1e-14)
    light = rough_map(height, seed=height)
    np.testing.assert_array_equal(
        radiance_from_directions(light, ways.reshape(-1, 3)), light.reshape(-1, 3)
    )


def test_directions_need_not_be_unit_vectors_and_may_be_of_single_precision() -> None:
    ways = texel_directions(64).reshape(-1, 3)
    light = rough_map(64)
    expected = radiance_from_directions(light, ways)
    np.testing.assert_array_equal(radiance_from_directions(light, 37.0 * ways), expected)
    np.testing.assert_array_equal(
        radiance_from_directions(light, ways.astype(np.float32)), expected
    )


@given(anything, anything, anything, st.integers(1, 5000))
@example(0.0, 0.0, 0.0, 8)
@example(0.0, 0.0, 1.0, 8)
@example(0.0, 0.0, -1.0, 8)
@example(-1.0, 0.0, 0.0, 8)
@example(-1.0, -0.0, 0.0, 8)
@example(-1.0, -5e-324, 0.0, 8)
@example(-0.0, -0.0, -1.0, 8)
@example(math.nan, math.nan, math.nan, 8)
@settings(max_examples=300, deadline=None)
def test_no_direction_leads_out_of_the_map(x: float, y: float, z: float, height: int) -> None:
    row, column = texel_of_direction(height, 2 * height, x, y, z)
    assert 0 <= row < height
    assert 0 <= column < 2 * height


def test_the_poles_and_the_seam_belong_to_the_rows_and_columns_at_the_border() -> None:
    assert texel_of_direction(8, 16, 0.0, 0.0, 1.0)[0] == 0
    assert texel_of_direction(8, 16, 0.0, 0.0, -1.0)[0] == 7
    assert texel_of_direction(8, 16, -1.0, 0.0, 0.0)[1] == 0
    assert texel_of_direction(8, 16, -1.0, -0.0, 0.0)[1] == 15
    assert texel_of_direction(8, 16, 1.0, 0.0, 0.0)[1] == 8


def test_wrong_arrays_are_refused() -> None:
    light = rough_map(8)
    with pytest.raises(ValueError, match=r"^directions: found shape \(3,\), expected \(N, 3\)"):
        radiance_from_directions(light, [0.1, 0.2, 0.3])
    with pytest.raises(ValueError, match=r"^environment: found shape \(8, 8, 3\)"):
        radiance_from_directions(light[:, :8], [[0.1, 0.2, 0.3]])


def test_no_directions_give_no_radiance() -> None:
    assert radiance_from_directions(rough_map(8), np.empty((0, 3))).shape == (0, 3)


def test_a_map_that_is_looked_at_is_linear_between_texels() -> None:
    """Against OpenCV's bilinear remapping of the map, wrapped around; poles end."""
    import cv2

    from pipelines.light.environment_lookup import smooth_radiance_from_direction

    rng = np.random.default_rng(4)
    radiance = rng.random((8, 16, 3)).astype(np.float32)
    ways = rng.normal(size=(500, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    wrapped = np.concatenate([radiance[:, -1:], radiance, radiance[:, :1]], axis=1)
    wrapped = np.concatenate([wrapped[:1], wrapped, wrapped[-1:]])
    x = (0.5 - np.arctan2(ways[:, 1], ways[:, 0]) / (2 * np.pi)) * 16 + 0.5
    y = np.arccos(ways[:, 2]) / np.pi * 8 + 0.5
    expected = cv2.remap(
        wrapped, x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR
    ).reshape(-1, 3)
    found = [smooth_radiance_from_direction(radiance, *way) for way in ways]
    # OpenCV's weights are multiples of 1/32.
    np.testing.assert_allclose(found, expected, atol=0.04)
    assert np.abs(found - np.roll(expected, 1, axis=0)).max() > 0.5
