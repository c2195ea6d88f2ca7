"""The compact form in memory: packed rows come back, one vertex equals all, equals the codes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.compact import (
    MEMORY_STEP,
    CompactCodes,
    decoded_coordinates,
    shared_vectors,
    sigma_of,
)
from pipelines.ssdf_lighting.compression.compact_memory import (
    cluster_bases,
    column_bits,
    pack,
    pack_rows,
    row_bytes,
    unpack_rows,
    vertex_distances,
)
from pipelines.ssdf_lighting.compression.decoder_tables import decoded_rows, tables_of_packed
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights


def some_codes(seed: int, *, clusters: int = 4, vertices: int = 50, rank: int = 9) -> CompactCodes:
    """Codes as they come: the first columns are the largest; clusters of any size, also empty."""
    random = np.random.default_rng(seed)
    n, step = 8, 0.02
    ranks = random.integers(0, rank + 1, clusters).astype(np.int32)
    cluster = random.integers(0, clusters, vertices).astype(np.int32)
    sizes = np.bincount(cluster, minlength=clusters)
    total = int(ranks.sum())
    fading = 400.0 * 0.5 ** np.arange(rank)

    def codes(size: NDArray[np.float64] | float, *shape: int) -> NDArray[np.int32]:
        return np.rint(random.standard_normal(shape) * size).astype(np.int32)

    weights = [
        codes(fading[:kept], size, kept).ravel() for size, kept in zip(sizes, ranks, strict=True)
    ]
    return CompactCodes(
        step,
        codes(20.0, rank, n * n),
        np.sort(random.integers(12, 40, rank).astype(np.int32))[::-1].copy(),
        codes(fading, clusters, rank),
        codes(fading / 4, total, rank),
        random.integers(0, 30, total).astype(np.int32),
        ranks,
        cluster,
        np.concatenate(weights),
    )


@st.composite
def tables(draw: st.DrawFn) -> NDArray[np.int32]:
    rows, columns = draw(st.integers(0, 6)), draw(st.integers(0, 12))
    limits = [7, 8, 127, 128, 1 << 15, (1 << 15) - 1, (1 << 31) - 1, 0]
    largest = np.array([draw(st.sampled_from(limits)) for _ in range(columns)], np.int64)
    random = np.random.default_rng(draw(st.integers(0, 1000)))
    values = random.integers(-largest - (largest > 0), largest + 1, (rows, columns))
    extremes = random.random((rows, columns)) < 0.3
    ends = np.where(random.random((rows, columns)) < 0.5, -largest - 1, largest)
    return np.where(extremes, ends, values).clip(-(1 << 31), (1 << 31) - 1).astype(np.int32)


@given(tables())
@settings(max_examples=200, deadline=None)
def test_rows_come_back(codes: NDArray[np.int32]) -> None:
    bits = column_bits(codes)
    assert set(bits.tolist()) <= {4, 8, 16, 32}
    rows = pack_rows(codes, bits)
    assert rows.dtype == np.uint8
    assert rows.shape == (len(codes), row_bytes(bits))
    np.testing.assert_array_equal(unpack_rows(rows, bits), codes)


@given(tables())
@settings(max_examples=100, deadline=None)
def test_widths_are_the_least(codes: NDArray[np.int32]) -> None:
    for column, bits in zip(codes.T.astype(np.int64), column_bits(codes), strict=True):
        fits = [
            b for b in (4, 8, 16, 32) if ((column >= -(1 << b - 1)) & (column < 1 << b - 1)).all()
        ]
        assert bits == fits[0]


def test_a_row_is_laid_out_as_described() -> None:
    """32 bits, 16 bits, 8 bits, then halves of bytes, the first in the lower half."""
    codes = np.array([[-2, 300, 5, 70_000, -100, 7]], np.int32)
    bits = np.array([4, 16, 4, 32, 8, 4], np.uint8)
    assert row_bytes(bits) == 9
    row = pack_rows(codes, bits)[0].tobytes()
    expected = (70_000).to_bytes(4, "little") + (300).to_bytes(2, "little")
    assert row == expected + bytes([256 - 100, (5 << 4) | 14, 7])


@pytest.mark.parametrize("seed", range(6))
def test_all_vertices_are_decoded_as_the_codes_say(seed: int) -> None:
    """The shared basis is rounded once more: to half a step over sigma."""
    compact = some_codes(seed)
    found = decoded_rows(tables_of_packed(pack(compact)), np.arange(50))
    coordinate = decoded_coordinates(compact).astype(np.float64)
    exact = coordinate @ shared_vectors(compact) / root_weights(64)
    slack = MEMORY_STEP * compact.step / 2 / sigma_of(compact.shared_level, compact.step)
    limit = (np.abs(coordinate) @ slack)[:, None] / root_weights(64)
    off = np.abs(found - exact)
    assert (off <= limit * 1.001 + 1e-4 * np.abs(exact).max()).all()
    # Rounding is a random walk over the vectors.
    root = np.sqrt((coordinate**2) @ slack**2 / 3)[:, None] / root_weights(64)
    assert math.sqrt(float((off**2).mean() / (root**2).mean())) == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("seed", range(6))
def test_one_vertex_is_decoded_as_all_are(seed: int) -> None:
    compact = some_codes(seed)
    memory = pack(compact)
    bases = cluster_bases(memory)
    together = decoded_rows(tables_of_packed(memory), np.arange(50))
    for vertex in range(50):
        alone = vertex_distances(memory, bases, vertex)
        assert alone.dtype == np.float32
        np.testing.assert_allclose(alone, together[vertex], rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("clusters", [1, 4, 300])
def test_numbers_of_clusters_and_places_take_no_more_than_they_need(clusters: int) -> None:
    memory = pack(some_codes(0, clusters=clusters, vertices=700))
    assert memory.cluster.itemsize == (1 if clusters <= 256 else 2)
    assert memory.nbytes == sum(part.nbytes for part in memory)
    sizes = np.bincount(memory.cluster, minlength=clusters)
    for number in range(clusters):
        places = memory.place[memory.cluster == number]
        np.testing.assert_array_equal(np.sort(places), np.arange(sizes[number]))


def test_without_any_vectors_the_centres_are_left() -> None:
    compact = some_codes(1)
    bare = compact._replace(
        basis=compact.basis[:0],
        level=compact.level[:0],
        ranks=np.zeros_like(compact.ranks),
        weights=compact.weights[:0],
    )
    memory = pack(bare)
    bases = cluster_bases(memory)
    found = decoded_rows(tables_of_packed(memory), np.arange(50))
    np.testing.assert_allclose(found, bases.centres[bare.cluster], rtol=1e-5)
    np.testing.assert_allclose(vertex_distances(memory, bases, 7), found[7], rtol=1e-5)
