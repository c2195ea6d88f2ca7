"""Which photographs show which points, and in which light."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb
from pipelines.geometry.cameras import project_points
from pipelines.street_billboards.capture.point_fusion import RgbdViews

_MOST_POINTS = 20_000
"""Points that are looked for: gains need no more."""
_DARKEST, _BRIGHTEST = 8, 247
"""Codes between which a camera tells how bright something is."""


class Observations(NamedTuple):
    """n times that a photograph shows a point."""

    point: NDArray[np.int64]
    photograph: NDArray[np.int64]
    radiance: NDArray[np.float64]
    """(n, 3), linear."""

    def shifted(self, photographs: int) -> Self:
        """The same with this many photographs before them."""
        return self._replace(photograph=self.photograph + photographs)


def observe_points(
    positions: NDArray[np.float64], views: RgbdViews, *, farthest: float
) -> Observations:
    """Points (n, 3) where the photographs' depth maps have them, up to ``farthest`` metres."""
    points = np.arange(0, len(positions), max(len(positions) // _MOST_POINTS, 1))
    _, height, width = views.depth.shape
    found = []
    for number, picture in enumerate(views.photographs):
        pixels, depth = project_points(
            views.intrinsics[number], views.poses[number], positions[points]
        )
        near = (depth > 0.5) & (depth < farthest)
        pixels = np.where(near[:, None], pixels, -9.0)
        x, y = np.rint(pixels).astype(np.int64).T
        near &= (x >= 0) & (x < width) & (y >= 0) & (y < height)
        there = np.where(near, views.depth[number][y * near, x * near], np.nan)
        off = np.where(near, views.deviation[number][y * near, x * near], np.nan)
        with np.errstate(invalid="ignore"):
            agrees = np.abs(there - depth) < 2.0 * off
        codes = picture[y * near, x * near]
        agrees &= ((codes >= _DARKEST) & (codes <= _BRIGHTEST)).all(axis=1)
        shown = points[agrees]
        found.append(
            Observations(shown, np.full(len(shown), number), decode_srgb(codes[agrees] / 255.0))
        )
    return Observations(*(np.concatenate(parts) for parts in zip(*found, strict=True)))
