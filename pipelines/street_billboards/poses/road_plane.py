"""The road below a drive's cameras, as points that several photographs show have it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.capture.plane_sweep import Photograph, sweep_depth
from pipelines.street_billboards.poses.sight_stars import Star, sights

FloatArray = NDArray[np.float64]

_EXACT = 1.5
"""Pixels within which a point's sights are."""
_STEEP = 0.15
"""Tangent below the horizon from which on a ray may meet the road nearby."""
_ASIDE = 2.0
"""Of a point's depth below the camera: how far aside it may be."""
_LANE = 0.8
"""The same where every pixel has its depth: no kerb."""
_AROUND, _EVERY = 3, 4
"""Frames before and after one, and pixels from one that is asked to the next."""
_NEAREST, _FARTHEST = 0.8, 15.0
"""Steps from frame to frame between which the road is looked for."""
_TRIALS = 600
_ON_PLANE = 0.04
"""Of the cameras' height: points within it are on the road."""
_LEAST_POINTS = 20
_LEAST_SHARE = 0.25
_NEARLY = 0.8
_TILTED = 0.9
"""Cosine between the road's normal and the cameras' up, at least."""


class Road(NamedTuple):
    """A plane below the cameras."""

    up: FloatArray
    """(3,), its unit normal, in the world of the poses."""
    height: float
    """Of the cameras above it, median, in their unit."""


def find_road(
    stars: Sequence[Star], poses: FloatArray, intrinsics: FloatArray, seed: int = 0
) -> Road | None:
    """The plane of most points below the cameras; None where no plane holds a quarter of them.

    poses (f, c, 4, 4), camera to world, any unit and any way up: what is below is told by the
    cameras' own axes (y down). Each star's points are taken from its camera, so that a road that
    climbs along the drive does not matter. RANSAC (Fischler and Bolles 1981), then least squares.
    """
    below, ups = [], []
    for star in stars:
        found = sights(star, poses, intrinsics)
        frame, camera = star.view
        exact = np.nanmedian(found.residual, axis=1) < _EXACT
        rays = np.concatenate([star.pixels, np.ones((len(star.pixels), 1))], axis=1)
        rays = rays @ np.linalg.inv(intrinsics[camera]).T
        low = (rays[:, 1] > _STEEP) & (np.abs(rays[:, 0]) < _ASIDE * rays[:, 1])
        kept = exact & low & (found.inverse_depth > 0)
        points = rays[kept] / found.inverse_depth[kept, None]
        below.append(points @ poses[frame, camera, :3, :3].T)
        ups.append(-poses[frame, camera, :3, 1])
    points, up = np.concatenate(below), np.mean(ups, axis=0)
    up /= np.linalg.norm(up)
    if len(points) < _LEAST_POINTS:
        return None
    return _plane(points, up, np.random.default_rng(seed))


def sweep_road(
    load: Callable[[int], NDArray[np.uint8]], poses: FloatArray, intrinsics: FloatArray
) -> Road | None:
    """The same of the depths of every pixel: asphalt has few features.

    load: photographs (c, h, w, 3) of a frame. Of the first camera, at two places of the drive, by
    ``plane_sweep`` with what is around them.
    """
    step = float(np.median(np.linalg.norm(np.diff(poses[:, 0, :3, 3], axis=0), axis=1)))
    below, ups = [], []
    for frame in sorted({len(poses) // 3, 2 * len(poses) // 3}):
        around = range(max(frame - _AROUND, 0), min(frame + _AROUND + 1, len(poses)))
        shown = {n: Photograph(load(n)[0], intrinsics[0], poses[n, 0]) for n in around}
        own = shown.pop(frame)
        reach = {"nearest": _NEAREST * step, "farthest": _FARTHEST * step}
        depth = sweep_depth(own, list(shown.values()), **reach).depth[::_EVERY, ::_EVERY]
        rows, columns = np.indices(depth.shape) * _EVERY
        rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1)
        rays = rays @ np.linalg.inv(intrinsics[0]).T
        kept = np.isfinite(depth) & (rays[..., 1] > _STEEP)
        kept &= np.abs(rays[..., 0]) < _LANE * rays[..., 1]
        below.append((rays[kept] * depth[kept, None]) @ own.pose[:3, :3].T)
        ups.append(-own.pose[:3, 1])
    points, up = np.concatenate(below), np.mean(ups, axis=0)
    if len(points) < _LEAST_POINTS:
        return None
    return _plane(points, up / np.linalg.norm(up), np.random.default_rng(0))


def _plane(points: FloatArray, up: FloatArray, generator: np.random.Generator) -> Road | None:
    """The lowest of the planes that hold nearly as many points as the best: pavements have more
    texture than the road, and lie a kerb above it."""
    planes = []
    for _ in range(_TRIALS):
        one, two, three = points[generator.choice(len(points), 3, replace=False)]
        normal = np.cross(two - one, three - one)
        length = np.linalg.norm(normal)
        if length == 0:
            continue
        normal /= length * np.sign(normal @ up or 1.0)
        height = -float(normal @ one)
        if normal @ up < _TILTED or height <= 0:
            continue
        near = np.abs(points @ normal + height) < _ON_PLANE * height
        planes.append((int(near.sum()), height, near))
    best = max((count for count, _, _ in planes), default=0)
    if best < max(_LEAST_POINTS, _LEAST_SHARE * len(points)):
        return None
    _, _, inside = max((one for one in planes if one[0] >= _NEARLY * best), key=lambda one: one[1])
    middle = points[inside].mean(axis=0)
    normal = np.linalg.svd(points[inside] - middle, full_matrices=False)[2][2]
    normal *= np.sign(normal @ up)
    return Road(normal, -float(normal @ middle))
