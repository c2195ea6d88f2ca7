"""A second decoder of compressed SSDFs, written from docs/ssdf_file.md alone.

Plain Python; only the meaning of the numbers takes NumPy. It imports nothing of this project.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

SPEEDS = (4, 7)
LEAST, MOST = 32, 65504
LONGEST = 14


class Numbers(NamedTuple):
    """All whole numbers of a file, in lists, and its step."""

    step: float
    n: int
    ranks: list[int]
    shared_level: list[int]
    level: list[int]
    cluster: list[int]
    shared: list[int]
    centre: list[int]
    basis: list[int]
    weights: list[int]


class _Code:
    """A row of numbers."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.place = 4
        self.code = int.from_bytes(data[:4].ljust(4, b"\0"), "big")
        self.range = (1 << 32) - 1
        self.chances: dict[object, list[list[int]]] = {}

    def _answer(self, chance: int) -> int:
        bound = (self.range >> 16) * chance
        if self.code < bound:
            self.range, answer = bound, 0
        else:
            self.code, self.range, answer = self.code - bound, self.range - bound, 1
        while self.range < 1 << 24:
            self.range <<= 8
            byte = self.data[self.place] if self.place < len(self.data) else 0
            self.code = self.code << 8 | byte
            self.place += 1
        return answer

    def _asked(self, pair: list[int]) -> int:
        fast, slow = pair
        answer = self._answer(min(max((fast + slow) >> 1, LEAST), MOST))
        for k, speed in enumerate(SPEEDS):
            pair[k] += -(pair[k] >> speed) if answer else (65536 - pair[k]) >> speed
        return answer

    def number(self, context: object) -> int:
        """The next one."""
        pairs = self.chances.get(context)
        if pairs is None:
            pairs = [[32768, 32768] for _ in range(2 + LONGEST + 31)]
            self.chances[context] = pairs
        if not self._asked(pairs[0]):
            return 0
        sign = -1 if self._asked(pairs[1]) else 1
        for size in range(1, LONGEST + 1):
            if not self._asked(pairs[1 + size]):
                return sign * size
        digits = 0
        while digits < 30 and self._asked(pairs[2 + LONGEST + digits]):
            digits += 1
        rest = 1
        for _ in range(digits):
            rest = 2 * rest + self._answer(32768)
        return sign * (LONGEST + rest)

    def end(self) -> None:
        """Raises ValueError for a code that was cut."""
        if self.place > len(self.data):
            raise ValueError("a code is cut")


def numbers_of(data: bytes) -> Numbers:
    """All numbers of a file. Raises ValueError for what the page says is refused."""
    if data[:8] != b"TSUYASDF" or len(data) < 44:
        raise ValueError("no such file")
    version, n, step, r, k, m, v, w, length = struct.unpack_from("<HHdIIIIII", data, 8)
    if version != 1:
        raise ValueError("another version")
    count = (n * n + k + m) * r + w + v + k + m
    if n % 2 or n < 4 or not k or not 0 < step < math.inf or count > 12_000 * len(data):
        raise ValueError("a header that cannot be")
    code = _Code(data[44 : 44 + length])
    ranks = [code.number("ranks") for _ in range(k)]
    if min(ranks) < 0 or sum(ranks) != m:
        raise ValueError("ranks that cannot be")
    shared_level = _summed([code.number("shared") for _ in range(r)])
    level: list[int] = []
    for rank in ranks:
        level += _summed([code.number("level") for _ in range(rank)])
    if any(not 0 <= each <= 4000 for each in shared_level + level):
        raise ValueError("levels that cannot be")
    front, cluster = list(range(k)), []
    for _ in range(v):
        place = code.number("cluster")
        if not 0 <= place < k:
            raise ValueError("a place that cannot be")
        cluster.append(front.pop(place))
        front.insert(0, cluster[-1])
    code.end()
    sizes = [0] * k
    for own in cluster:
        sizes[own] += 1
    if sum(rank * size for rank, size in zip(ranks, sizes, strict=True)) != w:
        raise ValueError("weights that cannot be")
    code = _Code(data[44 + length :])
    rings = [octaves(1 + math.sqrt(row * row + column * column), 3, 24)
             for row in range(n) for column in range(n)]  # fmt: skip
    places = [octaves(1 + place / 4, 2, 16) for place in range(r)]
    shared = [code.number(("shared", _clip(own), ring)) for own in shared_level for ring in rings]
    counts = [octaves(max(size, 1), 1, 24) for size in sizes]
    centre = [code.number(("centre", many, place)) for many in counts for place in places]
    basis = [code.number(("basis", _clip(own), place)) for own in level for place in places]
    weights, first = [], 0
    for rank, size in zip(ranks, sizes, strict=True):
        narrow = round(2 * math.log2(max(size, 1)))
        contexts = [("weights", _clip(own) - narrow) for own in level[first : first + rank]]
        weights += [code.number(context) for _ in range(size) for context in contexts]
        first += rank
    code.end()
    return Numbers(step, n, ranks, shared_level, level, cluster, shared, centre, basis, weights)


def _summed(differences: list[int]) -> list[int]:
    sums, total = [], 0
    for each in differences:
        total += each
        sums.append(total)
    return sums


def _clip(level: int) -> int:
    return min(max(level, 0), 80)


def octaves(value: float, per_octave: float, most: int) -> int:
    """The page's."""
    return min(int(per_octave * math.log2(value)), most - 1)


def distances_of(numbers: Numbers, solid_angles: Callable[[int], np.ndarray]) -> np.ndarray:
    """d (V, n²), radians; ``solid_angles`` (n²,) of n."""
    n, step = numbers.n, numbers.step
    frequency, place = np.arange(n)[:, None], np.arange(n)
    cosines = np.sqrt(np.where(frequency > 0, 2.0, 1.0) / n) * np.cos(
        np.pi * frequency * (place + 0.5) / n
    )
    rank = len(numbers.shared_level)
    rows = np.array(numbers.shared, float).reshape(rank, n, n)
    shared = np.einsum("krc,ry,cx->kyx", rows, cosines, cosines).reshape(rank, n * n)
    shared *= step / _sigma(numbers.shared_level, step)[:, None]
    sizes = np.bincount(numbers.cluster, minlength=len(numbers.ranks))
    centre = np.array(numbers.centre, float).reshape(-1, rank)
    centre *= step / np.sqrt(np.maximum(sizes, 1))[:, None]
    basis = np.array(numbers.basis, float).reshape(-1, rank)
    basis *= step / _sigma(numbers.level, step)[:, None]
    found = np.empty((len(numbers.cluster), n * n))
    first, read = 0, 0
    for cluster, (own, size) in enumerate(zip(numbers.ranks, sizes, strict=True)):
        weights = np.array(numbers.weights[read : read + own * size], float).reshape(size, own)
        coordinates = centre[cluster] + step * weights @ basis[first : first + own]
        found[np.flatnonzero(np.array(numbers.cluster) == cluster)] = coordinates @ shared
        first, read = first + own, read + own * size
    return found / np.sqrt(solid_angles(n) / (4 * np.pi / n**2))


def _sigma(level: list[int], step: float) -> np.ndarray:
    return step * 2.0 ** (np.array(level) / 4)


def mismatches(numbers: Numbers, other: dict[str, np.ndarray]) -> int:
    """How many numbers of the lists differ, or are missing, from those of another decoder."""
    wrong = 0
    for name, values in other.items():
        own = np.array(getattr(numbers, name))
        found = np.asarray(values).ravel()
        size = min(len(own), len(found))
        wrong += int((own[:size] != found[:size]).sum()) + abs(len(own) - len(found))
    return wrong
