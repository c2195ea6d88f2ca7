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

Floats = NDArray[np.float32]


class Decoder:
    """The SSDFs of a scene's vertices, in whichever form they are kept.

    ``make_tables`` is called when distances are first asked for, and what they take is imported
    then: a stored scene is at hand at once.

    >>> from pipelines.ssdf_lighting.compression.clustered_pca import clustered_pca
    >>> matrix = np.random.default_rng(0).normal(size=(6, 64)).astype(np.float32)
    >>> triangles, cluster = np.array([[0, 1, 2], [3, 4, 5]]), np.array([0, 1])
    >>> pca = clustered_pca(lambda rows: matrix[rows], triangles, cluster, values=3)
    >>> decoder = Decoder.of_pca(pca, vertices=6)
    >>> np.allclose(decoder.distances(np.arange(6)), matrix, atol=1e-5)
    True
    """

    def __init__(self, make_tables: Callable[[], DecoderTables]) -> None:
        self._make_tables = make_tables

    @classmethod
    def of_file(cls, data: bytes) -> Decoder:
        """Of the compact form's file. Distances raise ValueError for what is no such file."""

        def tables() -> DecoderTables:
            from pipelines.ssdf_lighting.compression.compact_file import from_bytes
            from pipelines.ssdf_lighting.compression.compact_memory import pack

            return tables_of_packed(pack(from_bytes(data)))

        return cls(tables)

    @classmethod
    def of_pca(cls, pca: ClusteredPca, vertices: int) -> Decoder:
        """Of the paper's form of so many vertices."""
        return cls(lambda: tables_of_pca(pca, vertices))

    @functools.cached_property
    def tables(self) -> DecoderTables:
        """All that is looked up, laid out."""
        return self._make_tables()

    def distances(self, vertices: NDArray[np.integer]) -> Floats:
        """d (P, D) float32, radians, of vertices (P,) in all directions."""
        return decoded_rows(self.tables, vertices)

    def distances_along(self, vertices: NDArray[np.integer], axes: Floats) -> Floats:
        """d (P, L) float32, radians, of vertices (P,) along unit vectors (P, L, 3) float32."""
        from pipelines.ssdf_lighting.compression.lookup import decoded_along

        return decoded_along(self.tables, vertices, axes)
