"""Figures of merit, as the checks of the graph have them: scenes, visibility, distances, their
compression, pictures. Functions of arrays; what is large comes in blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb
from pipelines.geometry.mesh_edges import edge_vertices
from pipelines.ssdf_lighting.distances.octahedral import (
    NO_EDGE,
    resolution_of,
    solid_angles,
    texel_directions,
)
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights

if TYPE_CHECKING:
    from pipelines.ssdf_lighting.scene import Scene

FloatArray = NDArray[np.float64]

_SAMPLED_RAYS = 256
_SAMPLED_AXES = 12


def sampled_rows(count: int, wanted: int) -> NDArray[np.int64]:
    """About ``wanted`` row numbers below ``count``, ascending, in runs of 16: few chunks."""
    starts = np.linspace(0, max(count - 16, 0), max(1, wanted // 16)).astype(np.int64)
    rows = np.unique(starts[:, None] + np.arange(16))
    return rows[rows < count]


# ---- scenes ------------------------------------------------------------------------------------


def turned_away(vertices: FloatArray, triangles: NDArray[np.integer], normals: FloatArray) -> float:
    """Share of the triangles' corners whose normal looks away from the triangle's front.

    vertices, normals (V, 3); triangles (F, 3).

    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> turned_away(corners, np.array([[0, 1, 2]]), np.array([[0.0, 0, 1], [0, 0, 1], [0, 0, 1]]))
    0.0
    """
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    facing = np.cross(b - a, c - a)
    along = np.einsum("fc,fkc->fk", facing, normals[triangles])
    return float((along < 0).mean())


def surface_area(vertices: FloatArray, triangles: NDArray[np.integer]) -> float:
    """Area of triangles (F, 3), in the square of the unit of vertices (V, 3)."""
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


# ---- visibility and distances ------------------------------------------------------------------


def visible_sphere_share(visible: NDArray[np.bool_], solid_angle: FloatArray) -> float:
    """Share of the sphere that is seen, mean of the vertices of ``visible`` (V, D); ``solid_angle``
    (D,) in steradians.

    >>> visible_sphere_share(np.array([[True, False], [True, True]]), np.full(2, 2 * np.pi))
    0.75
    """
    weights = solid_angle / (4 * np.pi)
    return float(np.mean(visible @ weights))


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


def closure_error(
    sums: NDArray[np.floating],
    visible: NDArray[np.bool_],
    normals: FloatArray,
    directions: FloatArray,
    solid_angle: FloatArray,
) -> float:
    """RMS over V vertices of how far form factors (their sums, (V,)) and the visible sky, weighted
    by the cosine, are from filling the hemisphere: both together have to be 1.

    visible (V, D) in directions (D, 3) of solid angles (D,); normals (V, 3).
    """
    falling = np.maximum(normals @ directions.T, 0.0) * solid_angle
    sky = (falling * visible).sum(axis=1) / falling.sum(axis=1)
    return float(np.sqrt(np.mean((sums + sky - 1.0) ** 2)))


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
    sample of the other visibility crosses the edge. How far below is not for samples to say:
    between them there may be holes and thin parts (see `thin_figures`).
    """
    exact = all_pairs_distances(visible)
    if not refined:
        return float(np.abs(distances - exact).max())
    over = np.abs(distances) - np.abs(exact)
    flipped = np.where(np.sign(distances) == np.sign(exact), 0.0, np.abs(exact))
    return float(max(over.max(), flipped.max(), 0.0))


def sign_error(
    blocks: Iterable[tuple[NDArray[np.float32], NDArray[np.bool_]]],
) -> float:
    """Share of all distances whose sign is not that of the visibility, of blocks (d, visible)."""
    wrong, count = 0, 0
    for distances, visible in blocks:
        wrong += int(np.count_nonzero((distances > 0) != visible))
        count += distances.size
    return wrong / count


# ---- compression -------------------------------------------------------------------------------


def unused_share(cluster: NDArray[np.integer]) -> float:
    """Share of the cluster numbers up to the largest that no triangle has; 1 for negative ones.

    >>> unused_share(np.array([0, 3, 3]))
    0.5
    """
    if cluster.min() < 0:
        return 1.0
    return float((np.bincount(cluster) == 0).mean())


def shared_basis_rmse(
    distances: NDArray[np.float32],
    coordinates: NDArray[np.float32],
    vectors: NDArray[np.float32],
) -> float:
    """Error, radians weighted by solid angle, of the shared basis on vertices with ``distances``
    (P, D) and ``coordinates`` (P, R) in ``vectors`` (D, R)."""
    weighted = distances * root_weights(distances.shape[1])
    found = coordinates @ vectors.T
    return float(np.sqrt(((weighted - found).astype(np.float64) ** 2).mean()))


def weighted_rmse(found: NDArray[np.float32], true: NDArray[np.float32]) -> float:
    """RMSE of distances (P, D), radians weighted by solid angle."""
    weighted = (found - true) * root_weights(true.shape[1])
    return float(np.sqrt((weighted.astype(np.float64) ** 2).mean()))


class CompressionErrors(NamedTuple):
    """``rmse`` radians, weighted by solid angle; ``wrong_visibility``, the share of the directions
    above the vertices' tangent planes, by solid angle, in which the sign is wrong;
    ``vertex_rmse`` (V,) float32."""

    rmse: float
    wrong_visibility: float
    vertex_rmse: NDArray[np.float32]


def compression_errors(
    blocks: Iterable[tuple[NDArray[np.int64], NDArray[np.float32]]],
    decode: Callable[[NDArray[np.int64]], NDArray[np.float32]],
    normals: FloatArray,
) -> CompressionErrors:
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
    return CompressionErrors(
        float(np.sqrt(each.mean())), wrong / above, np.sqrt(each).astype(np.float32)
    )


def errors_along_axes(
    blocks: Iterable[tuple[NDArray[np.int64], NDArray[np.float32]]],
    distances_along: Callable[[NDArray[np.int64], NDArray[np.float32]], NDArray[np.float32]],
) -> NDArray[np.float32]:
    """Found minus true d (V, 12), radians, along random axes, the same for all vertices.

    blocks: vertex numbers and distances (n, D), in order; distances_along: of vertices (n,) along
    unit vectors (n, 12, 3), d (n, 12).
    """
    from pipelines.ssdf_lighting.compression.lookup import matrix_along

    axes = np.random.default_rng(0).normal(size=(1, _SAMPLED_AXES, 3)).astype(np.float32)
    axes /= np.linalg.norm(axes, axis=2, keepdims=True)
    errors = []
    for vertices, distances in blocks:
        along = np.repeat(axes, len(vertices), axis=0)
        true = matrix_along(distances, np.arange(len(vertices)), along)
        errors.append(distances_along(vertices, along) - true)
    return np.concatenate(errors)


def seam_ratio(
    errors: NDArray[np.floating],
    triangles: NDArray[np.integer],
    cluster: NDArray[np.integer],
) -> float:
    """How much borders between clusters stand out: 1 is not at all.

    errors (V, S): found minus true, of whatever is seen at vertices in S samples (distances, or
    brightness under S lights). Mean step of the error over the edges between two clusters, over
    that of the edges that touch such a border and do not cross it: those are in the same places,
    of the same length and in the same light. 1 where there are no borders, or nothing else.

    >>> strip = np.array([[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]])
    >>> errors = np.array([[0.0], [0.1], [0.1], [0.5], [0.4], [0.4]])
    >>> round(seam_ratio(errors, strip, np.arange(6) // 3), 6)
    5.5
    """
    edges = edge_vertices(triangles)
    across = cluster[edges[:, 0]] != cluster[edges[:, 1]]
    at_border = np.zeros(len(cluster), bool)
    at_border[edges[across]] = True
    beside = ~across & at_border[edges].any(axis=1)
    if not across.any() or not beside.any():
        return 1.0
    steps = np.abs(errors[edges[:, 0]].astype(np.float64) - errors[edges[:, 1]]).mean(axis=1)
    return float(steps[across].mean() / max(steps[beside].mean(), 1e-300))


# ---- pictures ----------------------------------------------------------------------------------


def psnr(
    picture: NDArray[np.uint8], reference: NDArray[np.uint8], shown: NDArray[np.bool_]
) -> float:
    """Peak signal to noise ratio (dB) of 8-bit pictures (H, W, 3) over the pixels ``shown`` (H, W).

    >>> grey = np.full((4, 4, 3), 100, np.uint8)
    >>> round(psnr(grey + np.uint8(5), grey, np.ones((4, 4), bool)), 2)
    34.15
    """
    difference = picture[shown].astype(np.float64) - reference[shown]
    return float(10.0 * np.log10(255.0**2 / max((difference**2).mean(), 1e-12)))


def colour_error(
    picture: NDArray[np.uint8], reference: NDArray[np.uint8], shown: NDArray[np.bool_]
) -> float:
    """How far the mean colours of two sRGB pictures (H, W, 3) over the pixels ``shown`` (H, W) are
    apart: the largest difference of their shares of red, green and blue, in linear light.

    >>> grey = np.full((4, 4, 3), 100, np.uint8)
    >>> red = np.broadcast_to(np.array([100, 0, 0], np.uint8), (4, 4, 3))
    >>> round(colour_error(red, grey, np.ones((4, 4), bool)), 3)
    0.667
    """
    one, other = (
        decode_srgb(shot[shown] / 255.0).reshape(-1, 3).mean(axis=0)
        for shot in (picture, reference)
    )
    apart = one / max(one.sum(), 1e-9) - other / max(other.sum(), 1e-9)
    return float(np.abs(apart).max())


def reflectance(scene: Scene) -> float:
    """What the surfaces of a scene reflect, the mean over their area: albedo and gloss, the mean of
    red, green and blue; where textures are, as at the middles of the triangles."""
    from pipelines.ssdf_lighting.surface_textures import Sampler

    corners = scene.vertices[scene.triangles]
    edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.linalg.norm(np.cross(*edges), axis=1)
    reflected = scene.materials.albedo.mean(axis=1) + scene.materials.specular
    shares = reflected[scene.part]
    if scene.textures is not None:
        for material in scene.textures.materials:
            rows = np.flatnonzero(scene.part == material.row)
            uvs, colours = scene.textures.uvs[rows], scene.textures.colours[rows]
            size = np.linalg.norm(np.ptp(uvs, axis=1), axis=2).astype(np.float64)
            looks = Sampler(material).looks_at(uvs.mean(axis=1), colours.mean(axis=1), size)
            shares[rows] = looks.albedo.mean(axis=1) + looks.specular
    return float(np.average(shares, weights=area))


def mean_brightness(frames: NDArray[np.uint8], shown: NDArray[np.bool_]) -> float:
    """Mean of the 8-bit codes of frames (frames, H, W, 3) over the pixels ``shown``, in [0, 1]."""
    return float(frames[:, shown].astype("float64").mean() / 255.0)
