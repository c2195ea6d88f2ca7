"""Figures that tell whether a stage of the neural BTF is right, each apart from what made it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs
from pipelines.neural_btf.decoder_arrays import DECODER_PARAMETERS, LATENTS

# ---- photographs -----------------------------------------------------------------------------


def missing_pairs(pairs: Pairs) -> int:
    """Pairs that are missing, or there twice, if every view is to have the same lights.

    >>> from pipelines.light.directions import all_pairs, hemisphere_table
    >>> pairs = all_pairs(hemisphere_table(15), hemisphere_table(15))
    >>> missing_pairs(pairs), missing_pairs(Pairs(pairs.light[:-2], pairs.view[:-2]))
    (0, 2)
    """
    lights, light = np.unique(np.round(pairs.light, 9), axis=0, return_inverse=True)
    views, view = np.unique(np.round(pairs.view, 9), axis=0, return_inverse=True)
    counts = np.bincount(
        view.ravel() * len(lights) + light.ravel(), minlength=len(lights) * len(views)
    )
    return int(np.abs(counts - 1).sum())


def dark_share(photographs: Iterable[NDArray[np.floating]]) -> float:
    """Share of the photographs that are black, in blocks (image, y, x, channel)."""
    dark = [(block.reshape(len(block), -1).max(axis=1) <= 0) for block in photographs]
    return float(np.concatenate(dark).mean())


def mean_radiance(photographs: Iterable[NDArray[np.floating]]) -> float:
    """Mean of all values, in blocks (image, y, x, channel)."""
    sums = [(float(block.sum(dtype=np.float64)), block.size) for block in photographs]
    return sum(part for part, _ in sums) / sum(size for _, size in sums)


# ---- ABRDFs ----------------------------------------------------------------------------------


def transposition_error(abrdfs: NDArray[np.floating], images: NDArray[np.floating]) -> float:
    """Largest difference of ABRDFs (texel, n, channel) from photographs (n, y, x, channel)."""
    expected = np.stack([image.reshape(-1, 3) for image in images], axis=1)
    return float(np.abs(abrdfs.astype(np.float64) - expected).max())


def statistics_error(
    mean: NDArray[np.floating], deviation: NDArray[np.floating], images: NDArray[np.floating]
) -> float:
    """Largest difference of mu and sigma (n, channel) from those of photographs (n, y, x, c)."""
    logs = np.log(images.astype(np.float64) + 1.0)
    steps = np.abs(logs.mean(axis=(1, 2)) - mean), np.abs(logs.std(axis=(1, 2)) - deviation)
    return float(max(step.max() for step in steps))


def explained_share(singular_values: NDArray[np.floating], total_variation: float) -> float:
    """Share of the variation that the principal components hold, 0 to 1."""
    return float((singular_values**2).sum() / total_variation)


# ---- clusters --------------------------------------------------------------------------------


def smallest_cluster(ids: NDArray[np.integer], sizes: NDArray[np.integer]) -> int:
    """Members of the smallest cluster; 0 where the sizes are not those of the cluster numbers."""
    counted = np.bincount(ids, minlength=len(sizes))
    return int(counted.min()) if np.array_equal(counted, sizes) else 0


def spread_ratio(scores: NDArray[np.floating], ids: NDArray[np.integer]) -> float:
    """Squared distance to the cluster's mean over that to the mean of all, 0 to 1."""
    points = scores.astype(np.float64)
    counts = np.bincount(ids)
    sums = np.stack([np.bincount(ids, column) for column in points.T], axis=1)
    inside = np.sum((points - (sums / np.maximum(counts, 1)[:, None])[ids]) ** 2)
    whole = np.sum((points - points.mean(axis=0)) ** 2)
    return float(inside / whole) if whole > 0 else 0.0


# ---- network ---------------------------------------------------------------------------------


def loss_ratio(curve_rmse: NDArray[np.floating]) -> float:
    """RMSE of the last tenth of a loss curve over that of the first tenth."""
    tenth = max(1, len(curve_rmse) // 10)
    return float(curve_rmse[-tenth:].mean() / curve_rmse[:tenth].mean())


def table_bytes(clusters: int, texels: int) -> int:
    """Bytes of table 1: decoder, latents and, where texels share latents, the index list.

    >>> table_bytes(500, 10_000), table_bytes(10_000, 10_000)
    (153532, 417532)
    """
    index = 0 if clusters == texels else 4 * texels
    return 4 * (DECODER_PARAMETERS + LATENTS * clusters) + index


# ---- pictures --------------------------------------------------------------------------------


def mean_brightness(pictures: NDArray[np.uint8]) -> float:
    """Mean of the pictures' 8-bit codes, in [0, 1]."""
    return float(pictures.mean() / 255.0)
