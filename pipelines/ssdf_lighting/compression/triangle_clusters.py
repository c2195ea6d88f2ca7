"""Clusters of triangles: near each other in space, or alike in what they see of the sky.

The paper clusters triangles by their centroids. What is near in space mostly sees alike, but not
under a lid or at the foot of a wall; with as many clusters, made of the SSDFs themselves, a vertex
takes half as many values for the same error (docs/ssdf.md).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.clustering import k_means_from_farthest, k_means_plus_plus

_LEADING = 32
"""Coordinates in the shared basis by which SSDFs are compared."""


class Clusters(NamedTuple):
    """``triangle`` (F,) int32 and ``vertex`` (V,) int32: a vertex is in the cluster whose centre
    is nearest to its own features. Numbers are dense: each has a triangle; a few may have no
    vertex."""

    triangle: NDArray[np.int32]
    vertex: NDArray[np.int32]


def clusters_by_position(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer], count: int, seed: int
) -> Clusters:
    """The paper's: k-means on centroids, seeded by the farthest.

    vertices (V, 3); triangles (F, 3). Raises ValueError for more clusters than triangles.
    """
    centroids = vertices[triangles].mean(axis=1)
    labels = k_means_from_farthest(centroids, count, seed)
    return Clusters(labels, _nearest(vertices, _means(centroids, labels)))


def clusters_by_distance(
    coordinates: NDArray[np.float32], triangles: NDArray[np.integer], count: int, seed: int
) -> Clusters:
    """k-means++ on SSDFs, given by ``coordinates`` (V, R) in the shared basis, strongest first; a
    triangle has the mean of its corners'. Raises ValueError for more clusters than triangles."""
    leading = leading_coordinates(coordinates)
    points = leading[triangles].mean(axis=1)
    labels = k_means_plus_plus(points, count, seed)
    return Clusters(labels, _nearest(leading, _means(points, labels)))


def leading_coordinates(coordinates: NDArray[np.float32]) -> NDArray[np.float64]:
    """What SSDFs are compared by: the first of ``coordinates`` (V, R)."""
    return coordinates[:, :_LEADING].astype(np.float64)


def within_cluster_spread(
    features: NDArray[np.float64], triangles: NDArray[np.integer], labels: NDArray[np.int32]
) -> float:
    """Spread of the triangles' features inside clusters, over that of all; ``features`` (V, k)."""
    points = features[triangles].mean(axis=1)
    inside = ((points - _means(points, labels)[labels]) ** 2).sum()
    return float(np.sqrt(inside / ((points - points.mean(axis=0)) ** 2).sum()))


def _means(points: NDArray[np.float64], labels: NDArray[np.int32]) -> NDArray[np.float64]:
    sums = np.zeros((int(labels.max()) + 1, points.shape[1]))
    np.add.at(sums, labels, points)
    return sums / np.maximum(np.bincount(labels), 1)[:, None]


def _nearest(points: NDArray[np.float64], centres: NDArray[np.float64]) -> NDArray[np.int32]:
    from sklearn.metrics import pairwise_distances_argmin

    return pairwise_distances_argmin(points, centres).astype(np.int32)
