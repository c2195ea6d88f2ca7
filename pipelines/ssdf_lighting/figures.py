"""Figures of merit of visibility, distances and their compression."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.repair import edge_ends
from pipelines.ssdf_lighting.distances.octahedral import (
    resolution_of,
    solid_angles,
    texel_directions,
)
from pipelines.ssdf_lighting.distances.signed_distance import NO_EDGE
from pipelines.ssdf_lighting.distances.visible_edge import delaunay_sides

FloatArray = NDArray[np.float64]

_SAMPLED_RAYS = 256


def sampled_rows(count: int, wanted: int) -> NDArray[np.int64]:
    """About ``wanted`` row numbers below ``count``, ascending, in runs of 16: few chunks."""
    starts = np.linspace(0, max(count - 16, 0), max(1, wanted // 16)).astype(np.int64)
    rows = np.unique(starts[:, None] + np.arange(16))
    return rows[rows < count]


def visibility_error(
    vertices: FloatArray,
    triangles: NDArray[np.integer],
    origins: NDArray[np.float32],
    sealed: NDArray[np.bool_],
    visible: NDArray[np.bool_],
    directions: FloatArray,
) -> float:
    """Share of sampled rays whose visibility another method finds different.

    Möller and Trumbore's test of each ray with every triangle, in double precision. Rays that
    pass an edge closer than a millionth are left to either method.
    """
    random = np.random.default_rng(0)
    vertex = random.integers(len(origins), size=_SAMPLED_RAYS)
    way = random.integers(len(directions), size=_SAMPLED_RAYS)
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    first, second = b - a, c - a
    wrong = 0
    for v, w in zip(vertex, way, strict=True):
        across = np.cross(directions[w], second)
        scale = np.einsum("fi,fi->f", first, across)
        with np.errstate(divide="ignore", invalid="ignore"):
            to = origins[v].astype(np.float64) - a
            u = np.einsum("fi,fi->f", to, across) / scale
            turned = np.cross(to, first)
            t = turned @ directions[w] / scale
            distance = np.einsum("fi,fi->f", second, turned) / scale
            inside = np.minimum(np.minimum(u, t), 1.0 - u - t)
        ahead = (distance > 0) & np.isfinite(inside)
        hit = bool(np.any(ahead & (inside > 1e-6))) or bool(sealed[v])
        maybe = bool(np.any(ahead & (inside > -1e-6)))
        wrong += bool(visible[v, w]) if hit else (not maybe and not visible[v, w])
    return wrong / _SAMPLED_RAYS


def all_pairs_distances(visible: NDArray[np.bool_]) -> FloatArray:
    """d (P, D) by its definition: every direction with every one of the other visibility."""
    directions = texel_directions(resolution_of(visible.shape[1]))
    distances = np.where(visible, NO_EDGE, -NO_EDGE)
    for row, seen in enumerate(visible):
        if seen.all() or not seen.any():
            continue
        one, other = directions[seen], directions[~seen]
        near = one @ other.T
        for mask, these, those, best in (
            (seen, one, other, near.argmax(axis=1)),
            (~seen, other, one, near.argmax(axis=0)),
        ):
            chords = np.linalg.norm(these - those[best], axis=1)
            distances[row, mask] = 2.0 * np.arcsin(np.minimum(chords / 2.0, 1.0))
        distances[row, ~seen] *= -1.0
    return distances


def distance_error(
    distances: NDArray[np.float32], visible: NDArray[np.bool_], *, refined: bool
) -> float:
    """Largest error of d (P, D), radians, by all pairs.

    Distances to samples must be equal. Those to the refined edge lie below, for a path to a
    sample of the other visibility crosses the edge; and where the sky is visible by at most the
    longest side of a Delaunay triangle, for that far behind the edge there is a sample. (Hidden
    directions may be near a hole between the samples.)
    """
    exact = all_pairs_distances(visible)
    if not refined:
        return float(np.abs(distances - exact).max())
    n = resolution_of(visible.shape[1])
    ends = texel_directions(n)[delaunay_sides(n).ends]
    longest = 2.0 * np.arcsin(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).max() / 2.0)
    over = np.abs(distances) - np.abs(exact)
    under = np.where(visible, exact - longest - distances, 0.0)
    flipped = np.where(np.sign(distances) == np.sign(exact), 0.0, np.abs(exact))
    return float(max(over.max(), under.max(), flipped.max(), 0.0))


class Error(NamedTuple):
    """``rmse`` radians, weighted by solid angle; ``wrong_visibility``, the share of the directions
    above the vertices' tangent planes, by solid angle, in which the sign is wrong;
    ``vertex_rmse`` (V,) float32."""

    rmse: float
    wrong_visibility: float
    vertex_rmse: NDArray[np.float32]


def compression_error(
    blocks: Iterable[tuple[NDArray[np.int64], NDArray[np.float32]]],
    decode: Callable[[NDArray[np.int64]], NDArray[np.float32]],
    normals: FloatArray,
) -> Error:
    """Compare what ``decode`` makes of vertex numbers with (numbers, distances) blocks."""
    squares, wrong, above = [], 0.0, 0.0
    for vertices, distances in blocks:
        n = resolution_of(distances.shape[1])
        weights = solid_angles(n) / (4.0 * np.pi)
        found = decode(vertices)
        squares.append(((found - distances).astype(np.float64) ** 2) @ weights)
        upper = (normals[vertices] @ texel_directions(n).T > 0.0) * weights
        wrong += float((upper * ((found > 0) != (distances > 0))).sum())
        above += float(upper.sum())
    each = np.concatenate(squares)
    return Error(float(np.sqrt(each.mean())), wrong / above, np.sqrt(each).astype(np.float32))


def border_step(
    errors: NDArray[np.float32],
    triangles: NDArray[np.integer],
    cluster: NDArray[np.integer],
) -> float:
    """How much more the error of d steps along edges between clusters than inside them.

    errors (V, D), or any sample of vertices' directions: found minus true. Ratio of the RMS
    difference over edges with ends in two clusters and edges with both in one; 1 is no step.
    """
    edges = edge_ends(triangles)
    between = cluster[edges[:, 0]] != cluster[edges[:, 1]]
    if between.all() or not between.any():
        return 1.0
    steps = ((errors[edges[:, 0]] - errors[edges[:, 1]]).astype(np.float64) ** 2).mean(axis=1)
    return float(np.sqrt(steps[between].mean() / max(steps[~between].mean(), 1e-300)))
