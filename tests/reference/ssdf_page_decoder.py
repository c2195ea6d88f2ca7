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


# ---- version 2: bits ---------------------------------------------------------------------------


class SeenBits(NamedTuple):
    """The numbers of a file of version 2: ``cluster`` (V,), ``bits`` (V, n, n)."""

    n: int
    cluster: list[int]
    bits: list[list[list[int]]]


def bits_of(data: bytes) -> SeenBits:
    """All of a file of bits. Raises ValueError for what the page says is refused."""
    if data[:8] != b"TSUYASDF" or len(data) < 28:
        raise ValueError("no such file")
    version, n, vertices, clusters, first, second = struct.unpack_from("<HHIIII", data, 8)
    if version != 2:
        raise ValueError("another version")
    if n % 2 or n < 4 or not 0 < clusters <= vertices or vertices * n * n > 131072 * len(data):
        raise ValueError("a header that cannot be")
    code = _Code(data[28 : 28 + first])
    front, cluster = list(range(clusters)), []
    for _ in range(vertices):
        place = code.number("cluster")
        if not 0 <= place < clusters:
            raise ValueError("a place that cannot be")
        cluster.append(front.pop(place))
        front.insert(0, cluster[-1])
    code.end()
    if len(set(cluster)) != clusters:
        raise ValueError("a cluster without a vertex")
    references = _references(data[28 + first : 28 + first + second], vertices)
    return SeenBits(n, cluster, _Pictures(data[28 + first + second :], n).all(references))


def _references(data: bytes, vertices: int) -> list[list[int]]:
    (fresh,) = struct.unpack_from("<I", data)
    if fresh > 3 * vertices:
        raise ValueError("more new steps than steps")
    code = _Code(data[4:])
    places = [code.number(k % 3) for k in range(3 * vertices)]
    new = [code.number("new") for _ in range(fresh)]
    code.end()
    recent: list[int] = []
    found = []
    for k, place in enumerate(places):
        if not 0 <= place <= len(recent):
            raise ValueError("a place that cannot be")
        step = recent.pop(place - 1) if place else new.pop(0) if new else 0
        recent.insert(0, step)
        found.append(k // 3 - step)
        if (not 0 <= found[-1] < max(k // 3, 1) and k > 2) or (k < 3 and found[-1] != -1):
            raise ValueError("a reference that cannot be")
    return [found[3 * v : 3 * v + 3] for v in range(vertices)]


class _Pictures:
    """The third code: bits, vertex by vertex."""

    def __init__(self, data: bytes, n: int) -> None:
        self.code = _Code(data)
        self.n = n
        self.models: list[dict[tuple[int, ...], list[int]]] = [{} for _ in range(6)]
        self.mixing = [[16384] * 6 for _ in range(15)]
        self.flags = [32768] * 32
        self.done: list[list[list[int]]] = []

    def all(self, references: list[list[int]]) -> list[list[list[int]]]:
        blank = [[0] * self.n for _ in range(self.n)]
        for own in references:
            self.done.append(self._one([self.done[k] if k >= 0 else blank for k in own]))
        self.code.end()
        return self.done

    def _one(self, near: list[list[list[int]]]) -> list[list[int]]:
        n = self.n
        base = 16 if not self.done else 0
        own = [list(row) for row in near[0]]

        def at(picture: list[list[int]], y: int, x: int) -> int:
            return picture[min(max(y, 0), n - 1)][min(max(x, 0), n - 1)]

        # Of the own picture, what lies beyond the border is the first reference's.
        def mine(y: int, x: int) -> int:
            return own[y][x] if 0 <= y < n and 0 <= x < n else at(near[0], y, x)

        recent = 0
        for y in range(n):
            soft = [[sum((2 - abs(dy)) * (2 - abs(dx)) * at(picture, y + dy, x + dx)
                         for dy in (-1, 0, 1) for dx in (-1, 0, 1)) for picture in near]
                    for x in range(n)]  # fmt: skip
            total = [sum(each) for each in soft]
            active = sum(0 < each < 48 for each in total)
            flag = base + 4 * recent + min(active, 3)
            unlike = self.code._answer(65536 - self.flags[flag])
            self.flags[flag] += (65535 * unlike - self.flags[flag]) * 800 >> 16
            self.flags[flag] = min(max(self.flags[flag], LEAST), MOST)
            recent = unlike + 2 * (recent & 1)
            for x in range(n):
                if 0 < total[x] < 48:
                    chosen = (mine(y, x - 1) ^ mine(y - 1, x)) + 2 * min(abs(total[x] - 24) // 4, 6)
                elif unlike:
                    chosen = 14
                else:
                    own[y][x] = near[0][y][x]
                    continue
                own[y][x] = self._bit(_keys(mine, at, near, soft[x], y, x), chosen)
        return own

    def _bit(self, keys: list[tuple[int, ...]], chosen: int) -> int:
        weights = self.mixing[chosen]
        both = zip(self.models, keys, strict=True)
        asked = [model.setdefault(key, [32768, 0]) for model, key in both]
        answers = [stretch(chance >> 4) for chance, _ in asked]
        mixed = sum(a * w for a, w in zip(answers, weights, strict=True)) >> 16
        p = squash(min(max(mixed, -2047), 2047))
        bit = self.code._answer(65536 - p)
        error = 5 * (4096 * bit - (p >> 4))
        for k, (answer, pair) in enumerate(zip(answers, asked, strict=True)):
            weights[k] = min(max(weights[k] + (answer * error + 8192 >> 14), -262144), 262144)
            pair[0] += (65535 * bit - pair[0]) * (327680 // (10 * pair[1] + 16)) >> 15
            pair[1] = min(pair[1] + 1, 30)
        return bit


def stretch(place: int) -> int:
    """The page's, of a chance in 4096."""
    share = (place + 0.5) / 4096
    return min(max(round(256 * math.log(share / (1 - share))), -2047), 2047)


def squash(mixed: int) -> int:
    """The page's: a chance in 65536."""
    return min(max(round(65536 / (1 + math.exp(-mixed / 256))), LEAST), MOST)


def _keys(
    mine: Callable[[int, int], int],
    at: Callable[..., int],
    near: list[list[list[int]]],
    soft: list[int],
    y: int,
    x: int,
) -> list[tuple[int, ...]]:
    before = tuple(mine(y + dy, x + dx) for dy, dx in ((0, -1), (-1, -1), (-1, 0), (-1, 1)))
    far = tuple(mine(y + dy, x + dx) for dy, dx in ((0, -2), (-2, 0), (-2, 1), (-2, -1), (-1, 2)))
    a, b, c = ([at(picture, y + dy, x + dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1)]
               for picture in near)  # fmt: skip
    wide = tuple(at(near[0], y + dy, x + dx) for dy, dx in ((-2, 0), (0, -2), (0, 2), (2, 0)))
    return [
        (*before, *far, *a[4:], b[4], b[7]),
        (*before, *a, b[4], c[4]),
        (*before, *b, a[4], c[4]),
        (*before, *c, a[4], b[4]),
        (*before, soft[0], soft[1]),
        (before[0], before[2], *wide, *_cross(a), *_cross(b)),
    ]


def _cross(nine: list[int]) -> tuple[int, ...]:
    return nine[1], nine[3], nine[4], nine[5], nine[7]
