"""Figures of textures, found apart from what made them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.cameras import project_points
from pipelines.street_billboards.billboards import Billboards, axes_facing
from pipelines.street_billboards.capture.point_fusion import RgbdViews
from pipelines.street_billboards.textures.atlases import Page
from pipelines.street_billboards.textures.eigen_textures import decode_billboard, unpack_masks
from pipelines.street_billboards.textures.texture_tables import (
    SEEN,
    SIDE,
    CompressedTextures,
    ViewTextures,
)

_BILLBOARDS = 40
"""How many are sampled anew."""
_DECODED = 200
"""How many are decoded anew."""


def sampling_error(
    billboards: Billboards,
    views: ViewTextures,
    photographs: RgbdViews,
    codes: NDArray[np.uint8],
) -> float:
    """Median codes by which SEEN texels differ from the most alike photograph there.

    codes (k, 256, 3) even out exposures. Pixels are the nearest ones, without blending and
    averaging: a code or two of difference is usual, a texture that is mirrored, shifted or of
    another billboard differs by tens.
    """
    numbers = np.flatnonzero(np.diff(views.first) > 0)
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
                across, up = axes_facing(billboards.centre[number], pose[:3, 3])
                row, column = across * row[0], up * column[2]
            points = billboards.centre[number] + s[..., None] * row + t[..., None] * column
            pixels, depth = project_points(photographs.intrinsics[k], pose, points[seen])
            x, y = np.rint(np.nan_to_num(pixels, nan=-9.0)).clip(-9, 1e6).astype(np.int64).T
            shown = (depth > 0.3) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
            there = codes[k][photographs.photographs[k, y * shown, x * shown], np.arange(3)]
            apart = np.abs(there.astype(np.int64) - texels).mean(axis=1)
            least = np.where(shown, np.minimum(least, apart), least)
        found.append(least)
    return float(np.median(np.concatenate(found))) if found else 255.0


def decoded_rmse(views: ViewTextures, textures: CompressedTextures) -> float:
    """RMSE in codes of some billboards' SEEN texels, decoded with plain NumPy."""
    squares, count = 0.0, 0
    for number in _some(np.flatnonzero(np.diff(views.first) > 0)):
        rows = slice(views.first[number], views.first[number + 1])
        found = decode_billboard(textures, int(number))
        stored = textures.direction[textures.first[number] : textures.first[number + 1]]
        found = found[np.searchsorted(stored, views.direction[rows])]
        seen = views.states[rows] == SEEN
        apart = found[seen] - views.colours[rows][seen]
        squares += float((apart**2).sum())
        count += apart.size
    return float(np.sqrt(squares / max(count, 1)))


def unpacked_error(pages: Sequence[Page], textures: CompressedTextures) -> float:
    """Largest difference in codes of some billboards read from pages as their layout says.

    Masks that differ count as a difference of 255.
    """
    most = 0.0
    for page in pages:
        for place in _some(np.flatnonzero(np.diff(textures.first)[page.billboards] > 0)):
            number = int(page.billboards[place])
            found, masks = page_billboard(page, int(place))
            most = max(most, float(np.abs(found - decode_billboard(textures, number)).max()))
            if not np.array_equal(masks, unpack_masks(textures, number)):
                return 255.0
    return most


def _some(numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    return numbers[:: max(len(numbers) // _DECODED, 1)]


def page_billboard(page: Page, place: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Views (n, 32, 32, 3) in codes and masks (1 or n, 32, 32) of a page's billboard."""
    (texel, mask, low, high), (detail, tint, code, second) = page.records[place].astype(np.int64)
    count = int(low).bit_count() + int(high).bit_count()
    code = int(code)
    tiles = (code & 63, code >> 6 & 63)
    table = page.views.reshape(-1, 4)[texel:].astype(np.float64)
    table = table[: count * (1 + sum(tiles))].reshape(count, 1 + sum(tiles), 4)
    channels = np.repeat(table[:, 0, :3, None], SIDE * SIDE, axis=2).reshape(count, 3, SIDE, SIDE)
    taken = 1
    for atlas, first, reached in ((page.detail, detail, tiles[0]), (page.tint, tint, tiles[1])):
        columns = atlas.scales.shape[1]
        for step in range(reached):
            row, column = divmod(int(first) + step, columns)
            side = atlas.side
            tile = atlas.texels[row * side : (row + 1) * side, column * side : (column + 1) * side]
            for lane in range(4):
                plane = _full((tile[..., lane].astype(np.float64) - 128.0) / 127.0)
                amount = (table[:, taken, lane] - 128.0) / 127.0 * atlas.scales[row, column, lane]
                channel = 0 if atlas is page.detail else 1 + int(4 * step + lane >= second)
                channels[:, channel] += amount[:, None, None] * plane
            taken += 1
    if code >> 13 & 1:
        luma, orange, green = channels[:, 0], channels[:, 1] - 128.0, channels[:, 2] - 128.0
        channels = np.stack([luma + orange - green, luma + green, luma - orange - green], axis=1)
    flat = page.masks.reshape(page.masks.shape[0], -1, SIDE, 4).reshape(-1, SIDE, 4)
    masks = flat[mask : mask + (count if code >> 12 & 1 else 1)]
    bits = np.unpackbits(masks, axis=-1).astype(bool)
    return np.clip(channels.transpose(0, 2, 3, 1), 0.0, 255.0), bits


def _full(plane: NDArray[np.float64]) -> NDArray[np.float64]:
    """A plane of a lower resolution at a texture's texels."""
    from scipy.ndimage import zoom

    if len(plane) == SIDE:
        return plane
    return np.asarray(zoom(plane, SIDE / len(plane), order=1, mode="nearest", grid_mode=True))
