"""The stated deviation of a focal length against a dense inverse, and against what errors are."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.street_billboards.poses.bundle import (
    Bundle,
    Priors,
    Sightings,
    adjust_bundle,
    derivatives,
    residuals,
)
from pipelines.street_billboards.poses.focal_deviation import FocalDeviation, focal_deviation
from tests.pipelines.street_billboards.poses.driven_points import FOCAL, driven, noisy

RUNS = 20


def _adjusted(bundle: Bundle, seen: Sightings) -> tuple[Bundle, FocalDeviation]:
    found = adjust_bundle(bundle, seen, Priors(focal=10.0))
    return found, focal_deviation(found, seen)


@pytest.mark.parametrize("cameras", [1, 2])
def test_it_is_that_of_the_pseudo_inverse(cameras: int) -> None:
    """Of all normal equations at once, dense, whatever holds place, direction and scale."""
    bundle, seen = driven(6, 50, cameras=cameras)
    seen = noisy(seen, 0.02, 1)
    found, stated = _adjusted(bundle, seen)
    d = derivatives(found, seen)
    count, frames, points = len(seen.frame), len(found.poses), len(found.points)
    dense = np.zeros((count, 2, 6 * frames + 3 * points + 1))
    rows = np.arange(count)[:, None]
    for column in range(6):
        dense[rows, [0, 1], (6 * seen.frame + column)[:, None]] = d.pose[..., column]
    for axis in range(3):
        at = 6 * frames + 3 * seen.point + axis
        dense[rows, [0, 1], at[:, None]] = d.point[..., axis]
    dense[..., -1] = d.focal
    inverse = np.linalg.pinv(dense.reshape(2 * count, -1), rcond=1e-9)
    off = residuals(found, seen)[0]
    freedom = 2 * count - dense.shape[2] + (7 if cameras == 1 else 6)
    expected = np.sqrt((inverse[-1] ** 2).sum() * (off**2).sum() / freedom)
    assert stated.independent == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("pixels", [0.1, 0.5])
def test_errors_are_as_large_as_is_stated(pixels: float) -> None:
    bundle, seen = driven(10, 150)
    ratios = []
    for run in range(RUNS):
        found, stated = _adjusted(bundle, noisy(seen, pixels, run))
        ratios.append(np.log(found.intrinsics[0, 0, 0] / FOCAL) / np.array(stated))
    spread = np.std(ratios, axis=0)
    # Of 20 draws the deviation is known to 16 %: three of these either way.
    assert 0.55 < spread[0] < 1.45
    assert 0.55 < spread[1] < 1.6
    assert spread.min() < 1.45


def test_errors_that_stay_with_their_points_are_told_by_clusters() -> None:
    """Each point is found off by the same in all frames: residuals shrink, the error does not."""
    bundle, seen = driven(10, 150)
    by_one, by_point = [], []
    for run in range(RUNS):
        random = np.random.default_rng(run)
        # Off by a share of its own way through the picture: no place of a point explains it.
        share = random.normal(scale=0.01, size=len(bundle.points))[seen.point, None]
        drifted = seen._replace(places=seen.places + share * (seen.places - [319.5, 199.5]))
        found, stated = _adjusted(bundle, noisy(drifted, 0.05, run))
        error = np.log(found.intrinsics[0, 0, 0] / FOCAL)
        by_one.append(error / stated.independent)
        by_point.append(error / stated.by_point)
    assert np.std(by_point) < 1.6
    assert np.std(by_one) > 1.15 * np.std(by_point)


def test_a_straight_drive_tells_no_focal_length() -> None:
    bundle, seen = driven(bend=0.0)
    _, told = _adjusted(*driven(bend=0.5))
    straight = bundle._replace(poses=bundle.poses.copy())
    straight.poses[:, :3, :3] = np.eye(3)
    shown = residuals(straight, seen._replace(places=np.zeros_like(seen.places)))[0]
    off = noisy(seen._replace(places=shown), 0.2, 3)
    found, untold = _adjusted(straight, off)
    error = abs(np.log(found.intrinsics[0, 0, 0] / FOCAL))
    assert untold.stated > 20 * told.stated
    assert untold.stated > 0.05
    assert error < 3 * untold.stated


def test_too_few_sightings_tell_nothing() -> None:
    bundle, seen = driven(4, 6)
    few = np.isin(seen.point, [0, 1])
    number = np.cumsum(np.isin(np.arange(len(bundle.points)), [0, 1])) - 1
    less = bundle._replace(points=bundle.points[:2])
    some = seen.some(few)
    assert focal_deviation(less, some._replace(point=number[some.point])).stated == np.inf
