"""Tiles that stand alone hold the street: each billboard once, with its own textures."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.street_billboards.live_tiles import (
    live_tiles,
    some_textures,
    texel_points,
    tile_of,
    tile_textures,
)
from pipelines.street_billboards.textures.decoding import decode_views
from pipelines.street_billboards.textures.figures import unpacked_error
from pipelines.street_billboards.textures.texture_tables import SIDE
from pipelines.street_billboards.textures.view_directions import SPACING
from tests.pipelines.street_billboards.compressed_street import random_textures, scattered

WAY = np.column_stack([np.arange(-12.0, 12.1, 3.0), np.zeros(9), np.zeros(9)])


@pytest.mark.parametrize("colour", ["ycocg", "rgb"])
def test_each_billboard_is_in_one_tile_with_its_textures(colour: str) -> None:
    billboards = scattered(120)
    textures = random_textures(billboards.turns, colour=colour)
    tiles = live_tiles(billboards, textures, WAY, 8.0)
    assert len(tiles) == 3
    rows = np.concatenate([tile.rows for tile in tiles])
    assert np.array_equal(np.sort(rows), np.arange(120))
    for tile in tiles:
        own = some_textures(textures, tile.rows)
        assert unpacked_error([tile.page], own) < 0.01
        headers = tile.headers.reshape(-1, 5, 4)[: len(tile.rows)]
        assert np.array_equal(headers[:, 0, :3], billboards.centre[tile.rows].astype(np.float32))
        along = billboards.voxel[tile.rows, 0] + 12.0
        inside = np.clip(along, 0.0, 23.9)
        assert (inside > tile.stretch[0] - 0.2).all()
        assert (inside < tile.stretch[1] + 0.2).all()
        assert (billboards.centre[tile.rows] > tile.box[0]).all()
        assert (billboards.centre[tile.rows] < tile.box[1]).all()


def test_what_does_not_fit_on_one_page_becomes_several_tiles() -> None:
    billboards = scattered(120)
    textures = random_textures(billboards.turns)
    whole = live_tiles(billboards, textures, WAY, 100.0)
    parts = live_tiles(billboards, textures, WAY, 100.0, most_texels=256)
    assert len(whole) == 1 < len(parts)
    assert np.array_equal(np.concatenate([tile.rows for tile in parts]), whole[0].rows)
    assert max(max(tile.page.detail.texels.shape) for tile in parts) <= 256


def test_a_tile_comes_back_from_its_textures() -> None:
    billboards = scattered(60)
    textures = random_textures(billboards.turns)
    for tile in live_tiles(billboards, textures, WAY, 8.0):
        sides = (tile.page.detail.side, tile.page.tint.side)
        again = tile_of(tile.rows, tile_textures(tile), sides, tile.stretch, tile.box)
        assert again.page.detail.most_tiles == tile.page.detail.most_tiles
        assert unpacked_error([again.page], some_textures(textures, tile.rows)) < 0.01


def test_billboards_without_views_are_left_out() -> None:
    billboards = scattered(10)
    textures = random_textures(billboards.turns)
    nothing = some_textures(textures, np.arange(0))
    with pytest.raises(ValueError, match="none has a view"):
        live_tiles(billboards._make(v[:0] for v in billboards), nothing, WAY, 8.0)


def test_points_are_the_texels_that_the_other_decoder_shows() -> None:
    billboards = scattered(40)
    textures = random_textures(billboards.turns)
    (tile,) = live_tiles(billboards, textures, WAY, 100.0)
    for row, (places, colours, _) in zip(tile.rows, texel_points(tile, 1), strict=True):
        directions = textures.direction[textures.first[row] : textures.first[row + 1]]
        middle = float(directions[len(directions) // 2])
        decoded = np.zeros((1, SIDE, SIDE, 4), np.uint8)
        decode_views(textures, np.array([row]), np.array([middle]), decoded)
        shown = decoded[0, ..., 3] > 0
        assert np.abs(decoded[0, ..., :3][shown].astype(int) - colours).max() <= 1
        s = ((2 * np.arange(SIDE) + 1) / SIDE - 1)[None, :, None]
        half_s, half_t = billboards.half_s[row], billboards.half_t[row]
        if billboards.turns[row]:
            azimuth = np.radians((billboards.fan[row] + middle) * SPACING)
            half_s = half_s[0] * np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
            half_t = half_t[2] * np.array([0.0, 0.0, 1.0])
        expected = billboards.centre[row] + s * half_s - s.transpose(1, 0, 2) * half_t
        assert np.allclose(places, expected[shown], atol=1e-4)
