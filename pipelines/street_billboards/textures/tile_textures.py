"""Textures of all billboards along a road, tile by tile: photographs come and go with the tile."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pipelines.geometry.cameras import Cameras
from pipelines.street_billboards.billboards import Billboards
from pipelines.street_billboards.road_tiles import TiledBillboards, frames_that_see
from pipelines.street_billboards.textures import view_textures as sampling
from pipelines.street_billboards.textures.photographs import Photographs
from pipelines.street_billboards.textures.texture_tables import ViewTextures, join_views


def view_textures_by_tile(
    road: TiledBillboards,
    cameras: Cameras,
    frames: int,
    load: Callable[[slice], Photographs],
    *,
    plain: bool = False,
    farthest: float = 40.0,
    progress: Callable[[float], None] = lambda fraction: None,
) -> ViewTextures:
    """Sample the views of all billboards (``view_textures``), in the order of the road.

    cameras: of so many frames, frame by frame; load: the photographs of some frames, of which one
    tile's are held at a time. plain, farthest: as for ``view_textures``.
    """
    parts = []
    for number in np.unique(road.tile):
        progress(float(number / (road.tile[-1] + 1)))
        own = road.tile == number
        billboards = Billboards._make(values[own] for values in road.billboards)
        photographs = load(frames_that_see(cameras, frames, billboards.voxel, farthest))
        parts.append(
            sampling.view_textures(
                billboards, road.side, photographs, plain=plain, farthest=farthest
            )
        )
        del photographs  # before the next tile's are loaded
    return join_views(parts)
