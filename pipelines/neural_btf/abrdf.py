"""From photographs to ABRDFs: the transposition, and the encoder's view of the values (Eq. 1-4).

x1 is a measured value, x2 = log(x1 + 1), x3 = (x2 - mu) / sigma with the mean mu and the standard
deviation sigma over the texels, for every photograph and channel by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

LARGEST_HALF = 65504.0
"""Largest number of a half float: BTFs are stored as such."""

AbrdfSpace = Literal["log", "standardised", "linear"]
"""Where distances between ABRDFs are measured: on x2, x3 or x1."""

_LEAST_DEVIATION = 1e-6
"""A photograph of one value has no deviation to divide by: its x3 is 0."""


class ImageStatistics(NamedTuple):
    """Mean and deviation of x2 over the texels, and the largest x1, one a photograph."""

    mean: NDArray[np.float32]
    """mu, (image, channel) (Eq. 2)."""
    deviation: NDArray[np.float32]
    """sigma, (image, channel) (Eq. 3), at least 1e-6."""
    largest: NDArray[np.float32]
    """(image,)."""


@dataclass(frozen=True)
class PhotographBlocks:
    """All photographs of a BTF, a block at a time: iterated over as often as they are wanted."""

    images: int
    """N, photographs in all blocks together."""
    read: Callable[[], Iterable[NDArray[np.floating]]]
    """Starts a pass: blocks (image, y, x, channel), from the first photograph to the last."""

    @classmethod
    def of_array(cls, images: NDArray[np.floating]) -> PhotographBlocks:
        """One block of photographs (image, y, x, channel) that are in memory."""
        return cls(len(images), lambda: [images])

    def __iter__(self) -> Iterator[NDArray[np.floating]]:
        return iter(self.read())


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


def image_statistics(images: NDArray[np.floating]) -> ImageStatistics:
    """Statistics over the texels of photographs (image, y, x, channel).

    >>> found = image_statistics(np.full((5, 4, 4, 3), np.e - 1.0))
    >>> found.mean.shape, round(float(found.mean[0, 0]), 4)
    ((5, 3), 1.0)
    """
    logs = log_values(images).reshape(len(images), -1, images.shape[-1])
    deviation = logs.std(axis=1, dtype=np.float64).astype(np.float32)
    return ImageStatistics(
        logs.mean(axis=1, dtype=np.float64).astype(np.float32),
        np.maximum(deviation, _LEAST_DEVIATION),
        images.reshape(len(images), -1).max(axis=1).astype(np.float32),
    )


def standardised(
    values: NDArray[np.floating], mean: NDArray[np.float32], deviation: NDArray[np.float32]
) -> NDArray[np.float32]:
    """x3 of x1 (Eq. 4): ABRDFs (..., image, channel), mu and sigma (image, channel)."""
    return (log_values(values) - mean) / deviation


def abrdf_columns(images: NDArray[np.floating], space: AbrdfSpace) -> NDArray[np.float32]:
    """Photographs (image, y, x, channel) as columns of the ABRDF matrix in a space.

    Returns (texel, image * channel) float32: what `lowrank.principal_components` reads.
    """
    if space == "linear":
        values = images.astype(np.float32)
    else:
        values = log_values(images)
        if space == "standardised":
            found = image_statistics(images)
            values = (values - found.mean[:, None, None]) / found.deviation[:, None, None]
    return transposed(values).reshape(images.shape[1] * images.shape[2], -1)


def transposed_view(images: Any) -> Any:
    """Photographs (image, y, x, channel) as (texel, image, channel), texels row by row.

    Of a NumPy array or of a lazy one, whose transposition is lazy then.
    """
    count, height, width, channels = images.shape
    return images.transpose(1, 2, 0, 3).reshape(height * width, count, channels)


def transposed(images: NDArray[np.floating]) -> NDArray[np.floating]:
    """ABRDFs (texel, image, channel) of photographs (image, y, x, channel), contiguous in memory.

    >>> images = np.zeros((225, 6, 8, 3), np.float16)
    >>> images[7, 2, 5] = 0.5
    >>> abrdfs = transposed(images)
    >>> abrdfs.shape, abrdfs[2 * 8 + 5, 7].tolist()
    ((48, 225, 3), [0.5, 0.5, 0.5])
    """
    return np.ascontiguousarray(transposed_view(images))
