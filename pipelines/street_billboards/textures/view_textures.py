"""Textures of billboards from the photographs that see them best (4.2.1).

A texel's colour counts if the depth map of the photograph agrees with the billboard
(``texel_sampling``). The paper leaves this out ("plain"), and takes the pillar in front of a wall
for the wall.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numba
import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.billboards import Billboards
from pipelines.street_billboards.textures.photographs import Photographs, best_photographs
from pipelines.street_billboards.textures.texel_sampling import SampledViews, sample_views
from pipelines.street_billboards.textures.texture_tables import SEEN, SIDE, ViewTextures

_TRIED = 4
"""Photographs that are asked for one view."""
_LEAST_TEXELS = 12
"""That a view must show."""
_LEAST_SHARE = 0.4
"""Of the texels that the billboard's best view shows; what fewer tell of the rest is a guess."""
_VIEWS = 512
"""That a thread samples at a time."""


def view_textures(
    billboards: Billboards,
    voxel_side: float,
    photographs: Photographs,
    *,
    plain: bool = False,
    farthest: float = 40.0,
) -> ViewTextures:
    """Sample the views of billboards, in directions in which somebody looked.

    voxel_side and farthest (from camera to billboard) in metres; plain: without occlusion, one
    photograph a view, squares of the voxel's side opaque all over, as in the paper.
    """
    first, direction, chosen = _views(
        best_photographs(billboards, photographs, 1 if plain else _TRIED, farthest)
    )
    count = len(direction)
    sampled = SampledViews(
        np.zeros((count, SIDE, SIDE, 3), np.uint8),
        np.zeros((count, SIDE, SIDE), np.uint8),
        np.zeros(count, np.float32),
    )
    owner = np.repeat(np.arange(len(first) - 1), np.diff(first))

    def sample(start: int) -> None:
        rows = slice(start, start + _VIEWS)
        own = SampledViews._make(values[rows] for values in sampled)
        sample_views(owner[rows], chosen[rows], billboards, voxel_side, photographs, plain, own)

    with ThreadPoolExecutor(numba.get_num_threads()) as threads:
        list(threads.map(sample, range(0, count, _VIEWS)))
    kept = _kept(owner, sampled.states)
    ends = np.zeros(len(first), np.int64)
    ends[1:] = np.cumsum(np.bincount(owner[kept], minlength=len(first) - 1))
    colours, states, sharpness = sampled
    return ViewTextures(ends, direction[kept], colours[kept], states[kept], sharpness[kept])


def _views(
    chosen: NDArray[np.int32],
) -> tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.int32]]:
    """The ragged table: where a billboard's rows begin, directions, photographs (v, tried)."""
    some = chosen[..., 0] >= 0
    first = np.concatenate([[0], np.cumsum(some.sum(axis=1))]).astype(np.int64)
    _, direction = np.nonzero(some)
    return first, direction.astype(np.uint8), chosen[some]


def _kept(owner: NDArray[np.int64], states: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Views (v,) that show enough of their billboard."""
    seen = (states == SEEN).sum(axis=(1, 2))
    most = np.zeros(int(owner.max(initial=-1)) + 1, np.int64)
    np.maximum.at(most, owner, seen)
    return (seen >= _LEAST_TEXELS) & (seen >= _LEAST_SHARE * most[owner])
