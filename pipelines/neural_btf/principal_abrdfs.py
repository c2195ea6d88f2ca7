"""What is known of all ABRDFs together: statistics and principal components, block by block."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.lowrank import principal_components
from pipelines.neural_btf.abrdf import (
    AbrdfSpace,
    ImageStatistics,
    PhotographBlocks,
    abrdf_columns,
    image_statistics,
)


class AbrdfSummary(NamedTuple):
    """Statistics and principal components of M ABRDFs of N photographs."""

    statistics: ImageStatistics
    """Of all photographs."""
    scores: NDArray[np.float32]
    """(texel, component), the most important first."""
    singular_values: NDArray[np.float64]
    """(component,)."""
    total_variation: float
    """Sum of squares of the centred matrix: what all components together explain."""

    @property
    def alpha(self) -> float:
        """Largest value of all (Eq. 5)."""
        return float(self.statistics.largest.max())


def summarise_abrdfs(
    photographs: PhotographBlocks,
    *,
    components: int = 32,
    space: AbrdfSpace = "log",
    progress: Callable[[float], None] = lambda fraction: None,
) -> AbrdfSummary:
    """Statistics, and at most so many principal components in a space, in five passes (Eq. 1-5)."""
    found: list[ImageStatistics] = []
    variation = 0.0
    texels = read = 0
    for block in photographs:
        found.append(image_statistics(block))
        centred = abrdf_columns(block, space)
        centred -= centred.mean(axis=0)
        variation += float(np.sum(centred.astype(np.float64) ** 2))
        texels, read = len(centred), read + len(block)
        progress(0.3 * read / photographs.images)
    rank = min(components, texels, 3 * photographs.images)
    parts = principal_components(
        lambda: (abrdf_columns(block, space) for block in photographs), rank
    )
    progress(0.9)
    statistics = ImageStatistics(*(np.concatenate(blocks) for blocks in zip(*found, strict=True)))
    return AbrdfSummary(statistics, parts.scores, parts.singular_values, variation)
