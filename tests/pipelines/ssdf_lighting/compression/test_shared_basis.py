"""The scene's own basis against NumPy's SVD of the whole matrix."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.shared_basis import shared_basis
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights

ROWS, DIRECTIONS = 90, 64


def fading_matrix() -> NDArray[np.float32]:
    random = np.random.default_rng(0)
    left = np.linalg.qr(random.standard_normal((ROWS, 30)))[0]
    right = np.linalg.qr(random.standard_normal((DIRECTIONS, 30)))[0]
    return ((left * 30 * 0.7 ** np.arange(30)) @ right.T).astype(np.float32)


@pytest.mark.parametrize("rmse", [0.3, 0.03, 0.003])
def test_the_fewest_vectors_whose_error_is_allowed(rmse: float) -> None:
    matrix, told = fading_matrix(), list[float]()

    def blocks() -> Iterator[NDArray[np.float32]]:
        yield from np.split(matrix, [40, 41])

    found = shared_basis(blocks, matrix.shape, rmse, told.append)
    weighted = matrix.astype(np.float64) * root_weights(DIRECTIONS)
    sigma = np.linalg.svd(weighted, compute_uv=False)
    kept = len(found.sigma)
    np.testing.assert_allclose(found.sigma, sigma[:kept], rtol=1e-4)
    np.testing.assert_allclose(found.vectors.T @ found.vectors, np.eye(kept), atol=1e-5)
    np.testing.assert_allclose(found.coordinates, weighted @ found.vectors, atol=1e-4)
    lost = ((weighted - found.coordinates @ found.vectors.T) ** 2).sum()
    assert found.lost == pytest.approx(lost, rel=0.05, abs=1e-6 * matrix.size)
    assert lost <= 1.05 * rmse**2 * matrix.size
    assert (sigma[kept - 1 :] ** 2).sum() > rmse**2 * matrix.size
    assert told == sorted(told)
    assert told[-1] == 1.0
