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
    """
    from sklearn.cluster import KMeans, kmeans_plusplus

    different = len(np.unique(points, axis=0))
    if not 1 <= clusters <= different:
        raise ValueError(
            f"clusters is {clusters}; expected 1 to {different}, the number of different points."
        )
    found, _ = kmeans_plusplus(points, clusters, random_state=seed, n_local_trials=1)
    lloyd = KMeans(clusters, init=found, n_init=1, max_iter=_MOST_ROUNDS, tol=0.0)
    labels: NDArray[np.int32] = lloyd.fit_predict(points).astype(np.int32)
    return labels
