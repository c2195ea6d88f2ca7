"""Suns in a map of radiance: what is small, and so bright that the edge of its shadow is seen.

They are found in the map as it is, not in a smaller one, and leave it with their exact flux. A
disc of angular radius a and a spherical Gaussian of sharpness 4 / a² have the same variance, and
so the same width of penumbra.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance
from pipelines.light.environment_maps import solid_angles, texel_directions
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, integral

FloatArray = NDArray[np.float64]

SUN_RADIUS = math.radians(0.2665)
"""Of the sun in the sky, radians. Nothing is taken to be smaller."""
_MOST_RADIUS = math.radians(3.0)
_EDGE = 0.05  # of the peak, above what is around: a sun ends there
_LEAST_SHARE = 0.003  # of the map's flux


class SplitMap(NamedTuple):
    """``suns``: none or more, the brightest first. ``rest``: (H, 2 H, 3) float64, the map
    without what they add to it; both together have the map's flux."""

    suns: Lights
    rest: FloatArray


def sharpness_of_disc(radius: float) -> float:
    """λ of the SG that is as wide as a disc of even light, whose radius is in radians.

    >>> round(sharpness_of_disc(math.radians(0.2665)))
    184889
    """
    return 4.0 / radius**2


def split_suns(radiance: NDArray[np.floating], most: int) -> SplitMap:
    """Take up to ``most`` suns out of a map (H, 2 H, 3).

    A sun is at most 3 degrees in radius, where it has faded to a twentieth of its peak, and has
    0.3 % of the map's flux. What is wider does not need it: a few degrees of penumbra are no edge.
    """
    rest = np.array(radiance, np.float64)
    ways, omega = texel_directions(len(rest)), solid_angles(len(rest))[:, None]
    whole = float((luminance(rest) * omega).sum())
    found: list[tuple[FloatArray, float, FloatArray]] = []
    while len(found) < most:
        sun = _brightest(rest, ways, omega)
        if sun is None or float(luminance(sun.flux)) < _LEAST_SHARE * whole:
            break
        rest[sun.rows, sun.columns] -= sun.above
        found.append((sun.axis, sun.sharpness, sun.flux / integral(sun.sharpness)))
    axes, sharpness, amplitudes = zip(*found, strict=True) if found else ((), (), ())
    return SplitMap(
        Lights(
            np.reshape(axes, (-1, 3)), np.array(sharpness, float), np.reshape(amplitudes, (-1, 3))
        ),
        rest,
    )


class _Sun(NamedTuple):
    """axis (3,), λ, flux (3,); K texels that it covers, what it adds (K, 3) to what is around."""

    axis: FloatArray
    sharpness: float
    flux: FloatArray
    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    above: FloatArray


def _brightest(map_: FloatArray, ways: FloatArray, omega: FloatArray) -> _Sun | None:
    """The sun about the brightest texel, or nothing where that is part of something wide."""
    height = len(map_)
    bright: FloatArray = np.asarray(luminance(map_), np.float64)
    row, column = np.unravel_index(int(bright.argmax()), bright.shape)
    texel = math.pi / height
    near = slice(
        max(0, int(row - 2 * _MOST_RADIUS / texel) - 2), int(row + 2 * _MOST_RADIUS / texel) + 3
    )
    off = 2.0 * np.arcsin(
        np.minimum(0.5 * np.linalg.norm(ways[near] - ways[row, column], axis=-1), 1.0)
    )
    radius = _radius(bright[near], off, float(bright[row, column]), texel)
    if radius is None or texel > _MOST_RADIUS:
        return None
    ring = (off > radius) & (off <= 1.5 * radius + texel)
    around = np.median(map_[near][ring], axis=0)
    rows, columns = np.nonzero(off <= radius)
    rows = rows + near.start
    above = np.maximum(map_[rows, columns] - around, 0.0)
    weights = above.sum(axis=1) * omega[rows, 0]
    if not weights.any():
        return None
    flux = (above * omega[rows]).sum(axis=0)
    weights /= weights.sum()
    mean = weights @ ways[rows, columns]
    axis = mean / np.linalg.norm(mean)
    # A texel has a width itself.
    spread = float(weights @ (1.0 - ways[rows, columns] @ axis)) + texel**2 / 12.0
    sharpness = min(1.0 / max(spread, 1e-30), sharpness_of_disc(SUN_RADIUS))
    return _Sun(axis, sharpness, flux, rows, columns, above)


def _radius(bright: FloatArray, off: FloatArray, peak: float, texel: float) -> float | None:
    """How far from the peak the mean of a ring has faded."""
    last = int(2 * _MOST_RADIUS / texel) + 2
    ring = np.minimum((off / texel + 0.5).astype(np.int64), last)
    count = np.bincount(ring.ravel(), minlength=last + 1)
    means = np.bincount(ring.ravel(), bright.ravel(), last + 1) / np.maximum(count, 1)
    inner = max(1, math.ceil(_MOST_RADIUS / texel))
    floor = float(np.min(means[1:last][: 2 * inner]))
    faded = np.flatnonzero(means[: inner + 1] <= floor + _EDGE * (peak - floor))
    return (float(faded[0]) + 0.5) * texel if len(faded) else None
