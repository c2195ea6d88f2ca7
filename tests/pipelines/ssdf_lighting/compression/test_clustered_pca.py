"""The paper's compression against NumPy's SVD and the theorem of Eckart and Young."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.clustered_pca import (
    ClusteredPca,
    clustered_pca,
    gram_svd,
)
from pipelines.ssdf_lighting.compression.decoder_tables import decoded_rows, tables_of_pca

Matrix = NDArray[np.float32]
Ints = NDArray[np.int32]

GRID, DIRECTIONS = 12, 64


def some_matrix(seed: int = 0) -> Matrix:
    """Rows of a grid of vertices: singular values that fall, a mean that is not 0."""
    random = np.random.default_rng(seed)
    count = GRID * GRID
    left = np.linalg.qr(random.standard_normal((count, 40)))[0]
    right = np.linalg.qr(random.standard_normal((DIRECTIONS, 40)))[0]
    return ((left * 20 * 0.8 ** np.arange(40)) @ right.T + 0.5).astype(np.float32)


def some_triangles() -> tuple[Ints, Ints]:
    """Of the grid, in four clusters, quarters of it."""
    i, j = np.meshgrid(np.arange(GRID - 1), np.arange(GRID - 1), indexing="ij")
    a = (i * GRID + j).ravel()
    quads = np.stack([a, a + 1, a + GRID, a + 1, a + GRID + 1, a + GRID], -1).reshape(-1, 3)
    quarter = (2 * (i >= GRID // 2) + (j >= GRID // 2)).ravel()
    return quads.astype(np.int32), np.repeat(quarter, 2).astype(np.int32)


def compressed(matrix: Matrix, **how: float) -> ClusteredPca:
    triangles, cluster = some_triangles()
    return clustered_pca(lambda rows: matrix[rows], triangles, cluster, **how)  # type: ignore


def blocks(pca: ClusteredPca) -> list[tuple[NDArray[np.int32], Matrix, Matrix]]:
    """Vertices, weights and vectors of each cluster."""
    found, place = [], 0
    for number in range(len(pca.first) - 1):
        vertices = pca.row_vertex[pca.row_first[number] : pca.row_first[number + 1]]
        vectors = pca.vectors[pca.first[number] : pca.first[number + 1]]
        size = len(vertices) * len(vectors)
        found.append(
            (vertices, pca.weights[place : place + size].reshape(len(vertices), -1), vectors)
        )
        place += size
    assert place == len(pca.weights)
    return found


@pytest.mark.parametrize("values", [1, 4, 12])
def test_each_cluster_is_the_best_matrix_of_its_rank(values: int) -> None:
    matrix = some_matrix()
    pca = compressed(matrix, values=values)
    triangles, cluster = some_triangles()
    for number, (vertices, weights, vectors) in enumerate(blocks(pca)):
        np.testing.assert_array_equal(vertices, np.unique(triangles[cluster == number]))
        own = matrix[vertices].astype(np.float64)
        u, sigma, v = np.linalg.svd(own, full_matrices=False)
        best = (u[:, :values] * sigma[:values]) @ v[:values]
        np.testing.assert_allclose(weights @ vectors, best, atol=1e-4)
        np.testing.assert_allclose(vectors @ vectors.T, np.eye(values), atol=1e-5)
        # Eckart, Young: what is lost are the singular values that were dropped.
        lost = np.sqrt((sigma[values:] ** 2).sum() / (sigma**2).sum())
        assert pca.relative_error[number] == pytest.approx(lost, rel=1e-3)
    assert pca.nbytes == 4 * (values * 4 * DIRECTIONS + values * len(pca.row_vertex))


@pytest.mark.parametrize("contribution", [0.3, 0.9, 0.999])
def test_a_contribution_is_reached_by_as_few_as_can_be(contribution: float) -> None:
    matrix = some_matrix(1)
    pca = compressed(matrix, contribution=contribution)
    for vertices, _, vectors in blocks(pca):
        sigma = np.linalg.svd(matrix[vertices].astype(np.float64), compute_uv=False)
        share = np.cumsum(sigma) / sigma.sum()
        assert share[len(vectors) - 1] >= contribution - 1e-6
        assert len(vectors) == 1 or share[len(vectors) - 2] < contribution + 1e-6


def test_the_whole_contribution_and_more_values_than_there_are_keep_everything() -> None:
    matrix = some_matrix(2)
    triangles, _ = some_triangles()
    for pca in (compressed(matrix, contribution=1.0), compressed(matrix, values=500)):
        assert (pca.relative_error < 1e-5).all()
        assert (np.diff(pca.first) <= np.diff(pca.row_first)).all()
        found = decoded_rows(tables_of_pca(pca, len(matrix)), np.arange(len(matrix)))
        np.testing.assert_allclose(found, matrix, atol=1e-4)
    assert len(np.unique(triangles)) == len(matrix)


def test_a_vertex_of_several_clusters_is_decoded_from_the_first() -> None:
    matrix = some_matrix(3)
    pca = compressed(matrix, values=3)
    found = decoded_rows(tables_of_pca(pca, len(matrix)), np.arange(len(matrix)))
    done = np.zeros(len(matrix), bool)
    shared = 0
    for vertices, weights, vectors in blocks(pca):
        new = ~done[vertices]
        shared += int((~new).sum())
        np.testing.assert_allclose(found[vertices[new]], (weights @ vectors)[new], atol=1e-4)
        done[vertices] = True
    assert done.all()
    assert shared > 10


@pytest.mark.parametrize("shape", [(5, 64), (64, 5), (8, 8), (1, 9), (9, 1)])
def test_factors_are_those_of_the_svd(shape: tuple[int, int]) -> None:
    matrix = np.random.default_rng(4).standard_normal(shape).astype(np.float32)
    left, sigma, right = gram_svd(matrix)
    np.testing.assert_allclose(sigma, np.linalg.svd(matrix, compute_uv=False), rtol=1e-4)
    np.testing.assert_allclose((left * sigma) @ right, matrix, atol=1e-4)
    np.testing.assert_allclose(left.T @ left, np.eye(len(sigma)), atol=1e-5)
    np.testing.assert_allclose(right @ right.T, np.eye(len(sigma)), atol=1e-5)


def test_equal_rows_and_rows_of_zeros() -> None:
    row = np.linspace(-1, 1, DIRECTIONS, dtype=np.float32)
    count = GRID * GRID
    for matrix, error in ((np.tile(row, (count, 1)), 1e-6), (np.zeros((count, DIRECTIONS)), 0.0)):
        pca = compressed(matrix.astype(np.float32), values=8)
        np.testing.assert_array_equal(np.diff(pca.first), 1)
        assert (pca.relative_error <= error).all()
        found = decoded_rows(tables_of_pca(pca, count), np.arange(count))
        np.testing.assert_allclose(found, matrix, atol=1e-5)


def test_progress_ends_at_one() -> None:
    triangles, cluster = some_triangles()
    told: list[float] = []
    matrix = some_matrix()
    clustered_pca(lambda rows: matrix[rows], triangles, cluster, values=2, progress=told.append)
    assert told == [0.25, 0.5, 0.75, 1.0]


def test_exactly_one_of_both_rules_is_expected() -> None:
    for how in ({}, {"values": 3, "contribution": 0.5}):
        with pytest.raises(ValueError, match=r"^values, contribution: expected one of them\.$"):
            compressed(some_matrix(), **how)
