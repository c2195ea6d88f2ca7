"""Light made even, against slopes that were put on by hand."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.drawing.colour import luminance, to_8bit
from pipelines.photo_fur.figures import unevenness
from pipelines.photo_fur.suitability import evenly_lit, report_picture


def photograph(seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    return random.uniform(0.1, 0.5, (60, 80, 1)) * np.array([1.0, 0.7, 0.4])


@pytest.mark.parametrize("exponents", [(1.0, 0.0), (0.0, -0.8), (0.5, 0.7)])
def test_a_slope_is_taken_out_and_told(exponents: tuple[float, float]) -> None:
    rows, columns = np.meshgrid(np.linspace(-1, 1, 60), np.linspace(-1, 1, 80), indexing="ij")
    slope = exponents[0] * columns + exponents[1] * rows**2
    flat = photograph()
    lit = flat * np.exp(slope)[..., None]
    lit /= lit.max()
    even = evenly_lit(lit)
    assert even.unevenness == pytest.approx(slope.std(), rel=0.2)
    assert unevenness(luminance(even.radiance)) < 0.02 < unevenness(luminance(lit))
    ratio = even.radiance / flat
    assert ratio.std() / ratio.mean() < 0.08


def test_colours_and_the_mean_brightness_stay() -> None:
    flat = photograph()
    even = evenly_lit(flat).radiance
    np.testing.assert_allclose(even[..., 1] / even[..., 0], 0.7, rtol=1e-5)
    before, after = (np.log(luminance(each)).mean() for each in (flat, even))
    assert after == pytest.approx(before, abs=1e-5)


def test_what_is_no_fur_has_no_say() -> None:
    flat = photograph()
    fur = np.zeros((60, 80), bool)
    fur[:, :50] = True
    other = flat.copy()
    other[~fur] = 0.01
    np.testing.assert_allclose(
        evenly_lit(other, fur).radiance[fur], evenly_lit(flat, fur).radiance[fur], rtol=1e-6
    )


def test_nothing_leaves_the_display() -> None:
    bright = np.clip(photograph() * np.linspace(0.2, 3.0, 80)[:, None], 0, 1)
    even = evenly_lit(bright).radiance
    assert even.dtype == np.float32
    assert even.min() >= 0
    assert even.max() <= 1
    assert (even.max(axis=-1) == 1).mean() < 0.005


def test_the_report_dims_the_rest_and_frames_the_crop() -> None:
    flat = photograph()
    np.testing.assert_array_equal(report_picture(flat, None), to_8bit(flat))
    fur = np.zeros((60, 80), bool)
    fur[10:50, 20:70] = True
    shown = report_picture(flat, fur)
    assert (shown[~fur].max(axis=-1) < to_8bit(flat)[~fur].max(axis=-1)).all()
    np.testing.assert_array_equal(shown[15:45, 30:50], to_8bit(flat)[15:45, 30:50])
    assert (shown[10, 20:59] == to_8bit(np.array([0.05, 0.9, 0.35]))).all()
