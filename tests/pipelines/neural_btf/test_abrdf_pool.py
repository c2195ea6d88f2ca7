"""The pool of ABRDFs: every row has its turn, with its own values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.neural_btf.abrdf_pool import AbrdfPool, AbrdfReader, mean_abrdfs

IMAGES = 4


def matrix_of(rows: int) -> NDArray[np.float16]:
    random = np.random.default_rng(rows)
    return random.standard_normal((rows, IMAGES, 3)).astype(np.float16)


class Watched:
    """Reads a matrix and notes what was asked for."""

    def __init__(self, values: NDArray[np.float16]) -> None:
        self.values = values
        self.asked: list[tuple[int, int]] = []

    def __call__(self, first: int, last: int) -> NDArray[np.float16]:
        """Rows first to last - 1."""
        self.asked.append((first, last))
        return self.values[first:last]


def pool_of(read: AbrdfReader, rows: int, *, block: int, blocks: float, seed: int = 0) -> AbrdfPool:
    """A pool with room for that many blocks."""
    budget = int(blocks * block * IMAGES * 3 * 2)
    return AbrdfPool(read, rows, IMAGES, block=block, budget=budget, seed=seed)


def test_a_matrix_that_fits_is_one_part_in_order_and_read_once() -> None:
    values = matrix_of(25)
    read = Watched(values)
    pool = pool_of(read, 25, block=10, blocks=3)
    assert pool.parts == 1
    for number in (0, 1, 7):
        rows, found = pool.part(number)
        np.testing.assert_array_equal(rows, np.arange(25))
        np.testing.assert_array_equal(found, values)
    assert read.asked == [(0, 10), (10, 20), (20, 25)]


def test_what_is_in_memory_is_one_part() -> None:
    values = matrix_of(13)
    pool = AbrdfPool.of_array(values)
    assert (pool.parts, pool.rows, pool.images) == (1, 13, IMAGES)
    np.testing.assert_array_equal(pool.part(3)[1], values)


@settings(deadline=None)
@given(
    st.integers(1, 60), st.integers(1, 12), st.floats(0.0, 5.0), st.integers(0, 9),
    st.integers(0, 3),
)  # fmt: skip
def test_every_turn_gives_every_row_once_with_its_values(
    rows: int, block: int, blocks: float, seed: int, turn: int
) -> None:
    values = matrix_of(rows)
    pool = pool_of(Watched(values), rows, block=block, blocks=blocks, seed=seed)
    seen: list[int] = []
    for number in range(turn * pool.parts, (turn + 1) * pool.parts):
        numbers, found = pool.part(number)
        assert found.dtype == np.float16
        np.testing.assert_array_equal(found, values[numbers])
        assert len(numbers) <= max(1, int(blocks)) * block
        seen += numbers.tolist()
    assert sorted(seen) == list(range(rows))


def test_another_turn_and_another_seed_have_another_order() -> None:
    values = matrix_of(60)

    def order(seed: int, turn: int) -> list[int]:
        pool = pool_of(Watched(values), 60, block=3, blocks=2, seed=seed)
        parts = range(turn * pool.parts, (turn + 1) * pool.parts)
        return np.concatenate([pool.part(number)[0] for number in parts]).tolist()

    assert order(0, 0) != order(0, 1)
    assert order(0, 0) != order(1, 0)
    assert order(0, 2) == order(0, 2)  # what came before does not matter


def test_a_part_is_read_once_while_it_is_in_use() -> None:
    read = Watched(matrix_of(20))
    pool = pool_of(read, 20, block=5, blocks=1)
    for _ in range(5):
        pool.part(2)
    assert len(read.asked) == 1


@pytest.mark.parametrize("blocks", [1, 2, 9])
def test_mean_abrdfs_are_those_of_the_members(blocks: int) -> None:
    values = matrix_of(41)
    ids = np.random.default_rng(0).integers(0, 6, 41)
    pool = pool_of(Watched(values), 41, block=5, blocks=blocks)
    found = mean_abrdfs(pool, ids, 6)
    assert (found.shape, found.dtype) == ((6, IMAGES, 3), np.float16)
    for cluster in range(6):
        expected = values[ids == cluster].astype(np.float64).mean(axis=0)
        np.testing.assert_allclose(found[cluster], expected, atol=1e-3, rtol=1e-3)
