"""Measured ABRDFs averaged over the texels of coarser levels: what far views are to show."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.neural_btf.abrdf_pool import AbrdfReader
from pipelines.neural_btf.latent_texture import cover, level_sizes


class AveragedAbrdfs(NamedTuple):
    """ABRDFs of coarser levels in some of the photographs."""

    levels: tuple[NDArray[np.float16], ...]
    """Level 1, 2, …: (texel, photograph, 3)."""
    photographs: NDArray[np.int64]
    """Their numbers, ascending: whole views."""


def averaged_abrdfs(
    read: AbrdfReader,
    size: tuple[int, int],
    views: NDArray[np.integer],
    *,
    budget: int,
    seed: int = 0,
    progress: Callable[[float], None] = lambda fraction: None,
) -> AveragedAbrdfs:
    """Average ABRDFs over what each coarser texel covers (`latent_texture.cover`), row by row.

    ``read`` gives ABRDFs of texels, ``size`` is (rows, columns) of them, ``views`` (photograph,)
    numbers the view of each. Where all levels would take more than ``budget`` bytes, views are
    drawn that fit.

    >>> values = np.arange(16.0).reshape(4, 4, 1) * np.ones(3)
    >>> found = averaged_abrdfs(lambda a, b: values[a:b], (2, 2), np.arange(4), budget=1 << 20)
    >>> len(found.levels), found.levels[0][0, :, 0].tolist()
    (1, [6.0, 7.0, 8.0, 9.0])
    """
    height, width = size
    sizes = level_sizes(*size)[1:]
    photographs = _photographs_within(
        budget // (6 * sum(a * b for a, b in sizes) or 1), views, seed
    )
    down = [cover(height, rows).astype(np.float32) for rows, _ in sizes]
    across = [cover(width, columns).astype(np.float32) for _, columns in sizes]
    sums = [np.zeros((*coarse, len(photographs), 3), np.float32) for coarse in sizes]
    for row in range(height):
        fine = read(row * width, (row + 1) * width)[:, photographs].astype(np.float32)
        for rows, columns, total in zip(down, across, sums, strict=True):
            means = (columns @ fine.reshape(width, -1)).reshape(len(columns), -1, 3)
            for target in np.flatnonzero(rows[:, row]):
                total[target] += rows[target, row] * means
        progress((row + 1) / height)
    levels = tuple(part.reshape(-1, len(photographs), 3).astype(np.float16) for part in sums)
    return AveragedAbrdfs(levels, photographs)


def _photographs_within(most: int, views: NDArray[np.integer], seed: int) -> NDArray[np.int64]:
    """All photographs, or those of some views, drawn, of which at most so many are."""
    numbers, counts = np.unique(views, return_counts=True)
    order = np.random.default_rng(seed).permutation(len(numbers))
    fitting = max(1, int(np.searchsorted(np.cumsum(counts[order]), most, side="right")))
    return np.flatnonzero(np.isin(views, numbers[order[:fitting]]))
