"""One ABRDF that stands for each cluster: the element-wise median, the mean or the medoid."""

from __future__ import annotations

import itertools
from typing import Literal

import numba
import numpy as np
from numpy.typing import NDArray

Representative = Literal["median", "mean", "medoid"]


def members(ids: NDArray[np.integer], clusters: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Texels sorted by cluster (texel,), and where every cluster starts (cluster + 1,)."""
    order = np.argsort(ids, kind="stable").astype(np.int64)
    counts = np.bincount(ids, minlength=clusters)
    return order, np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def cluster_medians(
    values: NDArray[np.float32], order: NDArray[np.int64], starts: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Element-wise medians of clusters (paper 1, section 3.1).

    values (texel, column) float32; ``order`` and ``starts`` as `members` gives them. Returns
    (cluster, column); of an even number of members the mean of the middle two.
    """
    result = np.empty((len(starts) - 1, values.shape[1]), np.float32)
    _medians(values, order, starts, result)
    return result


def cluster_means(
    values: NDArray[np.float32], order: NDArray[np.int64], starts: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Means of clusters: values (texel, column), returns (cluster, column) float32."""
    sums = np.add.reduceat(values[order].astype(np.float64), starts[:-1], axis=0)
    return (sums / np.diff(starts)[:, None]).astype(np.float32)


def medoids(
    points: NDArray[np.floating], order: NDArray[np.int64], starts: NDArray[np.int64]
) -> NDArray[np.int64]:
    """The texel of every cluster whose distances to the others have the least sum, (cluster,).

    points (texel, dimension) are what was clustered.
    """
    chosen = []
    for first, last in itertools.pairwise(starts):
        inside = points[order[first:last]].astype(np.float64)
        squares = np.sum(inside**2, axis=1)
        distances = squares[:, None] + squares[None] - 2 * inside @ inside.T
        total = np.sqrt(np.maximum(distances, 0.0)).sum(axis=1)
        chosen.append(order[first + int(total.argmin())])
    return np.array(chosen, np.int64)


@numba.njit(parallel=True, cache=True)
def _medians(
    values: NDArray[np.float32],
    order: NDArray[np.int64],
    starts: NDArray[np.int64],
    result: NDArray[np.float32],
) -> None:
    for cluster in numba.prange(len(starts) - 1):
        first, count = starts[cluster], starts[cluster + 1] - starts[cluster]
        column_values = np.empty(count, np.float32)
        for column in range(values.shape[1]):
            for member in range(count):
                column_values[member] = values[order[first + member], column]
            column_values.sort()
            low, high = column_values[(count - 1) // 2], column_values[count // 2]
            result[cluster, column] = 0.5 * (low + high)
