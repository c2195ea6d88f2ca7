"""Asymmetric numeral systems (rANS, Duda 2013): symbols to words of 16 bits and back.

Many streams side by side: a step codes one symbol of each. A state is from 2^16 to 2^32 - 1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from storage.btf_file.tables import PRECISION, TOTAL, Table

Ints = NDArray[np.int64]

LEAST_STATE = 1 << 16
"""Where a stream's encoder begins, so where its decoder has to end."""


def encode_streams(
    streams: Sequence[NDArray[np.integer]],
    numbers: Sequence[NDArray[np.integer]],
    tables: Sequence[Table],
) -> list[bytes]:
    """One stream of words for each array of symbols (n,); ``numbers`` (n,): each symbol's table.

    >>> table = Table.of_levels(0, [32, 28])
    >>> encode_streams([np.array([0, 1, 0])], [np.zeros(3, int)], [table])[0].hex()
    '060028c0'
    """
    lengths = np.array([len(stream) for stream in streams])
    frequency, start = _looked_up(streams, numbers, tables)
    state = np.full(len(streams), LEAST_STATE, np.int64)
    words: list[list[int]] = [[] for _ in streams]
    for step in range(int(lengths.max(initial=0)) - 1, -1, -1):  # the last symbol first
        active = np.flatnonzero(lengths > step)
        x, f, c = state[active], frequency[active, step], start[active, step]
        full = x >= f << (32 - PRECISION)
        for lane, word in zip(active[full], x[full] & 0xFFFF, strict=True):
            words[lane].append(int(word))
        x = np.where(full, x >> 16, x)
        state[active] = (x // f << PRECISION) + x % f + c
    return [
        np.array([x >> 16, x & 0xFFFF, *reversed(lane)], "<u2").tobytes()
        for x, lane in zip(state.tolist(), words, strict=True)
    ]


def _looked_up(
    streams: Sequence[NDArray[np.integer]],
    numbers: Sequence[NDArray[np.integer]],
    tables: Sequence[Table],
) -> tuple[Ints, Ints]:
    """Frequency and start of each symbol, (stream, step); 1 and 0 behind a stream's end."""
    shape = len(streams), max((len(stream) for stream in streams), default=0)
    frequency, start = np.ones(shape, np.int64), np.zeros(shape, np.int64)
    for lane, (symbols, which) in enumerate(zip(streams, numbers, strict=True)):
        for number in np.unique(which):
            steps = np.flatnonzero(which == number)
            cells = symbols[steps] - tables[number].least
            frequency[lane, steps] = tables[number].frequencies[cells]
            start[lane, steps] = tables[number].starts[cells]
    return frequency, start


class StreamDecoder:
    """Streams that are decoded side by side, a symbol of each at a time."""

    def __init__(self, words: NDArray[np.uint16], lengths: Ints, tables: Sequence[Table]) -> None:
        """``lengths`` (stream,): words of each, one behind the other, two or more each."""
        self._ends = np.cumsum(lengths)
        self._at = self._ends - lengths
        self._words = np.append(words, np.uint16(0)).astype(np.int64)
        self._state = self._words[self._at] << 16 | self._words[self._at + 1]
        self._at += 2
        slots = [table.slots() for table in tables]
        self._symbols = np.concatenate([symbols for symbols, _, _ in slots])
        self._frequencies = np.concatenate([frequencies for _, frequencies, _ in slots])
        self._within = np.concatenate([within for _, _, within in slots])

    def take(self, lanes: NDArray[np.integer] | slice, tables: Ints) -> Ints:
        """The next symbols of each of these streams, (lane, n), by their tables, (lane or 1, n)."""
        state, at = self._state[lanes], self._at[lanes]
        found = np.empty((len(state), tables.shape[1]), np.int64)
        # What a damaged stream reads behind its end does not matter: `ended` tells.
        last = len(self._words) - 1
        for place, offset in enumerate(tables.T * TOTAL):
            cell = (state & (TOTAL - 1)) + offset
            found[:, place] = self._symbols.take(cell)
            state = self._frequencies.take(cell) * (state >> PRECISION) + self._within.take(cell)
            low = (state < LEAST_STATE).nonzero()[0]
            if len(low):
                state[low] = state[low] << 16 | self._words.take(np.minimum(at[low], last))
                at[low] += 1
        self._state[lanes], self._at[lanes] = state, at
        return found

    def ended(self) -> bool:
        """Whether each stream is where its encoder began, all its words read."""
        return bool((self._state == LEAST_STATE).all() and (self._at == self._ends).all())


def decode_sequence(decoder: StreamDecoder, numbers: Ints, a_stream: int) -> Ints:
    """A sequence of symbols (n,) that lies cut in streams of ``a_stream`` symbols, the last less.

    ``numbers`` (n,): each symbol's table.
    """
    count = len(numbers)
    lanes = -(-count // a_stream)
    padded = np.zeros(lanes * a_stream, np.int64)
    padded[:count] = numbers
    by_lane = padded.reshape(lanes, a_stream)
    last = count - (lanes - 1) * a_stream
    found = np.zeros((lanes, a_stream), np.int64)
    found[:, :last] = decoder.take(slice(None), by_lane[:, :last])
    found[:-1, last:] = decoder.take(slice(0, lanes - 1), by_lane[:-1, last:])
    return found.reshape(-1)[:count]
