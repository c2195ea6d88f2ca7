"""Whole numbers to bytes and back: an adaptive binary range coder.

A number is cut into yes-no questions: is it 0, is it negative, is its size more than 1, more than
2 and so on; sizes of 15 and more end in an Exp-Golomb code. Every question has a chance of its own
in each *context*, a number that the caller gives with each value and that the decoder knows before
it (how large values of this row are likely to be, say). Chances adapt to what has come, at two
speeds, so nothing but the code itself is stored. Carries are resolved as in Martin, "Range
encoding", 1979. All arithmetic is in whole numbers: every machine makes the same bytes.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

_UNARY = 14
_QUESTIONS = 2 + _UNARY + 31  # zero, sign, sizes, bits of what is over
_HALF = 1 << 15  # of a chance, in 1 / 65536
_FAST, _SLOW = 4, 7
_TOP = 1 << 24  # the range is kept at or above
_WHOLE = (1 << 32) - 1


def encode(values: NDArray[np.integer], contexts: NDArray[np.integer]) -> bytes:
    """Bytes of values (n,), each below 2^30 in size, in contexts (n,) from 0 on."""
    numbers = np.ascontiguousarray(values, dtype=np.int64)
    if len(numbers) and np.abs(numbers).max() >= 1 << 30:
        raise ValueError(f"values reach {np.abs(numbers).max()}; expected sizes below 2^30.")
    places = np.ascontiguousarray(contexts, dtype=np.int64)
    # A question costs at most 16 bits, and a value asks 2 + 14 + 2 * 30 of them.
    room = 64 + 8 * len(numbers)
    while True:
        code = np.empty(room, np.uint8)
        used = _encode(numbers, places, _chances(places), code)
        if used >= 0:
            return code[1:used].tobytes()  # the byte before the first is 0
        room *= 4


def decode(code: bytes, contexts: NDArray[np.integer]) -> NDArray[np.int32]:
    """The values (n,) int32 that `encode` made ``code`` of, in the same contexts (n,).

    Raises ValueError for a code that ends too early.
    """
    places = np.ascontiguousarray(contexts, dtype=np.int64)
    values = np.empty(len(places), np.int32)
    data = np.frombuffer(code, np.uint8)
    if _decode(data, places, _chances(places), values) > len(data):
        raise ValueError(f"the code ends after {len(data)} bytes; expected more.")
    return values


def _chances(contexts: NDArray[np.int64]) -> NDArray[np.int32]:
    count = int(contexts.max()) + 1 if len(contexts) else 0
    return np.full((count, _QUESTIONS, 2), _HALF, np.int32)


@njit(cache=True, nogil=True, inline="always")
def _chance(pair: NDArray[np.int32]) -> int:
    """Of a 0, in 1 / 65536: 32 to 65504."""
    return min(max((np.int64(pair[0]) + pair[1]) >> 1, 32), 65504)


@njit(cache=True, nogil=True, inline="always")
def _learn(pair: NDArray[np.int32], bit: int) -> None:
    for k, speed in ((0, _FAST), (1, _SLOW)):
        if bit:
            pair[k] -= pair[k] >> speed
        else:
            pair[k] += (65536 - pair[k]) >> speed


# state of the encoder: low (33 bits), range, held byte, bytes held, place, room left (1 or 0)
_LOW, _RANGE, _CACHE, _HELD, _PLACE = range(5)


@njit(cache=True, nogil=True)
def _shift(state: NDArray[np.int64], code: NDArray[np.uint8]) -> None:
    """Move a byte of ``low`` out; bytes of 255 wait for a carry."""
    low = state[_LOW]
    if low < 0xFF000000 or low > _WHOLE:
        carry = low >> 32
        if state[_PLACE] + state[_HELD] + 1 < len(code):
            byte = state[_CACHE]
            for _ in range(state[_HELD]):
                code[state[_PLACE]] = (byte + carry) & 0xFF
                state[_PLACE] += 1
                byte = 0xFF
            state[_HELD] = 0
        else:
            state[_PLACE] = len(code) + 1
            state[_HELD] = 0
        state[_CACHE] = (low >> 24) & 0xFF
    state[_HELD] += 1
    state[_LOW] = (low & 0x00FFFFFF) << 8


@njit(cache=True, nogil=True)
def _put(state: NDArray[np.int64], code: NDArray[np.uint8], chance: int, bit: int) -> None:
    bound = (state[_RANGE] >> 16) * chance
    if bit:
        state[_LOW] += bound
        state[_RANGE] -= bound
    else:
        state[_RANGE] = bound
    while state[_RANGE] < _TOP:
        state[_RANGE] <<= 8
        _shift(state, code)


@njit(cache=True, nogil=True)
def _encode(
    values: NDArray[np.int64],
    contexts: NDArray[np.int64],
    chances: NDArray[np.int32],
    code: NDArray[np.uint8],
) -> int:
    """Bytes used, or -1 where ``code`` has too little room."""
    state = np.array([0, _WHOLE, 0, 1, 0], np.int64)
    for k in range(len(values)):
        asked = chances[contexts[k]]
        value = values[k]
        size = abs(value)
        _ask(state, code, asked[0], 1 if size else 0)
        if not size:
            continue
        _ask(state, code, asked[1], 1 if value < 0 else 0)
        for step in range(_UNARY):
            more = 1 if size > step + 1 else 0
            _ask(state, code, asked[2 + step], more)
            if not more:
                break
        if size > _UNARY:
            rest = size - _UNARY  # 1 and more: Exp-Golomb
            bits = 0
            while rest >> (bits + 1):
                bits += 1
            for place in range(bits):
                _ask(state, code, asked[2 + _UNARY + place], 1)
            _ask(state, code, asked[2 + _UNARY + bits], 0)
            for place in range(bits - 1, -1, -1):
                _put(state, code, _HALF, (rest >> place) & 1)
        if state[_PLACE] > len(code):
            return -1
    for _ in range(5):
        _shift(state, code)
    if state[_PLACE] > len(code):
        return -1
    return int(state[_PLACE])


@njit(cache=True, nogil=True)
def _ask(
    state: NDArray[np.int64], code: NDArray[np.uint8], pair: NDArray[np.int32], bit: int
) -> None:
    _put(state, code, _chance(pair), bit)
    _learn(pair, bit)


# state of the decoder: code within the range, range, place
@njit(cache=True, nogil=True)
def _get(state: NDArray[np.int64], code: NDArray[np.uint8], chance: int) -> int:
    bound = (state[_RANGE] >> 16) * chance
    if state[_LOW] < bound:
        state[_RANGE] = bound
        bit = 0
    else:
        state[_LOW] -= bound
        state[_RANGE] -= bound
        bit = 1
    while state[_RANGE] < _TOP:
        state[_RANGE] <<= 8
        state[_LOW] = (state[_LOW] << 8) | _next(state, code)
    return bit


@njit(cache=True, nogil=True)
def _next(state: NDArray[np.int64], code: NDArray[np.uint8]) -> int:
    place = state[_PLACE]
    state[_PLACE] += 1
    return int(code[place]) if place < len(code) else 0


@njit(cache=True, nogil=True)
def _told(state: NDArray[np.int64], code: NDArray[np.uint8], pair: NDArray[np.int32]) -> int:
    bit = _get(state, code, _chance(pair))
    _learn(pair, bit)
    return bit


@njit(cache=True, nogil=True)
def _decode(
    code: NDArray[np.uint8],
    contexts: NDArray[np.int64],
    chances: NDArray[np.int32],
    values: NDArray[np.int32],
) -> int:
    """Bytes asked for."""
    state = np.array([0, _WHOLE, 0, 0, 0], np.int64)
    for _ in range(4):
        state[_LOW] = ((state[_LOW] << 8) | _next(state, code)) & _WHOLE
    for k in range(len(contexts)):
        told = chances[contexts[k]]
        if not _told(state, code, told[0]):
            values[k] = 0
            continue
        negative = _told(state, code, told[1])
        size = 1
        while size <= _UNARY and _told(state, code, told[1 + size]):
            size += 1
        if size > _UNARY:
            bits = 0
            while bits < 30 and _told(state, code, told[2 + _UNARY + bits]):
                bits += 1
            rest = 1
            for _ in range(bits):
                rest = (rest << 1) | _get(state, code, _HALF)
            size = _UNARY + rest
        values[k] = -size if negative else size
    return state[_PLACE]
