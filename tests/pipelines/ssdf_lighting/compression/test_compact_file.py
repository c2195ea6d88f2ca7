"""The compact file: every code comes back, and damage is told."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipelines.ssdf_lighting.compression.compact import CompactCodes
from pipelines.ssdf_lighting.compression.compact_file import MAGIC, from_bytes, to_bytes


def some_codes(
    seed: int,
    *,
    n: int = 4,
    rank: int = 5,
    clusters: int = 3,
    vertices: int = 40,
    largest: float = 30.0,
) -> CompactCodes:
    """Codes that need not mean anything, of heavy tails; clusters of any size, also empty."""
    random = np.random.default_rng(seed)

    def codes(*shape: int) -> np.ndarray:
        return (
            np.rint(random.standard_t(1.5, shape) * largest / 10).clip(-1e9, 1e9).astype(np.int32)
        )

    ranks = random.integers(0, rank + 1, clusters).astype(np.int32)
    cluster = random.integers(0, clusters, vertices).astype(np.int32)
    sizes = np.bincount(cluster, minlength=clusters)
    return CompactCodes(
        float(random.uniform(1e-4, 1.0)),
        codes(rank, n * n),
        random.integers(0, 90, rank).astype(np.int32),
        codes(clusters, rank),
        codes(int(ranks.sum()), rank),
        random.integers(0, 90, int(ranks.sum())).astype(np.int32),
        ranks,
        cluster,
        codes(int((ranks * sizes).sum())),
    )


def assert_same(one: CompactCodes, other: CompactCodes) -> None:
    for name, a, b in zip(CompactCodes._fields, one, other, strict=True):
        np.testing.assert_array_equal(a, b, err_msg=name)
        assert np.asarray(a).dtype == np.asarray(b).dtype, name
        assert np.shape(a) == np.shape(b), name


@given(
    st.integers(0, 10_000),
    st.sampled_from([4, 6, 16]),
    st.integers(0, 9),
    st.integers(1, 9),
    st.integers(1, 60),
    st.sampled_from([0.0, 3.0, 1e3, 1e8]),
)
@settings(max_examples=80, deadline=None)
def test_codes_come_back_from_the_file(
    seed: int, n: int, rank: int, clusters: int, vertices: int, largest: float
) -> None:
    compact = some_codes(
        seed, n=n, rank=rank, clusters=clusters, vertices=vertices, largest=largest
    )
    data = to_bytes(compact)
    assert data == to_bytes(compact)
    assert_same(from_bytes(data), compact)


def test_numbers_that_are_mostly_zero_cost_next_to_nothing() -> None:
    compact = some_codes(1, n=16, rank=40, vertices=2000, largest=0.0)
    entries = compact.shared.size + compact.centre.size + compact.basis.size + compact.weights.size
    assert entries > 20_000
    assert len(to_bytes(compact)) < 0.12 * entries


def test_the_layout_is_as_described() -> None:
    compact = some_codes(3)
    data = to_bytes(compact)
    header = struct.unpack_from("<8sHHdIIIII", data)
    assert header == (
        MAGIC, 1, 4, compact.step, 5, 3, len(compact.level), 40, len(compact.weights)
    )  # fmt: skip


def test_other_files_are_refused() -> None:
    data = to_bytes(some_codes(0))
    for other in (b"", b"TSUYASDF", b"PNG" + data[3:], data[:40]):
        with pytest.raises(ValueError, match="expected TSUYASDF"):
            from_bytes(other)
    with pytest.raises(ValueError, match=r"^the file's version is 2; expected 1\.$"):
        from_bytes(data[:8] + struct.pack("<H", 2) + data[10:])


@pytest.mark.parametrize("seed", range(3))
def test_every_file_that_ends_too_early_is_refused(seed: int) -> None:
    data = to_bytes(some_codes(seed))
    for length in range(len(data)):
        with pytest.raises(ValueError, match=r"expected|damaged"):
            from_bytes(data[:length])


@given(st.integers(0, 1_000_000), st.integers(0, 7), st.integers(0, 3))
@settings(max_examples=300, deadline=None)
def test_damaged_files_are_refused_or_read_as_something_whole(
    place: int, bit: int, seed: int
) -> None:
    """There is no checksum; whatever is read fits together."""
    data = bytearray(to_bytes(some_codes(seed)))
    data[place % len(data)] ^= 1 << bit
    try:
        found = from_bytes(bytes(data))
    except ValueError:
        return
    assert_whole(found)


@pytest.mark.parametrize("place", range(8, 44))
def test_damaged_headers_are_refused_or_read_as_something_whole(place: int) -> None:
    """Among them are counts of billions and a step that is not a number."""
    for value in (0, 1, 127, 128, 255):
        data = bytearray(to_bytes(some_codes(2)))
        data[place] = value
        try:
            found = from_bytes(bytes(data))
        except ValueError:
            continue
        assert_whole(found)


def assert_whole(found: CompactCodes) -> None:
    assert 0 < found.step < np.inf
    assert found.resolution >= 4
    rank, total = len(found.shared), len(found.level)
    assert found.shared_level.shape == (rank,)
    assert found.centre.shape == (len(found.ranks), rank)
    assert found.basis.shape == (total, rank)
    assert found.ranks.sum() == total
    assert (found.ranks >= 0).all()
    assert ((found.cluster >= 0) & (found.cluster < len(found.ranks))).all()
    assert (found.ranks * found.sizes).sum() == len(found.weights)
