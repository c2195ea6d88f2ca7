"""The decoder: both forms, made when it is asked, importing nothing heavy before."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.clustered_pca import clustered_pca
from pipelines.ssdf_lighting.compression.compact_file import compress
from pipelines.ssdf_lighting.compression.decoder import Decoder
from pipelines.ssdf_lighting.compression.decoder_tables import DecoderTables, decoded_rows
from pipelines.ssdf_lighting.compression.lookup import matrix_along
from pipelines.ssdf_lighting.distances.octahedral import texel_directions
from pipelines.ssdf_lighting.distances.signed_distance import distances_to_samples
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights

N, GRID = 16, 12


def floor_by_a_wall() -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """SSDFs of a grid of vertices, nearer and farther from a wall, and its triangles."""
    ways = texel_directions(N)
    far = np.repeat(np.linspace(0.1, 2.0, GRID), GRID)[:, None]
    hidden = (ways[:, 0] > 0) & (ways[:, 2] / np.maximum(ways[:, 0], 1e-9) < 1.0 / far)
    matrix = distances_to_samples((ways[:, 2] > 0) & ~hidden)
    i, j = np.meshgrid(np.arange(GRID - 1), np.arange(GRID - 1), indexing="ij")
    a = (i * GRID + j).ravel()
    quads = np.stack([a, a + 1, a + GRID, a + 1, a + GRID + 1, a + GRID], -1)
    return matrix, quads.reshape(-1, 3)


@pytest.mark.parametrize("rmse", [0.01, 0.05])
def test_a_matrix_through_its_file_has_the_error_asked_for(rmse: float) -> None:
    matrix, triangles = floor_by_a_wall()
    file = compress(matrix, triangles, clusters=8, rmse=rmse)
    assert len(file) < matrix.nbytes / 10
    decoder, vertices = Decoder.of_file(file), np.arange(len(matrix))
    off = (decoder.distances(vertices) - matrix) * root_weights(N * N)
    assert 0.3 * rmse < np.sqrt((off.astype(np.float64) ** 2).mean()) < 1.02 * rmse
    axes = np.random.default_rng(0).normal(size=(len(matrix), 5, 3)).astype(np.float32)
    along = decoder.distances_along(vertices, axes) - matrix_along(matrix, vertices, axes)
    assert np.sqrt((along**2).mean()) < 1.5 * rmse


def test_the_papers_form_decodes_its_tables() -> None:
    matrix, triangles = floor_by_a_wall()
    cluster = (np.arange(len(triangles)) >= len(triangles) // 2).astype(int)
    pca = clustered_pca(lambda rows: matrix[rows], triangles, cluster, contribution=1.0)
    decoder, some = Decoder.of_pca(pca, len(matrix)), np.array([100, 3, 3])
    np.testing.assert_allclose(decoder.distances(some), matrix[some], atol=1e-4)
    np.testing.assert_array_equal(decoder.distances(some), decoded_rows(decoder.tables, some))


def test_tables_are_made_once_and_when_they_are_asked_for() -> None:
    matrix, triangles = floor_by_a_wall()
    calls = []

    def make() -> DecoderTables:
        calls.append(1)
        return Decoder.of_file(compress(matrix, triangles, clusters=4, rmse=0.1)).tables

    decoder = Decoder(make)
    assert not calls
    decoder.distances(np.arange(3))
    decoder.distances_along(np.arange(3), np.ones((3, 1, 3), np.float32))
    assert calls == [1]


def test_a_file_that_is_none_is_refused_when_it_is_read() -> None:
    decoder = Decoder.of_file(b"no such file")
    with pytest.raises(ValueError, match="expected TSUYASDF"):
        decoder.distances(np.arange(1))


def test_a_decoder_is_at_hand_without_the_heavy_libraries() -> None:
    code = (
        "import sys; from pipelines.ssdf_lighting.compression.decoder import Decoder;"
        "Decoder.of_file(b''); print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    heavy = {"numba", "torch", "open3d", "pyvista", "sklearn", "scipy", "dagster", "xarray"}
    assert not heavy & set(done.stdout.split())
