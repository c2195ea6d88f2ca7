"""How near layers are to the photograph that they were made of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.photograph.photograph_layers import PhotographScratches
from pipelines.glass_scratches.photograph.segments import Segments, find_segments

_BINS = 180


class Likeness(NamedTuple):
    """direction_error: degrees by which area has to be turned, on average, to have the other's
    directions. coverage_ratio: area times contrast, over the photograph's, per area."""

    direction_error: float
    coverage_ratio: float


def direction_error(one: Segments, other: Segments) -> float:
    """Earth mover's distance of two sets' directions, degrees, by their areas: 0 to 45.

    >>> still = Segments(np.zeros((1, 2)), np.zeros(1), *np.ones((3, 1)), np.zeros(1))
    >>> round(direction_error(still, still._replace(angle=np.array([np.pi / 2]))))
    90
    """
    difference = np.cumsum(_shares(one) - _shares(other))
    # Around the half circle: what flows past the cut is free to choose (the median is the least).
    return float(np.abs(difference - np.median(difference)).sum() * 180.0 / _BINS)


def _shares(segments: Segments) -> NDArray[np.float64]:
    bins = (np.mod(segments.angle, np.pi) * (_BINS / np.pi)).astype(int) % _BINS
    sums = np.bincount(bins, segments.length * segments.width, _BINS)
    return np.asarray(sums / sums.sum())


def photograph_likeness(
    scratches: PhotographScratches, coverage: NDArray[np.floating], seed: int = 0
) -> Likeness:
    """Find scratches in a picture of layers' coverage (L, R, R), as in the photograph, and compare.

    The picture has the photograph's contrast and noise. R should be no less than a quarter of the
    photograph's longer side, or thin scratches are lost. Without any scratch: 90 degrees, 0.
    """
    shown = 1.0 - np.prod(1.0 - coverage[:, ::-1].astype(np.float64), axis=0)
    noise = scratches.noise * np.random.default_rng(seed).standard_normal(shown.shape)
    found = find_segments((scratches.full * shown + noise).astype(np.float32)).segments
    if len(found.length) == 0:
        return Likeness(90.0, 0.0)
    before = _light(scratches.segments) / float(np.prod(scratches.shape))
    return Likeness(direction_error(found, scratches.segments), _light(found) / shown.size / before)


def _light(segments: Segments) -> float:
    return float((segments.length * segments.width * segments.contrast).sum())
