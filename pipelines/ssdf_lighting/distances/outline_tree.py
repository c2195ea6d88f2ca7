"""The edges of a mesh that can be its outline, in a tree: who looks for outlines skips the rest.

An edge is part of the outline, seen from a point, where the mesh ends there or one of its two
triangles looks at the point and the other one away. An edge between triangles of one plane never
is. A node of the tree knows a ball around its edges, and a cone around their triangles' normals:
where all look at the point, or all away, none of its edges is outline (Sander, Gu, Gortler, Hoppe,
Snyder, "Silhouette clipping", 2000).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.geometry.mesh_edges import mesh_edges

FloatArray = NDArray[np.float64]

_LEAF = 4
"""Edges up to which a node is not divided."""
_FLAT = 1e-6
"""Sine of the angle between two triangles of one plane: positions are single precision."""


class OutlineTree(NamedTuple):
    """E edges that can be outline, in N nodes; a node's first child follows it.

    ends: (E, 2, 3) float64. normals: (E, 2, 3) of both triangles, unit, agreeing on the outside;
    zero where the mesh ends. middle (N, 3), radius (N,): a ball around a node's edges. axis (N, 3),
    spread (N,): a cone around their normals, its half-angle in radians; pi where edges have none.
    after: (N,) int64, the node to go on with where a node is skipped. first, last: (N,) int64, a
    leaf's edges; of inner nodes both are 0.
    """

    ends: FloatArray
    normals: FloatArray
    middle: FloatArray
    radius: FloatArray
    axis: FloatArray
    spread: FloatArray
    after: NDArray[np.int64]
    first: NDArray[np.int64]
    last: NDArray[np.int64]


def outline_tree(vertices: FloatArray, triangles: NDArray[np.integer]) -> OutlineTree:
    """The tree of a mesh's edges; vertices (V, 3), several of which may be at one place, as along
    creases; triangles (F, 3).

    >>> from pipelines.geometry.shapes import square
    >>> flat = square(8)
    >>> len(outline_tree(flat.vertices, flat.triangles).ends)  # the border alone
    32
    """
    ends, normals = _outline_edges(vertices, triangles)
    return OutlineTree(*_grown(ends, normals))


def _outline_edges(
    vertices: FloatArray, triangles: NDArray[np.integer]
) -> tuple[FloatArray, FloatArray]:
    """Ends (E, 2, 3) and both triangles' normals (E, 2, 3) of the edges that can be outline."""
    places, place = np.unique(vertices, axis=0, return_inverse=True)
    corners = place.reshape(-1)[triangles].astype(np.int64)
    edges = mesh_edges(corners)
    a, b, c = places[corners].transpose(1, 0, 2)
    facing = np.cross(b - a, c - a)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-300)
    pairs = edges.pairs()
    one, other = facing[pairs[:, 0] // 3], facing[pairs[:, 1] // 3]
    agree = edges.forwards[pairs[:, 0]] != edges.forwards[pairs[:, 1]]
    other = np.where(agree[:, None], other, -other)
    bent = np.linalg.norm(np.cross(one, other), axis=1) > _FLAT
    bent |= np.einsum("ij,ij->i", one, other) < 0.0
    # More than two triangles at an edge: as if the mesh ended there.
    single = edges.half_edges[edges.start[edges.uses != 2]]
    half = np.concatenate([pairs[bent, 0], single])
    begin, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    ends = np.stack([places[begin[half]], places[end[half]]], axis=1)
    normals = np.zeros_like(ends)
    normals[: bent.sum()] = np.stack([one[bent], other[bent]], axis=1)
    return ends, normals


@njit(cache=True, nogil=True)
def _grown(
    ends: FloatArray, normals: FloatArray
) -> tuple[
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    NDArray[np.int64],
    NDArray[np.int64],
    NDArray[np.int64],
]:
    """The fields of `OutlineTree`: halves by the middle along the longest side, depth first."""
    count = len(ends)
    middles = (ends[:, 0] + ends[:, 1]) * 0.5
    order = np.arange(count)
    most = 2 * count + 1
    middle, radius = np.zeros((most, 3)), np.zeros(most)
    axis, spread = np.zeros((most, 3)), np.zeros(most)
    after = np.zeros(most, np.int64)
    first, last = np.zeros(most, np.int64), np.zeros(most, np.int64)
    stack = np.empty((128, 2), np.int64)
    stack[0, 0], stack[0, 1] = 0, count
    depth, nodes = 1, 0
    sizes = np.zeros(most, np.int64)  # edges below each node
    while depth:
        depth -= 1
        begin, end = stack[depth, 0], stack[depth, 1]
        own = order[begin:end]
        _bound(ends, normals, own, middle[nodes], axis[nodes])
        radius[nodes], spread[nodes] = _reach(ends, normals, own, middle[nodes], axis[nodes])
        sizes[nodes] = end - begin
        if end - begin <= _LEAF:
            first[nodes], last[nodes] = begin, end
        else:
            longest, most_extent = 0, -1.0
            for k in range(3):
                extent = middles[own, k].max() - middles[own, k].min()
                if extent > most_extent:
                    longest, most_extent = k, extent
            order[begin:end] = own[np.argsort(middles[own, longest])]
            half = (begin + end) // 2
            stack[depth, 0], stack[depth, 1] = half, end
            stack[depth + 1, 0], stack[depth + 1, 1] = begin, half
            depth += 2
        nodes += 1
    # The nodes below one hold its edges: they are over where so many edges are.
    done = 0
    begins = np.zeros(nodes, np.int64)
    for k in range(nodes):
        begins[k] = done
        if last[k] > first[k]:
            done += sizes[k]
    following = np.full(count + 1, nodes, np.int64)
    for k in range(nodes - 1, -1, -1):
        over = begins[k] + sizes[k]
        after[k] = following[over]
        following[begins[k]] = k
    return (
        ends[order],
        normals[order],
        middle[:nodes],
        radius[:nodes],
        axis[:nodes],
        spread[:nodes],
        after[:nodes],
        first[:nodes],
        last[:nodes],
    )


@njit(cache=True, nogil=True)
def _bound(
    ends: FloatArray,
    normals: FloatArray,
    own: NDArray[np.int64],
    middle: FloatArray,
    axis: FloatArray,
) -> None:
    """Fills the middle of the edges' box and the mean of their normals, unit or zero."""
    for k in range(3):
        middle[k] = 0.5 * (ends[own][:, :, k].min() + ends[own][:, :, k].max())
        axis[k] = normals[own][:, :, k].sum()
    length = math.sqrt((axis * axis).sum())
    if length > 0.0:
        axis /= length


@njit(cache=True, nogil=True)
def _reach(
    ends: FloatArray,
    normals: FloatArray,
    own: NDArray[np.int64],
    middle: FloatArray,
    axis: FloatArray,
) -> tuple[float, float]:
    """The ball's radius and the cone's half-angle."""
    farthest, least = 0.0, 1.0
    for edge in own:
        for side in range(2):
            away = ends[edge, side] - middle
            farthest = max(farthest, (away * away).sum())
            normal = normals[edge, side]
            has_one = (normal * normal).sum() > 0.0
            least = min(least, (normal * axis).sum()) if has_one else -1.0
    return math.sqrt(farthest), math.acos(max(min(least, 1.0), -1.0)) + 1e-6
