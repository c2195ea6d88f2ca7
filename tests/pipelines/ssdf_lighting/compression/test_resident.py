"""What stays while a scene is drawn: the file's distances in few bytes, and nothing beside them."""

from __future__ import annotations

import functools
import gc
import weakref

import numpy as np
import pytest

from pipelines.ssdf_lighting.compression import resident
from pipelines.ssdf_lighting.compression.compact import decoded_coordinates, shared_vectors
from pipelines.ssdf_lighting.compression.compact_file import compress, from_bytes
from pipelines.ssdf_lighting.compression.decoder import Decoder
from pipelines.ssdf_lighting.compression.lookup import resident_along
from pipelines.ssdf_lighting.distances.octahedral import (
    bilinear_taps,
    solid_angles,
    texel_directions,
)
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights
from tests.pipelines.ssdf_lighting.compression.test_decoder import N, floor_by_a_wall


@pytest.fixture(scope="module")
def file() -> bytes:
    matrix, triangles = floor_by_a_wall()
    return compress(matrix, triangles, clusters=8, rmse=0.02)


def test_halving_is_the_least_squares_solution() -> None:
    rows = np.random.default_rng(0).standard_normal((5, N * N)).astype(np.float32)
    found = resident.resampled(rows, N // 2)
    taps = bilinear_taps(texel_directions(N), N // 2)
    matrix = np.zeros((N * N, (N // 2) ** 2))
    np.add.at(matrix, (np.arange(N * N)[:, None], taps.texels), taps.weights)
    root = np.sqrt(solid_angles(N))[:, None]
    expected = np.linalg.lstsq(root * matrix, (root * rows.T), rcond=None)[0].T
    assert np.abs(found - expected).max() < 2e-3
    # A null: samples of the rows are not that.
    sampled = rows[:, taps.texels[: (N // 2) ** 2, 0]]
    assert np.abs(sampled - expected).max() > 0.1


def rows_of(tables: resident.ResidentTables, vertex: int) -> np.ndarray:
    """d at all places of half the resolution, read column by column."""
    own, places = tables.cluster[vertex], tables.resolution**2
    wide, middle, narrow = (int(count) for count in tables.counts[own])
    pairs = -(-narrow // 2)
    starts = [int(start) for start in tables.starts[own]]
    words = tables.words[starts[0] :][: places * wide].reshape(places, wide)
    whole = tables.bytes[starts[1] :][: places * middle].reshape(places, middle)
    packed = tables.nibbles[starts[2] :][: places * pairs].reshape(places, pairs)
    halves = np.stack([packed & 15, packed >> 4], axis=-1).reshape(places, -1)[:, :narrow]
    codes = np.concatenate([words, whole, halves.astype(int) - 8], axis=1).astype(np.float64)
    count = codes.shape[1]
    scale = tables.scale[tables.scale_start[own] :][:count]
    weights = tables.weights[tables.weight_start[vertex] :][: count - 1]
    return codes @ (scale * np.append(1.0, weights))


def test_columns_stay_near_what_the_file_says(file: bytes) -> None:
    tables = resident.resident_tables(from_bytes(file))
    codes = from_bytes(file)
    expected = decoded_coordinates(codes) @ shared_vectors(codes) / root_weights(N * N)
    found = np.stack([rows_of(tables, vertex) for vertex in range(len(expected))])
    columns = tables.counts.sum(axis=1).max()
    off = np.sqrt(((found - expected) ** 2).mean())
    assert off < resident._ROUNDING * np.sqrt(columns)
    assert np.sqrt(((found[1:] - expected[:-1]) ** 2).mean()) > 5 * off


def test_a_lookup_interpolates_the_columns(file: bytes) -> None:
    tables = resident.resident_tables(from_bytes(file))
    random = np.random.default_rng(1)
    vertices = random.integers(0, len(tables.cluster), 60)
    axes = random.standard_normal((60, 7, 3))
    axes = (axes / np.linalg.norm(axes, axis=2, keepdims=True)).astype(np.float32)
    found = resident_along(tables, vertices, axes)
    taps = bilinear_taps(axes, tables.resolution)
    for row, vertex in enumerate(vertices):
        expected = (rows_of(tables, vertex)[taps.texels[row]] * taps.weights[row]).sum(axis=1)
        np.testing.assert_allclose(found[row], expected, atol=1e-4)


def test_nothing_else_is_held_while_drawing(file: bytes) -> None:
    decoder = Decoder.of_file(file)
    stated, gone = decoder.resident_bytes, weakref.ref(decoder)
    along = decoder.distances_along
    assert "tables" not in vars(decoder)
    del decoder
    gc.collect()
    assert gone() is None  # and its file with it
    along(np.arange(9), np.ones((9, 4, 3), np.float32))
    assert isinstance(along, functools.partial)
    assert not along.keywords
    (held,) = along.args
    arrays = [part for part in held if isinstance(part, np.ndarray)]
    assert {type(part) for part in held if not isinstance(part, np.ndarray)} == {int}
    # Bytes of the memory behind them, not of a view on more.
    memory = [part if part.base is None else part.base for part in arrays]
    assert sum(whole.nbytes for whole in memory) == stated
    # A null: unfolded to floats they are more.
    tables = Decoder.of_file(file).tables
    assert tables.table.nbytes + tables.weights.nbytes > 1.5 * stated


def test_odd_numbers_of_narrow_columns_are_padded_by_nothing() -> None:
    random = np.random.default_rng(0)
    rows = random.standard_normal((4, 16)).astype(np.float32)
    rows[1:] *= 1e-3
    made = resident._columns(rows, random.standard_normal((6, 3)))
    assert made.counts == (1, 0, 3)
    assert made.codes[2].shape == (16, 2)
    assert set(made.codes[2][:, 1] >> 4) == {8}
