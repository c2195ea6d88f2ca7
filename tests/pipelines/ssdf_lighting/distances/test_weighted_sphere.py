"""Weighting by solid angle: sums of squares become integrals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pipelines.ssdf_lighting.distances.octahedral import texel_directions
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights, weighted_gram


@pytest.mark.parametrize("n", [4, 16, 64])
def test_mean_squares_are_integrals_over_the_sphere(n: int) -> None:
    """Of z, whose square has the mean 1/3; of 1; and of z with x, which has none."""
    weights = root_weights(n * n)
    assert weights.dtype == np.float32
    assert (weights.astype(np.float64) ** 2).mean() == pytest.approx(1, rel=1e-6)
    ways = texel_directions(n) * weights[:, None]
    np.testing.assert_allclose(ways.T @ ways / n**2, np.eye(3) / 3, atol=0.8 / n**2)
    cap = texel_directions(n)[:, 2] > 0.9
    share = float((weights[cap].astype(np.float64) ** 2).sum() / n**2)
    assert n < 64 or share == pytest.approx(0.05, abs=0.003)


def test_gram_matrices_of_blocks_are_that_of_the_whole() -> None:
    matrix = np.random.default_rng(1).standard_normal((50, 36)).astype(np.float32)
    weighted = matrix.astype(np.float64) * root_weights(36)
    found = weighted_gram([matrix[:7], matrix[7:8], matrix[8:]])
    assert found.dtype == np.float64
    np.testing.assert_allclose(found, weighted.T @ weighted, atol=1e-4)
    assert math.isclose(float(np.trace(found)), float((weighted**2).sum()), rel_tol=1e-6)


def test_no_blocks_are_refused() -> None:
    with pytest.raises(ValueError, match="found none; expected at least one"):
        weighted_gram([])
