"""A street in tiles that stand alone: who drives through it loads and drops them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.billboards import Billboards
from pipelines.street_billboards.drawing.shader_street import page_headers
from pipelines.street_billboards.textures.atlases import Atlas, Page, pack_pages
from pipelines.street_billboards.textures.texture_tables import CompressedTextures

MOST_TEXELS = 4096
"""Of a texture's side: what WebGL2's devices have."""
_Three = tuple[NDArray[Any], NDArray[Any], NDArray[Any]]
_STEP = 0.25
"""Metres between the places of the way that billboards are assigned to."""


class LiveTile(NamedTuple):
    """Billboards along some metres of road, with all that draws them."""

    rows: NDArray[np.int64]
    """(n,), rows of the street's billboards; those that have no view are left out."""
    page: Page
    """Of the n billboards, numbered anew."""
    headers: NDArray[np.float32]
    """(y, 5 columns, 4), as `billboard.glsl` reads them."""
    stretch: tuple[float, float]
    """Metres along the way, from and to."""
    box: NDArray[np.float32]
    """(2, 3), least and most world coordinates that billboards reach."""


def live_tiles(
    billboards: Billboards,
    textures: CompressedTextures,
    places: NDArray[np.floating],
    metres: float,
    *,
    most_texels: int = MOST_TEXELS,
) -> list[LiveTile]:
    """The street in tiles of so many metres of road, in its order; none is empty.

    places (f, 3): the way that was driven. A tile that does not fit into textures of
    ``most_texels`` a side becomes several. Raises ValueError where no billboard has a view.
    """
    stretch = stretches(billboards.voxel, places, metres)
    drawable = np.diff(textures.first) > 0
    tiles = []
    for number in np.unique(stretch[drawable]):
        rows = np.flatnonzero(drawable & (stretch == number))
        own = Billboards._make(values[rows] for values in billboards)
        ends = (float(number * metres), float((number + 1) * metres))
        for page in pack_pages(some_textures(textures, rows), most_texels):
            chosen = page.billboards
            part = Billboards._make(values[chosen] for values in own)
            alone = page._replace(billboards=np.arange(len(chosen)))
            tiles.append(LiveTile(rows[chosen], alone, page_headers(part, alone), ends, _box(part)))
    if not tiles:
        raise ValueError("billboards: none has a view; expected some to show.")
    return tiles


def stretches(
    voxels: NDArray[np.float64], places: NDArray[np.floating], metres: float
) -> NDArray[np.int64]:
    """Which stretch (b,) of so many metres of the way (f, 3) is nearest to each voxel (b, 3).

    >>> way = np.array([[0.0, 0, 0], [10, 0, 0], [20, 0, 0]])
    >>> stretches(np.array([[1.0, 5, 2], [14, -3, 0], [90, 0, 0]]), way, 8.0).tolist()
    [0, 1, 2]
    """
    from scipy.spatial import cKDTree

    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    fine = np.arange(0.0, along[-1], _STEP)
    way = np.column_stack([np.interp(fine, along, places[:, axis]) for axis in range(3)])
    nearest = cKDTree(way).query(voxels)[1]
    return np.asarray(fine[nearest] // metres, np.int64)


def some_textures(textures: CompressedTextures, rows: NDArray[np.int64]) -> CompressedTextures:
    """The textures of some billboards (n,), in their order."""
    counts = np.diff(textures.first)
    ranks = textures.ranks.astype(np.int64)
    views = _members(counts, rows)
    masks = _members(np.diff(textures.first_mask), rows)
    planes = [_members(ranks[:, c], rows) for c in range(3)]
    weights = [_members(ranks[:, c] * counts, rows) for c in range(3)]

    def chosen(name: str, members: list[NDArray[np.int64]]) -> _Three:
        first, second, third = (
            values[own] for values, own in zip(getattr(textures, name), members, strict=True)
        )
        return first, second, third

    return CompressedTextures(
        textures.colour,
        _ends(counts[rows]),
        textures.direction[views],
        textures.means[views],
        textures.ranks[rows],
        chosen("planes", planes),
        chosen("scales", planes),
        chosen("weights", weights),
        _ends(np.diff(textures.first_mask)[rows]),
        textures.masks[masks],
    )


def _ends(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _members(counts: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Of ragged rows with so many members each: the members of some, row after row."""
    starts, taken = _ends(counts)[rows], counts[rows]
    return np.asarray(
        np.repeat(starts - (np.cumsum(taken) - taken), taken) + np.arange(taken.sum()), np.int64
    )


def _box(billboards: Billboards) -> NDArray[np.float32]:
    reach = np.hypot(
        np.linalg.norm(billboards.half_s, axis=1), np.linalg.norm(billboards.half_t, axis=1)
    )[:, None]
    least = (billboards.centre - reach).min(axis=0)
    most = (billboards.centre + reach).max(axis=0)
    return np.stack([least, most]).astype(np.float32)


def texel_points(
    tile: LiveTile, step: int = 2
) -> Iterator[tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.float32]]]:
    """Billboard by billboard, its texels as they look from the middle of its stored views.

    Every ``step``-th texel of a row and column that its mask shows. Yields places (t, 3) in the
    world, colours (t, 3) in sRGB codes, and half edges (2, 3) of the rectangle, as it stands there.
    """
    from pipelines.street_billboards.textures.figures import page_billboard
    from pipelines.street_billboards.textures.texture_tables import SIDE

    headers = tile.headers.reshape(-1, 5, 4)
    at = (np.arange(step // 2, SIDE, step) + 0.5) / SIDE * 2 - 1
    chosen = slice(step // 2, SIDE, step)
    for place in range(len(tile.page.records)):
        views, masks = page_billboard(tile.page, place)
        middle = len(views) // 2
        mask = masks[middle if len(masks) > 1 else 0][chosen, chosen]
        halves = _standing(headers[place], middle)
        grid = at[None, :, None] * halves[0] - at[:, None, None] * halves[1]
        places = (headers[place, 0, :3] + grid)[mask].astype(np.float32)
        colours = np.rint(views[middle][chosen, chosen][mask]).astype(np.uint8)
        yield places, colours, halves


def _standing(header: NDArray[np.float32], view: int) -> NDArray[np.float32]:
    """Half edges (2, 3) of a billboard, turned to where its stored view was taken from."""
    from pipelines.street_billboards.textures.view_directions import SPACING

    if header[1, 3] < 0.5:
        return header[1:3, :3]
    bits = int(header[3, 2]) | int(header[3, 3]) << 16
    direction = [bit for bit in range(32) if bits >> bit & 1][view]
    azimuth = np.radians((float(header[0, 3]) + direction) * SPACING)
    row = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    upwards = np.array([0.0, 0.0, 1.0])
    return np.stack([header[1, 0] * row, header[2, 2] * upwards]).astype(np.float32)


def tile_textures(tile: LiveTile) -> dict[str, NDArray[Any]]:
    """A tile's arrays as textures (1, y, x, 4), row 0 at t = 0; none of an atlas without planes."""
    page = tile.page
    made: dict[str, NDArray[Any]] = {
        "headers": tile.headers,
        "views": page.views,
        "masks": page.masks,
    }
    for name, atlas in (("detail", page.detail), ("tint", page.tint)):
        if atlas.most_tiles:
            made |= {name: atlas.texels, f"{name}_scales": atlas.scales}
    return {name: values[None] for name, values in made.items()}


def tile_of(
    rows: NDArray[np.integer],
    textures: Mapping[str, NDArray[Any]],
    sides: tuple[int, int],
    stretch: tuple[float, float],
    box: NDArray[np.float32],
) -> LiveTile:
    """The tile that `tile_textures` told; sides: of tiles of detail and tint, in texels."""
    headers = np.asarray(textures["headers"][0], np.float32)
    records = headers.reshape(-1, 5, 4)[: len(rows), 3:]
    codes = records[:, 1, 2].astype(np.int64)
    detail, tint = (
        _atlas(textures, name, side, int((codes >> shift & 63).max()))
        for name, side, shift in (("detail", sides[0], 0), ("tint", sides[1], 6))
    )
    views, masks = (np.asarray(textures[name][0], np.uint8) for name in ("views", "masks"))
    page = Page(np.arange(len(rows)), detail, tint, views, masks, records, 0, 0)
    return LiveTile(np.asarray(rows, np.int64), page, headers, stretch, box)


def _atlas(textures: Mapping[str, NDArray[Any]], name: str, side: int, most_tiles: int) -> Atlas:
    if name not in textures:
        nothing = np.empty((0, 0, 4), np.uint8)
        return Atlas(nothing, nothing.astype(np.float32), side, 0)
    texels = np.asarray(textures[name][0], np.uint8)
    scales = np.asarray(textures[f"{name}_scales"][0], np.float32)
    return Atlas(texels, scales, side, most_tiles)
