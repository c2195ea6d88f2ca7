"""One ABRDF that stands for each cluster: the element-wise median, the mean or the medoid."""

from __future__ import annotations

import itertools
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Representative = Literal["median", "mean", "medoid"]


class ClusterMembers(NamedTuple):
    """Which texels every cluster has; those of cluster c are ``order[starts[c] : starts[c + 1]]``.

    There are M texels and k clusters.
    """

    order: NDArray[np.int64]
    """(M,) texels sorted by cluster, then by number."""
    starts: NDArray[np.int64]
    """(k + 1,) where every cluster starts, and M."""

    @property
    def sizes(self) -> NDArray[np.int64]:
        """(k,) how many there are."""
        return np.diff(self.starts)


def cluster_members(ids: NDArray[np.integer], clusters: int) -> ClusterMembers:
    """Members of every cluster, for cluster numbers ``ids`` (texel,).

    >>> members = cluster_members(np.array([1, 0, 1, 1]), 2)
    >>> members.order.tolist(), members.sizes.tolist()
    ([1, 0, 2, 3], [1, 3])
    >>> cluster_means(np.array([[6.0], [5.0], [1.0], [2.0]], np.float32), members).tolist()
    [[5.0], [3.0]]
    """
    order = np.argsort(ids, kind="stable").astype(np.int64)
    counts = np.bincount(ids, minlength=clusters)
    return ClusterMembers(order, np.concatenate([[0], np.cumsum(counts)]).astype(np.int64))


def cluster_medians(values: NDArray[np.float32], members: ClusterMembers) -> NDArray[np.float32]:
    """Element-wise medians of clusters (paper 1, section 3.1).

    values (texel, column) float32. Returns (cluster, column); of an even number of members the
    mean of the middle two.
    """
    from pipelines.neural_btf.median_kernel import segment_medians

    result = np.empty((len(members.sizes), values.shape[1]), np.float32)
    segment_medians(values, members.order, members.starts, result)
    return result


def cluster_means(values: NDArray[np.floating], members: ClusterMembers) -> NDArray[np.float32]:
    """Means of clusters: values (texel, column), returns (cluster, column) float32."""
    sums = np.add.reduceat(values[members.order].astype(np.float64), members.starts[:-1], axis=0)
    return (sums / members.sizes[:, None]).astype(np.float32)


def cluster_medoids(points: NDArray[np.floating], members: ClusterMembers) -> NDArray[np.int64]:
    """The texel of every cluster whose distances to the others have the least sum, (cluster,).

    points (texel, dimension) are what was clustered.
    """
    chosen = []
    for first, last in itertools.pairwise(members.starts):
        inside = points[members.order[first:last]].astype(np.float64)
        squares = np.sum(inside**2, axis=1)
        distances = squares[:, None] + squares[None] - 2 * inside @ inside.T
        total = np.sqrt(np.maximum(distances, 0.0)).sum(axis=1)
        chosen.append(members.order[first + int(total.argmin())])
    return np.array(chosen, np.int64)
