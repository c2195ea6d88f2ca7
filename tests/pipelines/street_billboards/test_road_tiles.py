"""Tiles of the road: every billboard in one, in order; frames that see something of it."""

from __future__ import annotations

import numpy as np

from pipelines.geometry.cameras import Cameras
from pipelines.street_billboards.road_tiles import (
    TILE_FRAMES,
    by_tile,
    frames_near_tile,
    frames_that_see,
)
from tests.pipelines.street_billboards.compressed_street import placed_camera, scattered

FRAMES = 40


def _way() -> np.ndarray:
    return np.column_stack([np.arange(FRAMES) * 2.0, np.zeros(FRAMES), np.full(FRAMES, 1.9)])


def _driving(cameras: int = 2) -> Cameras:
    """Cameras side by side that look along +x, frame by frame."""
    made = [
        placed_camera((x, y + side, z), (x + 1, y + side, z), (30, 20), 25.0)
        for x, y, z in _way()
        for side in range(cameras)
    ]
    lenses, poses = zip(*made, strict=True)
    return Cameras(np.stack(lenses), np.stack(poses), 30, 20)


def test_billboards_are_sorted_along_the_road_and_stay_whole() -> None:
    made = scattered(300, reach=80.0)
    made = made._replace(voxel=np.abs(made.centre), centre=np.abs(made.centre))
    ordered, tile = by_tile(made, _way())
    assert (np.diff(tile) >= 0).all()
    assert tile.dtype == np.int32
    assert set(tile) == {0, 1, 2}
    nearest = np.rint(np.minimum(ordered.voxel[:, 0], 2.0 * (FRAMES - 1)) / 2)
    np.testing.assert_array_equal(tile, nearest // TILE_FRAMES)
    # Within a tile they keep their order, each with all that is known of it.
    number = {tuple(centre): row for row, centre in enumerate(made.centre)}
    rows = np.array([number[tuple(centre)] for centre in ordered.centre])
    assert sorted(rows) == list(range(300))
    for one, other in zip(ordered, made, strict=True):
        np.testing.assert_array_equal(one, other[rows])
    assert all((np.diff(rows[tile == t]) > 0).all() for t in range(3))


def test_frames_see_what_is_ahead_and_near_enough() -> None:
    voxels = np.array([[31.0, 3.0, 1.0], [35.0, -2.0, 1.0]])
    found = frames_that_see(_driving(), FRAMES, voxels, farthest=20.0)
    # The last before 35 m is at 34; from 12 m the nearer one is 19.2 m away, from 10 m 21.2 m.
    assert found == slice(6, 18)
    alone = frames_that_see(_driving(), FRAMES, voxels[:1], farthest=20.0)
    assert alone == slice(6, 16)


def test_what_nobody_sees_loads_one_frame() -> None:
    behind = np.array([[-5.0, 0.0, 1.0]])
    assert frames_that_see(_driving(), FRAMES, behind, farthest=20.0) == slice(0, 1)


def test_frames_near_a_tile_are_those_that_drive_towards_it() -> None:
    assert frames_near_tile(0) == slice(0, TILE_FRAMES + 2)
    assert frames_near_tile(3) == slice(TILE_FRAMES, 4 * TILE_FRAMES + 2)
