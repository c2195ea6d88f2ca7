"""Matches of pictures with known poses to tracks, and tracks to points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.bundle import (
    Bundle,
    FloatArray,
    Sightings,
    residuals,
    sum_by,
)

_LEAST_ANGLE = np.radians(0.7)
"""Under which a point is seen at least."""


class Matches(NamedTuple):
    """Which features of p pictures are one: m pairs of rows of all features."""

    starts: NDArray[np.int64]
    """(p + 1,), where each picture's features begin."""
    places: FloatArray
    """(n, 2), of all features, pixels."""
    pairs: NDArray[np.int64]
    """(m, 2)."""


def tracks_of(matches: Matches) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of features (m,) and the track of each (m,), tracks counted from 0.

    Features that matches lead to from one another are a track; one that has two features in a
    picture shows two things and is dropped.

    >>> two = Matches(np.array([0, 1, 2, 4]), np.zeros((4, 2)), np.array([[0, 1], [1, 2]]))
    >>> [values.tolist() for values in tracks_of(two)]
    [[0, 1, 2], [0, 0, 0]]
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(matches.places)
    ones = np.ones(len(matches.pairs), np.int8)
    graph = coo_array((ones, (matches.pairs[:, 0], matches.pairs[:, 1])), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    picture = np.searchsorted(matches.starts, np.arange(count), side="right") - 1
    both = label.astype(np.int64) * len(matches.starts) + picture
    _, first, times = np.unique(both, return_index=True, return_counts=True)
    clean = np.ones(label.max(initial=-1) + 1, np.bool_)
    clean[label[first[times > 1]]] = False
    clean &= np.bincount(label, minlength=len(clean)) > 1
    row = np.flatnonzero(clean[label])
    _, track = np.unique(label[row], return_inverse=True)
    return row, track


def triangulated(bundle: Bundle, seen: Sightings, count: int) -> FloatArray:
    """Points (count, 3) nearest to all rays on which they are seen, by least squares; nan where
    the rays are all but parallel."""
    poses = bundle.poses[seen.frame] @ bundle.rig[seen.camera]
    lens = bundle.intrinsics[seen.camera]
    flat = (seen.places - lens[:, [0, 1], [2, 2]]) / lens[:, [0, 1], [0, 1]]
    rays = np.einsum("mij,mj->mi", poses[:, :3, :3], np.column_stack([flat, np.ones(len(flat))]))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    origin = bundle.poses[0, :3, 3]  # small numbers stay exact far from zero
    offset = np.einsum("mij,mj->mi", across, poses[:, :3, 3] - origin)
    normal = sum_by(seen.point, across, count)
    right = sum_by(seen.point, offset, count)
    spread = np.linalg.eigvalsh(normal)[:, 0] / np.maximum(np.trace(normal, axis1=1, axis2=2), 1e-9)
    wide = spread > (_LEAST_ANGLE / 4) ** 2
    points = np.full((count, 3), np.nan)
    points[wide] = np.linalg.solve(normal[wide], right[wide][..., None])[..., 0] + origin
    return points


def kept_sightings(
    bundle: Bundle, seen: Sightings, most: float
) -> tuple[Bundle, Sightings, NDArray[np.int64]]:
    """What fits: sightings before the camera, off by at most ``most`` pixels, of points that have
    two of them or more and are seen under 0.7 degrees; and the rows that these points had."""
    with np.errstate(invalid="ignore", divide="ignore"):
        off, depth = residuals(bundle, seen)
        fits = (depth > 0) & (np.linalg.norm(off, axis=1) <= most)
    seen = seen.some(fits)
    count = len(bundle.points)
    places = (bundle.poses[seen.frame] @ bundle.rig[seen.camera])[:, :3, 3]
    ways = bundle.points[seen.point] - places
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    times = np.bincount(seen.point, minlength=count)
    mean = sum_by(seen.point, ways, count) / np.maximum(times, 1)[:, None]
    # Of unit vectors spread by an angle, the mean is shorter by its square over 8.
    wide = 1 - np.linalg.norm(mean, axis=1) > _LEAST_ANGLE**2 / 32
    kept = np.flatnonzero((times >= 2) & wide)
    new = np.full(count, -1)
    new[kept] = np.arange(len(kept))
    stays = new[seen.point] >= 0
    seen = seen.some(stays)
    return bundle._replace(points=bundle.points[kept]), seen._replace(point=new[seen.point]), kept
