"""The unit and the up axis of found poses: by the road below the camera, by a track, by a baseline.

Pictures alone tell neither. The world that is made here has z up, metres, and the first camera's
path begins near the origin.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.joined_pieces import Similarity

FloatArray = NDArray[np.float64]

CAMERA_HEIGHT = 1.5
"""Metres above the road, of a camera behind a windscreen."""
_TILTED = 25.0
"""Degrees by which the road may be inclined to the camera's own level."""
_CLIMBING = 3.0
"""Degrees between the road and the way that is driven on it."""
_TRIALS = 2000
_BAND = 0.04
"""Of the camera's height: how far off the plane a point of the road may be."""
_BESIDE, _AHEAD = 1.5, 15.0
"""Camera heights to either side and ahead, in which the road is looked for."""
_PARTS = 8
"""Of the drive, whose heights are compared."""
_FEWEST = 60
_EARTH, _FLATTENING = 6378137.0, 1 / 298.257223563  # WGS 84


class Road(NamedTuple):
    """The road, as a plane in the cameras' own axes."""

    normal: FloatArray
    """(3,), of length 1, away from the road, in a camera's axes (x right, y down, z forward)."""
    height: float
    """Of the camera above the road, in the world's unit."""
    deviation: float
    """Of the height, of where along the road it is taken, relative to it."""
    points: int
    """That lie in it."""


def road_below(
    poses: FloatArray, points: FloatArray, nearest: NDArray[np.integer], *, seed: int = 0
) -> Road:
    """The road's plane below the cameras, by RANSAC over sparse points.

    poses (f, 4, 4) camera to world, nan where there is none; points (n, 3); nearest (n,), the frame
    nearest to each. Each point is put into the axes of its nearest camera, so that all of the drive
    shows one piece of road, hills or not. A car drives along the road: a plane that the way leads
    into or out of is none, however many points lie in it. Raises ValueError where no plane lies
    below.
    """
    away = points - poses[nearest, :3, 3]
    own = np.einsum("nji,nj->ni", poses[nearest, :3, :3], away)
    low = np.flatnonzero((own[:, 1] > 0) & (own[:, 2] > 0))
    plane = _ransac(own[low], _way(poses), np.random.default_rng(seed))
    if plane is None:
        raise ValueError(
            "scale: found no road below the cameras; expected sparse points of it, or a track or "
            "a baseline that says the unit."
        )
    normal, height = plane
    inside = _on_plane(own[low], normal, height)
    heights = -own[low][inside] @ normal
    deviation = _spread_along(heights, nearest[low][inside]) / height
    return Road(normal, height, deviation, int(inside.sum()))


def by_road(poses: FloatArray, road: Road, camera_height: float = CAMERA_HEIGHT) -> Similarity:
    """Into metres and z up: x along the first camera's view, its path over the origin."""
    normals = np.einsum("fij,j->fi", poses[:, :3, :3], road.normal)
    up = np.nanmean(normals, axis=0)
    return _upright(poses, up / np.linalg.norm(up), camera_height / road.height, camera_height)


def by_baseline(
    poses: FloatArray, up: FloatArray, found: float, given: float, height: float = CAMERA_HEIGHT
) -> Similarity:
    """Into metres where two cameras are ``found`` apart in the world's unit and ``given`` in
    metres; up (3,): of the world as found."""
    return _upright(poses, up / np.linalg.norm(up), given / found, height)


def by_track(poses: FloatArray, up: FloatArray, track: FloatArray) -> tuple[Similarity, float]:
    """Into a track's metres, x east and y north, and the root mean square of what is left.

    track (f, 3), where each camera was (:func:`east_north_up`), nan: not known; up (3,): of the
    world as found (a straight track says nothing of a roll about it). Half of the worst places are
    left out, as receivers jump. Raises ValueError for fewer than three places, or a way within
    three times what it is off.
    """
    upright = _upright(poses, up / np.linalg.norm(up), 1.0, 0.0)
    flat = upright.points(poses[:, :3, 3])
    known = np.flatnonzero(np.isfinite(flat).all(axis=1) & np.isfinite(track[:, :2]).all(axis=1))
    if len(known) < 3:
        raise ValueError(f"track: found {len(known)} places of the drive; expected at least 3.")
    source, target = (values[known] @ [1.0, 1.0j] for values in (flat[:, :2], track[:, :2]))
    weight = np.ones(len(known))
    for _ in range(30):
        share = weight / weight.sum()
        from_source, from_target = source - share @ source, target - share @ target
        # A turn, a scale and a shift of the plane are one complex line.
        factor = (share * from_source.conj()) @ from_target / (share @ np.abs(from_source) ** 2)
        left = np.abs(from_target - factor * from_source)
        weight = 1.0 / np.maximum(left, np.median(left) / 2 + 1e-9)
    off = float(np.sqrt(np.mean(np.sort(left)[: (len(left) + 1) // 2] ** 2)))
    if not np.abs(factor * from_source).max() > 3 * off:
        raise ValueError(f"track: found places that are {off:.1f} m off; expected a longer way.")
    scale, angle = float(np.abs(factor)), float(np.angle(factor))
    cosine, sine = np.cos(angle), np.sin(angle)
    north = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    turned = Similarity(scale * upright.scale, north @ upright.turn, np.zeros(3))
    share = weight / weight.sum()
    moved = turned.points(poses[known, :3, 3])
    heights = track[known, 2]
    level = np.nanmedian(heights - moved[:, 2]) if np.isfinite(heights).any() else 0.0
    shift = np.append(share @ (track[known, :2] - moved[:, :2]), level)
    return turned._replace(shift=shift), off


def east_north_up(places: FloatArray, origin: FloatArray | None = None) -> FloatArray:
    """Metres east, north and up (n, 3) of an origin, of degrees north, degrees east and metres
    above the sea (n, 3), on the ellipsoid WGS 84.

    origin (3,): in degrees and metres too, by default the first known place. Unknown heights (nan)
    stay unknown.

    >>> east_north_up(np.array([[0.0, 0.0, 0.0], [0.0, 0.001, 5.0]])).round(2).tolist()
    [[0.0, 0.0, 0.0], [111.32, 0.0, 5.0]]
    """
    known = np.isfinite(places[:, :2]).all(axis=1)
    if origin is None:
        origin = places[known][0]
    level = places.copy()
    level[:, 2] = 0.0
    at = np.array([origin[0], origin[1], 0.0])
    north, east = np.radians(at[:2])
    away = _earth_centred(level) - _earth_centred(at[None])
    axes = np.array(
        [
            [-np.sin(east), np.cos(east), 0],
            [-np.sin(north) * np.cos(east), -np.sin(north) * np.sin(east), np.cos(north)],
        ]
    )
    height = places[:, 2] - (origin[2] if np.isfinite(origin[2]) else 0.0)
    return np.column_stack([away @ axes.T, height])


def _earth_centred(places: FloatArray) -> FloatArray:
    north, east = np.radians(places[:, :2]).T
    squared = _FLATTENING * (2 - _FLATTENING)
    radius = _EARTH / np.sqrt(1 - squared * np.sin(north) ** 2)
    level = (radius + places[:, 2]) * np.cos(north)
    up = (radius * (1 - squared) + places[:, 2]) * np.sin(north)
    return np.column_stack([level * np.cos(east), level * np.sin(east), up])


def _way(poses: FloatArray) -> FloatArray:
    """(3,), of length 1: which way the car drives, in its camera's axes, median of its steps."""
    known = poses[np.isfinite(poses[:, 0, 0])]
    steps = np.einsum("fji,fj->fi", known[:-1, :3, :3], np.diff(known[:, :3, 3], axis=0))
    lengths = np.linalg.norm(steps, axis=1, keepdims=True)
    way = np.median(steps[lengths[:, 0] > 0] / lengths[lengths[:, 0] > 0], axis=0)
    return np.asarray(way / np.linalg.norm(way))


def _ransac(
    low: FloatArray, way: FloatArray, generator: np.random.Generator
) -> tuple[FloatArray, float] | None:
    """Normal and height of the plane below along a way with most points; None where there is
    none."""
    if len(low) < _FEWEST:
        return None
    best: tuple[FloatArray, float] | None = None
    most = _FEWEST - 1
    for _ in range(_TRIALS):
        plane = _through(low[generator.choice(len(low), 3, replace=False)], way)
        if plane is not None and (count := int(_on_plane(low, *plane).sum())) > most:
            most, best = count, plane
    for _ in range(5 if best is not None else 0):
        fitted = _through(low[_on_plane(low, *best)], way)  # type: ignore[misc]
        if fitted is None or _on_plane(low, *fitted).sum() < _FEWEST:
            break
        best = fitted
    return best


def _through(points: FloatArray, way: FloatArray) -> tuple[FloatArray, float] | None:
    """The plane nearest to points (k, 3): its normal upwards and the camera's height above it;
    None where it is none that is driven on."""
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][-1]
    normal = -normal * np.sign(normal[1] or 1.0)
    height = float(-normal @ middle)
    climbs = abs(float(normal @ way)) > np.sin(np.radians(_CLIMBING))
    if height <= 0 or climbs or -normal[1] < np.cos(np.radians(_TILTED)):
        return None
    return normal, height


def _on_plane(low: FloatArray, normal: FloatArray, height: float) -> NDArray[np.bool_]:
    """Which points are of the road before the car; beside it pavements are a little higher."""
    near = (np.abs(low[:, 0]) < _BESIDE * height) & (low[:, 2] < _AHEAD * height)
    return near & (np.abs(low @ normal + height) < _BAND * height)


def _spread_along(heights: FloatArray, frame: NDArray[np.integer]) -> float:
    """How much the height differs from part to part of the drive."""
    order = np.argsort(frame, kind="stable")
    parts = [np.median(part) for part in np.array_split(heights[order], _PARTS)]
    return float(np.std(parts))


def _upright(poses: FloatArray, up: FloatArray, scale: float, height: float) -> Similarity:
    first = poses[np.isfinite(poses[:, 0, 0])][0]
    ahead = first[:3, 2] - (first[:3, 2] @ up) * up
    ahead /= np.linalg.norm(ahead)
    turn = np.stack([ahead, np.cross(up, ahead), up])
    return Similarity(scale, turn, np.array([0.0, 0.0, height]) - scale * turn @ first[:3, 3])
