"""Textures tile by tile: as all at once, of no more photographs than a tile needs."""

from __future__ import annotations

import numpy as np

from pipelines.geometry.cameras import Cameras
from pipelines.street_billboards.road_tiles import TiledBillboards, frames_that_see
from pipelines.street_billboards.textures.tile_textures import view_textures_by_tile
from pipelines.street_billboards.textures.view_textures import view_textures
from tests.pipelines.street_billboards.painted_wall import VOXEL, Scene, on_the_wall

PLACES = [(x, -5.0, 0.3) for x in np.arange(-6.0, 30.0, 2.0)]
FARTHEST = 9.0


def _everything() -> tuple[TiledBillboards, object]:
    walls = on_the_wall([(x, 0.0, 0.0) for x in (-1.0, 0.0, 11.0, 12.0, 22.0)])
    # Each camera looks straight at the wall.
    shots = [Scene().photographs([place], target=(place[0], 0.0, 0.3)) for place in PLACES]
    photographs = type(shots[0])(*(np.concatenate(columns) for columns in zip(*shots, strict=True)))
    return TiledBillboards(walls, np.array([0, 0, 1, 1, 2], np.int32), VOXEL, 3), photographs


def test_tiles_together_are_as_all_at_once() -> None:
    road, photographs = _everything()
    cameras = Cameras(photographs.intrinsics, photographs.to_world, 96, 80)
    asked: list[slice] = []
    told: list[float] = []

    def load(frames: slice) -> object:
        asked.append(frames)
        return type(photographs)(*(values[frames] for values in photographs))

    found = view_textures_by_tile(
        road, cameras, len(PLACES), load, farthest=FARTHEST, progress=told.append
    )
    whole = view_textures(road.billboards, VOXEL, photographs, farthest=FARTHEST)
    assert len(whole.direction) > 5
    for one, other in zip(found, whole, strict=True):
        np.testing.assert_array_equal(one, other)
        assert one.dtype == other.dtype
    assert asked == [
        frames_that_see(cameras, len(PLACES), road.billboards.voxel[rows], FARTHEST)
        for rows in (slice(0, 2), slice(2, 4), slice(4, 5))
    ]
    assert max(frames.stop - frames.start for frames in asked) < len(PLACES) / 1.5
    assert told == [0.0, 1 / 3, 2 / 3]


def test_plain_sampling_is_handed_on() -> None:
    road, photographs = _everything()
    photographs.depth[:] = 1.0
    cameras = Cameras(photographs.intrinsics, photographs.to_world, 96, 80)

    def load(frames: slice) -> object:
        return type(photographs)(*(values[frames] for values in photographs))

    hidden = view_textures_by_tile(road, cameras, len(PLACES), load, farthest=FARTHEST)
    plain = view_textures_by_tile(road, cameras, len(PLACES), load, plain=True, farthest=FARTHEST)
    assert len(hidden.direction) == 0 < len(plain.direction)
