"""Figures of view textures, sampled apart from what made them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.billboards import Billboards, turned_axes
from pipelines.street_billboards.cameras import projected
from pipelines.street_billboards.point_fusion import FrameViews
from pipelines.street_billboards.textures import SEEN, SIDE, ViewTextures

_BILLBOARDS = 40
"""How many are looked at."""


def sampling_error(
    billboards: Billboards,
    views: ViewTextures,
    photographs: FrameViews,
    codes: NDArray[np.uint8],
    asked: NDArray[np.bool_],
) -> float:
    """Median codes by which SEEN texels differ from the most alike photograph there.

    codes (k, 256, 3) even out exposures; asked (b,): of which billboards some are taken. Pixels are
    the nearest ones, without blending and averaging: a code or two of difference is usual, a
    texture that is mirrored, shifted or of another billboard differs by tens.
    """
    numbers = np.flatnonzero(asked & (np.diff(views.first) > 0))
    numbers = numbers[:: max(len(numbers) // _BILLBOARDS, 1)]
    steps = (2 * np.arange(SIDE) + 1) / SIDE - 1
    t, s = np.meshgrid(-steps, steps, indexing="ij")
    _, height, width = photographs.depth.shape
    found = []
    for number in numbers:
        view = views.first[number]
        seen = views.states[view] == SEEN
        texels = views.colours[view][seen].astype(np.int64)
        least = np.full(len(texels), 255.0)
        for k, pose in enumerate(photographs.poses):
            row, column = billboards.half_s[number], billboards.half_t[number]
            if billboards.turns[number]:
                across, up = turned_axes(billboards.centre[number], pose[:3, 3])
                row, column = across * row[0], up * column[2]
            points = billboards.centre[number] + s[..., None] * row + t[..., None] * column
            pixels, depth = projected(photographs.intrinsics[k], pose, points[seen])
            x, y = np.rint(np.nan_to_num(pixels, nan=-9.0)).clip(-9, 1e6).astype(np.int64).T
            shown = (depth > 0.3) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
            there = codes[k][photographs.photographs[k, y * shown, x * shown], np.arange(3)]
            apart = np.abs(there.astype(np.int64) - texels).mean(axis=1)
            least = np.where(shown, np.minimum(least, apart), least)
        found.append(least)
    return float(np.median(np.concatenate(found))) if found else 255.0
