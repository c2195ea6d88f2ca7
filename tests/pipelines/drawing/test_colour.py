"""sRGB and luminance against scikit-image, tabulated values and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from skimage.color import rgb2xyz

from pipelines.drawing.colour import (
    auto_exposure,
    decode_srgb,
    encode_srgb,
    luminance,
    to_8bit,
)

LINEAR_OF_CODE = {0: 0.0, 1: 0.000304, 10: 0.003035, 11: 0.003347, 128: 0.215861, 188: 0.502886}
"""8-bit sRGB codes and their linear light, as colour tables print them."""


def test_decode_is_what_the_tables_print() -> None:
    for code, linear in LINEAR_OF_CODE.items():
        assert decode_srgb(code / 255) == pytest.approx(linear, abs=6e-7)
    assert decode_srgb(1.0) == 1.0


def test_decode_is_what_scikit_image_decodes() -> None:
    """Of a grey pixel XYZ / white is the linear light."""
    codes = np.arange(256) / 255
    grey = np.repeat(codes[:, None], 3, axis=1)
    np.testing.assert_allclose(decode_srgb(codes), rgb2xyz(grey)[:, 1], rtol=1e-5, atol=1e-9)


def test_every_8_bit_code_survives_the_round_trip() -> None:
    codes = np.arange(256)
    np.testing.assert_array_equal(to_8bit(decode_srgb(codes / 255)), codes)


@settings(deadline=None)
@given(st.floats(0.0, 1.0))
def test_encode_and_decode_undo_one_another(value: float) -> None:
    # The standard's two pieces meet only to 1e-7 or so.
    assert float(decode_srgb(encode_srgb(value))) == pytest.approx(value, abs=1e-7)
    assert float(encode_srgb(decode_srgb(value))) == pytest.approx(value, abs=1e-6)


@settings(deadline=None)
@given(st.floats(0.0, 1.0))
def test_to_8bit_is_the_nearest_code(value: float) -> None:
    distances = np.abs(np.arange(256) / 255 - float(encode_srgb(value)))
    assert distances[int(to_8bit(value))] == distances.min()


def test_light_outside_the_display_is_clipped() -> None:
    np.testing.assert_allclose(encode_srgb([-0.5, 1.5, np.inf]), [0.0, 1.0, 1.0], rtol=1e-12)
    np.testing.assert_array_equal(to_8bit([-0.5, 7.0]), [0, 255])


def test_to_8bit_keeps_the_shape() -> None:
    assert to_8bit(np.zeros((2, 3, 4, 3), np.float32)).shape == (2, 3, 4, 3)
    assert to_8bit(np.zeros((2, 3))).dtype == np.uint8


def test_luminance_is_y_of_the_srgb_primaries() -> None:
    rgb = np.random.default_rng(1).random((7, 5, 3))
    np.testing.assert_allclose(luminance(decode_srgb(rgb)), rgb2xyz(rgb)[..., 1], atol=1e-4)


def test_luminance_of_each_primary_and_of_grey() -> None:
    np.testing.assert_allclose(luminance(np.eye(3)), [0.2126, 0.7152, 0.0722], rtol=1e-15)
    grey = np.linspace(0, 3, 20)
    np.testing.assert_allclose(luminance(np.repeat(grey[:, None], 3, axis=1)), grey, rtol=1e-15)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_luminance_keeps_the_dtype(dtype: type) -> None:
    assert luminance(np.ones((2, 2, 3), dtype)).dtype == dtype


@given(st.floats(1e-3, 1e3))
def test_exposure_answers_brightness_inversely(times: float) -> None:
    picture = np.random.default_rng(0).gamma(1, 0.3, (12, 10, 3))
    exposure = auto_exposure(picture * times)
    assert exposure == pytest.approx(auto_exposure(picture) / times, rel=1e-5)


def test_exposure_brings_the_brighter_part_to_0_8() -> None:
    ramp = np.linspace(0, 7, 1001)
    assert np.quantile(ramp * auto_exposure(ramp), 0.99) == pytest.approx(0.8)


def test_a_black_picture_can_be_exposed() -> None:
    assert math.isfinite(auto_exposure(np.zeros((3, 3))))
