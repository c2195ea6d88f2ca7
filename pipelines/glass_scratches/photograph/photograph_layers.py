"""Layers like the scratches of a photograph: what its segments tell, and another pane of the kind.

The tile is a square of the photograph's longer side. A photograph tells directions, numbers,
lengths, widths (with its blur) and relative strengths; a layer gets scratches drawn from its own.
Places are new ones: the tile repeats, the photograph does not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.layers.features import Features, Layers, layers_of_features
from pipelines.glass_scratches.photograph.ridges import line_contrast
from pipelines.glass_scratches.photograph.segments import Segments, find_segments

MOST_LAYERS = 8
FEWEST_SEGMENTS = 8
MOST_COVERAGE = 0.3
_SCATTER = np.deg2rad(8.0)
"""RMS of directions about their layers': as few layers as keep it."""
_BINS = 180
_FULL = 0.9
"""Of the scratches' length: what is weaker than the rest counts as fully scratched."""
_LONGEST, _LONGEST_ARC = 0.5, 0.45  # half lengths, tiles: a feature does not overlap its copy
_WIDEST = 0.2
_ELLIPSE = 4.0 / np.pi  # an ellipse's width over its mean width


class PhotographScratches(NamedTuple):
    """Scratches of a photograph by layers.

    segments: n, in pixels. layer: (n,) int32. angle: (L,) radians from x upwards. strength: (n,)
    contrast over that of a full scratch, at most 1. full: that contrast. dark: whether they are
    darker than their ground. noise: standard deviation of the ground's contrast. shape: rows and
    columns of the photograph.
    """

    segments: Segments
    layer: NDArray[np.int32]
    angle: NDArray[np.float32]
    strength: NDArray[np.float64]
    full: float
    dark: bool
    noise: float
    shape: tuple[int, int]

    @property
    def tile(self) -> int:
        """Side of the tile, pixels."""
        return max(self.shape)

    @property
    def coverage(self) -> NDArray[np.float64]:
        """Share of the area that each layer (L,) covers, strength counted."""
        segments = self.segments
        area = segments.length * segments.width * self.strength
        return np.bincount(self.layer, area, len(self.angle)) / float(np.prod(self.shape))


def photograph_scratches(luminance: NDArray[np.floating]) -> PhotographScratches:
    """Find the scratches of a photograph (y, x), linear, and put them into layers.

    Raises ValueError where too few lines stand out of their ground, or lines cover so much that
    they are a texture: what was found, without a full stop.

    >>> ground = 0.2 + 0.002 * np.random.default_rng(0).standard_normal((128, 128))
    >>> for k in range(10): ground[9 + 12 * k : 11 + 12 * k, 16 + 3 * k : 80 + 3 * k] += 0.1
    >>> photograph_scratches(ground).angle.shape
    (1,)
    """
    contrast = line_contrast(luminance)
    segments, dark = find_segments(contrast)
    count = len(segments.length)
    if count < FEWEST_SEGMENTS:
        raise ValueError(f"{count} lines that stand out of the noise")
    covered = float((segments.length * segments.width).sum()) / contrast.size
    if covered > MOST_COVERAGE:
        raise ValueError(f"lines over {covered:.0%} of the picture, more a texture")
    angle, layer = direction_layers(segments.angle, segments.length * segments.width)
    full = _quantile(segments.contrast, segments.length, _FULL)
    return PhotographScratches(
        segments,
        layer,
        angle,
        np.minimum(segments.contrast / full, 1.0),
        full,
        dark,
        1.4826 * float(np.median(np.abs(contrast - np.median(contrast)))),
        (contrast.shape[0], contrast.shape[1]),
    )


def direction_layers(
    angle: NDArray[np.float64], weight: NDArray[np.float64]
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Directions of layers (L,) and the layer of each scratch (n,), of the scratches' directions.

    As few layers as leave 8 degrees of scatter (RMS by weight) about their directions, at most
    eight, each with the least scatter for its number: of uniform directions a fan of eight.
    """
    bins = (np.mod(angle, np.pi) * (_BINS / np.pi)).astype(int) % _BINS
    share = np.bincount(bins, weight, _BINS) / weight.sum()
    # The half circle is cut where directions are fewest.
    window = np.ones(9) / 9
    thin = np.convolve(np.concatenate([share[-4:], share, share[:4]]), window, "valid")
    start = int(np.argmin(thin))
    borders = _least_scatter(np.roll(share, -start))
    layer = (np.searchsorted(borders, (bins - start) % _BINS, side="right") - 1).astype(np.int32)
    doubled = weight * np.exp(2j * angle)
    sums = np.array([doubled[layer == k].sum() for k in range(len(borders))])
    return np.mod(0.5 * np.angle(sums), np.pi).astype(np.float32), layer


def _least_scatter(share: NDArray[np.float64]) -> NDArray[np.intp]:
    """First bin of each layer, of shares (_BINS,) along a cut half circle."""
    place = (np.arange(_BINS) + 0.5) * (np.pi / _BINS)
    sums = np.stack([np.cumsum(np.append(0.0, share * place**k)) for k in range(3)])
    part = sums[:, None, :] - sums[:, :, None]  # (3, from, to)
    cost = part[2] - part[1] ** 2 / np.maximum(part[0], 1e-12)
    cost[np.tril_indices(_BINS + 1)] = np.inf
    best = cost[0]
    back: list[NDArray[np.intp]] = []
    while best[-1] > _SCATTER**2 and len(back) + 1 < MOST_LAYERS:
        joined = best[:, None] + cost
        back.append(np.argmin(joined, axis=0))
        best = joined.min(axis=0)
    borders, end = [], _BINS
    for came in reversed(back):
        end = int(came[end])
        borders.append(end)
    # Stretches without a scratch are no layers.
    starts = np.array([0, *reversed(borders)], np.intp)
    return starts[np.add.reduceat(share, starts) > 0.0]


def layers_like(scratches: PhotographScratches, seed: int) -> Layers:
    """A tile of such scratches: as many to the area, drawn from the photograph's, elsewhere."""
    rng = np.random.default_rng(seed)
    per_tile = scratches.tile**2 / float(np.prod(scratches.shape))
    rows = np.concatenate(
        [
            _drawn(np.flatnonzero(scratches.layer == k), per_tile, rng)
            for k in range(len(scratches.angle))
        ]
    )
    segments, layer = scratches.segments.chosen(rows), scratches.layer[rows]
    half_length = 0.5 * segments.length / scratches.tile
    longest = np.where(segments.turn == 0.0, _LONGEST, _LONGEST_ARC)
    half_width = np.minimum(0.5 * _ELLIPSE * segments.width / scratches.tile, _WIDEST)
    curvature = segments.turn / (2.0 * half_length)
    tightest = 0.5 / half_width
    turn = segments.angle - scratches.angle[layer]
    count = len(rows)
    features = Features(
        layer=layer,
        centre=rng.random((count, 2), dtype=np.float32),
        turn=(np.mod(turn + np.pi / 2, np.pi) - np.pi / 2).astype(np.float32),
        half_length=np.minimum(half_length, longest).astype(np.float32),
        half_width=half_width.astype(np.float32),
        curvature=np.clip(curvature, -tightest, tightest).astype(np.float32),
        strength=scratches.strength[rows].astype(np.float32),
        seed=rng.integers(0, 2**32, count, dtype=np.uint32),
        is_dig=np.zeros(count, bool),
    )
    return layers_of_features(scratches.angle, features)


def _drawn(rows: NDArray[np.intp], per_tile: float, rng: np.random.Generator) -> NDArray[np.intp]:
    """All rows as often as the tile is larger than the photograph, and some once more."""
    whole, rest = divmod(round(per_tile * len(rows)), len(rows))
    return np.concatenate([np.tile(rows, whole), rng.choice(rows, rest, replace=False)])


def _quantile(values: NDArray[np.float64], weight: NDArray[np.float64], share: float) -> float:
    order = np.argsort(values)
    sums = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(sums, share * sums[-1])])
