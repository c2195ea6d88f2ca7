"""Distances along directions against NumPy's sums and the octahedral interpolation."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.decoder_tables import (
    DecoderTables,
    decoded_rows,
    make_tables,
)
from pipelines.ssdf_lighting.compression.lookup import decoded_along, matrix_along
from pipelines.ssdf_lighting.distances.octahedral import (
    bilinear_taps,
    directions_of,
    texel_directions,
)

Floats = NDArray[np.float32]

N, VERTICES = 8, 40
RANKS = np.array([3, 0, 7, 1])


def some_tables(seed: int = 0) -> tuple[DecoderTables, Floats]:
    """Tables, and the rows (V, D) that they stand for."""
    random = np.random.default_rng(seed)
    first = np.concatenate([[0], np.cumsum(RANKS)])
    centres = random.standard_normal((4, N * N)).astype(np.float32)
    vectors = random.standard_normal((int(first[-1]), N * N)).astype(np.float32)
    cluster = random.permutation(np.arange(VERTICES) % 4)
    weights, starts, rows = [], [], []
    for vertex in random.permutation(VERTICES):  # weights lie in any order
        own = random.standard_normal(RANKS[cluster[vertex]]).astype(np.float32)
        starts.append((vertex, sum(len(part) for part in weights)))
        weights.append(own)
        some = vectors[first[cluster[vertex]] : first[cluster[vertex] + 1]]
        rows.append((vertex, centres[cluster[vertex]] + own.astype(np.float64) @ some))
    start = np.array([place for _, place in sorted(starts)])
    matrix = np.stack([row for _, row in sorted(rows, key=lambda pair: pair[0])])
    tables = make_tables(centres, vectors, first, cluster, np.concatenate(weights), start)
    return tables, matrix.astype(np.float32)


def some_axes(count: int, lobes: int, seed: int = 0) -> Floats:
    """Random ones, and those on folds and borders of the square and in texels' middles."""
    random = np.random.default_rng(seed)
    axes = random.standard_normal((count, lobes, 3))
    special = np.concatenate([
        np.eye(3), -np.eye(3), texel_directions(N)[:20],
        directions_of([(1.0, 0.3), (-1.0, 0.3), (0.2, 1.0), (0.2, -1.0), (1, 1), (0.5, 0.5)]),
        [(1, 0, -1), (0, 1, -1), (-0.0, 1, -1), (1, -0.0, -0.5), (0, -1, 1)],
    ])  # fmt: skip
    axes[:, 0] = special[np.arange(count) % len(special)]
    axes /= np.linalg.norm(axes, axis=2, keepdims=True)
    return axes.astype(np.float32)


def interpolated(matrix: Floats, vertices: NDArray[np.int64], axes: Floats) -> NDArray[np.float64]:
    found = bilinear_taps(axes.astype(np.float64), N)
    rows = matrix[vertices].astype(np.float64)
    values = np.take_along_axis(rows[:, None, :], found.texels.astype(np.int64), axis=2)
    return (values * found.weights).sum(axis=2)


def test_rows_are_centres_and_weighted_vectors() -> None:
    tables, matrix = some_tables()
    np.testing.assert_allclose(decoded_rows(tables, np.arange(VERTICES)), matrix, atol=1e-5)
    some = np.array([31, 2, 2, 17])
    np.testing.assert_allclose(decoded_rows(tables, some), matrix[some], atol=1e-5)
    assert decoded_rows(tables, some[:0]).shape == (0, N * N)


@pytest.mark.parametrize("seed", range(3))
def test_along_any_direction_rows_are_interpolated(seed: int) -> None:
    tables, matrix = some_tables(seed)
    vertices = np.random.default_rng(seed).integers(0, VERTICES, 200)
    axes = some_axes(200, 6, seed)
    expected = interpolated(matrix, vertices, axes)
    for found in (decoded_along(tables, vertices, axes), matrix_along(matrix, vertices, axes)):
        assert found.dtype == np.float32
        # In single precision: places on the square are off by a ten-millionth.
        np.testing.assert_allclose(found, expected, atol=1e-4)


def test_texels_middles_are_read_as_they_are() -> None:
    tables, matrix = some_tables()
    vertices = np.arange(VERTICES)
    axes = np.repeat(texel_directions(N)[None].astype(np.float32), VERTICES, axis=0)
    np.testing.assert_allclose(decoded_along(tables, vertices, axes), matrix, atol=2e-4)


def test_axes_of_zeros_ask_for_nothing_and_get_something() -> None:
    tables, matrix = some_tables()
    nothing = np.zeros((3, 2, 3), np.float32)
    for found in (
        decoded_along(tables, np.arange(3), nothing),
        matrix_along(matrix, np.arange(3), nothing),
    ):
        assert np.isfinite(found).all()


def test_no_vertices_and_no_directions() -> None:
    tables, _ = some_tables()
    assert decoded_along(tables, np.arange(0), np.zeros((0, 2, 3), np.float32)).shape == (0, 2)
    assert decoded_along(tables, np.arange(4), np.zeros((4, 0, 3), np.float32)).shape == (4, 0)
