"""Clusters of texels and their representatives against NumPy, whatever the blocks."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.neural_btf.abrdf import PhotographBlocks, abrdf_columns, transposed
from pipelines.neural_btf.clusters import cluster_abrdfs, single_texel_clusters, warm_start
from pipelines.neural_btf.decoder_arrays import LATENTS
from pipelines.neural_btf.representatives import Representative

HEIGHT, WIDTH, IMAGES, CLUSTERS = 6, 7, 11, 4


@pytest.fixture(scope="module")
def photographs() -> NDArray[np.float16]:
    """Four kinds of texels, a little uneven."""
    random = np.random.default_rng(0)
    kinds = random.gamma(1.0, 1.0, (CLUSTERS, IMAGES, 3))
    texels = kinds[random.integers(0, CLUSTERS, HEIGHT * WIDTH)]
    texels = texels * (1 + 0.05 * random.standard_normal(texels.shape))
    images = texels.transpose(1, 0, 2).reshape(IMAGES, HEIGHT, WIDTH, 3)
    return images.astype(np.float16)


@pytest.mark.parametrize("representative", ["median", "mean", "medoid"])
@pytest.mark.parametrize("cut", [1, 5])
def test_representatives_are_those_of_the_members_whatever_the_blocks(
    photographs: NDArray[np.float16], representative: Representative, cut: int
) -> None:
    told: list[float] = []
    blocks = PhotographBlocks(IMAGES, lambda: [photographs[:cut], photographs[cut:]])
    scores = abrdf_columns(photographs, "log")
    found = cluster_abrdfs(
        blocks, scores, CLUSTERS, representative=representative, progress=told.append
    )
    assert (found.ids.shape, found.ids.dtype) == ((HEIGHT * WIDTH,), np.int32)
    np.testing.assert_array_equal(found.sizes, np.bincount(found.ids, minlength=CLUSTERS))
    assert found.representatives is not None
    assert found.representatives.shape == (CLUSTERS, IMAGES, 3)
    assert found.representatives.dtype == np.float32
    abrdfs = transposed(photographs).astype(np.float32)
    for cluster in range(CLUSTERS):
        inside = abrdfs[found.ids == cluster]
        if representative == "medoid":
            points = scores[found.ids == cluster]
            sums = np.linalg.norm(points[:, None] - points[None], axis=-1).sum(axis=1)
            expected = inside[sums.argmin()]
        else:
            expected = {"median": np.median, "mean": np.mean}[representative](inside, axis=0)
        np.testing.assert_allclose(found.representatives[cluster], expected, rtol=1e-5)
    assert told[-1] == 1.0
    assert sorted(told) == told


def test_latents_of_clusters_start_at_the_means_of_their_components(
    photographs: NDArray[np.float16],
) -> None:
    scores = abrdf_columns(photographs, "log")
    found = cluster_abrdfs(PhotographBlocks.of_array(photographs), scores, CLUSTERS, seed=3)
    means = np.stack([scores[found.ids == one].mean(axis=0) for one in range(CLUSTERS)])
    np.testing.assert_allclose(found.start, warm_start(means), atol=1e-4)


def test_too_many_clusters_are_refused(photographs: NDArray[np.float16]) -> None:
    blocks = PhotographBlocks.of_array(photographs)
    with pytest.raises(ValueError, match="clusters is 43; expected 1 to 42"):
        cluster_abrdfs(blocks, abrdf_columns(photographs, "log"), 43)


def test_every_texel_can_be_a_cluster_of_its_own() -> None:
    scores = np.random.default_rng(1).standard_normal((9, 12))
    found = single_texel_clusters(scores)
    np.testing.assert_array_equal(found.ids, np.arange(9))
    assert (found.ids.dtype, found.sizes.dtype) == (np.int32, np.int64)
    assert found.sizes.tolist() == [1] * 9
    assert found.representatives is None
    np.testing.assert_array_equal(found.start, warm_start(scores))


# ---- warm start ------------------------------------------------------------------------------


def test_a_warm_start_is_the_first_8_components_with_mean_0_and_deviation_1() -> None:
    scores = np.random.default_rng(0).standard_normal((50, 11)) * 3.0 ** -np.arange(11) + 4
    latents = warm_start(scores)
    assert (latents.shape, latents.dtype) == ((50, LATENTS), np.float32)
    np.testing.assert_allclose(latents.mean(axis=0), 0, atol=1e-6)
    np.testing.assert_allclose(latents.std(axis=0), 1, rtol=1e-6)
    for one in range(LATENTS):
        assert np.corrcoef(latents[:, one], scores[:, one])[0, 1] == pytest.approx(1)


def test_components_that_are_missing_or_constant_start_at_0() -> None:
    scores = np.random.default_rng(1).standard_normal((20, 4))
    scores[:, 2] = 0.7
    latents = warm_start(scores)
    deviation = latents.std(axis=0)
    np.testing.assert_allclose(deviation[[0, 1, 3]], 1, rtol=1e-6)
    np.testing.assert_array_equal(latents[:, [2, 4, 5, 6, 7]], 0)


def test_one_latent_vector_starts_at_0() -> None:
    np.testing.assert_array_equal(warm_start(np.array([[3.0, 1.0, 2.0]])), np.zeros((1, LATENTS)))
