"""Points that several frames' depth maps agree on, and their union along a drive.

A point of one photograph stays if other frames' depth maps have it at the same place and not half
as many look through it; it moves to the mean of what they measured (Merrell et al., Real-time
visibility-based fusion of depth maps, ICCV 2007).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.capture.multi_view_consistency import (
    DepthView,
    GreyView,
    OtherDepthViews,
    OtherGreyViews,
    geometric_consistency,
    photometric_consistency,
)

FloatArray = NDArray[np.float64]
Map = NDArray[np.float32]
Sums = NDArray[np.float64]
"""(n, 10): position, colour, normal, each times weight, and weight, summed over a cell."""

_AHEAD = 4.0
"""Metres before a camera, around which others see best what it sees."""
_TILE = 25.0
"""Metres, the side of what is cleaned at a time."""
_PENDING = 400_000
"""Points that a tile keeps before they are merged."""
_REACH = 3.0
"""Cells around a point in which others have to be."""


class Points(NamedTuple):
    """n points of surfaces."""

    positions: FloatArray
    """(n, 3), metres in the world."""
    colours: NDArray[np.uint8]
    """(n, 3), sRGB."""
    normals: Map
    """(n, 3), of length 1, towards the cameras; 0 where unknown."""
    weight: Map
    """(n,), inverse variance of the position, 1 / m²; of cells, the sum."""


class RgbdViews(NamedTuple):
    """k photographs with their depths and cameras."""

    depth: Map
    """(k, h, w), metres along the camera's axis; nan: unknown, inf: sky."""
    deviation: Map
    """(k, h, w), standard deviation, metres."""
    photographs: NDArray[np.uint8]
    """(k, h, w, 3), sRGB."""
    intrinsics: FloatArray
    """(k, 3, 3), pixels."""
    poses: FloatArray
    """(k, 4, 4), from the camera's axes to the world's."""


# ---- one frame -------------------------------------------------------------------------------


def consistent_points(
    frame: RgbdViews,
    neighbours: RgbdViews,
    *,
    least_support: int = 2,
    farthest: float = 25.0,
    step: int = 1,
) -> Points:
    """Points of one frame's pixels that ``least_support`` depth maps of other frames confirm.

    Views of ``neighbours`` that stand where one of the frame's does are not asked: they would
    confirm their own errors. farthest: metres along the axis; step: every step-th row and column
    has points. Wrong intrinsics or poses leave many, wrong ones: ``photometric_agreement`` tells.
    """
    parts = []
    for i in range(len(frame.depth)):
        others = _others(neighbours, frame, i)
        lens, to_world = _camera(frame, i)
        view = DepthView(
            _contiguous(frame.depth[i]), _contiguous(frame.deviation[i]), lens, to_world
        )
        asked = OtherDepthViews(
            _contiguous(neighbours.depth[others]),
            _contiguous(neighbours.deviation[others]),
            *_cameras(neighbours, others),
        )
        positions, normals, weight = geometric_consistency(
            view, asked, least_support, farthest, step
        )
        kept = weight > 0
        colours = frame.photographs[i, ::step, ::step][kept]
        parts.append(Points(positions[kept], colours, normals[kept], weight[kept]))
    return _joined(parts)


def photometric_agreement(frame: RgbdViews, neighbours: RgbdViews) -> float:
    """Share of a frame's textured pixels up to 20 m that other frames confirm where they look.

    Same depth within 4 %, and it looks alike there. 0.5 to 0.8 with right intrinsics and poses,
    less than 0.2 with those off by a tenth or by three degrees. 0 where nothing can be compared.
    """
    asked = agree = 0
    greys = neighbours.photographs.mean(axis=-1, dtype=np.float32)
    for i in range(len(frame.depth)):
        others = _others(neighbours, frame, i)
        lens, to_world = _camera(frame, i)
        grey = frame.photographs[i].mean(axis=-1, dtype=np.float32)
        view = GreyView(_contiguous(frame.depth[i]), grey, lens, to_world)
        beside = OtherGreyViews(
            _contiguous(neighbours.depth[others]), greys[others], *_cameras(neighbours, others)
        )
        counts = photometric_consistency(view, beside)
        asked += counts[0]
        agree += counts[1]
    return agree / asked if asked else 0.0


def _others(views: RgbdViews, frame: RgbdViews, camera: int) -> NDArray[np.int64]:
    """Views but the frame's own, first those around what the camera sees best: they know most."""
    apart = np.abs(views.poses[:, None] - frame.poses[None]).max(axis=(2, 3)).min(axis=1)
    others = np.flatnonzero(apart > 1e-9)
    ahead = frame.poses[camera, :3, 3] + _AHEAD * frame.poses[camera, :3, 2]
    away = np.linalg.norm(views.poses[others, :3, 3] - ahead, axis=1)
    return others[np.argsort(away, kind="stable")]


def _camera(views: RgbdViews, number: int) -> tuple[FloatArray, FloatArray]:
    """Lens (4,) and pose (4, 4) of one."""
    pose = np.ascontiguousarray(views.poses[number], dtype=np.float64)
    return _lenses(views.intrinsics[number : number + 1])[0], pose


def _cameras(views: RgbdViews, chosen: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """Lenses (k, 4) and what takes the world to the cameras' axes (k, 4, 4)."""
    poses = np.asarray(views.poses[chosen], np.float64)
    return _lenses(views.intrinsics[chosen]), np.asarray(np.linalg.inv(poses), np.float64)


def _lenses(intrinsics: FloatArray) -> FloatArray:
    """(k, 4): focal lengths and principal points of K (k, 3, 3), in pixels."""
    places = ((0, 0), (1, 1), (0, 2), (1, 2))
    return np.stack([intrinsics[:, i, j] for i, j in places], axis=1).astype(np.float64)


def _contiguous(values: NDArray[np.floating]) -> Map:
    return np.ascontiguousarray(values, dtype=np.float32)


def _joined(parts: list[Points]) -> Points:
    if not parts:
        normals, weight = np.zeros((0, 3), np.float32), np.zeros(0, np.float32)
        return Points(np.zeros((0, 3)), np.zeros((0, 3), np.uint8), normals, weight)
    return Points(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


# ---- a drive ---------------------------------------------------------------------------------


def fuse_points(parts: Iterable[Points], cell: float = 0.05, company: int = 10) -> Points:
    """The union of many frames' points, one for each cell of ``cell`` metres, without outliers.

    Positions, colours and normals are means by weight. Those that fewer than ``company`` others
    accompany within three cells are left out (Open3D); of three cameras, a pole 10 cm thick has
    about 15 points there. What is kept meanwhile grows with the surface's cells,
    not with frames; outliers are looked for in tiles of 25 m. Ordered by tile.
    """
    tiles: dict[tuple[int, int], list[Sums]] = defaultdict(list)
    for part in parts:
        for tile, rows in _by_tile(_cells(_rows(part), cell)):
            tiles[tile].append(rows)
            # The first is what has been merged before.
            if sum(map(len, tiles[tile][1:])) > _PENDING:
                tiles[tile] = [_cells(np.concatenate(tiles[tile]), cell)]
    merged = {tile: _cells(np.concatenate(rows), cell) for tile, rows in tiles.items()}
    return _joined([_cleaned(merged, tile, cell, company) for tile in sorted(merged)])


def _rows(points: Points) -> Sums:
    weight = points.weight[:, None].astype(np.float64)
    return np.concatenate(
        [points.positions * weight, points.colours * weight, points.normals * weight, weight],
        axis=1,
    )


def _places(rows: Sums) -> FloatArray:
    return rows[:, :3] / rows[:, 9:]


def _cells(rows: Sums, cell: float) -> Sums:
    """Rows of one cell added up. A cell's mean lies in the cell: adding again mixes none."""
    if len(rows) == 0:
        return rows
    place = np.floor(_places(rows) / cell).astype(np.int64)
    place -= place.min(axis=0)
    size = place.max(axis=0) + 1
    key = (place[:, 0] * size[1] + place[:, 1]) * size[2] + place[:, 2]
    return np.asarray(_added(rows, key, np.argsort(key, kind="stable")))


@njit(cache=True, nogil=True)
def _added(rows: Sums, key: NDArray[np.int64], order: NDArray[np.int64]) -> Sums:
    added = np.zeros_like(rows)
    last = -1
    for n in range(len(order)):
        if n == 0 or key[order[n]] != key[order[n - 1]]:
            last += 1
        for k in range(rows.shape[1]):
            added[last, k] += rows[order[n], k]
    return added[: last + 1].copy()


def _by_tile(rows: Sums) -> list[tuple[tuple[int, int], Sums]]:
    x, y = np.floor(_places(rows)[:, :2] / _TILE).astype(np.int64).T
    return [
        ((int(i), int(j)), rows[(x == i) & (y == j)])
        for i in np.unique(x)
        for j in np.unique(y[x == i])
    ]


def _cleaned(
    tiles: dict[tuple[int, int], Sums], tile: tuple[int, int], cell: float, company: int
) -> Points:
    """A tile's cells without those that stand alone, judged with a margin of its neighbours."""
    import open3d as o3d  # takes seconds, and depth maps do without

    radius = _REACH * cell
    own = tiles[tile]
    around = [_places(own)]
    low = np.array(tile) * _TILE - radius
    high = np.array(tile) * _TILE + _TILE + radius
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            beside = tiles.get((tile[0] + i, tile[1] + j))
            if beside is not None and (i, j) != (0, 0):
                places = _places(beside)
                inside = ((places[:, :2] >= low) & (places[:, :2] <= high)).all(axis=1)
                around.append(places[inside])
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.concatenate(around)))
    _, rest = cloud.remove_radius_outlier(nb_points=company, radius=radius)
    kept = np.asarray(rest, dtype=np.int64)
    own = own[np.sort(kept[kept < len(own)])]
    normals = own[:, 6:9]
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return Points(
        _places(own),
        np.rint(own[:, 3:6] / own[:, 9:]).astype(np.uint8),
        (normals / np.where(length > 0, length, 1)).astype(np.float32),
        own[:, 9].astype(np.float32),
    )
