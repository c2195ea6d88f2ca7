"""Representatives of clusters against NumPy and brute force."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.neural_btf.representatives import (
    cluster_means,
    cluster_medians,
    cluster_medoids,
    cluster_members,
)


def ids_of(counts: list[int], seed: int = 0) -> NDArray[np.int32]:
    """Cluster numbers of that many members each, shuffled."""
    ids = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
    return np.random.default_rng(seed).permutation(ids)


every_size = pytest.mark.parametrize("counts", [[1, 2, 3, 4, 5], [6], [7, 1], [30, 31, 1, 2]])


@settings(deadline=None)
@given(st.lists(st.integers(0, 4), min_size=1, max_size=40))
def test_members_list_every_texel_once_with_its_cluster_in_order(ids: list[int]) -> None:
    order, starts = cluster_members(np.array(ids), 5)
    assert (starts[0], starts[-1], len(starts)) == (0, len(ids), 6)
    for cluster in range(5):
        inside = order[starts[cluster] : starts[cluster + 1]].tolist()
        assert inside == [texel for texel, one in enumerate(ids) if one == cluster]


@every_size
def test_medians_are_numpys(counts: list[int]) -> None:
    ids = ids_of(counts)
    values = np.random.default_rng(1).standard_normal((len(ids), 9)).astype(np.float32)
    found = cluster_medians(values, cluster_members(ids, len(counts)))
    assert (found.shape, found.dtype) == ((len(counts), 9), np.float32)
    for cluster in range(len(counts)):
        np.testing.assert_allclose(
            found[cluster], np.median(values[ids == cluster], axis=0), rtol=1e-6
        )


def test_medians_are_taken_by_the_element_not_by_the_texel() -> None:
    values = np.array([[0, 9], [1, 0], [2, 5]], np.float32)
    found = cluster_medians(values, cluster_members(np.zeros(3, int), 1))
    np.testing.assert_array_equal(found, [[1, 5]])


@every_size
def test_means_are_numpys(counts: list[int]) -> None:
    ids = ids_of(counts)
    values = np.random.default_rng(2).standard_normal((len(ids), 9)).astype(np.float32)
    found = cluster_means(values, cluster_members(ids, len(counts)))
    assert (found.shape, found.dtype) == ((len(counts), 9), np.float32)
    for cluster in range(len(counts)):
        expected = values[ids == cluster].astype(np.float64).mean(axis=0)
        np.testing.assert_allclose(found[cluster], expected, rtol=1e-6, atol=1e-7)


@every_size
def test_medoids_have_the_least_sum_of_distances(counts: list[int]) -> None:
    ids = ids_of(counts)
    points = np.random.default_rng(3).standard_normal((len(ids), 4))
    found = cluster_medoids(points, cluster_members(ids, len(counts)))
    for cluster, texel in enumerate(found):
        inside = np.flatnonzero(ids == cluster)
        sums = [sum(np.linalg.norm(points[a] - points[b]) for b in inside) for a in inside]
        assert texel in inside
        assert sums[int(np.flatnonzero(inside == texel)[0])] == pytest.approx(min(sums))


def test_a_medoid_minimises_distances_not_their_squares() -> None:
    """On a line the sum of distances is least at the median, that of squares by the mean."""
    points = np.array([0.0, 1.0, 2.0, 10.0, 40.0])[:, None]
    assert cluster_medoids(points, cluster_members(np.zeros(5, int), 1)).tolist() == [2]
