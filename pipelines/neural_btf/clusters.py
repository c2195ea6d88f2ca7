"""Texels that share their latents: k-means++ on the principal components (section 3.1)."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.clustering import k_means_plus_plus
from pipelines.neural_btf.abrdf import PhotographBlocks, transposed
from pipelines.neural_btf.decoder_arrays import LATENTS
from pipelines.neural_btf.representatives import (
    Representative,
    cluster_means,
    cluster_medians,
    cluster_medoids,
    cluster_members,
)


class AbrdfClusters(NamedTuple):
    """M texels in k clusters."""

    ids: NDArray[np.int32]
    """(M,) cluster of every texel."""
    sizes: NDArray[np.int64]
    """(k,) members of every cluster."""
    representatives: NDArray[np.float32] | None
    """(k, N, 3) what the encoder sees of every cluster; None: every texel is its own cluster."""
    start: NDArray[np.float32]
    """(k, 8) where fast training starts the latents."""


def warm_start(scores: NDArray[np.floating], count: int = LATENTS) -> NDArray[np.float32]:
    """Latents (k, count) from principal components (k, r): the first ones, each with deviation 1.

    Where there are fewer components, or one is the same everywhere, latents are 0.

    >>> warm_start(np.array([[3.0], [5.0]]))[:, :2].tolist()
    [[-1.0, 0.0], [1.0, 0.0]]
    """
    latents = np.zeros((len(scores), count), np.float32)
    used = scores[:, :count].astype(np.float64)
    deviation = used.std(axis=0)
    varies = deviation > 1e-9 * max(float(deviation.max(initial=0.0)), 1e-30)
    centred = used - used.mean(axis=0)
    latents[:, : used.shape[1]] = np.where(varies, centred / np.where(varies, deviation, 1.0), 0.0)
    return latents


def single_texel_clusters(scores: NDArray[np.floating]) -> AbrdfClusters:
    """Every texel for itself, k = M; scores (texel, component)."""
    texels = len(scores)
    ids = np.arange(texels, dtype=np.int32)
    return AbrdfClusters(ids, np.ones(texels, np.int64), None, warm_start(scores))


def cluster_abrdfs(
    photographs: PhotographBlocks,
    scores: NDArray[np.floating],
    clusters: int,
    *,
    representative: Representative = "median",
    seed: int = 0,
    progress: Callable[[float], None] = lambda fraction: None,
) -> AbrdfClusters:
    """Cluster texels by their scores (texel, component), and take the clusters' representatives.

    Raises ValueError where there are fewer different texels than clusters.
    """
    ids = k_means_plus_plus(scores, clusters, seed)
    progress(0.3)
    members = cluster_members(ids, clusters)
    chosen = cluster_medoids(scores, members) if representative == "medoid" else None
    parts: list[NDArray[np.float32]] = []
    done = 0
    for block in photographs:
        abrdfs = transposed(block.astype(np.float32))
        columns = abrdfs.reshape(len(abrdfs), -1)
        if chosen is not None:
            found = columns[chosen]
        elif representative == "median":
            found = cluster_medians(columns, members)
        else:
            found = cluster_means(columns, members)
        parts.append(found.reshape(clusters, len(block), -1))
        done += len(block)
        progress(0.3 + 0.7 * done / photographs.images)
    centres = cluster_means(scores, members)
    values = np.concatenate(parts, axis=1)
    return AbrdfClusters(ids, members.sizes, values, warm_start(centres))
