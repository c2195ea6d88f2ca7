"""The rivals of the compressed distances: nothing is lost, and they are what they are called."""

from __future__ import annotations

import lzma

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks import ssdf_rivals as rivals
from benchmarks.ssdf_rebuilt import rebuilt_distances
from benchmarks.ssdf_visibility_coding import decode_visibility, encode_visibility
from pipelines.ssdf_lighting.distances.octahedral import solid_angles, texel_directions
from pipelines.ssdf_lighting.distances.signed_distance import distances_to_samples

N, GRID = 16, 14


def caps(n: int = N) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """What a grid of vertices sees past a ball that hangs over it, and its triangles."""
    place = np.linspace(-1.0, 1.0, GRID)
    x, y = np.meshgrid(place, place)
    ball = np.stack([-x.ravel(), -y.ravel(), np.full(x.size, 0.7)], axis=1)
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    ways = texel_directions(n)
    visible = (ball @ ways.T < np.cos(0.6)) & (ways[:, 2] > 0)
    i, j = np.meshgrid(np.arange(GRID - 1), np.arange(GRID - 1), indexing="ij")
    a = (i * GRID + j).ravel()
    quads = np.stack([a, a + 1, a + GRID, a + 1, a + GRID + 1, a + GRID], -1)
    return visible, quads.reshape(-1, 3)


def test_bits_come_back_without_loss_and_in_fewer_bytes_than_of_a_general_coder() -> None:
    visible, triangles = caps(32)
    code = encode_visibility(visible, triangles)
    assert np.array_equal(decode_visibility(code), visible)
    packed = np.packbits(visible, axis=1).tobytes()
    assert len(code) < 0.6 * len(lzma.compress(packed, preset=9))


def test_noise_costs_what_it_holds() -> None:
    random = np.random.default_rng(0)
    _, triangles = caps()
    visible = random.random((GRID * GRID, N * N)) < 0.5
    code = encode_visibility(visible, triangles)
    assert np.array_equal(decode_visibility(code), visible)
    assert 0.99 * visible.size / 8 < len(code) < 1.2 * visible.size / 8


def test_an_altered_code_gives_other_bits() -> None:
    visible, triangles = caps()
    code = bytearray(encode_visibility(visible, triangles))
    code[-len(code) // 4] ^= 64
    assert (decode_visibility(bytes(code)) != visible).sum() > 20


def test_smooth_edges_are_nearer_to_the_truth_than_samples() -> None:
    n = 32
    ways = texel_directions(n)
    middles = np.random.default_rng(1).normal(size=(12, 3))
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    exact = 0.9 - np.arccos(np.clip(middles @ ways.T, -1.0, 1.0))
    errors = [
        np.sqrt(((found - exact) ** 2).mean())
        for found in (rebuilt_distances(exact > 0), distances_to_samples(exact > 0))
    ]
    assert errors[0] < 0.6 * errors[1]
    assert np.array_equal(rebuilt_distances(exact > 0) > 0, exact > 0)


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
