"""Bundle adjustment: derivatives against differences, known bundles found again."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.street_billboards.poses.bundle import (
    Priors,
    adjust_bundle,
    derivatives,
    huber_weights,
    moved_bundle,
    residuals,
)
from pipelines.street_billboards.poses.joined_pieces import pose_similarity
from tests.pipelines.street_billboards.poses.driven_points import FOCAL, driven, noisy, shaken

STEP = 1e-6


def test_derivatives_are_those_of_differences() -> None:
    bundle, seen = driven(6, 60, cameras=2)
    exact = derivatives(bundle, seen)
    frames, still = len(bundle.poses), np.zeros_like(bundle.points)
    for column in range(6):
        step = np.zeros(6 * frames)
        step[column::6] = STEP
        by_pose = residuals(moved_bundle(bundle, step, still), seen)[0] / STEP
        np.testing.assert_allclose(by_pose, exact.pose[..., column], rtol=1e-3, atol=2e-3)
    for axis in range(3):
        by_point = residuals(moved_bundle(bundle, step * 0, still + STEP * np.eye(3)[axis]), seen)
        np.testing.assert_allclose(by_point[0] / STEP, exact.point[..., axis], rtol=1e-3, atol=2e-3)
    step = np.append(np.zeros(6 * frames), STEP)
    by_focal = residuals(moved_bundle(bundle, step, still), seen)[0] / STEP
    np.testing.assert_allclose(by_focal, exact.focal, rtol=1e-3, atol=2e-3)


def test_a_shaken_bundle_is_found_again_but_for_a_similarity() -> None:
    bundle, seen = driven()
    found = adjust_bundle(shaken(bundle, 0.05, 0.005, 1), seen)
    assert np.abs(residuals(found, seen)[0]).max() < 0.02
    back = pose_similarity(found.poses, bundle.poses)
    np.testing.assert_allclose(back.poses(found.poses), bundle.poses, atol=2e-3)
    np.testing.assert_allclose(back.points(found.points), bundle.points, atol=0.05)


def test_a_focal_length_is_found_where_the_road_bends() -> None:
    bundle, seen = driven()
    wrong = bundle._replace(intrinsics=bundle.intrinsics * [[0.9, 1, 1], [1, 0.9, 1], [1, 1, 1]])
    found = adjust_bundle(wrong, seen, Priors(focal=10.0))
    assert found.intrinsics[0, 0, 0] == pytest.approx(FOCAL, rel=1e-3)
    assert found.intrinsics[0, 1, 1] == found.intrinsics[0, 0, 0]
    kept = adjust_bundle(wrong, seen)
    np.testing.assert_array_equal(kept.intrinsics, wrong.intrinsics)


def test_priors_weigh_as_their_deviations_say() -> None:
    """Without sightings' noise tight priors hold poses where they are, wide ones let them go."""
    bundle, seen = driven()
    rough = shaken(bundle, 0.05, 0.005, 2)
    tight = adjust_bundle(rough, seen, Priors(place=1e-6, turn=1e-7))
    np.testing.assert_allclose(tight.poses, rough.poses, atol=1e-4)
    wide = adjust_bundle(rough, seen, Priors(place=0.05, turn=0.005))
    error = np.linalg.norm(wide.poses[:, :3, 3] - bundle.poses[:, :3, 3], axis=1)
    given = np.linalg.norm(rough.poses[:, :3, 3] - bundle.poses[:, :3, 3], axis=1)
    assert error.mean() < 0.7 * given.mean()


def test_cameras_of_a_rig_stay_where_they_are_on_it() -> None:
    bundle, seen = driven(10, 200, cameras=3)
    rough = shaken(bundle, 0.03, 0.003, 3)
    found = adjust_bundle(rough, seen, Priors(place=0.03, turn=0.003))
    np.testing.assert_array_equal(found.rig, bundle.rig)
    # A rig's baselines tell the unit: no similarity is needed for the path's length.
    length = np.linalg.norm(found.poses[-1, :3, 3] - found.poses[0, :3, 3])
    truth = np.linalg.norm(bundle.poses[-1, :3, 3] - bundle.poses[0, :3, 3])
    assert length == pytest.approx(truth, rel=2e-3)


def test_some_wrong_sightings_do_little() -> None:
    bundle, seen = driven()
    wrong = noisy(seen, 0.2, 4)
    strays = np.random.default_rng(5).random(len(seen.frame)) < 0.03
    wrong.places[strays] += 15.0
    found = adjust_bundle(bundle, wrong)
    clean = adjust_bundle(bundle, wrong.some(~strays))
    apart = pose_similarity(found.poses, bundle.poses).poses(found.poses) - bundle.poses
    usual = pose_similarity(clean.poses, bundle.poses).poses(clean.poses) - bundle.poses
    assert np.linalg.norm(apart[:, :3, 3], axis=1).max() < 0.15
    assert np.linalg.norm(usual[:, :3, 3], axis=1).max() < 0.05
    assert huber_weights(np.array([[0.3, 0.4], [30.0, 40.0]])).tolist() == [1.0, 0.02]


def test_points_that_are_seen_once_are_refused() -> None:
    bundle, seen = driven(4, 30)
    once = np.ones(len(seen.point), np.bool_)
    once[np.flatnonzero(seen.point == 0)[1:]] = False
    with pytest.raises(ValueError, match="seen less than twice"):
        adjust_bundle(bundle, seen.some(once))
