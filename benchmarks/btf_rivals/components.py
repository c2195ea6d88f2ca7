"""Principal components of ABRDFs as a tensor over views, lights and channels.

Of radiance, which is what errors are of: of log(1 + radiance) they made errors larger (0.4 % on
knit at 65 536 bytes).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.btf_rivals.rival import MeasuredBtf
from pipelines.lowrank import principal_components

MOST_COMPONENTS = 96


class Components(NamedTuple):
    """Values (texel, view, light, channel) are about ``texels`` times ``tensor``."""

    texels: NDArray[np.float32]
    """(M, 1 + rank), orthonormal columns; the first is constant and carries the mean."""
    tensor: NDArray[np.float32]
    """(1 + rank, views, lights, 3)."""


def components_of(measured: MeasuredBtf) -> Components:
    """The largest components of all ABRDFs, 96 of them or as many as there can be.

    The randomised search takes one iteration: components past the first ten need not be exact,
    the products are those of the data all the same.
    """
    abrdfs = measured.abrdfs
    texels, images, _ = abrdfs.shape

    def blocks() -> Iterator[NDArray[np.float32]]:
        for first in range(0, images, 243):
            yield abrdfs[:, first : first + 243].astype(np.float32).reshape(texels, -1)

    mean = np.concatenate([block.mean(axis=0, dtype=np.float64) for block in blocks()])
    rank = min(MOST_COMPONENTS, texels, 3 * images)
    found = principal_components(blocks, rank, iterations=1, seed=measured.seed)
    rank = max(1, int(np.sum(found.singular_values > 1e-6 * found.singular_values[0])))
    lengths = np.maximum(found.singular_values[:rank], 1e-30)
    columns = np.concatenate(
        [np.full((texels, 1), texels**-0.5), found.scores[:, :rank] / lengths], axis=1
    )
    rows = np.concatenate(
        [mean[:, None] * texels**0.5, found.loadings[:, :rank] * lengths], axis=1
    ).T
    shape = (1 + rank, len(measured.views), len(measured.lights), 3)
    return Components(columns.astype(np.float32), rows.astype(np.float32).reshape(shape))
