"""What is fitted: target ABRDFs, the latent vectors they belong to, and what scales them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.neural_btf.abrdf_pool import AbrdfPool, mean_abrdfs
from pipelines.neural_btf.clusters import AbrdfClusters
from pipelines.neural_btf.training.plan import TrainingPlan


class TrainingTargets(NamedTuple):
    """ABRDFs that the decoder is to give: every texel's, or one a cluster."""

    pool: AbrdfPool
    owner: NDArray[np.int64]
    """(row,) which latent vector belongs to a row of the pool."""
    weights: NDArray[np.float64]
    """(row,) how many texels a row stands for."""


class AbrdfScale(NamedTuple):
    """What turns ABRDFs of N photographs into the networks' values."""

    mean: NDArray[np.float32]
    deviation: NDArray[np.float32]
    """(N, 3) mu and sigma of Eq. 2 and 3, for the encoder."""
    alpha: float
    """Largest value (Eq. 5): the decoder gives values over alpha."""


@dataclass(frozen=True)
class TrainingData:
    """What is fitted. N photographs, k latent vectors."""

    targets: TrainingTargets
    representatives: NDArray[np.floating] | None
    """(k, N, 3) what the encoder sees of each cluster; None: the targets themselves."""
    scale: AbrdfScale
    directions: NDArray[np.float32]
    """(N, 4) the decoder's inputs."""
    start: NDArray[np.float32]
    """(k, 8) the warm start `pca`."""
    ids: NDArray[np.integer]
    """(M,) which latent vector each texel has."""
    size: tuple[int, int]
    """Rows and columns of texels."""

    @property
    def latent_count(self) -> int:
        """k, the number of latent vectors."""
        return len(self.start)

    @property
    def is_textured(self) -> bool:
        """Whether every texel has latents of its own, so that they are a texture."""
        return len(self.start) == self.size[0] * self.size[1]


def training_targets(
    pool: AbrdfPool, clusters: AbrdfClusters, plan: TrainingPlan
) -> TrainingTargets:
    """Target ABRDFs of all texels in a pool and their clusters.

    `fast` fits the clusters' means, `paper` every texel or the representatives, as the plan says.
    """
    representatives = clusters.representatives
    one_a_cluster = np.arange(len(clusters.sizes)), clusters.sizes.astype(np.float64)
    if representatives is not None and plan.training == "fast":
        means = mean_abrdfs(pool, clusters.ids, len(clusters.sizes))
        return TrainingTargets(AbrdfPool.of_array(means), *one_a_cluster)
    if representatives is not None and plan.targets == "representatives":
        values = representatives.astype(np.float16)
        return TrainingTargets(AbrdfPool.of_array(values), *one_a_cluster)
    return TrainingTargets(pool, clusters.ids.astype(np.int64), np.ones(pool.rows))


def training_data(
    pool: AbrdfPool,
    clusters: AbrdfClusters,
    scale: AbrdfScale,
    directions: NDArray[np.float32],
    size: tuple[int, int],
    plan: TrainingPlan,
) -> TrainingData:
    """All that a plan needs of a BTF of ``size`` (rows, columns).

    The pool has the ABRDFs of all texels; directions (N, 4) are `decoder_arrays.direction_inputs`.
    """
    return TrainingData(
        training_targets(pool, clusters, plan),
        clusters.representatives,
        scale,
        directions,
        clusters.start,
        clusters.ids,
        size,
    )
