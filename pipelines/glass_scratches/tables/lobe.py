"""A table as sampling needs it: the lobe of every view at every place across the scratch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_edges
from pipelines.glass_scratches.tables.bsdf_table import BsdfTable, lean_weights

_LEAST_BLUR = 0.01
"""Of the lean where walls keep it: lobes of half a degree can still be evaluated."""


class Direction(NamedTuple):
    """A unit vector in the scratch's frame: along the scratch, across it, and its normal."""

    u: float
    v: float
    n: float


class Lobe(NamedTuple):
    """What the kernels need of tables of S leans, M bins a side.

    ``rho`` (S, places, 2 M view, 2 M light) float32; ``cdf`` (S, places, 2 M, 2 M + 1) float32 over
    the light's bins, from 0 to 1; ``share`` (S, places, 2 M) float32: part of the light that
    leaves; ``weights`` (S, 2 M): rho times these is the part that goes into a bin; ``leans`` (S,);
    ``keeps``: whether walls keep the lean (the last table is then that from a lean of 1 on);
    ``sines`` (M + 1,) of the bins' borders; ``refractive_index`` of the glass; ``blur``: deviation
    of the lean where it is kept.
    """

    rho: NDArray[np.float32]
    cdf: NDArray[np.float32]
    share: NDArray[np.float32]
    weights: NDArray[np.float64]
    leans: NDArray[np.float64]
    keeps: bool
    sines: NDArray[np.float64]
    refractive_index: float
    blur: float


def make_lobe(table: BsdfTable) -> Lobe:
    """The lobe of a table of both sides.

    >>> flat = np.full((1, 16, 16), np.pi / 2 / 3.25)
    >>> across = flat[:, None].astype(np.float32)
    >>> table = BsdfTable(flat, 0 * flat, np.zeros((1, 16)), across, np.zeros(1), False, 1.5)
    >>> lobe = make_lobe(table)
    >>> lobe.cdf.shape, round(float(lobe.share[0, 0, 0]), 6)
    ((1, 1, 16, 17), 1.0)
    """
    weights = _weights(table)
    part = table.across * weights[:, None, None].astype(np.float32)
    share = part.sum(axis=-1, dtype=np.float64)
    running = np.cumsum(part, axis=-1, dtype=np.float64)
    running /= np.where(share > 0, share, 1.0)[..., None]
    cdf = np.zeros((*share.shape, part.shape[-1] + 1), np.float32)
    cdf[..., 1:] = running
    cdf[..., -1] = 1.0
    return lobe_from_sums(table, cdf, share.astype(np.float32))


def lobe_from_sums(table: BsdfTable, cdf: NDArray[np.float32], share: NDArray[np.float32]) -> Lobe:
    """A lobe whose sums were made before."""
    return Lobe(
        table.across,
        cdf,
        share,
        _weights(table),
        table.leans,
        table.keeps,
        np.sin(bin_edges(table.across.shape[-1] // 2)),
        float(table.refractive_index),
        _LEAST_BLUR,
    )


def _weights(table: BsdfTable) -> NDArray[np.float64]:
    bins = table.across.shape[-1] // 2
    return lean_weights(bins, table.leans, table.refractive_index, keeps=table.keeps)
