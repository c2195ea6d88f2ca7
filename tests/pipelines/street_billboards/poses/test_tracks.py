"""Tracks and points of pictures with known poses."""

from __future__ import annotations

import numpy as np

from pipelines.street_billboards.poses.bundle import residuals
from pipelines.street_billboards.poses.tracks import (
    Matches,
    kept_sightings,
    tracks_of,
    triangulated,
)
from tests.pipelines.street_billboards.poses.driven_points import driven, noisy


def test_matches_that_hang_together_are_a_track() -> None:
    starts = np.array([0, 3, 6, 9])  # three pictures of three features
    pairs = np.array([[0, 3], [3, 6], [1, 4], [2, 5], [5, 8], [1, 7]])
    row, track = tracks_of(Matches(starts, np.zeros((9, 2)), pairs))
    found = {frozenset(row[track == number].tolist()) for number in np.unique(track)}
    assert found == {frozenset({0, 3, 6}), frozenset({1, 4, 7}), frozenset({2, 5, 8})}


def test_two_features_of_one_picture_are_no_track() -> None:
    starts = np.array([0, 2, 4])
    pairs = np.array([[0, 2], [1, 2], [1, 3]])  # 0, 1, 2, 3 hang together
    row, track = tracks_of(Matches(starts, np.zeros((4, 2)), pairs))
    assert len(row) == len(track) == 0
    none = tracks_of(Matches(starts, np.zeros((4, 2)), np.zeros((0, 2), np.int64)))
    assert len(none[0]) == 0


def test_points_are_where_their_rays_meet_also_far_from_zero() -> None:
    bundle, seen = driven(8, 120, cameras=2)
    far = np.array([4.5e5, 5.4e6, 300.0])
    moved = bundle._replace(poses=bundle.poses.copy(), points=bundle.points + far)
    moved.poses[:, :3, 3] += far
    found = triangulated(moved, seen, len(bundle.points))
    known = np.isfinite(found[:, 0])
    assert known.mean() > 0.9
    np.testing.assert_allclose(found[known], moved.points[known], atol=1e-3)


def test_parallel_rays_meet_nowhere() -> None:
    bundle, seen = driven(3, 40)
    still = bundle._replace(poses=np.tile(bundle.poses[:1], (3, 1, 1)))
    places = residuals(still, seen)[0] + seen.places
    same = triangulated(still, seen._replace(places=places), len(bundle.points))
    assert np.isnan(same).all()


def test_what_does_not_fit_is_dropped() -> None:
    bundle, seen = driven(8, 100)
    wrong = noisy(seen, 0.1, 0)
    strays = np.flatnonzero(wrong.point < 5)
    wrong.places[strays] += 30.0
    kept, fitting, rows = kept_sightings(bundle, wrong, most=2.0)
    assert set(range(5)).isdisjoint(rows)
    np.testing.assert_array_equal(kept.points, bundle.points[rows])
    assert (np.bincount(fitting.point) >= 2).all()
    assert len(rows) > 0.8 * (len(bundle.points) - 5)
    unknown = bundle._replace(points=bundle.points.copy())
    unknown.points[9] = np.nan
    assert 9 not in kept_sightings(unknown, wrong, most=2.0)[2]
