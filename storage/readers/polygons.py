"""Polygons with shared corners, as mesh files hold them, and their triangles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class PolygonMesh(NamedTuple):
    """``positions`` (P, 3) float64; ``sizes`` (F,) int64, corners of each polygon; ``corners``
    (sum of sizes,) int64, the position of each corner, one polygon after the other;
    ``corner_uvs`` (sum of sizes, 2) float64, or None; ``parts`` (F,) int64, which part of the
    file each polygon is in (what a part is, the reader says), or None where the format has none."""

    positions: NDArray[np.float64]
    sizes: NDArray[np.int64]
    corners: NDArray[np.int64]
    corner_uvs: NDArray[np.float64] | None
    parts: NDArray[np.int64] | None = None


def triangulate(
    positions: NDArray[np.float64], sizes: NDArray[np.int64], corners: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cut polygons (arguments as in :class:`PolygonMesh`, sizes >= 3) into triangles.

    Returns the triangles (T, 3), numbers of entries of ``corners``, in the order and the
    orientation of the polygons, and the polygon (T,) of each. Concave polygons and corners in
    the middle of a straight side are respected, so that triangles of valid polygons neither
    overlap nor vanish; files leave the cut open (a fan would be right for convex ones only).
    """
    starts = np.cumsum(sizes) - sizes
    triangles = [starts[sizes == 3][:, None] + np.arange(3)]
    owners = [np.flatnonzero(sizes == 3)]
    quads = np.flatnonzero(sizes == 4)
    triangles.append(_cut_quads(positions, corners, starts[quads][:, None] + np.arange(4)))
    owners.append(np.repeat(quads, 2))
    for polygon in np.flatnonzero(sizes > 4):
        numbers = starts[polygon] + np.arange(sizes[polygon])
        triangles.append(_cut_ears(positions, corners, numbers))
        owners.append(np.full(len(triangles[-1]), polygon))
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(triangles)[order], owner[order]


def _cut_quads(
    positions: NDArray[np.float64], corners: NDArray[np.int64], quads: NDArray[np.int64]
) -> NDArray[np.int64]:
    """(Q, 4) numbers of corners to (2 Q, 3), along the diagonal with the larger product of the
    two triangles' areas: outside a concave quad one area counts as negative, and a triangle
    that vanishes makes the product zero."""
    points = positions[corners[quads]]

    def areas(a: int, b: int, c: int) -> NDArray[np.float64]:
        return np.cross(points[:, b] - points[:, a], points[:, c] - points[:, a])

    first = np.einsum("ij,ij->i", areas(0, 1, 2), areas(0, 2, 3))
    second = np.einsum("ij,ij->i", areas(1, 2, 3), areas(1, 3, 0))
    cut = np.where((second > first)[:, None], [1, 2, 3, 1, 3, 0], [0, 1, 2, 0, 2, 3])
    return np.take_along_axis(quads, cut, axis=1).reshape(-1, 3)


def _cut_ears(
    positions: NDArray[np.float64], corners: NDArray[np.int64], polygon: NDArray[np.int64]
) -> NDArray[np.int64]:
    """(n,) numbers of corners to (n - 2, 3): the smallest ear first, so that corners on a
    straight side are not left over alone; the last four corners as a quad."""
    flat = _in_its_plane(positions[corners[polygon]])
    left = list(range(len(polygon)))
    ears = []
    while len(left) > 4:
        ear = _smallest_ear(flat[left])
        ears.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    last = _cut_quads(positions, corners, polygon[left][None])
    return np.concatenate([polygon[np.array(ears)], last])


def _smallest_ear(outline: NDArray[np.float64]) -> int:
    before, after = np.roll(outline, 1, axis=0), np.roll(outline, -1, axis=0)
    area = _cross(outline - before, after - outline)
    for ear in np.argsort(np.where(area > 0, area, np.inf)):
        if area[ear] <= 0:
            break
        a, b, c = before[ear], outline[ear], after[ear]
        others = np.delete(outline, [ear - 1, ear, (ear + 1) % len(outline)], axis=0)
        inside = [_cross(q - p, others - p) >= 0 for p, q in ((a, b), (b, c), (c, a))]
        if not np.logical_and.reduce(inside).any():
            return int(ear)
    return int(np.argmax(area))  # the outline crosses itself: no cut is right


def _in_its_plane(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3) to (n, 2), counter-clockwise, along the outline's mean normal (Newell's)."""
    around = points - points.mean(axis=0)
    normal = np.cross(around, np.roll(around, -1, axis=0)).sum(axis=0)
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    return np.stack([around @ across, around @ np.cross(normal, across)], axis=1)


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    cross: NDArray[np.float64] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return cross
