"""Which ABRDFs are fitted, for every kind of training."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.neural_btf.abrdf_pool import AbrdfPool
from pipelines.neural_btf.clusters import AbrdfClusters, single_texel_clusters
from pipelines.neural_btf.training.data import AbrdfScale, training_data, training_targets
from pipelines.neural_btf.training.plan import TrainingPlan

IMAGES = 5
ABRDFS = np.random.default_rng(0).random((12, IMAGES, 3)).astype(np.float16)
IDS = np.array([0, 1, 1, 2, 0, 2, 2, 1, 0, 2, 2, 2], np.int32)
CLUSTERED = AbrdfClusters(
    IDS,
    np.bincount(IDS),
    np.random.default_rng(1).random((3, IMAGES, 3)).astype(np.float32),
    np.zeros((3, 8), np.float32),
)
SINGLE = single_texel_clusters(np.random.default_rng(2).standard_normal((12, 8)))


@pytest.mark.parametrize("plan", [TrainingPlan(), TrainingPlan("paper", targets="representatives")])
def test_without_clusters_every_texel_is_fitted_with_its_own_latents(plan: TrainingPlan) -> None:
    pool = AbrdfPool.of_array(ABRDFS)
    found = training_targets(pool, SINGLE, plan)
    assert found.pool is pool
    np.testing.assert_array_equal(found.owner, np.arange(12))
    np.testing.assert_array_equal(found.weights, np.ones(12))


def test_fast_training_fits_the_means_weighted_by_the_members() -> None:
    found = training_targets(AbrdfPool.of_array(ABRDFS), CLUSTERED, TrainingPlan())
    means = np.stack([ABRDFS[one == IDS].mean(axis=0, dtype=np.float64) for one in range(3)])
    np.testing.assert_allclose(found.pool.part(0)[1], means, atol=1e-3)
    np.testing.assert_array_equal(found.owner, [0, 1, 2])
    np.testing.assert_array_equal(found.weights, [3, 3, 6])


def test_the_papers_training_fits_all_texels_or_the_representatives() -> None:
    pool = AbrdfPool.of_array(ABRDFS)
    texels = training_targets(pool, CLUSTERED, TrainingPlan("paper"))
    assert texels.pool is pool
    np.testing.assert_array_equal(texels.owner, IDS)
    np.testing.assert_array_equal(texels.weights, np.ones(12))
    given = training_targets(pool, CLUSTERED, TrainingPlan("paper", targets="representatives"))
    assert CLUSTERED.representatives is not None
    np.testing.assert_allclose(given.pool.part(0)[1], CLUSTERED.representatives, atol=1e-3)
    np.testing.assert_array_equal(given.owner, [0, 1, 2])
    np.testing.assert_array_equal(given.weights, [3, 3, 6])


def test_the_encoder_sees_representatives_whatever_is_fitted() -> None:
    scale = AbrdfScale(np.zeros((IMAGES, 3), np.float32), np.ones((IMAGES, 3), np.float32), 1.0)
    directions = np.zeros((IMAGES, 4), np.float32)
    pool = AbrdfPool.of_array(ABRDFS)
    for plan in (TrainingPlan(), TrainingPlan("paper")):
        data = training_data(pool, CLUSTERED, scale, directions, (3, 4), plan)
        assert data.representatives is CLUSTERED.representatives
        assert data.latent_count == 3
    assert (
        training_data(pool, SINGLE, scale, directions, (3, 4), TrainingPlan()).representatives
        is None
    )
