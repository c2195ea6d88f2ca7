"""Settings of scratch layers (section 3.2 of the scratch paper, and what it leaves open)."""

from __future__ import annotations

import math
from dataclasses import dataclass

MOST_FEATURES = 2_000_000
MOST_LAYERS = 64


@dataclass(frozen=True)
class LayerSpec:
    """How the scratches of a tile (a unit square that repeats without seams) are drawn.

    length, width: sizes of a noise cell along and across the scratches, tile = 1 (paper, table 1).
        There is about one scratch a cell: 1 / (length * width) in the tile.
    threshold: of the noise, in cells: half a scratch is threshold * length long.
    coverage: share of the tile's area that each layer covers, opacity counted; it replaces the
        threshold.
    layers: number of layers, each with a direction of its own.
    curvature: standard deviation of the turn of a scratch from end to end, radians.
    digs: share of the features that are pits: round, and of no direction.
    fading: how far a scratch wavers and peters out along its length, 0 not at all, 1 to nothing.
    breaks: share of its length that is missing.
    spread: sigma of the log-normal factors on lengths and widths (the mean area stays); strengths
        fall below 1 by as much.
    """

    length: float = 0.3
    width: float = 0.001
    threshold: float = 0.1
    coverage: float | None = None
    layers: int = 4
    curvature: float = 0.0
    digs: float = 0.0
    fading: float = 0.0
    breaks: float = 0.0
    spread: float = 0.0

    @property
    def features_per_layer(self) -> float:
        """Expected number of scratches of a layer."""
        return 1.0 / (self.length * self.width)

    def validate(self) -> None:
        """Raise ValueError for the first setting that is out of its range."""
        _check(0.0 < self.length <= 1.0, "length", self.length, "more than 0 and at most 1")
        _check(0.0 < self.width <= 1.0, "width", self.width, "more than 0 and at most 1")
        _check(0.0 < self.threshold <= 0.5, "threshold", self.threshold, "more than 0, at most 0.5")
        if self.coverage is not None:
            _check(
                0.0 < self.coverage <= 0.6, "coverage", self.coverage, "more than 0, at most 0.6"
            )
        _check(1 <= self.layers <= MOST_LAYERS, "layers", self.layers, f"1 to {MOST_LAYERS}")
        _check(
            0.0 <= self.curvature <= math.pi / 2, "curvature", self.curvature, "0 to pi / 2 radians"
        )
        _check(0.0 <= self.digs <= 1.0, "digs", self.digs, "0 to 1")
        _check(0.0 <= self.fading <= 1.0, "fading", self.fading, "0 to 1")
        _check(0.0 <= self.breaks < 1.0, "breaks", self.breaks, "0 or more and less than 1")
        _check(0.0 <= self.spread <= 2.0, "spread", self.spread, "0 to 2")
        count = self.layers * self.features_per_layer
        if count > MOST_FEATURES:
            raise ValueError(
                f"layers / (length * width) makes {count:.0f} scratches; expected at most "
                f"{MOST_FEATURES}."
            )


def _check(good: bool, name: str, value: float, expected: str) -> None:
    if not good:
        raise ValueError(f"{name} of the layers is {value:g}; expected {expected}.")
