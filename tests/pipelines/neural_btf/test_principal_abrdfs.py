"""Statistics and principal components of ABRDFs in blocks against those of the whole matrix."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.neural_btf.abrdf import (
    AbrdfSpace,
    PhotographBlocks,
    abrdf_columns,
    image_statistics,
)
from pipelines.neural_btf.principal_abrdfs import summarise_abrdfs


@pytest.fixture(scope="module")
def photographs() -> NDArray[np.float16]:
    random = np.random.default_rng(0)
    texels = random.gamma(1.0, 0.5, (20, 3)) @ random.gamma(1.0, 0.5, (3, 9 * 3))
    images = texels.reshape(4, 5, 9, 3).transpose(2, 0, 1, 3)
    return (images + 0.01 * random.random(images.shape)).astype(np.float16)


@pytest.mark.parametrize("space", ["log", "standardised", "linear"])
def test_blocks_give_what_the_whole_matrix_gives(
    photographs: NDArray[np.float16], space: AbrdfSpace
) -> None:
    told: list[float] = []
    blocks = PhotographBlocks(9, lambda: [photographs[:2], photographs[2:7], photographs[7:]])
    found = summarise_abrdfs(blocks, components=6, space=space, progress=told.append)
    for part, expected in zip(found.statistics, image_statistics(photographs), strict=True):
        np.testing.assert_array_equal(part, expected)
    assert found.alpha == photographs.max()
    matrix = abrdf_columns(photographs, space).astype(np.float64)
    matrix -= matrix.mean(axis=0)
    assert found.total_variation == pytest.approx(np.sum(matrix**2), rel=1e-5)
    lengths = np.linalg.svd(matrix, compute_uv=False)
    assert found.scores.shape == (20, 6)
    np.testing.assert_allclose(found.singular_values[:3], lengths[:3], rtol=1e-2)
    np.testing.assert_allclose(told, [0.3 * 2 / 9, 0.3 * 7 / 9, 0.3, 0.9])


def test_there_are_never_more_components_than_texels_or_columns() -> None:
    few_texels = np.random.default_rng(1).random((9, 2, 3, 3))
    assert summarise_abrdfs(PhotographBlocks.of_array(few_texels)).scores.shape == (6, 6)
    few_images = np.random.default_rng(1).random((2, 5, 4, 3))
    assert summarise_abrdfs(PhotographBlocks.of_array(few_images)).scores.shape == (20, 6)
