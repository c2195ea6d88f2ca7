"""How near layers are to the photograph that they were made of, and what it tells of walls."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.photograph.photograph_layers import PhotographScratches
from pipelines.glass_scratches.photograph.segments import Segments, find_segments

_BINS = 180
_BOOTSTRAPS = 400


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


def brightness_across(
    segments: Segments, azimuth: float, seed: int = 0
) -> tuple[float, float, float]:
    """How many times as bright scratches across a light's direction are as those along it.

    azimuth: where the light comes from, radians from x towards up. Returns the least-squares
    ratio and its 5 % and 95 % quantiles over scratches drawn anew. Of walls that scatter evenly
    it is near 1; an interval that holds 1 tells nothing of them. Ends are 0 and infinite where the
    directions leave it open.
    """
    rng = np.random.default_rng(seed)
    count = len(segments.angle)
    ratios = [_ratio(segments, azimuth, rng.integers(0, count, count)) for _ in range(_BOOTSTRAPS)]
    low, high = np.quantile(ratios, (0.05, 0.95), method="nearest")
    return _ratio(segments, azimuth, np.arange(count)), float(low), float(high)


def _ratio(segments: Segments, azimuth: float, rows: NDArray[np.int64]) -> float:
    wave = -np.cos(2.0 * (segments.angle[rows] - azimuth))  # 1 across, -1 along
    light = segments.contrast[rows] * segments.width[rows]
    weight = np.sqrt(segments.length[rows])
    columns = np.stack([np.ones_like(wave), wave], axis=1) * weight[:, None]
    (mean, depth), *_ = np.linalg.lstsq(columns, light * weight, rcond=None)
    across, along = max(mean + depth, 0.0), max(mean - depth, 0.0)
    return float(across / along) if along > 0.0 else float("inf")
