"""Photographs taken anew with the principal point in their middle."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import center_of_mass

from pipelines.street_billboards.capture.centred_photographs import (
    centre_photographs,
    centred_intrinsics,
)

WIDTH, HEIGHT = 12, 9


def any_lens(rng: np.random.Generator, width: int, height: int) -> NDArray[np.float64]:
    fx, fy = width * rng.uniform(0.6, 1.5, 2)
    cx, cy = width * rng.uniform(0.35, 0.65), height * rng.uniform(0.35, 0.65)
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 10_000))
def test_the_widest_centred_photograph_lies_inside(seed: int) -> None:
    lens = any_lens(np.random.default_rng(seed), WIDTH, HEIGHT)
    wanted = centred_intrinsics(lens, WIDTH, HEIGHT)
    assert wanted[0, 0] == wanted[1, 1]
    np.testing.assert_allclose(wanted[:2, 2], [(WIDTH - 1) / 2, (HEIGHT - 1) / 2])
    corners = np.array([[x, y, 1.0] for x in (0, WIDTH - 1) for y in (0, HEIGHT - 1)]).T
    before = lens @ np.linalg.inv(wanted) @ corners
    x, y = before[0] / before[2], before[1] / before[2]
    slack = np.array([x.min(), WIDTH - 1 - x.max(), y.min(), HEIGHT - 1 - y.max()])
    assert slack.min() == pytest.approx(0.0, abs=1e-9)


def test_a_point_lands_where_the_new_lens_says() -> None:
    rng = np.random.default_rng(2)
    width, height = 90, 60
    lens = any_lens(rng, width, height)
    wanted = centred_intrinsics(lens, width, height)
    for pixel in [(30.0, 25.0), (60.3, 40.6)]:
        ray = np.linalg.inv(wanted) @ [*pixel, 1.0]
        before = lens @ ray
        y, x = np.mgrid[:height, :width]
        spot = np.exp(-((x - before[0]) ** 2 + (y - before[1]) ** 2) / (2 * 2.0**2))
        picture = np.rint(200 * spot)[..., None].repeat(3, axis=2).astype(np.uint8)
        made = centre_photographs(picture[None], lens[None])[0]
        row, column = center_of_mass(made[..., 0].astype(float))
        assert (column, row) == pytest.approx(pixel, abs=0.05)


def test_a_centred_photograph_stays_as_it_is() -> None:
    rng = np.random.default_rng(3)
    pictures = rng.integers(0, 256, (2, 40, 60, 3), dtype=np.uint8)
    lens = np.array([[50.0, 0, 29.5], [0, 50.0, 19.5], [0, 0, 1]])
    other = lens.copy()
    other[0, 2] += 3
    np.testing.assert_allclose(centred_intrinsics(lens, 60, 40), lens)
    made = centre_photographs(pictures, np.stack([lens, other]))
    np.testing.assert_array_equal(made[0], pictures[0])
    assert (made[1] != pictures[1]).any()
