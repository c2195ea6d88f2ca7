"""ABRDFs in memory while a network is trained: all of them, or a changing part."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

AbrdfReader = Callable[[int, int], NDArray[np.floating]]
"""ABRDFs (row, image, channel) of rows first … last - 1."""


class AbrdfPool:
    """Rows of an ABRDF matrix, by parts that fit into ``budget`` bytes as half floats.

    A matrix that fits is one part, read once. A larger one is read by blocks of rows; a part is a
    random choice of blocks, and all rows have their turn before one comes again.
    """

    def __init__(
        self, read: AbrdfReader, rows: int, images: int, *, block: int, budget: int, seed: int
    ) -> None:
        self.read = read
        self.rows, self.images = rows, images
        self._seed = seed
        self._starts = np.arange(0, rows, block)
        self._block = block
        self._blocks_a_part = max(1, budget // (block * images * 3 * 2))
        self.parts = -(-len(self._starts) // self._blocks_a_part)
        """Parts that make up the matrix."""
        self._held: tuple[int, NDArray[np.int64], NDArray[np.float16]] | None = None

    @classmethod
    def of_array(cls, values: NDArray[np.float16]) -> AbrdfPool:
        """A pool of what is in memory already: (row, image, channel)."""
        rows, images, _ = values.shape
        whole = {"block": rows, "budget": values.nbytes}
        return cls(lambda first, last: values[first:last], rows, images, **whole, seed=0)

    def part(self, number: int) -> tuple[NDArray[np.int64], NDArray[np.float16]]:
        """Row numbers (r,) and ABRDFs (r, image, channel) of the part that has the number.

        Numbers go on for ever; every ``parts`` of them are one turn of all rows.
        """
        number = number if self.parts > 1 else 0
        if self._held is None or self._held[0] != number:
            self._held = None  # let go of the old part before the new one comes
            self._held = (number, *self._load(number))
        return self._held[1:]

    def _load(self, number: int) -> tuple[NDArray[np.int64], NDArray[np.float16]]:
        turn, inside = divmod(number, self.parts)
        starts = self._starts
        if self.parts > 1:
            starts = np.random.default_rng((self._seed, turn)).permutation(starts)
        first = inside * self._blocks_a_part
        chosen = np.sort(starts[first : first + self._blocks_a_part])
        ends = np.minimum(chosen + self._block, self.rows)
        rows = [np.arange(a, b) for a, b in zip(chosen, ends, strict=True)]
        numbers = np.concatenate(rows).astype(np.int64)
        values = np.empty((len(numbers), self.images, 3), np.float16)
        at = 0
        for start, end in zip(chosen, ends, strict=True):
            values[at : at + end - start] = self.read(int(start), int(end))
            at += end - start
        return numbers, values


def mean_abrdfs(pool: AbrdfPool, ids: NDArray[np.integer], clusters: int) -> NDArray[np.float16]:
    """Mean of every cluster's ABRDFs, (cluster, image, channel); ids (row,)."""
    sums = np.zeros((clusters, pool.images, 3), np.float32)
    for number in range(pool.parts):
        rows, values = pool.part(number)
        for row, abrdf in zip(rows, values, strict=True):
            sums[ids[row]] += abrdf
    counts = np.bincount(ids, minlength=clusters)
    return (sums / np.maximum(counts, 1)[:, None, None]).astype(np.float16)
