"""Noise goes, scratches stay; what tracing tells the denoiser; exposure."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.scratches_pictures import Judged, contrast_kept
from pipelines.drawing.colour import luminance
from pipelines.geometry.solid_shapes import plate
from pipelines.glass_scratches.drawing import denoising
from pipelines.glass_scratches.drawing.denoising import denoised
from pipelines.glass_scratches.drawing.frames import picture_exposure
from pipelines.glass_scratches.drawing.path_tracing import TracedPicture
from pipelines.light.built_in_environments import lamps
from pipelines.light.environment_sampling import make_environment_sampler
from tests.pipelines.glass_scratches.drawing.test_path_tracing import (
    CLEAN,
    WORN,
    facing,
    picture,
    surface,
)

Floats = NDArray[np.float64]
SIZE, PATHS = 96, 64


@pytest.fixture(scope="module")
def scratched_wall() -> tuple[TracedPicture, Floats]:
    """A wall behind glass with scratches three pixels wide, as paths would find it, and without
    noise: of scattered light one path in eight finds eight times as much."""
    random = np.random.default_rng(3)
    row, column = np.mgrid[:SIZE, :SIZE]
    off = (2 * row + 3 * column) % 47 - 23
    share = 0.8 * np.exp(-((off / 5.0) ** 2))
    wall = np.where(column + 0.3 * row > 60, 0.2, 1.5)[..., None] * np.array([1.0, 0.8, 0.6])
    light = (0.5 + 0.4 * np.sin(row / 30.0))[..., None] * np.array([0.7, 0.8, 1.0])
    met = random.binomial(PATHS, share) / PATHS
    found = random.binomial(np.rint(PATHS * met).astype(int), 1 / 8) * 8 / PATHS
    smooth, scattered = (1 - met)[..., None] * wall, found[..., None] * light
    normal = np.broadcast_to([0.0, -1.0, 0.0], wall.shape)
    parts = (smooth + scattered, met, met, smooth, normal)
    traced = TracedPicture(*(part.astype(np.float32) for part in parts), 0, PATHS)
    return traced, (1 - share)[..., None] * wall + share[..., None] * light


def _judged(wall: tuple[TracedPicture, Floats]) -> Judged:
    traced, truth = wall
    blind = denoised(
        traced._replace(scratched=np.zeros_like(traced.scratched), smooth=traced.radiance)
    )
    blurred = cv2.GaussianBlur(traced.radiance, (0, 0), 1.5)
    pictures = (truth, denoised(traced), blind, traced.radiance, blurred)
    return Judged(*(255 * picture.astype(np.float64) for picture in pictures), traced.scratched)


def test_noise_goes_and_scratches_stay(scratched_wall: tuple[TracedPicture, Floats]) -> None:
    """Nulls: blurred, and denoised without a word of scratches."""
    judged = _judged(scratched_wall)
    errors = {
        way: float(np.sqrt(np.mean((getattr(judged, way) - judged.reference) ** 2)))
        for way in Judged._fields[1:5]
    }
    assert errors["clean"] < 0.5 * errors["noisy"]
    assert errors["clean"] < 0.9 * errors["without_scratches"]
    assert errors["clean"] < 0.5 * errors["blurred"]
    assert contrast_kept(judged, "clean") > 0.9
    assert contrast_kept(judged, "blurred") < 0.75


def test_contrast_is_that_of_the_reference_whatever_noise_there_is(
    scratched_wall: tuple[TracedPicture, Floats],
) -> None:
    judged = _judged(scratched_wall)
    noise = np.random.default_rng(5).normal(size=judged.reference.shape) * 20
    same = judged._replace(clean=judged.reference, noisy=judged.reference + noise)
    assert contrast_kept(same, "clean") == pytest.approx(1.0)
    assert contrast_kept(same, "noisy") == pytest.approx(1.0, abs=0.03)


def test_contrast_needs_scratches(scratched_wall: tuple[TracedPicture, Floats]) -> None:
    judged = _judged(scratched_wall)
    with pytest.raises(ValueError, match=r"no pixel shows scratches"):
        contrast_kept(judged._replace(scratched=0 * judged.scratched), "clean")


def test_of_few_paths_the_share_loses_noise_and_not_its_detail() -> None:
    """The error falls; where all paths or none met a scratch, sharp edges stay as they are."""
    random = np.random.default_rng(6)
    row, column = np.mgrid[:SIZE, :SIZE]
    faint = 0.15 + 0.1 * np.sin(row / 9.0) * np.sin(column / 13.0)
    found = (random.binomial(16, faint) / 16).astype(np.float32)
    quiet = denoising._quiet_share(found, 16)
    assert np.std(quiet - faint) < 0.4 * np.std(found - faint)
    sharp = ((2 * row + column) % 37 < 6).astype(np.float32)
    np.testing.assert_allclose(denoising._quiet_share(sharp, 16), sharp, atol=1e-3)


def test_light_is_kept(scratched_wall: tuple[TracedPicture, Floats]) -> None:
    traced, truth = scratched_wall
    assert denoised(traced).mean() == pytest.approx(truth.mean(), rel=0.02)


# ---- what tracing tells ----------------------------------------------------------------------


def test_glass_without_scratches_is_all_smooth() -> None:
    light = make_environment_sampler(lamps(16))
    found = picture(plate(1.5, 1.1, 0.05), surface(CLEAN), light, facing(), samples=8)
    assert (found.scratched == 0).all()
    np.testing.assert_array_equal(found.smooth, found.radiance)
    np.testing.assert_allclose(found.normal, np.broadcast_to([0, -1, 0], found.normal.shape))


def test_the_scattered_part_is_where_scratches_are() -> None:
    light = make_environment_sampler(lamps(16))
    found = picture(plate(1.5, 1.1, 0.05), surface(WORN), light, facing(height=3.0), samples=16)
    beside = ~found.normal.any(axis=2)
    assert 0.3 < beside.mean() < 0.9
    scattered = luminance(found.radiance - found.smooth)
    assert (scattered > -1e-6).all()
    assert (scattered[found.scratched == 0] < 1e-6).all()
    assert scattered[found.scratched > 0.5].mean() > 0.01
    assert (found.scratched[beside] == 0).all()


# ---- exposure --------------------------------------------------------------------------------


def test_exposure_follows_the_picture_and_hardly_its_lamps() -> None:
    """A hundredth of the picture a hundred times as bright: the mean doubles, and shows all else
    half as bright."""
    random = np.random.default_rng(2)
    dim = np.exp(random.normal(size=(50, 50, 1))) * np.array([0.1, 0.1, 0.1])
    first = picture_exposure(dim)
    assert picture_exposure(4 * dim) == pytest.approx(first / 4)
    assert np.exp(np.log(luminance(dim * first)).mean()) == pytest.approx(0.22)
    lit = dim.copy()
    lit[20:25, 20:25] = 16.0
    assert luminance(lit).mean() > 1.9 * luminance(dim).mean()
    assert picture_exposure(lit) > 0.93 * first


def test_a_picture_that_is_mostly_black_is_exposed() -> None:
    dark = np.zeros((8, 8, 3), np.float32)
    dark[0, 0] = 1.0
    assert np.isfinite(picture_exposure(dark))
