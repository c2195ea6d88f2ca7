"""Tiles of the road: photographs of a long drive are loaded tile by tile, not all at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.cameras import Cameras, project_points
from pipelines.street_billboards.billboards import Billboards

TILE_FRAMES = 16
"""Frames of a tile of the road."""


class TiledBillboards(NamedTuple):
    """Billboards in the order of the road."""

    billboards: Billboards
    tile: NDArray[np.int32]
    """(b,), number of the tile, rising."""
    side: float
    """Of an octree's leaf, m."""
    depth: int
    """Levels of the octree."""


def by_tile(
    billboards: Billboards, places: NDArray[np.floating]
) -> tuple[Billboards, NDArray[np.int32]]:
    """The billboards in the order of the road, and the tile (b,) that each one lies in.

    places (f, 3): of the car, frame by frame; a billboard belongs to the nearest one's tile.
    """
    from scipy.spatial import cKDTree

    tile = cKDTree(places).query(billboards.voxel)[1] // TILE_FRAMES
    order = np.argsort(tile, kind="stable")
    return Billboards._make(values[order] for values in billboards), tile[order].astype(np.int32)


def frames_near_tile(tile: int) -> slice:
    """Frames that see most of a tile: its own, and those that drive towards it.

    >>> frames_near_tile(2)
    slice(0, 50, None)
    """
    return slice(max((tile - 2) * TILE_FRAMES, 0), (tile + 1) * TILE_FRAMES + 2)


def frames_that_see(
    cameras: Cameras, frames: int, voxels: NDArray[np.float64], farthest: float
) -> slice:
    """From the first to the last frame with a camera before which, near enough, some voxel is.

    cameras: of so many frames, frame by frame; voxels (b, 3): their middles; farthest: metres. The
    first frame where none sees any.
    """
    seen = np.zeros(len(cameras.to_world), bool)
    for number, pose in enumerate(cameras.to_world):
        depth = project_points(cameras.intrinsics[number], pose, voxels)[1]
        away = np.linalg.norm(voxels - pose[:3, 3], axis=1)
        seen[number] = bool(((depth > 0) & (away < farthest)).any())
    near = np.flatnonzero(seen.reshape(frames, -1).any(axis=1))
    return slice(int(near[0]), int(near[-1]) + 1) if len(near) else slice(0, 1)
