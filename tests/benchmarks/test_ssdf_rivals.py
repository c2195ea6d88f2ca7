"""The rivals of the compressed distances: nothing is lost, and they are what they are called."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import ssdf_rivals as rivals
from pipelines.ssdf_lighting.distances.octahedral import solid_angles, texel_directions


def test_harmonics_are_orthonormal() -> None:
    n = 64
    basis = rivals.harmonics_of(texel_directions(n))
    gram = basis.T @ (basis * solid_angles(n)[:, None])
    np.testing.assert_allclose(gram, np.eye(basis.shape[1]), atol=0.02)


@pytest.fixture(scope="module")
def judged() -> rivals.Judged:
    """One vertex under an open sky, one under half of it."""
    n = 16
    ways, areas = texel_directions(3 * n), solid_angles(3 * n)
    axis = np.array([[0.6, 0.0, 0.8]])
    falling = np.exp(8.0 * (axis @ ways.T - 1.0)) * areas
    whole = (falling * np.maximum(axis @ ways.T, 0.0)).sum(axis=1)
    normals = np.tile([0.0, 0.0, 1.0], (2, 1))
    free = np.stack([ways[:, 2] > 0, (ways[:, 2] > 0) & (ways[:, 0] < 0)])
    truth = (free * np.maximum(normals @ ways.T, 0.0)) @ falling.T / whole
    shares = np.tile([1.0, 0.0, 0.0], (2, 1))
    corners = np.array([[0, 0, 0], [1, 1, 1]])
    nothing = np.zeros((2, 1))
    return rivals.Judged(
        corners, shares, normals, truth, whole, nothing[..., None], nothing, nothing, nothing, ways,
        falling,
    )  # fmt: skip


def test_bits_are_judged_by_what_they_let_through(judged: rivals.Judged) -> None:
    ways = texel_directions(16)
    upper = ways[:, 2] > 0
    half = upper & (ways[:, 0] < 0)
    right = rivals.bits_db(judged, np.stack([upper, half]))
    assert right > 35
    # Nulls: the same for both, and the wrong half.
    assert rivals.bits_db(judged, np.stack([upper, upper])) < 15
    assert rivals.bits_db(judged, np.stack([upper, upper & ~half])) < 15
