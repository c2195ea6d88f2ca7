"""Pages read back by the layout's description, and against what they were packed from."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.street_billboards.textures.atlases import Atlas, Page, pack_pages, pack_slots
from pipelines.street_billboards.textures.decoding import decode_views
from pipelines.street_billboards.textures.texture_tables import SIDE
from tests.pipelines.street_billboards.compressed_street import random_textures

MIXED = np.arange(14) % 3 == 0


def tile_planes(atlas: Atlas, tile: int) -> NDArray[np.uint8]:
    row, column = divmod(tile, atlas.scales.shape[1])
    side = atlas.side
    cut = atlas.texels[row * side : (row + 1) * side, column * side : (column + 1) * side]
    return np.moveaxis(cut, -1, 0)


def enlarged(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """A square of fewer texels, interpolated between their middles at those of 32 x 32."""
    side = values.shape[-1]
    place = np.clip((np.arange(SIDE) + 0.5) / SIDE * side - 0.5, 0, side - 1)
    matrix = np.maximum(1 - np.abs(place[:, None] - np.arange(side)), 0)
    return matrix @ values @ matrix.T


def read_page(page: Page, row: int, view: int) -> tuple[NDArray[np.uint8], int]:
    """RGBA (32, 32, 4) of a stored view, and its direction, from the page's arrays alone."""
    first, second = page.records[row].astype(np.int64)
    detail_tiles, tint_tiles = second[2] & 63, second[2] >> 6 & 63
    per_view, luma_chroma = second[2] >> 12 & 1, second[2] >> 13 & 1
    texels = page.views.reshape(-1, 4)[first[0] + view * (1 + detail_tiles + tint_tiles) :]
    texels = texels.astype(np.float64)
    channels = [np.full((SIDE, SIDE), texels[0, c]) for c in range(3)]
    for atlas, start, tiles, texel in (
        (page.detail, second[0], detail_tiles, 1),
        (page.tint, second[1], tint_tiles, 1 + detail_tiles),
    ):
        for k in range(tiles):
            planes = tile_planes(atlas, start + k)
            scales = atlas.scales.reshape(-1, 4)[start + k]
            for slot in range(4):
                weight = scales[slot] * (texels[texel + k, slot] - 128) / 127
                channel = 0 if atlas is page.detail else 1 + (4 * k + slot >= second[3])
                channels[channel] += weight * enlarged((planes[slot] - 128.0) / 127)
    if luma_chroma:
        y, co, cg = channels[0], channels[1] - 128, channels[2] - 128
        channels = [y + co - cg, y + cg, y - co - cg]
    mask = page.masks.reshape(-1, SIDE, 4)[first[1] + (view if per_view else 0)]
    alpha = np.unpackbits(mask, axis=-1) * 255.0
    rgba = np.stack([*channels, alpha], axis=-1)
    return np.floor(np.clip(rgba, 0, 255) + 0.5).astype(np.uint8), int(texels[0, 3])


@pytest.mark.parametrize(("colour", "tint_side"), [("ycocg", 16), ("ycocg", 32), ("rgb", 32)])
@pytest.mark.parametrize("most", [8192, 96])
def test_a_page_read_as_described_is_what_was_packed(
    colour: str, tint_side: int, most: int
) -> None:
    textures = random_textures(MIXED, seed=1, colour=colour, tint_side=tint_side, most_views=4)
    made = pack_pages(textures, most)
    assert (len(made) > 1) == (most == 96)
    assert np.array_equal(np.concatenate([page.billboards for page in made]), np.arange(14))
    for page in made:
        for row, billboard in enumerate(page.billboards):
            begin, end = textures.first[billboard : billboard + 2]
            for view in range(end - begin):
                found, direction = read_page(page, row, view)
                assert direction == textures.direction[begin + view]
                expected = np.empty((1, SIDE, SIDE, 4), np.uint8)
                decode_views(
                    textures, np.array([billboard]), np.array([float(direction)]), expected
                )
                off = np.abs(found.astype(int) - expected[0])
                # Codes may be rounded to either side of one half.
                assert off[..., :3].max() <= 1
                assert (off > 0).mean() < 0.01
                assert off[..., 3].max() == 0
            bits = page.records[row, 0, 2:].astype(np.int64)
            seen = np.flatnonzero((bits[:, None] >> np.arange(16) & 1).ravel())
            assert np.array_equal(seen, textures.direction[begin:end])


def test_weights_of_planes_of_others_are_nothing() -> None:
    textures = random_textures(np.zeros(9, bool), seed=2, ranks=(1, 1, 1), most_views=1)
    page = pack_pages(textures)[0]
    first = page.records[:, 0, 0].astype(int)
    for row, texel in enumerate(first):
        weights = page.views.reshape(-1, 4)[texel + 1]
        own = textures.weights[0][row]
        assert (np.delete(weights, np.flatnonzero(weights == own)[:1]) == 128).all()


@given(st.lists(st.integers(0, 20), max_size=60))
@settings(max_examples=60, deadline=None)
def test_slots_are_dense_and_few_reach_too_far(ranks: list[int]) -> None:
    of_billboard = np.array(ranks, np.int64)
    first = pack_slots(of_billboard)
    slots = [np.arange(start, start + r) for start, r in zip(first, ranks, strict=True)]
    every = np.sort(np.concatenate([np.empty(0, np.int64), *slots]))
    assert np.array_equal(every, np.arange(of_billboard.sum()))
    reached = (first % 4 + of_billboard + 3) // 4
    too_far = (reached > -(-of_billboard // 4)) & (of_billboard > 0)
    rest = of_billboard % 4
    surplus = max((rest == 3).sum() - (rest == 1).sum(), 0)
    assert too_far.sum() <= (surplus + 1) // 2 + 1


def test_a_page_holds_the_papers_billboards() -> None:
    # 4.3: 16 tiles of 32 x 32 RGB each, 4096 billboards in 8192 x 8192; here in 512 x 512.
    textures = random_textures(
        np.zeros(40, bool), colour="rgb", tint_side=32, ranks=16, most_views=2
    )
    of_paper = (512 // SIDE) ** 2 // 16
    assert len(pack_pages(textures, 512)[0].billboards) == 2 * of_paper


def test_bytes_are_known_beforehand() -> None:
    textures = random_textures(MIXED, seed=3)
    for most in (8192, 96):
        made = pack_pages(textures, most)
        held = sum(
            array.nbytes
            for page in made
            for array in (*page.detail[:2], *page.tint[:2], page.views, page.masks, page.records)
        )
        assert sum(page.bytes + page.padding for page in made) == held
        sheets = [s for p in made for s in (p.detail[0], p.tint[0], p.views, p.masks)]
        assert max(max(sheet.shape[:2]) for sheet in sheets) <= most
    stored = sum(planes.nbytes + 4 * len(planes) for planes in textures.planes)
    stored += sum(weights.nbytes for weights in textures.weights) + textures.masks.nbytes
    stored += 4 * len(textures.direction) + 32 * 14
    assert sum(page.bytes for page in pack_pages(textures)) == stored


def test_padding_of_many_is_small() -> None:
    textures = random_textures(np.zeros(1500, bool), seed=4, most_views=2)
    (page,) = pack_pages(textures)
    assert page.padding < 0.06 * page.bytes


def test_too_many_bytes_are_refused() -> None:
    textures = random_textures(MIXED, seed=5)
    needed = sum(page.bytes + page.padding for page in pack_pages(textures))
    assert len(pack_pages(textures, byte_budget=needed)) == 1
    message = rf"would take {needed} bytes; expected {needed - 1} at most \(byte_budget\)"
    with pytest.raises(ValueError, match=message):
        pack_pages(textures, byte_budget=needed - 1)


def test_what_cannot_be_packed_is_refused() -> None:
    textures = random_textures(np.zeros(1, bool), ranks=16, tint_side=32, most_views=2)
    with pytest.raises(ValueError, match="do not fit on a page of 64 x 64 texels"):
        pack_pages(textures, 64)
    other = random_textures(np.zeros(1, bool), ranks=16, tint_side=16, most_views=2)
    mixed = textures._replace(planes=(*textures.planes[:2], other.planes[2]))
    with pytest.raises(ValueError, match="sides of 32 and 16 texels; expected one"):
        pack_pages(mixed)
    twice = random_textures(np.zeros(3, bool), seed=6)
    twice.direction[textures.first[0] :] = 7
    with pytest.raises(ValueError, match=r"has direction 7 .* times; expected each once"):
        pack_pages(twice)


def test_nothing_makes_no_page() -> None:
    assert pack_pages(random_textures(np.zeros(0, bool))) == []
