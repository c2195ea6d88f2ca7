"""A decoder of `.tbtf` files, written from docs/btf_file.md alone: NumPy, and nothing of ours."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np


class PageFile:
    """A whole file: ``header``, ``decoder``, ``student``, ``levels`` (rows, columns, C), ``ids``.

    Symbols are whole numbers in ``symbols``, values are float32.
    """

    def __init__(self, data: bytes) -> None:
        self.data = data
        magic, version, self.flags, self.c, coarser, length, crc = struct.unpack_from(
            "<4s4B2I", data
        )
        assert (magic, version, length) == (b"TBTF", 1, len(data))
        assert zlib.crc32(data[:12] + data[16:]) == crc
        self.height, self.width, self.k = struct.unpack_from("<2HI", data, 16)
        self.alpha, self.least, self.largest = struct.unpack_from("<3f", data, 24)
        self.side, layers, student_layers, tables = struct.unpack_from("<4B", data, 36)
        self.at = 40
        shapes = [self.tensors(count) for count in (layers, student_layers)]
        self.sizes = [
            (math.ceil(self.height / 2**level), math.ceil(self.width / 2**level))
            for level in range(coarser + 1)
        ]
        groups = [not self.flags & 1, coarser > 0]
        channel_tables = [self.take("u1", self.c) if group else None for group in groups]
        quantised = [[table != 255 for _, _, table in tensors] for tensors in shapes]
        steps = [self.take("<f4", sum(which)) for which in quantised]
        self.steps = [self.take("<f4", self.c) if group else None for group in groups]
        self.parallax = self.take("<f4", 18).reshape(9, 2) if self.flags & 4 else None
        counts = [
            math.ceil(sum(math.prod(shape) for _, shape, table in tensors if table != 255) / 2048)
            for tensors in shapes
        ]
        finest = 0
        if groups[0]:
            finest = math.ceil(self.k / self.side**2) if self.flags & 2 else self.tiles(0)
        streams = 1 + sum(counts) + finest + sum(self.tiles(n + 1) for n in range(coarser))
        self.lengths = iter(self.take("<u2", streams).tolist())
        model = self.stream([q_of_model()])
        self.tables = [self.table(model) for _ in range(tables)]
        predicted = [groups[0] and not self.flags & 2, groups[1]]
        self.coefficients = [self.coefficient_set(model) if one else None for one in predicted]
        assert next(model, "ended") == "ended"
        self.symbols: dict[str, Any] = {}
        self.decoder = self.tensors_of("decoder", shapes[0], steps[0])
        self.student = self.tensors_of("student", shapes[1], steps[1])
        self.read_latents(channel_tables, coarser)
        self.ids = self.read_ids() if self.flags & 2 else None
        assert self.at == len(data)

    def take(self, dtype: str, count: int) -> np.ndarray:
        """The next values."""
        found = np.frombuffer(self.data, dtype, count, self.at)
        self.at += found.nbytes
        return found

    def tensors(self, layers: int) -> list[tuple[str, tuple[int, ...], int]]:
        """Name, shape, table of each tensor."""
        found: list[tuple[str, tuple[int, ...], int]] = []
        inputs = self.c + 4
        for number in range(1, layers + 1):
            outputs, weights, biases = struct.unpack_from("<H2B", self.data, self.at)
            self.at += 4
            found.append((f"weight_{number}", (outputs, inputs), weights))
            found.append((f"bias_{number}", (outputs,), biases))
            inputs = outputs
        return found

    def tiles(self, level: int) -> int:
        """Tiles of a level."""
        rows, columns = self.sizes[level]
        return math.ceil(rows / self.side) * math.ceil(columns / self.side)

    # ---- streams -----------------------------------------------------------------------------

    def stream(self, tables: list[tuple[int, list[int]]]) -> Stream:
        """The next stream."""
        return Stream(self.take("<u2", next(self.lengths)).tolist(), tables)

    def table(self, model: Stream) -> tuple[int, list[int]]:
        """Least symbol, and where ranges end."""
        least, largest = next(model), next(model)
        levels = []
        level = 32
        for _ in range(largest - least + 1):
            level += next(model)
            levels.append(level)
        return least, ranges(levels)

    def coefficient_set(self, model: Stream) -> np.ndarray:
        """By channel, phase and neighbour."""
        differences = [next(model) for _ in range(self.c * 20)]
        return np.cumsum(np.reshape(differences, (self.c, 4, 5)), axis=0)

    # ---- sections ----------------------------------------------------------------------------

    def tensors_of(self, section: str, tensors: list, steps: np.ndarray) -> dict[str, np.ndarray]:
        """Values of a decoder."""
        values = {}
        for name, shape, table in tensors:
            if table == 255:
                values[name] = self.take("<f4", math.prod(shape)).reshape(shape)
        coded = [(name, shape, table) for name, shape, table in tensors if table != 255]
        order = [table for _, shape, table in coded for _ in range(math.prod(shape))]
        symbols: list[int] = []
        for first in range(0, len(order), 2048):
            stream = self.stream(self.tables)
            symbols += [stream.symbol(table) for table in order[first : first + 2048]]
            assert stream.ended()
        for (name, shape, _), step in zip(coded, steps, strict=True):
            count = math.prod(shape)
            self.symbols[f"{section}/{name}"] = np.reshape(symbols[:count], shape)
            values[name] = np.float32(self.symbols[f"{section}/{name}"]) * step
            del symbols[:count]
        return values

    def read_latents(self, tables: list, coarser: int) -> None:
        """Symbols and values of all levels."""
        levels: list[Any] = [None] * (coarser + 1)
        starts: list[Any] = [None] * (coarser + 1)
        vectors = None
        if self.flags & 1:
            vectors = self.take("<f4", self.k * self.c).reshape(self.k, self.c)
        elif self.flags & 2:
            found: list[list[int]] = []
            while len(found) < self.k:
                stream = self.stream(self.tables)
                for _ in range(min(self.side**2, self.k - len(found))):
                    found.append([stream.symbol(table) for table in tables[0]])
                assert stream.ended()
            self.symbols["vectors"] = np.array(found)
            vectors = np.float32(found) * self.steps[0]
        else:
            starts[0] = [self.stream(self.tables) for _ in range(self.tiles(0))]
        for level in range(1, coarser + 1):
            starts[level] = [self.stream(self.tables) for _ in range(self.tiles(level))]
        for level in range(coarser, -1, -1):
            if starts[level] is not None:
                parents = levels[level + 1] if level < coarser else None
                group = min(level, 1)
                levels[level] = self.image(level, starts[level], parents, tables[group], group)
        self.symbols["levels"] = levels
        self.vectors = vectors

    def image(
        self, level: int, streams: list[Stream], parents: Any, tables: Any, group: int
    ) -> np.ndarray:
        """Symbols of a level."""
        rows, columns = self.sizes[level]
        found = np.zeros((rows, columns, self.c), int)
        coefficients = self.coefficients[group]
        left_over = iter(streams)
        for top in range(0, rows, self.side):
            for left in range(0, columns, self.side):
                stream = next(left_over)
                bottom, right = min(top + self.side, rows), min(left + self.side, columns)
                for r in range(top, bottom):
                    for c in range(left, right):
                        around = neighbours(found, r, c, top, left, right)
                        for n in range(self.c):
                            a, b, d, e = (int(one[n]) for one in around)
                            parent = 0 if parents is None else int(parents[r // 2, c // 2, n])
                            k = coefficients[n, 2 * (r % 2) + c % 2].tolist()
                            p = a * k[0] + b * k[1] + d * k[2] + e * k[3] + parent * k[4] + 16 >> 5
                            p = min(max(p, -128), 127)
                            coded = stream.symbol(tables[n])
                            found[r, c, n] = (p + coded + 128) % 256 - 128
                assert stream.ended()
        return found

    def read_ids(self) -> np.ndarray:
        """Numbers of latent vectors."""
        texels = self.height * self.width
        if self.flags & 1:
            return self.take("<i4", texels)
        bits = (self.k - 1).bit_length()
        packed = self.take("u1", math.ceil(texels * bits / 8)).tolist()
        return np.array(
            [
                sum(
                    (packed[(bits * t + i) // 8] >> (bits * t + i) % 8 & 1) << i
                    for i in range(bits)
                )
                for t in range(texels)
            ]
        )

    # ---- from values to radiance -------------------------------------------------------------

    def level(self, number: int) -> np.ndarray:
        """Values of a level, (rows, columns, C)."""
        if number == 0 and self.vectors is not None:
            chosen = self.vectors if self.ids is None else self.vectors[self.ids]
            return chosen.reshape(self.height, self.width, self.c)
        return np.float32(self.symbols["levels"][number]) * self.steps[min(number, 1)]

    def radiance(
        self, place: tuple[float, float], light: np.ndarray, view: np.ndarray, seen: float = 0.0
    ) -> np.ndarray:
        """RGB at (u, v) for unit vectors; ``seen``: texels of the finest level that a pixel has."""
        inputs = [light[:2] / (1 + light[2]), view[:2] / (1 + view[2])]
        row, column = (1 - place[1]) * self.height - 0.5, place[0] * self.width - 0.5
        if self.parallax is not None:
            x, y = inputs[1]
            terms = [x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3]
            column += float(np.dot(terms, self.parallax[:, 0]))
            row += float(np.dot(terms, self.parallax[:, 1]))
        wanted = min(max(math.log2(seen) if seen > 0 else 0.0, 0.0), len(self.sizes) - 1)
        lower = math.floor(wanted)
        latents = self.bilinear(lower, row, column)
        if wanted > lower:
            latents += (wanted - lower) * (self.bilinear(lower + 1, row, column) - latents)
        values = np.concatenate([latents, *inputs])
        layers = len(self.decoder) // 2
        for layer in range(1, layers + 1):
            values = self.decoder[f"weight_{layer}"].astype(float) @ values
            values = values + self.decoder[f"bias_{layer}"]
            if layer < layers:
                values = np.maximum(values, 0)
        return np.clip(values, self.least, self.largest) * self.alpha

    def bilinear(self, level: int, row: float, column: float) -> np.ndarray:
        """Latents between four texels of a level."""
        values = self.level(level).astype(float)
        h, w, _ = values.shape
        row, column = (
            (row + 0.5) * h / self.height - 0.5,
            (column + 0.5) * w / self.width - 0.5,
        )
        top, left = math.floor(row), math.floor(column)
        found = np.zeros(self.c)
        for r, down in ((top, 1 - (row - top)), (top + 1, row - top)):
            for c, across in ((left, 1 - (column - left)), (left + 1, column - left)):
                found += down * across * values[r % h, c % w]
        return found


class Stream(Iterator[int]):
    """Symbols of one stream; as an iterator, with the first table, to its end."""

    def __init__(self, words: list[int], tables: list[tuple[int, list[int]]]) -> None:
        self.x = 65536 * words[0] + words[1]
        self.words = words[2:][::-1]
        self.tables = tables

    def symbol(self, table: int) -> int:
        """The next one, with this table."""
        least, ends = self.tables[table]
        slot = self.x % 4096
        place = int(np.searchsorted(ends, slot, side="right"))
        start = ends[place - 1] if place else 0
        self.x = (ends[place] - start) * (self.x // 4096) + slot - start
        if self.x < 65536:
            self.x = 65536 * self.x + self.words.pop()
        return least + place

    def ended(self) -> bool:
        """Whether nothing is left."""
        return self.x == 65536 and not self.words

    def __next__(self) -> int:
        if self.ended():
            raise StopIteration
        return self.symbol(0)


def ranges(levels: list[int]) -> list[int]:
    """Where each symbol's range ends."""
    weights = [[16, 19, 23, 27][q % 4] * 2 ** (q // 4) if q else 0 for q in levels]
    come = sum(q > 0 for q in levels)
    found, n, w = [], 0, 0
    for q, weight in zip(levels, weights, strict=True):
        n, w = n + (q > 0), w + weight
        found.append(n + w * (4096 - come) // sum(weights))
    return found


def q_of_model() -> tuple[int, list[int]]:
    return -128, ranges([max(1, 32 - 5 * abs(v).bit_length()) for v in range(-128, 128)])


def neighbours(found: np.ndarray, r: int, c: int, top: int, left: int, right: int) -> list:
    """Left, above, above left, above right."""
    if r == top and c == left:
        return [np.zeros(found.shape[2], int)] * 4
    if r == top:
        return [found[r, c - 1]] * 4
    above = found[r - 1, c]
    before, above_left = (above, above) if c == left else (found[r, c - 1], found[r - 1, c - 1])
    return [before, above, above_left, above if c + 1 == right else found[r - 1, c + 1]]
