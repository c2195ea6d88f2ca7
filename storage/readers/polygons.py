"""Polygons with shared corners, as mesh files hold them, and their triangles."""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MOST_CORNERS = 20_000
"""Of a file's large polygons together: as many take seconds, more than in proportion."""

_SLIVER = 1e-11  # twice the area by the longest side squared; readers refuse 1e-12

_Triangle = tuple[int, int, int]


class PolygonMesh(NamedTuple):
    """``positions`` (P, 3) float64; ``sizes`` (F,) int64, corners of each polygon; ``corners``
    (sum of sizes,) int64, the position of each corner, one polygon after the other;
    ``corner_uvs`` (sum of sizes, 2) float64, or None; ``parts`` (F,) int64, which part of the
    file each polygon is in (what a part is, the reader says), or None where the format has none;
    ``corner_colours`` (sum of sizes, 4) float64, linear RGB and opacity in [0, 1], or None;
    ``notes``, what was converted, mended or left out, a sentence each."""

    positions: NDArray[np.float64]
    sizes: NDArray[np.int64]
    corners: NDArray[np.int64]
    corner_uvs: NDArray[np.float64] | None
    parts: NDArray[np.int64] | None = None
    corner_colours: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()


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
    larger = np.flatnonzero(sizes > 4)
    if larger.size:
        triangles.append(_cut_larger(positions, corners, starts[larger], sizes[larger]))
        owners.append(np.repeat(larger, sizes[larger] - 2))
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


def _cut_larger(
    positions: NDArray[np.float64],
    corners: NDArray[np.int64],
    starts: NDArray[np.int64],
    sizes: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Polygons that begin at ``starts`` to (sum of sizes - 2, 3) numbers of corners."""
    from manifold3d import triangulate as cut

    firsts = np.cumsum(sizes) - sizes
    numbers = np.repeat(starts - firsts, sizes) + np.arange(sizes.sum())
    flat = _in_their_planes(positions[corners[numbers]], firsts, sizes)
    # Manifold cuts any outline into as many triangles as there have to be, at once even where
    # it crosses itself, but corners in the middle of a side into triangles without area.
    pieces = [
        cut([flat[first : first + size]], 0.0) for first, size in zip(firsts, sizes, strict=True)
    ]
    triangles = np.concatenate(pieces).astype(np.int64) + np.repeat(firsts, sizes - 2)[:, None]
    ends = np.cumsum(sizes - 2)
    slivers = np.flatnonzero(_flatness(flat[triangles]) <= _SLIVER)
    for polygon in np.unique(np.searchsorted(ends, slivers, side="right")):
        its = slice(ends[polygon] - sizes[polygon] + 2, ends[polygon])
        triangles[its] = _without_slivers(flat, triangles[its])
    return numbers[triangles]


def _flatness(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T, 3, 2) to twice the area, negative if clockwise, by the longest side squared."""
    sides = triangles - np.roll(triangles, 1, axis=1)
    longest = (sides**2).sum(axis=2).max(axis=1)
    doubled = sides[:, 1, 0] * sides[:, 2, 1] - sides[:, 1, 1] * sides[:, 2, 0]
    return np.divide(doubled, longest, out=np.zeros_like(doubled), where=longest > 0)


def _without_slivers(flat: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles of one polygon, those without area joined to their neighbours.

    The longest side of such a triangle a, b, c, whose corner c lies between a and b, is turned:
    with the neighbour b, a, d it makes a, d, c and d, b, c. The longest first, as a neighbour that
    has no area either has to give way before.
    """
    points: list[tuple[float, float]] = flat.tolist()

    def squared(a: int, b: int) -> float:
        return (points[a][0] - points[b][0]) ** 2 + (points[a][1] - points[b][1]) ** 2

    def longest_side_first(a: int, b: int, c: int) -> _Triangle:
        turns = ((a, b, c), (b, c, a), (c, a, b))
        return max(turns, key=lambda turn: squared(turn[0], turn[1]))

    def is_sliver(a: int, b: int, c: int) -> bool:
        (ax, ay), (bx, by), (cx, cy) = points[a], points[b], points[c]
        doubled = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        return abs(doubled) <= _SLIVER * squared(a, b) and squared(a, b) > 0

    cut = [longest_side_first(*triangle) for triangle in triangles.tolist()]
    across = {side: row for row, (a, b, c) in enumerate(cut) for side in ((a, b), (b, c), (c, a))}
    waiting = [
        (-squared(*triangle[:2]), row, triangle)
        for row, triangle in enumerate(cut)
        if is_sliver(*triangle)
    ]
    heapq.heapify(waiting)
    for _ in range(4 * len(cut)):  # more than any polygon without crossings needs
        if not waiting:
            break
        _, row, triangle = heapq.heappop(waiting)
        a, b, c = triangle
        other = across.get((b, a))
        if cut[row] != triangle or other is None or 0 in (squared(a, c), squared(b, c)):
            continue
        (d,) = set(cut[other]) - {a, b}
        del across[a, b], across[b, a]
        across |= {(a, d): row, (d, c): row, (c, d): other, (b, c): other}
        for changed, corners in ((row, (a, d, c)), (other, (d, b, c))):
            cut[changed] = longest_side_first(*corners)
            if is_sliver(*cut[changed]):
                heapq.heappush(waiting, (-squared(*cut[changed][:2]), changed, cut[changed]))
    return np.array(cut, np.int64)


def _in_their_planes(
    points: NDArray[np.float64], firsts: NDArray[np.int64], sizes: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(n, 3) to (n, 2), each polygon counter-clockwise along its mean normal (Newell's), in
    units of its own size."""
    around = _in_own_units(points, firsts, sizes)
    following = np.arange(len(points)) + 1
    following[firsts + sizes - 1] = firsts
    normals = np.add.reduceat(np.cross(around, around[following]), firsts)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    across = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), np.finfo(float).tiny)
    axes = np.repeat(np.stack([across, np.cross(normals, across)], axis=1), sizes, axis=0)
    return np.einsum("nij,nj->ni", axes, around)


def _in_own_units(
    points: NDArray[np.float64], firsts: NDArray[np.int64], sizes: NDArray[np.int64]
) -> NDArray[np.float64]:
    """About the middle of their box, which is 2 wide at most; nothing overflows."""
    low, high = np.minimum.reduceat(points, firsts), np.maximum.reduceat(points, firsts)
    half = (high / 2 - low / 2).max(axis=1, keepdims=True)
    half[half == 0] = 1
    return (points - np.repeat(low / 2 + high / 2, sizes, axis=0)) / np.repeat(half, sizes, axis=0)
