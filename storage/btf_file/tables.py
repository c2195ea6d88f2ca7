"""How often each symbol comes: tables of 4096 shares, and how a file holds them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

PRECISION = 12
TOTAL = 1 << PRECISION
"""Sum of a table's frequencies."""
LEAST, LARGEST = -128, 127
"""Of all symbols and table entries."""
MOST_LEVEL = 63
FIRST_LEVEL = 32
"""A table's first level is stored as its difference from this."""

_PEAK = 50  # level of the most frequent symbol: twelve octaves above the rarest
_LONG_GAP = 8  # symbols that never come, in a row, before they are left out of the table


@dataclass(frozen=True)
class Table:
    """Frequencies of the symbols ``least``, ``least`` + 1, …, which sum up to 4096.

    They follow from *levels*, 0 (never comes) to 63: a symbol's weight is 2^(level / 4), in whole
    numbers. With W the sum of all weights and N the number of symbols that come, frequencies start
    at n + floor(w (4096 - N) / W), w and n being weights and symbols before this one.
    """

    least: int
    levels: tuple[int, ...]
    frequencies: NDArray[np.int64]
    starts: NDArray[np.int64]
    """Sum of the frequencies before each symbol."""

    @classmethod
    def of_levels(cls, least: int, levels: Iterable[int]) -> Table:
        """The table of levels of which one at least is not 0.

        >>> Table.of_levels(-1, [28, 32, 0, 28]).frequencies.tolist()
        [1024, 2047, 0, 1025]
        """
        level = np.array(list(levels), np.int64)
        weights = np.where(level > 0, np.array([16, 19, 23, 27])[level % 4] << level // 4, 0)
        comes = level > 0
        before = np.cumsum(weights)
        ends = np.cumsum(comes) + before * (TOTAL - int(comes.sum())) // before[-1]
        starts = np.concatenate([[0], ends[:-1]])
        return cls(least, tuple(level.tolist()), ends - starts, starts)

    @classmethod
    def of_counts(cls, counts: NDArray[np.integer]) -> Table:
        """A table for symbols of which the one numbered n (from -128) comes counts[n] times."""
        there = np.flatnonzero(counts)
        first, last = int(there[0]), int(there[-1])
        held = counts[first : last + 1].astype(np.float64)
        share = np.maximum(held / held.sum() * TOTAL - 1.0, 1e-3)
        levels = np.maximum(_PEAK + np.rint(4 * np.log2(share / share.max())), 1).astype(int)
        missing = 0
        for place, count in enumerate(held):
            if count:
                if missing >= _LONG_GAP:
                    levels[place - missing : place] = 0
                missing = 0
            else:
                missing += 1
        return cls.of_levels(first + LEAST, levels.tolist())

    def slots(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """By slot, 0 to 4095: symbol, its frequency, and the slot's place in the symbol's."""
        symbols = np.repeat(np.arange(len(self.levels)), self.frequencies)
        within = np.arange(TOTAL) - self.starts[symbols]
        return symbols + self.least, self.frequencies[symbols], within

    def bits(self, counts: NDArray[np.integer]) -> float:
        """Bits of symbols that come as often as ``counts`` (256,) says."""
        held = counts[self.least - LEAST : self.least - LEAST + len(self.levels)]
        come = np.flatnonzero(held)
        return float((held[come] * (PRECISION - np.log2(self.frequencies[come]))).sum())

    def entries(self) -> list[int]:
        """The whole numbers, -128 to 127, that a file holds of it."""
        steps = np.diff(self.levels, prepend=FIRST_LEVEL).tolist()
        return [self.least, self.least + len(self.levels) - 1, *steps]


def table_of_entries(entries: Iterator[int]) -> Table:
    """The table that stands next; ValueError, a few words, for one that cannot be."""
    least, largest = next(entries), next(entries)
    if largest < least:
        raise ValueError("one that ends before it begins")
    levels, level = [], FIRST_LEVEL
    for _ in range(largest - least + 1):
        level += next(entries)
        if not 0 <= level <= MOST_LEVEL:
            raise ValueError(f"one with a level of {level}")
        levels.append(level)
    if not any(levels):
        raise ValueError("one in which no symbol comes")
    return Table.of_levels(least, levels)


def _levels_of_entries() -> list[int]:
    """The table of the entries themselves: the more bits a number has, the rarer it is."""
    return [max(1, 32 - 5 * abs(entry).bit_length()) for entry in range(LEAST, LARGEST + 1)]


ENTRY_TABLE = Table.of_levels(LEAST, _levels_of_entries())


def entry_bits(entries: Sequence[int]) -> float:
    """Bits that a file takes for these entries."""
    found = ENTRY_TABLE.frequencies[np.array(entries) - LEAST]
    return float((PRECISION - np.log2(found)).sum())


def counts_of(symbols: NDArray[np.integer]) -> NDArray[np.int64]:
    """How often each symbol comes, (256,), from -128."""
    return np.bincount(symbols.ravel() - LEAST, minlength=LARGEST - LEAST + 1)


def shared_tables(counts: Sequence[NDArray[np.int64]]) -> tuple[list[Table], list[int]]:
    """Tables for kinds of symbols, and the number of each kind's table.

    Two kinds share a table as long as that saves more of the table than it costs in their symbols.
    """
    groups = [([kind], count) for kind, count in enumerate(counts)]
    costs = [_cost(count) for count in counts]
    saved = {
        (a, b): costs[a] + costs[b] - _cost(counts[a] + counts[b])
        for b in range(len(counts))
        for a in range(b)
    }
    left = set(range(len(groups)))
    while saved:
        (a, b), most = max(saved.items(), key=lambda item: (item[1], item[0]))
        if most <= 0:
            break
        groups[a] = groups[a][0] + groups[b][0], groups[a][1] + groups[b][1]
        costs[a] = _cost(groups[a][1])
        left.remove(b)
        saved = {pair: value for pair, value in saved.items() if not {a, b} & set(pair)}
        for other in left - {a}:
            pair = min(a, other), max(a, other)
            saved[pair] = costs[a] + costs[other] - _cost(groups[a][1] + groups[other][1])
    numbers = [0] * len(counts)
    for number, group in enumerate(sorted(left)):
        for kind in groups[group][0]:
            numbers[kind] = number
    return [Table.of_counts(groups[group][1]) for group in sorted(left)], numbers


def _cost(counts: NDArray[np.int64]) -> float:
    table = Table.of_counts(counts)
    return table.bits(counts) + entry_bits(table.entries())
