"""A table as sampling needs it: the lobe of every view at every place across the scratch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_edges, bin_weights
from pipelines.glass_scratches.tables.walls import bounce_blur

_LEAST_BLUR = 0.01
"""Of theta at a mirror: lobes of half a degree can still be evaluated."""


class Direction(NamedTuple):
    """A unit vector in the scratch's frame: along the scratch, across it, and its normal."""

    u: float
    v: float
    n: float


class Lobe(NamedTuple):
    """What the kernels need of a table.

    ``rho`` (places, M, M) float32; ``cdf`` (places, M, M + 1) float32 over the light's bins, from
    0 to 1; ``share`` (places, M) float32: part of the light that leaves; ``sines`` (M + 1,) of the
    bins' borders; ``blur`` of theta's quantile, infinite where k = 1 (see `sampling`).
    """

    rho: NDArray[np.float32]
    cdf: NDArray[np.float32]
    share: NDArray[np.float32]
    sines: NDArray[np.float64]
    blur: float


def make_lobe(across: NDArray[np.float32], roughness: float) -> Lobe:
    """The lobe of a table's ``across`` (places, M, M). Raises ValueError for a roughness outside
    [0, 1].

    >>> lobe = make_lobe(np.ones((2, 8, 8), np.float32), roughness=0.5)
    >>> lobe.cdf.shape, lobe.share.shape, lobe.blur
    ((2, 8, 9), (2, 8), 0.5)
    """
    bins = across.shape[1]
    part = across.astype(np.float64) * bin_weights(bins) / np.pi
    share = part.sum(axis=-1)
    running = np.cumsum(part, axis=-1) / np.where(share > 0, share, 1.0)[..., None]
    cdf = np.concatenate([np.zeros((*share.shape, 1)), running], axis=-1)
    cdf[..., -1] = 1.0
    return lobe_from_sums(across, cdf.astype(np.float32), share.astype(np.float32), roughness)


def lobe_from_sums(
    across: NDArray[np.float32],
    cdf: NDArray[np.float32],
    share: NDArray[np.float32],
    roughness: float,
) -> Lobe:
    """A lobe whose sums were made before. Raises ValueError for a roughness outside [0, 1]."""
    # Half: the quantile runs over (0, 1), the bounce's sine over (-1, 1).
    blur = max(bounce_blur(roughness) / 2, _LEAST_BLUR)
    return Lobe(across, cdf, share, np.sin(bin_edges(across.shape[1])), float(blur))
