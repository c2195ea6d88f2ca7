"""Compressed textures as the graphics card holds them (4.3): one set of textures a page.

Every array here is indexed as ``texelFetch`` does: [row, column], row 0 at t = 0. Row 0 of a tile
is the top of a billboard's texture. Nothing is mipmapped.

**detail** (RGBA8) holds the planes of channel 0 (Y or R), **tint** (RGBA8) those of channels 1 and
2 (Co and Cg, or G and B), in tiles of side x side texels. A tile holds four planes, one a channel:
slot n is channel n % 4 of tile n // 4, tiles lie in rows. The planes of one billboard are
consecutive slots, in tint those of channel 1 before those of channel 2; billboards are put in such
an order that few reach into a tile more than they need (``pack_slots``), and no slot stays free but
in the last row of tiles. What a tile adds to a channel is the product of its sample and four
weights, zero for planes of other billboards.

**detail scales**, **tint scales** (RGBA32F): a texel a tile, the four planes' scales, in codes.

**views** (RGBA8), texel by texel in rows: a view is 1 + d + t texels, d and t the numbers of tiles
its billboard reaches into: (mean of channel 0, 1, 2; direction), then the weights of each tile's
four planes, 128 (a weight of zero) for planes of others.

**masks** (RGBA8): a mask is 32 texels in a row of the texture, from the top of the mask down: a row
of it each, 32 bits, the leftmost in the red byte's highest bit.

**records** (float32, integers below 2^24): two texels a billboard, (first texel in views, first
mask, directions 0 to 15 and 16 to 31 as bits) and (first tile in detail, first tile in tint,
d + 64 t + 4096 (1 for a mask a view) + 8192 (1 for Y, Co, Cg), channel 2's first slot counted from
the first tile in tint).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.textures.texture_tables import SIDE, CompressedTextures

MOST_TEXELS = 8192
"""Texels of a texture's side (the paper's)."""
_EXACT = 1 << 24
"""Whole numbers below this are exact in float32."""


class Atlas(NamedTuple):
    """Planes in tiles."""

    texels: NDArray[np.uint8]
    """(rows * side, columns * side, 4)."""
    scales: NDArray[np.float32]
    """(rows, columns, 4), in codes; 0 in slots without a plane."""
    side: int
    """Texels of a tile's side."""
    most_tiles: int
    """Tiles that the planes of one billboard reach into, at most."""


class Page(NamedTuple):
    """What one draw call needs of p billboards, but for where they stand."""

    billboards: NDArray[np.int64]
    """(p,), rows of the compressed textures."""
    detail: Atlas
    tint: Atlas
    views: NDArray[np.uint8]
    """(y, x, 4)."""
    masks: NDArray[np.uint8]
    """(y, 32 m, 4)."""
    records: NDArray[np.float32]
    """(p, 2, 4)."""
    bytes: int
    """Bytes that stand for something."""
    padding: int
    """Bytes of textures that stand for nothing."""

    @property
    def flags(self) -> NDArray[np.int64]:
        """(p, 2): whether there is a mask a view; whether channels are Y, Co, Cg."""
        codes = self.records[:, 1, 2].astype(np.int64)
        return np.column_stack([codes >> 12 & 1, codes >> 13 & 1])

    @property
    def has_views(self) -> NDArray[np.bool_]:
        """(p,): whether there is something to show."""
        return np.asarray(self.records[:, 0, 2:].any(axis=1))


class _Plan(NamedTuple):
    """Where the billboards ``start`` to ``stop`` go on a page."""

    start: int
    stop: int
    detail: NDArray[np.int64]
    """(p,), first slots."""
    tint: NDArray[np.int64]
    detail_tiles: NDArray[np.int64]
    """(p,), how many tiles each reaches into."""
    tint_tiles: NDArray[np.int64]
    sheets: tuple[tuple[int, int], ...]
    """(rows, columns) of tiles in detail and tint, texels in views, masks in masks."""


def pack_slots(ranks: NDArray[np.integer]) -> NDArray[np.int64]:
    """First slots (p,) of billboards with so many planes each (p,); no slot between stays free.

    Planes that do not fill tiles share them where they complete each other, three and one, two and
    two: none but some of what is three too many reaches into one tile more than it has to.

    >>> pack_slots(np.array([3, 4, 1, 2]))
    array([4, 0, 7, 8])
    """
    rest = ranks % 4
    threes, ones = np.flatnonzero(rest == 3), np.flatnonzero(rest == 1)
    pairs = min(len(threes), len(ones))
    order = np.concatenate(
        [
            np.flatnonzero(rest == 0),
            np.column_stack([threes[:pairs], ones[:pairs]]).ravel(),
            np.flatnonzero(rest == 2),
            ones[pairs:],
            threes[pairs:],
        ]
    )
    first = np.empty(len(ranks), np.int64)
    first[order] = np.cumsum(ranks[order], dtype=np.int64) - ranks[order]
    return first


def pack_pages(
    textures: CompressedTextures, most_texels: int = MOST_TEXELS, *, byte_budget: int | None = None
) -> list[Page]:
    """Pack compressed textures into pages, in the order of the billboards.

    most_texels: texels of a texture's side that must not be exceeded. Raises ValueError where
    ``byte_budget`` would be exceeded, a billboard does not fit on a page, channels 1 and 2 have
    planes of different sides, or a billboard has a direction twice.
    """
    plans = _plans(textures, most_texels)
    _check_budget(sum(_allocated(textures, plan) for plan in plans), byte_budget)
    return [_packed(textures, plan) for plan in plans]


def _check_budget(found: int, budget: int | None) -> None:
    if budget is not None and found > budget:
        raise ValueError(
            f"the atlases of the street would take {found} bytes; expected {budget} at most "
            "(byte_budget)."
        )


# ---- planning ----------------------------------------------------------------------------------


def _sides(textures: CompressedTextures) -> tuple[int, int]:
    sides = [max(planes.shape[-1], 1) for planes in textures.planes]
    if sides[1] != sides[2]:
        raise ValueError(
            f"planes of channels 1 and 2 have sides of {sides[1]} and {sides[2]} texels; expected "
            "one side."
        )
    return sides[0], sides[1]


def _plans(textures: CompressedTextures, most: int) -> list[_Plan]:
    detail_side, tint_side = _sides(textures)
    ranks = textures.ranks.astype(np.int64)
    slots = np.column_stack([ranks[:, 0], ranks[:, 1] + ranks[:, 2]])
    views = np.diff(textures.first)
    # A run reaches into one tile more than it fills, at most.
    view_texels = views * (1 + np.where(slots, slots // 4 + 2, 0).sum(axis=1))
    needed = np.column_stack([slots, view_texels, np.diff(textures.first_mask)])
    # A sheet of any number of tiles has no more rows than columns, but a run is never wider.
    longest = (slots // 4 + 2).max(axis=0, initial=1)
    across = np.array([most // detail_side, most // tint_side])
    limits = np.append(4 * across**2, [min(most**2, _EXACT), most * (most // SIDE)])
    if len(ranks) and ((needed > limits).any() or (longest > across).any()):
        raise ValueError(
            f"a billboard has {slots.max()} planes of a texture and {views.max()} views; expected "
            f"fewer: they do not fit on a page of {most} x {most} texels."
        )
    total = np.concatenate([np.zeros((1, 4), np.int64), np.cumsum(needed, axis=0)])
    made, start = [], 0
    while start < len(ranks):
        ends = [
            np.searchsorted(total[:, column], total[start, column] + limits[column], "right")
            for column in range(4)
        ]
        stop = int(min(ends)) - 1
        made.append(_planned(textures, slots, most, start, stop))
        start = stop
    return made


def _planned(
    textures: CompressedTextures, slots: NDArray[np.int64], most: int, start: int, stop: int
) -> _Plan:
    own = slots[start:stop]
    firsts, tiles, sheets = [], [], []
    for ranks in own.T:
        first = pack_slots(ranks)
        reached = np.where(ranks, (first % 4 + ranks + 3) // 4, 0)
        firsts.append(first)
        tiles.append(reached)
        sheets.append(_sheet(-(-int(ranks.sum()) // 4), int(reached.max(initial=1))))
    views = np.diff(textures.first[start : stop + 1])
    sheets.append(_sheet(int((views * (1 + tiles[0] + tiles[1])).sum())))
    masks = int(textures.first_mask[stop] - textures.first_mask[start])
    # A mask is 32 texels wide and one high.
    columns = min(-(-_sheet(masks * SIDE)[1] // SIDE), most // SIDE)
    sheets.append((max(-(-masks // columns), 1), columns))
    return _Plan(start, stop, firsts[0], firsts[1], tiles[0], tiles[1], tuple(sheets))


def _sheet(count: int, least: int = 1) -> tuple[int, int]:
    """Rows and columns that hold so many, nearly square, ``least`` columns or more."""
    columns = max(math.isqrt(max(count - 1, 0)) + 1, least)
    return max(-(-count // columns), 1), columns


def _allocated(textures: CompressedTextures, plan: _Plan) -> int:
    detail, tint, views, masks = (rows * columns for rows, columns in plan.sheets)
    sides = _sides(textures)
    # Four planes and their four scales; texels of four bytes; two records of four floats.
    planes = sum(
        count * (4 * side**2 + 16) for count, side in zip((detail, tint), sides, strict=True)
    )
    return planes + 4 * views + 4 * SIDE * masks + 32 * (plan.stop - plan.start)


# ---- packing -----------------------------------------------------------------------------------


def _packed(textures: CompressedTextures, plan: _Plan) -> Page:
    count = plan.stop - plan.start
    ranks = textures.ranks[plan.start : plan.stop].astype(np.int64)
    channels = [(0, plan.detail), (1, plan.tint), (2, plan.tint + ranks[:, 1])]
    detail = _atlas(textures, plan, channels[:1], plan.sheets[0], plan.detail_tiles)
    tint = _atlas(textures, plan, channels[1:], plan.sheets[1], plan.tint_tiles)
    first_texel, views = _views(textures, plan, ranks)
    masks = textures.masks[textures.first_mask[plan.start] : textures.first_mask[plan.stop]]
    rows, columns = plan.sheets[3]
    mask_texels = np.zeros((rows * columns, SIDE, 4), np.uint8)
    mask_texels[: len(masks)] = masks
    records = np.zeros((count, 2, 4), np.float32)
    records[:, 0, 0] = first_texel
    records[:, 0, 1] = textures.first_mask[plan.start : plan.stop] - textures.first_mask[plan.start]
    records[:, 0, 2:] = _direction_bits(textures, plan)
    records[:, 1, 0] = plan.detail // 4
    records[:, 1, 1] = plan.tint // 4
    many = np.diff(textures.first_mask)[plan.start : plan.stop] > 1
    records[:, 1, 2] = plan.detail_tiles + 64 * plan.tint_tiles + 4096 * many
    records[:, 1, 2] += 8192 * (textures.colour == "ycocg")
    records[:, 1, 3] = plan.tint % 4 + ranks[:, 1]
    used = sum(
        planes * (side**2 + 4)
        for planes, side in (
            (int(ranks[:, 0].sum()), detail.side),
            (int(ranks[:, 1:].sum()), tint.side),
        )
    )
    view_count = np.diff(textures.first[plan.start : plan.stop + 1])
    used += int((view_count * (4 + ranks.sum(axis=1))).sum()) + masks.nbytes + records.nbytes
    return Page(
        billboards=np.arange(plan.start, plan.stop),
        detail=detail,
        tint=tint,
        views=views,
        masks=mask_texels.reshape(rows, columns * SIDE, 4),
        records=records,
        bytes=used,
        padding=_allocated(textures, plan) - used,
    )


def _atlas(
    textures: CompressedTextures,
    plan: _Plan,
    channels: list[tuple[int, NDArray[np.int64]]],
    sheet: tuple[int, int],
    tiles: NDArray[np.int64],
) -> Atlas:
    rows, columns = sheet
    side = _sides(textures)[min(channels[0][0], 1)]
    texels = np.zeros((rows, side, columns, side, 4), np.uint8)
    scales = np.zeros((rows, columns, 4), np.float32)
    for channel, first in channels:
        ranks = textures.ranks[:, channel].astype(np.int64)
        before = int(ranks[: plan.start].sum())
        owner, within = _ragged(ranks[plan.start : plan.stop])
        slot = first[owner] + within
        row, column = np.divmod(slot // 4, columns)
        chosen = slice(before, before + len(slot))
        texels[row, :, column, :, slot % 4] = textures.planes[channel][chosen]
        scales[row, column, slot % 4] = textures.scales[channel][chosen]
    return Atlas(
        texels.reshape(rows * side, columns * side, 4), scales, side, int(tiles.max(initial=0))
    )


def _views(
    textures: CompressedTextures, plan: _Plan, ranks: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """The first texels of the billboards (p,), and the texture."""
    first, last = textures.first[plan.start], textures.first[plan.stop]
    counts = np.diff(textures.first[plan.start : plan.stop + 1])
    width = 1 + plan.detail_tiles + plan.tint_tiles
    owner, within = _ragged(counts)
    taken = counts * width
    first_texel = np.cumsum(taken) - taken
    place = first_texel[owner] + within * width[owner]
    rows, columns = plan.sheets[2]
    texels = np.full((rows * columns, 4), 128, np.uint8)
    texels[place, :3] = textures.means[first:last]
    texels[place, 3] = textures.direction[first:last]
    tint_texel = 1 + plan.detail_tiles
    for channel, lead, texel in (
        (0, plan.detail % 4, np.ones_like(tint_texel)),
        (1, plan.tint % 4, tint_texel),
        (2, plan.tint % 4 + ranks[:, 1], tint_texel),
    ):
        all_ranks = textures.ranks[:, channel].astype(np.int64)
        a_billboard = np.diff(textures.first) * all_ranks
        before = int(a_billboard[: plan.start].sum())
        view, number = _ragged(ranks[owner, channel])
        slot = lead[owner][view] + number
        texels[(place + texel[owner])[view] + slot // 4, slot % 4] = textures.weights[channel][
            before : before + len(slot)
        ]
    return first_texel, texels.reshape(rows, columns, 4)


def _direction_bits(textures: CompressedTextures, plan: _Plan) -> NDArray[np.float32]:
    """(p, 2): bit n of the first number stands for direction n, of the second for n + 16."""
    owner, _ = _ragged(np.diff(textures.first[plan.start : plan.stop + 1]))
    direction = textures.direction[textures.first[plan.start] : textures.first[plan.stop]]
    direction = direction.astype(np.int64)
    seen = np.zeros((plan.stop - plan.start, 32), np.int64)
    np.add.at(seen, (owner, direction), 1)
    if (seen > 1).any():
        billboard, twice = np.argwhere(seen > 1)[0]
        raise ValueError(
            f"direction: billboard {plan.start + billboard} has direction {twice} "
            f"{seen[billboard, twice]} times; expected each once."
        )
    return (seen.reshape(-1, 2, 16) << np.arange(16)).sum(axis=-1).astype(np.float32)


def _ragged(counts: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Of all members of groups with so many each: the group, and the place within it."""
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
