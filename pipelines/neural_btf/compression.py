"""Photographs in memory to a compressed BTF, by one call."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs
from pipelines.neural_btf.abrdf import PhotographBlocks, check_values, transposed
from pipelines.neural_btf.abrdf_pool import AbrdfPool
from pipelines.neural_btf.clusters import cluster_abrdfs, single_texel_clusters
from pipelines.neural_btf.compressed import CompressedBtf, compressed_btf
from pipelines.neural_btf.decoder_arrays import direction_inputs
from pipelines.neural_btf.network import decoder_arrays
from pipelines.neural_btf.principal_abrdfs import summarise_abrdfs
from pipelines.neural_btf.training.data import AbrdfScale, training_data
from pipelines.neural_btf.training.plan import TrainingPlan
from pipelines.neural_btf.training.trainer import train


def compress_photographs(
    images: NDArray[np.floating],
    pairs: Pairs,
    *,
    clusters: int | None = None,
    plan: TrainingPlan | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
) -> CompressedBtf:
    """Compress photographs (image, y, x, 3) of linear radiance, taken under pairs of directions.

    ``clusters``: texels of one share their latents; None: every texel has its own. ``plan``: by
    default 250 steps of fast training. Values are rounded to half floats. Raises ValueError for
    values that are not finite, at or below -1, or too large, and for more clusters than texels.

    >>> from pipelines.light.directions import all_pairs, hemisphere_table
    >>> pairs = all_pairs(hemisphere_table(15), hemisphere_table(15))
    >>> grey = np.random.default_rng(0).random((6, 8, 1)) * np.ones(3)
    >>> images = grey * np.cos(pairs.light[:, 0])[:, None, None, None]  # Lambertian
    >>> btf = compress_photographs(images, pairs, plan=TrainingPlan(steps=5))
    >>> btf.latents.shape, btf.photographs(pairs).shape
    ((48, 8), (225, 6, 8, 3))
    """
    check_values(images)
    halves = images.astype(np.float16)
    photographs = PhotographBlocks.of_array(halves)
    summary = summarise_abrdfs(photographs)
    found = (
        single_texel_clusters(summary.scores)
        if clusters is None
        else cluster_abrdfs(photographs, summary.scores, clusters)
    )
    plan = plan or TrainingPlan()
    data = training_data(
        AbrdfPool.of_array(transposed(halves)),
        found,
        AbrdfScale(summary.statistics.mean, summary.statistics.deviation, summary.alpha),
        direction_inputs(pairs),
        (images.shape[1], images.shape[2]),
        plan,
    )
    trained = train(data, plan, progress=progress)
    return compressed_btf(
        decoder_arrays(trained.decoder),
        trained.latents,
        found.ids,
        summary.alpha,
        images.shape[1:3],
        trained.parallax,
    )
