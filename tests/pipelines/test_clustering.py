"""k-means against brute force and the distribution of its seeds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import stats

from pipelines import clustering
from pipelines.clustering import k_means_from_farthest, k_means_plus_plus


def means_of(points: NDArray[np.floating], labels: NDArray[np.integer]) -> NDArray[np.float64]:
    return np.stack([points[labels == one].mean(axis=0) for one in range(labels.max() + 1)])


def squared_distances(
    points: NDArray[np.floating], others: NDArray[np.floating]
) -> NDArray[np.float64]:
    return np.sum((points[:, None].astype(np.float64) - others[None]) ** 2, axis=-1)


@pytest.mark.parametrize("seed", range(5))
def test_well_separated_blobs_are_found(seed: int) -> None:
    random = np.random.default_rng(seed)
    truth = random.permutation(np.repeat(np.arange(4), [5, 20, 50, 125]))
    centres = 1000 * np.eye(4)
    points = centres[truth] + random.standard_normal((len(truth), 4))
    labels = k_means_plus_plus(points, 4, seed)
    assert len({(int(a), int(b)) for a, b in zip(truth, labels, strict=True)}) == 4


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("clusters", [2, 9, 40])
def test_every_point_is_nearest_to_the_mean_of_its_own_cluster(
    clusters: int, dtype: type[np.floating]
) -> None:
    """Lloyd went on until no assignment changed."""
    points = np.random.default_rng(clusters).random((600, 3)).astype(dtype)
    labels = k_means_plus_plus(points, clusters, 0)
    away = squared_distances(points, means_of(points, labels))
    own = away[np.arange(len(points)), labels]
    np.testing.assert_allclose(own, away.min(axis=1), rtol=0, atol=1e-6)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=1, max_size=40),
    st.integers(0, 99),
    st.data(),
)
def test_every_cluster_has_members(
    points: list[tuple[int, int]], seed: int, data: st.DataObject
) -> None:
    """Among points with many duplicates, too, up to one cluster for each different point."""
    clusters = data.draw(st.integers(1, len(set(points))))
    labels = k_means_plus_plus(np.array(points, np.float64), clusters, seed)
    assert labels.dtype == np.int32
    assert sorted(set(labels.tolist())) == list(range(clusters))


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=1, max_size=30),
    st.integers(0, 99),
)
def test_as_many_clusters_as_different_points_hold_one_each(
    points: list[tuple[int, int]], seed: int
) -> None:
    labels = k_means_plus_plus(np.array(points, np.float64), len(set(points)), seed)
    assert len(set(zip(labels.tolist(), points, strict=True))) == len(set(points))


def test_one_cluster_holds_all_points() -> None:
    points = np.random.default_rng(0).random((20, 2))
    np.testing.assert_array_equal(k_means_plus_plus(points, 1, 0), 0)


def test_seeds_are_drawn_by_the_squared_distance() -> None:
    """Three points at 0, 1 and 2.2 in two clusters: Lloyd ends where it begins.

    The last two are together exactly if the seeds were the first two: c joins the nearer seed b.
    If c is a seed, the first two are together.
    """
    place = np.array([0.0, 1.0, 2.2])
    squares = (place[:, None] - place) ** 2
    chance = squares / squares.sum(axis=1, keepdims=True) / 3  # first seed evenly, then D(x)²
    apart = chance[0, 1] + chance[1, 0]
    runs = 1500
    counts = np.zeros(2)
    for seed in range(runs):
        labels = k_means_plus_plus(place[:, None], 2, seed)
        counts[int(labels[1] == labels[2])] += 1
    expected = runs * np.array([1 - apart, apart])
    assert stats.chisquare(counts, expected).pvalue > 1e-3
    # The test can tell it from even chances and from D(x), the distance unsquared.
    distance = np.abs(place[:, None] - place)
    linear = distance / distance.sum(axis=1, keepdims=True) / 3
    for other in (1 / 3, linear[0, 1] + linear[1, 0]):
        assert stats.chisquare(counts, runs * np.array([1 - other, other])).pvalue < 1e-6


def test_equal_seeds_give_equal_clusters_and_others_others() -> None:
    points = np.random.default_rng(0).random((300, 2))
    one = k_means_plus_plus(points, 12, 3)
    np.testing.assert_array_equal(one, k_means_plus_plus(points, 12, 3))
    assert (one != k_means_plus_plus(points, 12, 4)).any()


@pytest.mark.parametrize("clusters", [-1, 0, 4, 6])
def test_more_clusters_than_different_points_and_none_are_refused(clusters: int) -> None:
    points = np.array([[0.0, 1], [0, 1], [2, 2], [2, 2], [5, 0], [5, 0]])
    message = rf"^clusters is {clusters}; expected 1 to 3, the number of different points\.$"
    with pytest.raises(ValueError, match=message):
        k_means_plus_plus(points, clusters, 0)


# ---- seeds that are the farthest -------------------------------------------------------------


def farthest_seeds(points: NDArray[np.floating], clusters: int, first: int) -> NDArray[np.floating]:
    """Every further seed the point farthest from its nearest seed, by all distances."""
    away = np.sqrt(squared_distances(points, points))
    seeds = [first]
    while len(seeds) < clusters:
        seeds.append(int(away[:, seeds].min(axis=1).argmax()))
    return points[seeds]


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 1000), st.integers(1, 12), st.integers(1, 4))
def test_seeds_are_the_farthest_from_those_before(
    seed: int, clusters: int, dimensions: int
) -> None:
    points = np.random.default_rng(seed + 1).random((60, dimensions))
    first = int(np.random.default_rng(seed).integers(60))
    given_seeds: list[NDArray[np.floating]] = []

    def caught(all_points: NDArray[np.floating], seeds: NDArray[np.floating]) -> NDArray[np.int32]:
        given_seeds.append(seeds)
        return np.zeros(len(all_points), np.int32)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(clustering, "_lloyd", caught)
        k_means_from_farthest(points, clusters, seed)
    np.testing.assert_array_equal(given_seeds[0], farthest_seeds(points, clusters, first))


def lloyd(points: NDArray[np.float64], means: NDArray[np.float64]) -> NDArray[np.int64]:
    """Rounds until nothing changes."""
    labels = np.full(len(points), -1)
    while True:
        found = squared_distances(points, means).argmin(axis=1)
        if (found == labels).all():
            return labels
        labels = found
        means = means_of(points, labels)


@pytest.mark.parametrize("seed", range(6))
def test_rounds_begin_at_the_farthest_and_end_where_nothing_changes(seed: int) -> None:
    points = np.random.default_rng(50 + seed).random((400, 3))
    clusters = 9
    labels = k_means_from_farthest(points, clusters, seed)
    away = squared_distances(points, means_of(points, labels))
    np.testing.assert_array_equal(labels, away.argmin(axis=1))
    first = int(np.random.default_rng(seed).integers(len(points)))
    expected = lloyd(points, farthest_seeds(points, clusters, first))
    np.testing.assert_array_equal(labels, expected)
    np.testing.assert_array_equal(labels, k_means_from_farthest(points, clusters, seed))


def test_well_separated_blobs_are_found_from_any_first_seed() -> None:
    """The farthest seeds lie in different blobs, surely: there is no chance in it but the first."""
    random = np.random.default_rng(1)
    truth = np.repeat(np.arange(6), [1, 3, 10, 40, 80, 160])
    points = 1000 * np.eye(6)[truth] + random.standard_normal((len(truth), 6))
    for seed in range(20):
        labels = k_means_from_farthest(points, 6, seed)
        assert len(set(zip(truth.tolist(), labels.tolist(), strict=True))) == 6


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=1, max_size=40),
    st.integers(0, 99),
    st.data(),
)
def test_every_cluster_from_the_farthest_has_members(
    points: list[tuple[int, int]], seed: int, data: st.DataObject
) -> None:
    clusters = data.draw(st.integers(1, len(set(points))))
    labels = k_means_from_farthest(np.array(points, np.float64), clusters, seed)
    assert labels.dtype == np.int32
    assert sorted(set(labels.tolist())) == list(range(clusters))


@pytest.mark.parametrize("clusters", [-1, 0, 4])
def test_the_farthest_refuse_more_clusters_than_different_points(clusters: int) -> None:
    points = np.array([[0.0, 1], [0, 1], [2, 2], [5, 0], [5, 0]])
    with pytest.raises(ValueError, match=rf"^clusters is {clusters}; expected 1 to 3, the number"):
        k_means_from_farthest(points, clusters, 0)
