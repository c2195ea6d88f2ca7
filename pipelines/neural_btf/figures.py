"""Figures that tell whether a stage of the neural BTF is right."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs
from pipelines.neural_btf.network import HIDDEN, LATENTS

DECODER_PARAMETERS = 12 * HIDDEN + HIDDEN + 2 * (HIDDEN * HIDDEN + HIDDEN) + HIDDEN * 3 + 3
"""24 383."""


def missing_pairs(pairs: Pairs) -> int:
    """Pairs that are missing, or there twice, if every view is to have the same lights."""
    lights, light = np.unique(np.round(pairs.light, 9), axis=0, return_inverse=True)
    views, view = np.unique(np.round(pairs.view, 9), axis=0, return_inverse=True)
    counts = np.bincount(
        view.ravel() * len(lights) + light.ravel(), minlength=len(lights) * len(views)
    )
    return int(np.abs(counts - 1).sum())


def table_bytes(clusters: int, texels: int) -> int:
    """Bytes of table 1: decoder, latents and, where texels share latents, the index list."""
    index = 0 if clusters == texels else 4 * texels
    return 4 * (DECODER_PARAMETERS + LATENTS * clusters) + index


def spread_ratio(scores: NDArray[np.floating], ids: NDArray[np.integer]) -> float:
    """Squared distance to the cluster's mean over that to the mean of all, 0 to 1."""
    points = scores.astype(np.float64)
    counts = np.bincount(ids)
    sums = np.stack([np.bincount(ids, column) for column in points.T], axis=1)
    inside = np.sum((points - (sums / np.maximum(counts, 1)[:, None])[ids]) ** 2)
    whole = np.sum((points - points.mean(axis=0)) ** 2)
    return float(inside / whole) if whole > 0 else 0.0


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


def decoded_plainly(
    arrays: Mapping[str, NDArray[np.floating]],
    latents: NDArray[np.floating],
    directions: NDArray[np.floating],
) -> NDArray[np.float64]:
    """What a decoder's arrays say, (texel, pair, 3), for latents (texel, 8) and pairs (pair, 4).

    The network written out in NumPy, in double precision: what torch's is compared with.
    """
    inputs = [latents[:, None].repeat(len(directions), 1), directions[None].repeat(len(latents), 0)]
    values = np.concatenate(inputs, axis=-1).astype(np.float64)
    for layer in range(1, 5):
        values = values @ arrays[f"weight_{layer}"].T.astype(np.float64) + arrays[f"bias_{layer}"]
        if layer < 4:
            values = np.maximum(values, 0.0)
    return values
