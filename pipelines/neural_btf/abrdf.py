"""From photographs to ABRDFs: the transposition, and the encoder's view of the values (Eq. 1-4).

x1 is a measured value, x2 = log(x1 + 1), x3 = (x2 - mu) / sigma with the mean mu and the standard
deviation sigma over the texels, for every photograph and channel by itself.
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

LARGEST_HALF = 65504.0
"""Largest number of a half float: BTFs are stored as such."""

Space = Literal["log", "standardised", "linear"]
"""Where distances between ABRDFs are measured: on x2, x3 or x1."""

_LEAST_DEVIATION = 1e-6
"""A photograph of one value has no deviation to divide by: its x3 is 0."""


class Statistics(NamedTuple):
    """Mean and deviation of x2 over the texels, and the largest x1, one a photograph."""

    mean: NDArray[np.float32]
    """mu, (image, channel) (Eq. 2)."""
    deviation: NDArray[np.float32]
    """sigma, (image, channel) (Eq. 3), at least 1e-6."""
    largest: NDArray[np.float32]
    """(image,)."""


def check_values(values: NDArray[np.floating]) -> None:
    """Raise ValueError unless all values are finite, above -1 (for the log) and fit a half float.

    Negative values are allowed: colours outside the RGB gamut have them.
    """
    least, largest = float(values.min()), float(values.max())
    if not np.isfinite(least) or not np.isfinite(largest):
        raise ValueError("BTF: a value is not finite; expected finite radiance.")
    if least <= -1.0 or largest > LARGEST_HALF:
        raise ValueError(
            f"BTF: values are {least:.4g} to {largest:.6g}; expected more than -1 and at most "
            f"{LARGEST_HALF:g}."
        )


def log_values(values: NDArray[np.floating]) -> NDArray[np.float32]:
    """x2 of x1 (Eq. 1), any shape."""
    return np.log1p(values.astype(np.float32))


def statistics(images: NDArray[np.floating]) -> Statistics:
    """Statistics over the texels of photographs (image, y, x, channel)."""
    logs = log_values(images).reshape(len(images), -1, images.shape[-1])
    deviation = logs.std(axis=1, dtype=np.float64).astype(np.float32)
    return Statistics(
        logs.mean(axis=1, dtype=np.float64).astype(np.float32),
        np.maximum(deviation, _LEAST_DEVIATION),
        images.reshape(len(images), -1).max(axis=1).astype(np.float32),
    )


def standardised(
    values: NDArray[np.floating], mean: NDArray[np.float32], deviation: NDArray[np.float32]
) -> NDArray[np.float32]:
    """x3 of x1 (Eq. 4): ABRDFs (..., image, channel), mu and sigma (image, channel)."""
    return (log_values(values) - mean) / deviation


def columns(images: NDArray[np.floating], space: Space) -> NDArray[np.float32]:
    """Photographs (image, y, x, channel) as columns of the ABRDF matrix in a space.

    Returns (texel, image * channel) float32: what `lowrank.principal_components` reads.
    """
    if space == "linear":
        values = images.astype(np.float32)
    else:
        values = log_values(images)
        if space == "standardised":
            found = statistics(images)
            values = (values - found.mean[:, None, None]) / found.deviation[:, None, None]
    return transposed(values).reshape(images.shape[1] * images.shape[2], -1)


def texel_rows(images: Any) -> Any:
    """Photographs (image, y, x, channel) as (texel, image, channel), texels row by row.

    Of a NumPy array or of a lazy one, whose transposition is lazy then.
    """
    count, height, width, channels = images.shape
    return images.transpose(1, 2, 0, 3).reshape(height * width, count, channels)


def transposed(images: NDArray[np.floating]) -> NDArray[np.floating]:
    """The same, contiguous in memory."""
    return np.ascontiguousarray(texel_rows(images))
