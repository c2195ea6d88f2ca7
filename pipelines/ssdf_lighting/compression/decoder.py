"""What a compressed scene is asked for: distances of vertices."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.clustered_pca import ClusteredPca
from pipelines.ssdf_lighting.compression.decoder_tables import (
    DecoderTables,
    decoded_rows,
    tables_of_packed,
    tables_of_pca,
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
        """Of the compact form's file. Distances raise ValueError for what is no such file."""

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
