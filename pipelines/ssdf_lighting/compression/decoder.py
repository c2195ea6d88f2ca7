"""What a compressed scene is asked for: distances of vertices."""

from __future__ import annotations

import functools
import struct
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.clustered_pca import ClusteredPca
from pipelines.ssdf_lighting.compression.decoder_tables import (
    DecoderTables,
    decoded_rows,
    tables_of_packed,
    tables_of_pca,
    tables_of_resident,
)
from pipelines.ssdf_lighting.compression.resident import ResidentTables, resident_tables

Floats = NDArray[np.float32]
DistancesAlong = Callable[[NDArray[np.integer], Floats], Floats]


class Decoder:
    """The SSDFs of a scene's vertices, in whichever form they are kept.

    ``make_resident`` is called when distances along axes are first asked for, as they are while
    drawing, ``make_tables`` when whole rows are; what they take is imported then: a stored scene is
    at hand at once. Without ``make_resident`` the tables serve both.

    >>> from pipelines.ssdf_lighting.compression.clustered_pca import clustered_pca
    >>> matrix = np.random.default_rng(0).normal(size=(6, 64)).astype(np.float32)
    >>> triangles, cluster = np.array([[0, 1, 2], [3, 4, 5]]), np.array([0, 1])
    >>> pca = clustered_pca(lambda rows: matrix[rows], triangles, cluster, values=3)
    >>> decoder = Decoder.of_pca(pca, vertices=6)
    >>> np.allclose(decoder.distances(np.arange(6)), matrix, atol=1e-5)
    True
    """

    def __init__(
        self,
        make_tables: Callable[[], DecoderTables],
        make_resident: Callable[[], ResidentTables] | None = None,
    ) -> None:
        self._make_tables = make_tables
        self._make_resident = make_resident

    @classmethod
    def of_file(cls, data: bytes) -> Decoder:
        """Of a file in either version of docs/ssdf_file.md.

        Of version 2, bits, whole rows are what is drawn from, too, in its directions. Distances
        raise ValueError for what is no such file.
        """
        if holds_bits(data):
            return cls(lambda: tables_of_resident(_rebuilt(data)), lambda: _rebuilt(data))

        def tables() -> DecoderTables:
            from pipelines.ssdf_lighting.compression.compact_file import from_bytes
            from pipelines.ssdf_lighting.compression.compact_memory import pack

            return tables_of_packed(pack(from_bytes(data)))

        def resident() -> ResidentTables:
            from pipelines.ssdf_lighting.compression.compact_file import from_bytes

            return resident_tables(from_bytes(data))

        return cls(tables, resident)

    @classmethod
    def of_pca(cls, pca: ClusteredPca, vertices: int) -> Decoder:
        """Of the paper's form of so many vertices."""
        return cls(lambda: tables_of_pca(pca, vertices))

    @functools.cached_property
    def tables(self) -> DecoderTables:
        """Clusters' vectors unfolded to all directions, as whole rows are made of them."""
        return self._make_tables()

    @functools.cached_property
    def resident(self) -> ResidentTables | DecoderTables:
        """All that is looked up while a scene is drawn."""
        return self.tables if self._make_resident is None else self._make_resident()

    @property
    def resident_bytes(self) -> int:
        """Bytes of the arrays that stay while a scene is drawn."""
        return sum(part.nbytes for part in self.resident if isinstance(part, np.ndarray))

    def distances(self, vertices: NDArray[np.integer]) -> Floats:
        """d (P, D) float32, radians, of vertices (P,) in all directions."""
        return decoded_rows(self.tables, vertices)

    def distances_in(self, vertices: NDArray[np.integer], n: int) -> Floats:
        """d (P, n²) float32, radians, of vertices (P,) in n x n directions: as `distances`,
        interpolated where the form has others."""
        from pipelines.ssdf_lighting.distances.octahedral import bilinear_taps, texel_directions

        rows = self.distances(vertices)
        if self.tables.resolution == n:
            return rows
        taps = bilinear_taps(texel_directions(n), self.tables.resolution)
        shares = taps.weights.astype(np.float32)
        found = np.zeros((len(rows), n * n), np.float32)
        for k in range(4):
            found += shares[:, k] * rows[:, taps.texels[:, k]]
        return found

    @property
    def distances_along(self) -> DistancesAlong:
        """Function of vertices (P,) and unit vectors (P, L, 3) float32: d (P, L) float32, radians.

        It holds what is resident and nothing else: not this decoder, nor its file.
        """
        from pipelines.ssdf_lighting.compression.lookup import decoded_along, resident_along

        kept = self.resident
        if isinstance(kept, ResidentTables):
            return functools.partial(resident_along, kept)
        return functools.partial(decoded_along, kept)


def holds_bits(data: bytes) -> bool:
    """Whether a file is in version 2 of docs/ssdf_file.md: bits in place of distances."""
    return data[8:10] == struct.pack("<H", 2)


@functools.lru_cache(maxsize=1)
def _rebuilt(data: bytes) -> ResidentTables:
    """What is drawn from a file of bits: kept, for it takes seconds, and assets and their checks
    ask for the same one."""
    from pipelines.ssdf_lighting.compression.bits_file import bits_from_bytes, resident_of_bits

    return resident_of_bits(bits_from_bytes(data))
