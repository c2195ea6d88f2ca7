"""Points that several depth maps agree on, and their union along a drive.

A point of one photograph stays if other frames' depth maps have it at the same place and not more
of them look through it; it moves to the mean of what they measured.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Map = NDArray[np.float32]

_SURE = 3.0  # standard deviations within which two depths are one
_MOST_APART = 0.06  # of the depth: farther apart, they are two surfaces however unsure
_TILE = 25.0  # metres: what is cleaned at a time
_PENDING = 400_000  # points a tile keeps before it merges them


class Points(NamedTuple):
    """n points of surfaces."""

    positions: FloatArray
    """(n, 3), metres in the world."""
    colours: NDArray[np.uint8]
    """(n, 3), sRGB."""
    normals: Map
    """(n, 3), unit vectors towards the cameras; zero where unknown."""
    weight: Map
    """(n,), inverse variance, 1 / m²."""


class FrameViews(NamedTuple):
    """k photographs with their depths and cameras."""

    depth: Map
    """(k, h, w), metres along the camera's axis; nan where unknown."""
    deviation: Map
    """(k, h, w), standard deviation, metres."""
    photographs: NDArray[np.uint8]
    """(k, h, w, 3), sRGB."""
    intrinsics: FloatArray
    """(k, 3, 3)."""
    poses: FloatArray
    """(k, 4, 4), from the camera's axes to the world's."""


# ---- one frame -------------------------------------------------------------------------------


def consistent_points(
    frame: FrameViews,
    neighbours: FrameViews,
    *,
    least_support: int = 2,
    farthest: float = 25.0,
    step: int = 1,
) -> Points:
    """Points of one frame's pixels that at least ``least_support`` neighbours confirm."""
    parts = []
    for i in range(len(frame.depth)):
        others = _others(neighbours, frame.poses[i])
        found, normals, weight = _confirmed(
            frame.depth[i],
            frame.deviation[i],
            _focal(frame.intrinsics[i : i + 1])[0],
            np.ascontiguousarray(frame.poses[i], dtype=np.float64),
            neighbours.depth[others],
            neighbours.deviation[others],
            _focal(neighbours.intrinsics[others]),
            np.linalg.inv(neighbours.poses[others]),
            least_support,
            farthest,
            step,
        )
        kept = weight > 0
        colours = frame.photographs[i, ::step, ::step][kept]
        parts.append(Points(found[kept], colours, normals[kept], weight[kept]))
    return _joined(parts)


def agreement(frame: FrameViews, neighbours: FrameViews) -> float:
    """Share of a frame's textured pixels that its neighbours show at the same depth, alike."""
    asked = confirmed = 0
    greys = neighbours.photographs.mean(axis=-1, dtype=np.float32)
    for i in range(len(frame.depth)):
        others = _others(neighbours, frame.poses[i])
        counts = _alike(
            frame.depth[i],
            frame.photographs[i].mean(axis=-1, dtype=np.float32),
            _focal(frame.intrinsics[i : i + 1])[0],
            np.ascontiguousarray(frame.poses[i], dtype=np.float64),
            neighbours.depth[others],
            greys[others],
            _focal(neighbours.intrinsics[others]),
            np.linalg.inv(neighbours.poses[others]),
        )
        asked += counts[0]
        confirmed += counts[1]
    return confirmed / asked if asked else 0.0


def _others(views: FrameViews, pose: FloatArray) -> NDArray[np.int64]:
    """Views that are not this camera itself: it would confirm whatever it says."""
    return np.flatnonzero(np.abs(views.poses - pose).max(axis=(1, 2)) > 1e-9)


def _focal(intrinsics: FloatArray) -> FloatArray:
    """(k, 4): focal lengths and principal points, in pixels."""
    return np.stack(
        [
            intrinsics[:, 0, 0],
            intrinsics[:, 1, 1],
            intrinsics[:, 0, 2],
            intrinsics[:, 1, 2],
        ],
        axis=1,
    ).astype(np.float64)


def _joined(parts: list[Points]) -> Points:
    if not parts:
        return Points(
            np.zeros((0, 3)),
            np.zeros((0, 3), np.uint8),
            np.zeros((0, 3), np.float32),
            np.zeros(0, np.float32),
        )
    return Points(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


@njit(cache=True, nogil=True)
def _depth_at(depth, deviation, u, v, expected, tolerance):  # type: ignore[no-untyped-def]
    """Depth of a view at (u, v), interpolated where its four pixels are one surface, and spread.

    Of a step between two surfaces, the one nearer to what is expected; nan where it knows none.
    """
    height, width = depth.shape
    x, y = int(np.floor(u)), int(np.floor(v))
    if x < 0 or y < 0 or x > width - 2 or y > height - 2:
        return np.nan, np.nan
    a, b = u - x, v - y
    best = np.nan
    spread = np.nan
    nearest = np.inf
    total = mean = 0.0
    least, most = np.inf, -np.inf
    for j in range(2):
        for i in range(2):
            d = depth[y + j, x + i]
            if not np.isfinite(d):
                continue
            least, most = min(least, d), max(most, d)
            share = (a if i else 1 - a) * (b if j else 1 - b)
            total += share
            mean += share * d
            if abs(d - expected) < nearest:
                nearest = abs(d - expected)
                best = d
                spread = deviation[y + j, x + i]
    if total > 0.4 and most - least <= tolerance:
        best = mean / total
    return best, spread


@njit(cache=True, nogil=True)
def _confirmed(  # type: ignore[no-untyped-def]
    depth, deviation, lens, pose, depths, deviations, lenses, to_views, support, farthest, step
):
    """Positions, normals, inverse variances of every step-th pixel; weight 0: not confirmed."""
    height, width = depth.shape
    rows, columns = (height + step - 1) // step, (width + step - 1) // step
    found = np.zeros((rows, columns, 3))
    normals = np.zeros((rows, columns, 3), np.float32)
    weight = np.zeros((rows, columns), np.float32)
    for row in range(rows):
        for column in range(columns):
            y, x = row * step, column * step
            z = depth[y, x]
            if not (z <= farthest):
                continue
            across, down = (x - lens[2]) / lens[0], (y - lens[3]) / lens[1]
            way = pose[:3, 0] * across + pose[:3, 1] * down + pose[:3, 2]
            here = pose[:3, 3] + way * z
            variance = deviation[y, x] ** 2
            certain = 1 / variance
            moved = 0.0
            agree = through = 0
            for k in range(len(depths)):
                m = to_views[k]
                seen_z = m[2, 0] * here[0] + m[2, 1] * here[1] + m[2, 2] * here[2] + m[2, 3]
                if seen_z < 0.5:
                    continue
                seen_x = m[0, 0] * here[0] + m[0, 1] * here[1] + m[0, 2] * here[2] + m[0, 3]
                seen_y = m[1, 0] * here[0] + m[1, 1] * here[1] + m[1, 2] * here[2] + m[1, 3]
                u = seen_x / seen_z * lenses[k, 0] + lenses[k, 2]
                v = seen_y / seen_z * lenses[k, 1] + lenses[k, 3]
                rough = _MOST_APART * seen_z
                measured, spread = _depth_at(depths[k], deviations[k], u, v, seen_z, rough)
                if not np.isfinite(measured):
                    continue
                slope = m[2, 0] * way[0] + m[2, 1] * way[1] + m[2, 2] * way[2]
                apart = measured - seen_z
                allowed = min(
                    _SURE * np.sqrt(spread**2 + variance * slope**2) + 0.005 * seen_z, rough
                )
                if abs(apart) <= allowed:
                    agree += 1
                    if abs(slope) > 0.5:
                        share = slope**2 / spread**2
                        certain += share
                        moved += share * apart / slope
                elif apart > 0:
                    through += 1
            if agree < support or through > agree:
                continue
            found[row, column] = here + way * (moved / certain)
            # Measurements of overlapping photographs share their errors: no surer than 1 cm.
            weight[row, column] = 1 / (1 / certain + 1e-4)
            _set_normal(normals[row, column], depth, lens, pose, x, y)
    return found, normals, weight


@njit(cache=True, nogil=True)
def _set_normal(normal, depth, lens, pose, x, y):  # type: ignore[no-untyped-def]
    """The depth map's normal at a pixel, from differences as far as its surface goes."""
    height, width = depth.shape
    z = depth[y, x]
    reach = 3
    slopes = np.zeros(2)
    for axis in range(2):
        low = high = z
        span = 0
        for sign in (-1, 1):
            for r in range(reach, 0, -1):
                i, j = (x + sign * r, y) if axis == 0 else (x, y + sign * r)
                if i < 0 or j < 0 or i >= width or j >= height:
                    continue
                d = depth[j, i]
                if abs(d - z) <= 0.02 * z * r:
                    span += r
                    if sign < 0:
                        low = d
                    else:
                        high = d
                    break
        if span == 0:
            return
        slopes[axis] = (high - low) / span
    # The plane 1/z = a x + b y + c has the normal (a f, b f, c at the principal point).
    a, b = -slopes[0] / z**2, -slopes[1] / z**2
    n0, n1 = a * lens[0], b * lens[1]
    n2 = 1 / z - a * (x - lens[2]) - b * (y - lens[3])
    length = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    for i in range(3):
        normal[i] = -(pose[i, 0] * n0 + pose[i, 1] * n1 + pose[i, 2] * n2) / length


@njit(cache=True, nogil=True)
def _alike(depth, grey, lens, pose, depths, greys, lenses, to_views):  # type: ignore[no-untyped-def]
    """How many (pixel, view) could be compared, and how many agree in depth and look alike.

    Depth alone would not do: a road and walls along the drive stay where they are when the focal
    length or the way driven is wrong, only what is painted on them slides.
    """
    height, width = depth.shape
    asked = confirmed = 0
    side = 2
    ours = np.zeros((2 * side + 1) ** 2)
    theirs = np.zeros((2 * side + 1) ** 2)
    for y in range(side, height - side, 5):
        for x in range(side, width - side, 5):
            z = depth[y, x]
            if not (z <= 20.0):
                continue
            mean = square = 0.0
            n = 0
            for j in range(-side, side + 1):
                for i in range(-side, side + 1):
                    ours[n] = grey[y + j, x + i]
                    mean += ours[n]
                    square += ours[n] ** 2
                    n += 1
            mean /= n
            if square / n - mean**2 < 25.0:
                continue
            for k in range(len(depths)):
                m = to_views[k]
                inside = True
                same = False
                n = 0
                for j in range(-side, side + 1):
                    for i in range(-side, side + 1):
                        d = depth[y + j, x + i]
                        if not abs(d - z) <= 0.05 * z:
                            d = z
                        across = (x + i - lens[2]) / lens[0] * d
                        down = (y + j - lens[3]) / lens[1] * d
                        p = (pose[:3, 0] * across + pose[:3, 1] * down + pose[:3, 2] * d) + pose[
                            :3, 3
                        ]
                        w = m[2, 0] * p[0] + m[2, 1] * p[1] + m[2, 2] * p[2] + m[2, 3]
                        if w < 0.5:
                            inside = False
                            break
                        u = (m[0, 0] * p[0] + m[0, 1] * p[1] + m[0, 2] * p[2] + m[0, 3]) / w
                        v = (m[1, 0] * p[0] + m[1, 1] * p[1] + m[1, 2] * p[2] + m[1, 3]) / w
                        u = u * lenses[k, 0] + lenses[k, 2]
                        v = v * lenses[k, 1] + lenses[k, 3]
                        h, g = int(np.floor(v)), int(np.floor(u))
                        if h < 0 or g < 0 or h > height - 2 or g > width - 2:
                            inside = False
                            break
                        if i == 0 and j == 0:
                            measured = depths[k, int(round(v)), int(round(u))]
                            # Without a depth, or behind something, the view says nothing.
                            if not measured >= 0.9 * w:
                                inside = False
                                break
                            same = measured <= 1.04 * w and measured >= 0.96 * w
                        a, b = u - g, v - h
                        top = greys[k, h, g] * (1 - a) + greys[k, h, g + 1] * a
                        low = greys[k, h + 1, g] * (1 - a) + greys[k, h + 1, g + 1] * a
                        theirs[n] = top * (1 - b) + low * b
                        n += 1
                    if not inside:
                        break
                if not inside:
                    continue
                asked += 1
                if same and _correlation(ours, theirs) > 0.6:
                    confirmed += 1
    return asked, confirmed


@njit(cache=True, nogil=True)
def _correlation(ours, theirs):  # type: ignore[no-untyped-def]
    one, two = ours - ours.mean(), theirs - theirs.mean()
    return (one * two).sum() / np.sqrt((one * one).sum() * (two * two).sum() + 1e-9)


# ---- a drive ---------------------------------------------------------------------------------


def fused(parts: Iterable[Points], cell: float = 0.05) -> Points:
    """The union of many frames' points, one a cell of ``cell`` metres, without outliers."""
    tiles: dict[tuple[int, int], NDArray[np.float64]] = {}
    pending: dict[tuple[int, int], list[NDArray[np.float64]]] = defaultdict(list)
    for part in parts:
        rows = _rows(part)
        for tile, members in _by_tile(rows[:, :3] / rows[:, 9:10]):
            pending[tile].append(rows[members])
            if sum(map(len, pending[tile])) > _PENDING:
                tiles[tile] = _merged_cells(tiles.get(tile), pending.pop(tile), cell)
    for tile in list(pending):
        tiles[tile] = _merged_cells(tiles.get(tile), pending.pop(tile), cell)
    return _joined([_cleaned(tiles, tile, cell) for tile in sorted(tiles)])


def _rows(points: Points) -> NDArray[np.float64]:
    """(n, 10): position, colour, normal times weight, and weight: what cells add up."""
    weight = points.weight[:, None].astype(np.float64)
    return np.concatenate(
        [points.positions * weight, points.colours * weight, points.normals * weight, weight],
        axis=1,
    )


def _by_tile(
    positions: FloatArray,
) -> list[tuple[tuple[int, int], NDArray[np.int64]]]:
    tile = np.floor(positions[:, :2] / _TILE).astype(np.int64)
    which, index = np.unique(tile, axis=0, return_inverse=True)
    index = index.ravel()
    return [((int(a), int(b)), np.flatnonzero(index == i)) for i, (a, b) in enumerate(which)]


def _merged_cells(
    old: NDArray[np.float64] | None, new: list[NDArray[np.float64]], cell: float
) -> NDArray[np.float64]:
    rows = np.concatenate(new if old is None else [old, *new])
    # Each cell's mean lies in the cell, so merging again does not mix cells.
    place = np.floor(rows[:, :3] / rows[:, 9:10] / cell).astype(np.int64)
    place -= place.min(axis=0)
    size = place.max(axis=0) + 1
    key = (place[:, 0] * size[1] + place[:, 1]) * size[2] + place[:, 2]
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    return np.add.reduceat(rows[order], first, axis=0)


def _cleaned(
    tiles: dict[tuple[int, int], NDArray[np.float64]], tile: tuple[int, int], cell: float
) -> Points:
    """A tile's cells without those that stand alone, judged with a margin of its neighbours."""
    import open3d as o3d  # takes seconds

    radius = 4 * cell
    own = tiles[tile]
    rows = [own]
    low = np.array(tile) * _TILE - radius
    high = np.array(tile) * _TILE + _TILE + radius
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            beside = tiles.get((tile[0] + i, tile[1] + j))
            if beside is None or (i == 0 and j == 0):
                continue
            places = beside[:, :2] / beside[:, 9:10]
            rows.append(beside[((places >= low) & (places <= high)).all(axis=1)])
    everything = np.concatenate(rows)
    cloud = o3d.geometry.PointCloud(
        o3d.utility.Vector3dVector(everything[:, :3] / everything[:, 9:10])
    )
    _, kept = cloud.remove_radius_outlier(nb_points=6, radius=radius)
    inside = np.asarray(kept, dtype=np.int64)
    own = own[np.sort(inside[inside < len(own)])]
    weight = own[:, 9:10]
    normals = own[:, 6:9]
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return Points(
        own[:, :3] / weight,
        np.round(own[:, 3:6] / weight).astype(np.uint8),
        (normals / np.where(length > 0, length, 1)).astype(np.float32),
        weight[:, 0].astype(np.float32),
    )
