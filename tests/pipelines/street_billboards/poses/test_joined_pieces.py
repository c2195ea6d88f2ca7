"""Pieces of a long film: cut from a known drive, moved into worlds of their own, joined again."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipelines.street_billboards.poses.bundle import Bundle, Sightings
from pipelines.street_billboards.poses.joined_pieces import (
    Piece,
    Similarity,
    common_focal,
    join_pieces,
    pose_similarity,
)
from tests.pipelines.street_billboards.poses.driven_points import FOCAL, driven


def _similarity(seed: int) -> Similarity:
    random = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed).as_matrix()
    return Similarity(float(random.uniform(0.3, 3)), turn, random.normal(scale=20, size=3))


def _piece(
    bundle: Bundle, seen: Sightings, first: int, last: int, seed: int, deviation: float = 0.01
) -> Piece:
    """Frames from first to before last, in a world of its own."""
    inside = (seen.frame >= first) & (seen.frame < last)
    inside &= np.bincount(seen.point[inside], minlength=len(bundle.points))[seen.point] >= 2
    points, point = np.unique(seen.point[inside], return_inverse=True)
    some = seen.some(inside)._replace(frame=seen.frame[inside] - first, point=point)
    world = _similarity(seed)
    own = bundle._replace(
        poses=world.poses(bundle.poses[first:last]), points=world.points(bundle.points[points])
    )
    count = len(points)
    return Piece(
        np.arange(first, last),
        own,
        some,
        deviation,
        np.zeros(count),
        np.full(count, first),
        np.zeros((count, 3), np.uint8),
    )


def test_a_similarity_is_found_also_of_a_straight_path() -> None:
    bundle, _ = driven(bend=0.0)
    world = _similarity(3)
    found = pose_similarity(bundle.poses, world.poses(bundle.poses))
    assert found.scale == pytest.approx(world.scale)
    np.testing.assert_allclose(found.turn, world.turn, atol=1e-9)
    np.testing.assert_allclose(found.shift, world.shift, atol=1e-6)


def test_pieces_are_one_drive_again() -> None:
    bundle, seen = driven(40, 700)
    pieces = [
        _piece(bundle, seen, first, last, seed)
        for seed, (first, last) in enumerate([(0, 16), (11, 28), (24, 40)])
    ]
    joined = join_pieces(pieces, fixed_focal=True)
    np.testing.assert_array_equal(joined.frames, np.arange(40))
    back = pose_similarity(joined.poses, bundle.poses)
    np.testing.assert_allclose(back.poses(joined.poses), bundle.poses, atol=1e-5)
    assert len(joined.points) == sum(len(piece.errors) for piece in pieces)
    assert joined.sightings.sum() == sum(len(piece.seen.frame) for piece in pieces)
    assert joined.notes == ()


def test_where_nothing_joins_the_longest_part_is_kept_and_said() -> None:
    bundle, seen = driven(40, 700)
    pieces = [
        _piece(bundle, seen, first, last, seed)
        for seed, (first, last) in enumerate([(0, 12), (10, 28), (23, 40)])
    ]
    joined = join_pieces(pieces, fixed_focal=True)  # two frames are too few
    np.testing.assert_array_equal(joined.frames, np.arange(10, 40))
    assert "falls into 2 parts" in joined.notes[0]
    assert "frames 10 to 39" in joined.notes[0]


def test_the_focal_length_is_that_of_the_piece_that_tells_it() -> None:
    bundle, seen = driven(24, 500)
    bends = _piece(bundle, seen, 0, 14, 0, deviation=0.001)
    straight = _piece(bundle, seen, 9, 24, 1, deviation=0.2)
    wrong = straight.bundle.intrinsics * [[1.15, 1, 1], [1, 1.15, 1], [1, 1, 1]]
    straight = straight._replace(bundle=straight.bundle._replace(intrinsics=wrong))
    focal, deviation = common_focal([bends, straight])
    assert focal == pytest.approx(FOCAL, rel=1e-4)
    assert deviation == pytest.approx(0.001, rel=0.01)
    joined = join_pieces([bends, straight], fixed_focal=False)
    assert joined.intrinsics[0, 0] == pytest.approx(focal)
    back = pose_similarity(joined.poses, bundle.poses)
    np.testing.assert_allclose(back.poses(joined.poses), bundle.poses, atol=0.02)


def test_pieces_that_disagree_widen_what_is_stated() -> None:
    bundle, seen = driven(16, 300)
    one, other = (_piece(bundle, seen, 0, 16, seed, deviation=0.01) for seed in (0, 1))
    longer = other.bundle.intrinsics * [[1.1, 1, 1], [1, 1.1, 1], [1, 1, 1]]
    other = other._replace(bundle=other.bundle._replace(intrinsics=longer))
    focal, deviation = common_focal([one, other])
    assert focal == pytest.approx(FOCAL * np.sqrt(1.1), rel=1e-6)
    assert deviation == pytest.approx(np.log(1.1) / 2, rel=0.01)
    given = [piece._replace(deviation=0.0) for piece in (one, one)]
    assert common_focal(given) == (pytest.approx(FOCAL), 0.0)
    untold = [piece._replace(deviation=np.inf) for piece in (one, one)]
    assert common_focal(untold)[1] == np.inf
