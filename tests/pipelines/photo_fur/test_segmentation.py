"""Where the fur is, on pictures that say so, and the largest square against brute force."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from skimage import data
from skimage.transform import resize_local_mean

from pipelines.drawing.colour import decode_srgb
from pipelines.photo_fur.segmentation import (
    LEAST_SEPARATION,
    fur_mask,
    largest_square,
    separation,
)
from pipelines.virtual.pelt.pelt import make_pelt

_SIDE = 128


@pytest.fixture(scope="module")
def pelt() -> NDArray[np.floating]:
    return make_pelt(_SIDE, 1000, 8, 3).radiance


def behind(name: str) -> NDArray[np.floating]:
    colours = decode_srgb(getattr(data, name)()[:300, :300] / 255.0)
    return np.asarray(resize_local_mean(colours, (_SIDE, _SIDE, 3), channel_axis=2))


def ellipse(wide: float, high: float) -> NDArray[np.bool_]:
    rows, columns = np.mgrid[:_SIDE, :_SIDE] / (_SIDE - 1) * 2 - 1
    return np.asarray(np.hypot(columns / wide, rows / high) < 1)


def overlap(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    return float((one & other).sum() / (one | other).sum())


@pytest.mark.parametrize("name", ["astronaut", "coffee", "rocket"])
def test_fur_in_another_photograph_is_found(pelt: NDArray[np.floating], name: str) -> None:
    true = ellipse(0.8, 0.6)
    found = fur_mask(np.where(true[..., None], pelt, behind(name)))
    assert found is not None
    assert overlap(found, true) > 0.8
    assert overlap(ellipse(0.5, 0.9), true) < 0.6  # the null


def test_a_photograph_of_fur_alone_is_fur_everywhere(pelt: NDArray[np.floating]) -> None:
    assert fur_mask(pelt) is None
    assert fur_mask(pelt * np.linspace(0.6, 1.0, _SIDE)[:, None]) is None


def test_what_lies_in_the_fur_and_is_none_is_left_out(pelt: NDArray[np.floating]) -> None:
    true, eye = ellipse(0.85, 0.8), ellipse(0.2, 0.2)
    eye = np.roll(eye, (-20, 15), (0, 1))
    picture = np.where(true[..., None], pelt, behind("astronaut"))
    picture[eye] = (0.02, 0.25, 0.05)
    found = fur_mask(picture)
    assert found is not None
    assert found[eye].mean() < 0.2
    assert overlap(found, true & ~eye) > 0.8


def test_the_mask_has_the_photographs_size_and_is_the_same_again(
    pelt: NDArray[np.floating],
) -> None:
    picture = np.where(ellipse(0.8, 0.6)[..., None], pelt, behind("coffee"))
    large = np.repeat(np.repeat(picture, 3, axis=0), 4, axis=1)
    found = fur_mask(large)
    assert found is not None
    assert found.shape == large.shape[:2]
    np.testing.assert_array_equal(found, fur_mask(large))


def test_separation_is_mahalanobis_and_nothing_of_too_few_pixels() -> None:
    random = np.random.default_rng(0)
    mask = np.zeros((100, 100), bool)
    mask[:50] = True
    looks = random.normal(size=(100, 100, 3)) * 5.0
    assert separation(looks, mask) < LEAST_SEPARATION / 4
    looks[:50, :, 0] += 20.0
    expected = 20.0 / np.sqrt(25.0 + 8.0)  # the least spread is 8
    assert separation(looks, mask) == pytest.approx(expected, rel=0.03)
    few = np.zeros_like(mask)
    few[0, :10] = True
    assert separation(looks, few) == 0.0


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.3, 0.95))
def test_the_largest_square_against_brute_force(seed: int, share: float) -> None:
    mask = np.random.default_rng(seed).random((9, 12)) < share
    left, top, side = largest_square(mask)
    assert mask[top : top + side, left : left + side].all()
    larger = side + 2  # sides are odd
    for row in range(9 - larger + 1):
        for column in range(12 - larger + 1):
            assert not mask[row : row + larger, column : column + larger].all()
