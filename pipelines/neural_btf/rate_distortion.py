"""What bytes buy: a network's errors in files of many sizes, and why there are no clusters in ours.

All are made from one trained network without training it further: latents rounded to ever fewer
bits, and latents shared by ever fewer clusters of texels, as the paper shares them, also with a
gain a texel against its graininess. The file that was trained to be rounded stands beside them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.clustering import k_means_plus_plus
from pipelines.drawing.plots import canvas_picture, new_figure
from pipelines.neural_btf.abrdf_pool import AbrdfReader
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.representatives import cluster_means, cluster_members

_BLOCKS, _BLOCK = 4, 64
_PAIRS_STEP = 13


class Sample(NamedTuple):
    """Measured values that forms are compared by: some blocks of texels in every 13th pair."""

    blocks: tuple[tuple[int, int], ...]
    """First and last + 1 of texels."""
    directions: NDArray[np.float32]
    """(pair, 4)."""
    values: NDArray[np.float32]
    """(texel, pair, 3), over alpha."""


def sample_of(read: AbrdfReader, texels: int, directions: NDArray[np.float32]) -> Sample:
    """Of ``read``, which gives ABRDFs over alpha, (texel, pair, 3)."""
    pairs = np.arange(0, len(directions), _PAIRS_STEP)
    firsts = np.unique(np.linspace(0, max(0, texels - _BLOCK), _BLOCKS).astype(int))
    blocks = tuple((int(first), min(int(first) + _BLOCK, texels)) for first in firsts)
    values = np.concatenate([read(*block)[:, pairs] for block in blocks]).astype(np.float32)
    return Sample(blocks, directions[pairs], values)


def restored(btf: CompressedBtf, sample: Sample) -> NDArray[np.float32]:
    """What a form makes of the sample, (texel, pair, 3)."""
    return np.concatenate([btf.abrdfs(*block, sample.directions) for block in sample.blocks])


def rmse(found: NDArray[np.floating], sample: Sample) -> float:
    """Over alpha, of all values of the sample."""
    return float(np.sqrt(np.mean((found.astype(np.float64) - sample.values) ** 2)))


def rmse_null(sample: Sample) -> float:
    """Of the mean ABRDF for every texel."""
    return rmse(np.broadcast_to(sample.values.mean(axis=0), sample.values.shape), sample)


def with_gains(found: NDArray[np.float32], sample: Sample) -> NDArray[np.float32]:
    """Each texel's values times the one number that brings them nearest to the measured ones."""
    products = np.einsum("tpc,tpc->t", found, sample.values)
    squares = np.einsum("tpc,tpc->t", found, found)
    gains = np.divide(products, squares, out=np.ones_like(products), where=squares > 0)
    return found * gains[:, None, None]


def rounded(
    values: NDArray[np.floating], bits: int
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Whole numbers of so many bits, sign included, and steps: a column (n, channel) has its own.

    >>> symbols, steps = rounded(np.array([[-3.0], [1.8], [0.9]]), 3)
    >>> symbols.ravel().tolist(), steps.tolist()
    ([-3, 2, 1], [1.0])
    """
    largest = np.abs(values).max(axis=0)
    steps = np.where(largest > 0, largest, 1.0) / (2 ** (bits - 1) - 1)
    return np.rint(values / steps).astype(np.int32), steps.astype(np.float32)


def clustered(btf: CompressedBtf, clusters: int, seed: int = 0) -> CompressedBtf:
    """Texels share the mean latents of so many clusters of them."""
    latents = btf.latents_of(slice(None))
    ids = k_means_plus_plus(latents, clusters, seed)
    means = cluster_means(latents, cluster_members(ids, clusters))
    return replace(btf, latents=means.astype(np.float32), ids=ids, mips=())


def rmse_at(asked: float, sizes: NDArray[np.floating], errors: NDArray[np.floating]) -> float:
    """The error that forms of these sizes, ascending, have at so many bytes: between two of them
    by the logarithms of both.

    >>> round(rmse_at(20.0, np.array([10.0, 40.0]), np.array([0.4, 0.1])), 3)
    0.2
    """
    return float(np.exp(np.interp(np.log(asked), np.log(sizes), np.log(errors))))


class Curves(NamedTuple):
    """Bytes and RMSE over alpha."""

    bits: NDArray[np.int64]
    rounded: NDArray[np.float64]
    """(bits, 2): latents rounded to so many bits."""
    clusters: NDArray[np.int64]
    clustered: NDArray[np.float64]
    """(clusters, 2)."""
    gained: NDArray[np.float64]
    """(clusters, 2): with a gain a texel, of a byte."""
    float32: NDArray[np.float64]
    """(2,) the paper's form."""
    file: NDArray[np.float64]
    """(2,) the file that was trained to be rounded."""
    null: NDArray[np.float64]
    """() of the mean ABRDF for every texel."""

    @property
    def file_over_rounding(self) -> float:
        """RMSE of the file over that of plain rounding at its bytes."""
        at = rmse_at(self.file[0], self.rounded[:, 0], self.rounded[:, 1])
        return float(self.file[1] / at)


def rate_distortion_picture(curves: Curves) -> NDArray[np.uint8]:
    """All of it on logarithmic axes."""
    figure, canvas = new_figure(6.4, 4.4)
    axis = figure.subplots()
    axis.plot(*curves.rounded.T, "o-", color="tab:blue", label="latents rounded, not trained")
    for bits, (x, y) in zip(curves.bits, curves.rounded, strict=True):
        axis.annotate(f"{bits}", (x, y), xytext=(3, 4), textcoords="offset points", fontsize=8)
    if len(curves.clusters):
        axis.plot(*curves.clustered.T, "s-", color="tab:red", label="clusters of texels")
        axis.plot(*curves.gained.T, "s:", color="tab:red", label="clusters, a gain a texel")
    for clusters, (x, y) in zip(curves.clusters, curves.clustered, strict=True):
        axis.annotate(
            f"k={clusters}", (x, y), xytext=(3, 4), textcoords="offset points", fontsize=8
        )
    axis.plot(*curves.float32, "D", color="tab:gray", label="float32, the paper's form")
    axis.plot(*curves.file, "*", color="tab:green", markersize=14, label="the file")
    axis.axhline(float(curves.null), color="black", linewidth=0.8, linestyle="--", label="mean")
    axis.set(xlabel="bytes", ylabel="RMSE over alpha", xscale="log", yscale="log")
    axis.grid(alpha=0.3, which="both")
    axis.legend(fontsize=8)
    return canvas_picture(canvas)
