"""Pictures: what is drawn where, found again in the pixels."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.photo_fur.attenuation import Attenuation, luminance_histogram
from pipelines.photo_fur.pictures import decay_picture, layer_picture

RED = (200, 0, 0)


def decay(medium: Attenuation, layers: int, luminance: NDArray[np.float64]) -> NDArray[np.uint8]:
    counts, edges = luminance_histogram(luminance)
    return decay_picture(counts, edges, medium, medium.boundaries(layers))


def red_pixels(picture: NDArray[np.uint8]) -> int:
    """Pixels of the colour that marks Imax, Imin and the boundaries."""
    return int((picture == (214, 39, 40)).all(axis=-1).sum())


def test_the_decay_picture_is_a_picture_and_shows_its_figures() -> None:
    luminance = np.random.default_rng(0).random((40, 40))
    medium = Attenuation(0.9, 0.05)
    picture = decay(medium, 8, luminance)
    assert picture.dtype == np.uint8
    assert picture.ndim == 3
    assert picture.shape[2] == 3
    assert picture.shape[1] > picture.shape[0] > 100
    assert red_pixels(picture) > 100
    # Every part of what it is given is drawn.
    assert (decay(medium, 8, luminance**2) != picture).any()
    assert (decay(Attenuation(0.9, 0.2), 8, luminance) != picture).any()
    assert red_pixels(decay(medium, 30, luminance)) > red_pixels(picture)
    np.testing.assert_array_equal(decay(medium, 8, luminance), picture)


def test_layers_go_from_yellow_tips_to_violet_skin_and_dropped_pixels_are_red() -> None:
    layer = np.array([[1, 2, 3], [4, 0, 0]], np.uint8)
    picture = layer_picture(layer, 4)
    assert picture.shape == (2, 3, 3)
    assert picture.dtype == np.uint8
    np.testing.assert_array_equal(picture[1, 1:], [RED, RED])
    # The ends of matplotlib's viridis.
    np.testing.assert_allclose(picture[0, 0], [253, 231, 36], atol=1)
    np.testing.assert_allclose(picture[1, 0], [68, 1, 84], atol=1)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) == 5


@pytest.mark.parametrize("layers", [1, 2, 250])
def test_every_layer_gets_a_colour_that_is_not_dropped(layers: int) -> None:
    layer = np.arange(layers + 1, dtype=np.uint8)[None]
    picture = layer_picture(layer, layers)
    np.testing.assert_array_equal((picture == RED).all(axis=-1), layer == 0)
    brightness = picture[0, 1:] @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(brightness) <= 1).all()  # darker with the depth
