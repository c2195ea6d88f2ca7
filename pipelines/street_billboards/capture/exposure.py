"""Exposures of photographs, evened out by what several of them show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb, encode_srgb

_ROUNDS = 6
_OUTLIER = 0.15
"""Difference of logarithms from which on an observation counts for less (Huber)."""


def exposure_gains(
    point: NDArray[np.integer],
    photograph: NDArray[np.integer],
    radiance: NDArray[np.floating],
    photograph_count: int,
) -> NDArray[np.float64]:
    """Factors (photographs, channels) of linear light by which photographs are brighter.

    One observation a row: which point, which photograph, linear radiance (n, channels) > 0. Solves
    log radiance = log point + log gain in the least absolute sense beyond small differences; what
    reflects differs from view to view. The gains' logarithms have the mean 0. Photographs that
    share no point with others have a gain of 1.

    >>> seen = np.array([[0.1], [0.2], [0.3], [0.6]])
    >>> gains = exposure_gains(np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1]), seen, 2)
    >>> np.round(gains[1] / gains[0], 3)
    array([2.])
    """
    logs = np.log(np.asarray(radiance, np.float64))
    gains = np.zeros((photograph_count, logs.shape[1]))
    points = int(point.max()) + 1 if len(point) else 0
    for channel in range(logs.shape[1]):
        weight = np.ones(len(point))
        for _ in range(_ROUNDS):
            # Points are eliminated: each leaves the differences to its weighted mean.
            total = np.maximum(np.bincount(point, weight, points), 1e-12)
            matrix = np.zeros((photograph_count, photograph_count))
            np.add.at(matrix, (photograph, photograph), weight)
            matrix -= _shared(point, photograph, weight, total, photograph_count)
            mean = np.bincount(point, weight * logs[:, channel], points) / total
            right = np.bincount(
                photograph, weight * (logs[:, channel] - mean[point]), photograph_count
            )
            # Just enough to have a solution: a drift along many photographs is held by little more.
            typical = float(matrix.trace()) / max(photograph_count, 1)
            matrix[np.diag_indices(photograph_count)] += 1e-9 * max(typical, 1e-9)
            found = np.linalg.solve(matrix, right)
            found -= found.mean()
            rest = logs[:, channel] - found[photograph]
            rest -= (np.bincount(point, weight * rest, points) / total)[point]
            weight = _OUTLIER / np.maximum(np.abs(rest), _OUTLIER)
        gains[:, channel] = found
    return np.exp(gains)


def _shared(
    point: NDArray[np.integer],
    photograph: NDArray[np.integer],
    weight: NDArray[np.float64],
    total: NDArray[np.float64],
    photographs: int,
) -> NDArray[np.float64]:
    from scipy.sparse import csr_array

    by_point = csr_array((weight, (point, photograph)), shape=(len(total), photographs))
    scaled = csr_array((weight / total[point], (point, photograph)), shape=by_point.shape)
    return np.asarray((by_point.T @ scaled).toarray())


def exposure_lut(gains: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Codes (…, 256, channels): what each sRGB code would be at a gain (…, channels) of 1.

    >>> exposure_lut(np.array([1.0, 2.0, 0.5]))[128]
    array([128,  92, 176], dtype=uint8)
    """
    linear = decode_srgb(np.arange(256) / 255.0)
    evened = linear[:, None] / np.asarray(gains)[..., None, :]
    return np.rint(encode_srgb(evened) * 255.0).astype(np.uint8)
