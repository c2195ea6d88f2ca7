"""Features and matches of pictures that are moved by known ways."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.street_billboards.poses.features import match_features, sift_features
from tests.pipelines.street_billboards.poses.corridor import lens, photograph


@pytest.fixture(scope="module")
def wall() -> NDArray[np.uint8]:
    return photograph(np.eye(4), lens())


def test_features_are_spread_over_the_picture(wall: NDArray[np.uint8]) -> None:
    few = sift_features(wall, most=200)
    assert few.places.shape == (200, 2)
    np.testing.assert_allclose(np.linalg.norm(few.descriptors, axis=1), 1, atol=1e-4)
    thirds = np.histogram(few.places[:, 0], bins=3, range=(0, wall.shape[1]))[0]
    assert thirds.min() > 25
    assert len(np.unique(few.places, axis=0)) == 200
    coloured = sift_features(np.repeat(wall[..., None], 3, axis=2), most=200)
    np.testing.assert_allclose(coloured.places, few.places, atol=0.1)


def test_nothing_is_found_where_it_is_masked(wall: NDArray[np.uint8]) -> None:
    mask = np.ones(wall.shape, np.bool_)
    mask[:, :150] = False
    assert (sift_features(wall, mask).places[:, 0] >= 149).all()
    assert len(sift_features(wall, np.zeros_like(mask)).places) == 0


def test_a_moved_picture_is_matched_where_it_went(wall: NDArray[np.uint8]) -> None:
    whole = sift_features(wall[:150, :280])
    moved = sift_features(wall[9:159, 4:284])
    rows = match_features(whole, moved)
    assert len(rows) > 0.5 * len(whole.places)
    way = moved.places[rows[:, 1]] - whole.places[rows[:, 0]]
    right = np.abs(way - [-4, -9]).max(axis=1) < 0.3
    assert right.mean() > 0.97
    assert np.abs(np.median(way, axis=0) - [-4, -9]).max() < 0.02
    for column in rows.T:
        assert len(np.unique(column)) == len(rows)


def test_large_pictures_are_looked_at_smaller(wall: NDArray[np.uint8]) -> None:
    """Every pixel eight times across and down, of which every second line is kept."""
    large = np.kron(wall, np.ones((8, 8), np.uint8))
    found = sift_features(large, most=400).places
    direct = sift_features(np.kron(wall, np.ones((4, 4), np.uint8)), most=400).places
    np.testing.assert_allclose(found, (direct + 0.5) * 2 - 0.5, atol=1e-3)
    mask = np.ones(large.shape, np.bool_)
    mask[:, :1200] = False
    assert (sift_features(large, mask, 400).places[:, 0] >= 1198).all()


def test_other_pictures_match_hardly(wall: NDArray[np.uint8]) -> None:
    noise = np.random.default_rng(0).integers(0, 255, wall.shape).astype(np.uint8)
    here, there = sift_features(wall), sift_features(noise)
    assert len(match_features(here, there)) < 0.03 * len(here.places)
    nothing = sift_features(np.zeros_like(wall))
    assert match_features(here, nothing).shape == (0, 2)


def test_places_are_counted_from_the_middle_of_the_first_pixel() -> None:
    """Turned by 180 degrees a picture's features are where they were, counted from the end."""
    picture = photograph(np.eye(4), lens())
    here, there = sift_features(picture), sift_features(picture[::-1, ::-1].copy())
    rows = match_features(here, there)
    back = np.array(picture.shape[::-1]) - 1 - there.places[rows[:, 1]]
    assert np.abs(np.median(back - here.places[rows[:, 0]], axis=0)).max() < 0.05
