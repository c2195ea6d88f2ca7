"""k-means by scikit-learn, seeded as the papers seed it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_MOST_ROUNDS = 1000


def k_means_plus_plus(points: NDArray[np.floating], clusters: int, seed: int) -> NDArray[np.int32]:
    """Cluster numbers (points,) of points (points, dimensions); every cluster has members.

    Seeds are drawn one by one with probability D(x)² (one candidate a step, as in Arthur and
    Vassilvitskii 2007; paper 1, section 3.2), then Lloyd's rounds until no assignment changes.
    Raises ValueError where there are fewer different points than clusters.

    >>> points = np.array([[0.0, 0.0], [0.0, 1.0], [9.0, 9.0], [9.0, 8.0]])
    >>> cluster = k_means_plus_plus(points, 2, seed=0)
    >>> (cluster == cluster[0]).tolist()
    [True, True, False, False]
    """
    from sklearn.cluster import kmeans_plusplus

    _check_clusters(points, clusters)
    found, _ = kmeans_plusplus(points, clusters, random_state=seed, n_local_trials=1)
    return _lloyd(points, found)


def k_means_from_farthest(
    points: NDArray[np.floating], clusters: int, seed: int
) -> NDArray[np.int32]:
    """Cluster numbers (points,) of points (points, dimensions); every cluster has members.

    The first seed is drawn; every further one is the point farthest from its nearest seed; then
    Lloyd's rounds until no assignment changes (paper 4, section 2).
    Raises ValueError where there are fewer different points than clusters.
    """
    _check_clusters(points, clusters)
    seeds = [int(np.random.default_rng(seed).integers(len(points)))]
    distance = np.full(len(points), np.inf)
    while len(seeds) < clusters:
        from_last = ((points - points[seeds[-1]]) ** 2).sum(axis=1)
        distance = np.minimum(distance, from_last)
        seeds.append(int(distance.argmax()))
    return _lloyd(points, points[seeds])


def _check_clusters(points: NDArray[np.floating], clusters: int) -> None:
    different = len(np.unique(points, axis=0))
    if not 1 <= clusters <= different:
        raise ValueError(
            f"clusters is {clusters}; expected 1 to {different}, the number of different points."
        )


def _lloyd(points: NDArray[np.floating], seeds: NDArray[np.floating]) -> NDArray[np.int32]:
    from sklearn.cluster import KMeans

    lloyd = KMeans(len(seeds), init=seeds, n_init=1, max_iter=_MOST_ROUNDS, tol=0.0)
    labels: NDArray[np.int32] = lloyd.fit_predict(points).astype(np.int32)
    return labels
