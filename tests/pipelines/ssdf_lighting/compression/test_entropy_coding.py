"""The range coder against what went in, Shannon's bound and a frozen code."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipelines.ssdf_lighting.compression.entropy_coding import decode, encode

MOST = (1 << 30) - 1
FROZEN = "27970d346dfb2f2b7c4ad913b41fffffd03bf8d2aad9fffdddffff018352b3a1"

numbers = st.one_of(
    st.integers(-3, 3),
    st.integers(-40, 40),
    st.integers(-MOST, MOST),
    st.sampled_from([MOST, -MOST, 1 << 29, 14, -14, 15, -15, 16, 0]),
)


@given(st.lists(st.tuples(numbers, st.integers(0, 5)), max_size=200))
@settings(max_examples=200, deadline=None)
def test_numbers_come_back(pairs: list[tuple[int, int]]) -> None:
    values = np.array([value for value, _ in pairs], np.int64)
    contexts = np.array([context for _, context in pairs], np.int64)
    found = decode(encode(values, contexts), contexts)
    assert found.dtype == np.int32
    np.testing.assert_array_equal(found, values)


@pytest.mark.parametrize("count", [0, 1, 1000, 30_000])
@pytest.mark.parametrize("value", [0, -1, 14, MOST, -MOST])
def test_the_same_number_again_and_again_comes_back(value: int, count: int) -> None:
    """Chances go to their ends; bytes of 255 wait for carries."""
    values, contexts = np.full(count, value), np.zeros(count, np.int64)
    code = encode(values, contexts)
    np.testing.assert_array_equal(decode(code, contexts), values)
    if abs(value) < 15:  # a sure answer costs -log2(65504 / 65536), a few before it more
        asked = 1 + (value != 0) + abs(value)
        assert len(code) < 4 + asked * (count * 0.000705 / 8 + 20)


def test_every_size_comes_back() -> None:
    """All that the unary part takes, and both sides of every power of two beyond."""
    sizes = sorted({*range(300), *(min((1 << k) + off, MOST) for k in range(8, 31)
                                   for off in (-1, 0, 1, 13, 14, 15))})  # fmt: skip
    values = np.array([*sizes, *(-size for size in sizes)])
    contexts = np.arange(len(values)) % 3
    np.testing.assert_array_equal(decode(encode(values, contexts), contexts), values)


def test_long_codes_of_noise_come_back() -> None:
    random = np.random.default_rng(1)
    size = 2.0 ** random.integers(0, 29, 40_000)
    values = np.rint(random.laplace(0, size)).clip(-MOST, MOST).astype(np.int64)
    contexts = np.log2(size).astype(np.int64)
    np.testing.assert_array_equal(decode(encode(values, contexts), contexts), values)


def laplacian_bits(scale: float) -> float:
    """Entropy of a Laplacian number, rounded."""
    at = np.arange(-2000, 2001)
    edges = np.concatenate([at - 0.5, [at[-1] + 0.5]])
    tail = 0.5 * np.exp(-np.abs(edges) / scale)
    below = np.where(edges < 0, tail, 1 - tail)
    chance = np.diff(below)
    chance = chance[chance > 0]
    return float(-(chance * np.log2(chance)).sum())


@pytest.mark.parametrize("scale", [0.12, 0.4, 1.0, 4.0, 12.0, 60.0])
def test_the_code_is_about_as_long_as_the_entropy(scale: float) -> None:
    values = np.rint(np.random.default_rng(7).laplace(0, scale, 60_000)).astype(np.int64)
    bits = 8 * len(encode(values, np.zeros(len(values), np.int64))) / len(values)
    assert 0.98 * laplacian_bits(scale) < bits < 1.05 * laplacian_bits(scale)


def test_contexts_keep_what_is_different_apart() -> None:
    random = np.random.default_rng(3)
    contexts = random.integers(0, 2, 60_000)
    scales = np.array([0.2, 30.0])
    values = np.rint(random.laplace(0, scales[contexts])).astype(np.int64)
    expected = np.mean([laplacian_bits(scale) for scale in scales])
    apart = 8 * len(encode(values, contexts)) / len(values)
    together = 8 * len(encode(values, np.zeros_like(contexts))) / len(values)
    assert apart < 1.03 * expected
    assert together > 1.1 * expected


def test_chances_follow_what_changes() -> None:
    values = np.concatenate([np.zeros(20_000, np.int64), np.full(20_000, 5)])
    assert len(encode(values, np.zeros(len(values), np.int64))) < 200


@given(st.lists(numbers, min_size=1, max_size=60), st.data())
@settings(max_examples=100, deadline=None)
def test_a_code_that_ends_too_early_is_refused(values: list[int], data: st.DataObject) -> None:
    contexts = np.zeros(len(values), np.int64)
    code = encode(np.array(values), contexts)
    left = data.draw(st.integers(0, len(code) - 1))
    with pytest.raises(ValueError, match=rf"^the code ends after {left} bytes; expected more\.$"):
        decode(code[:left], contexts)


@given(st.binary(max_size=200), st.integers(0, 60))
@settings(max_examples=100, deadline=None)
def test_any_bytes_are_some_numbers_or_refused(code: bytes, count: int) -> None:
    try:
        found = decode(code, np.arange(count) % 2)
    except ValueError:
        return
    assert found.shape == (count,)


def test_bytes_are_these_on_every_machine() -> None:
    values = np.array([0, 0, 1, -1, 2, 0, 14, -15, 16, 1000, -123456, MOST, 0, 0, 0, -3])
    contexts = np.array([0, 1] * 8)
    code = encode(values, contexts)
    assert code == encode(values.astype(np.int32), contexts.astype(np.int32))
    assert code.hex() == FROZEN


@pytest.mark.parametrize("value", [1 << 30, -(1 << 30), 1 << 40])
def test_too_large_numbers_are_refused(value: int) -> None:
    with pytest.raises(
        ValueError, match=rf"^values reach {abs(value)}; expected sizes below 2\^30"
    ):
        encode(np.array([0, value]), np.zeros(2, np.int64))


def test_nothing_is_a_few_bytes() -> None:
    none = np.zeros(0, np.int64)
    assert len(encode(none, none)) <= 4
    assert decode(encode(none, none), none).shape == (0,)


def test_a_first_question_costs_one_bit() -> None:
    """Chances start even: the first zero of each of many contexts."""
    contexts = np.arange(8000)
    assert len(encode(np.zeros(8000, np.int64), contexts)) == math.ceil(8000 / 8) + 4
