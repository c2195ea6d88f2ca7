"""Texture coordinates of any mesh: charts by xatlas, and how much they stretch a texture."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def unwrap(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Texture coordinates for a mesh that has none, by xatlas.

    Returns vertices (V', 3), split along the charts' borders; triangles (F, 3) in the given
    order; and uvs (V', 2). Charts are nearly isometric: a photograph is a square as wide as the
    radius of the sphere around the mesh (about the middle of its box) everywhere. Their borders
    show as seams, and they may overlap on the photograph.

    Raises ValueError for a mesh whose vertices all are at one position.

    >>> from pipelines.geometry.shapes import square
    >>> flat = square(2)
    >>> vertices, triangles, uvs = unwrap(flat.vertices, flat.triangles)
    >>> vertices.shape, triangles.shape, uvs.shape
    ((9, 3), (8, 3), (9, 2))
    """
    import xatlas

    low, high = vertices.min(axis=0), vertices.max(axis=0)
    centred = vertices - (low + high) / 2
    radius = np.linalg.norm(centred, axis=-1).max()
    if not radius > 0:
        raise ValueError("all vertices are at one position; expected a surface")
    atlas = xatlas.Atlas()
    # In units of the radius: xatlas takes floats and has absolute tolerances.
    atlas.add_mesh((centred / radius).astype(np.float32), triangles.astype(np.uint32))
    options = xatlas.PackOptions()
    options.texels_per_unit = 256.0  # sets the packing's precision and the unit of its size
    atlas.generate(pack_options=options)
    sources, faces, uvs = atlas[0]
    uvs = np.nan_to_num(uvs)  # of triangles that vanish in its floats
    size = np.array([atlas.width, atlas.height], np.float64)
    faces = faces.astype(np.int64)
    return vertices[sources], faces, _not_mirrored(uvs * size / options.texels_per_unit, faces)


def _not_mirrored(uvs: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.float64]:
    """Charts that show the photograph mirrored (xatlas does not care) turned over in place."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = triangles.ravel(), np.roll(triangles, 1, axis=1).ravel()
    links = coo_array((np.ones(triangles.size), pairs), shape=(len(uvs), len(uvs)))
    count, chart = connected_components(links, directed=False)
    a, b, c = np.moveaxis(uvs[triangles], 1, 0)
    doubled_area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    mirrored = np.bincount(chart[triangles[:, 0]], doubled_area, count) < 0
    left, right = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(left, chart, uvs[:, 0])
    np.maximum.at(right, chart, uvs[:, 0])
    turned = uvs.copy()
    turned[:, 0] = np.where(mirrored[chart], (left + right)[chart] - uvs[:, 0], uvs[:, 0])
    return turned


def texture_stretch(vertices: ArrayLike, triangles: ArrayLike, uvs: ArrayLike) -> float:
    """Median over the triangles of how far the texture is drawn out of shape; 1 = not at all.

    The ratio of the singular values of each triangle's map from texture to surface, weighted by
    the triangle's area. vertices (V, 3), triangles (F, 3), uvs (V, 2). Triangles without area on
    the texture count as infinitely stretched.

    >>> from pipelines.geometry.shapes import square
    >>> flat = square(2)
    >>> round(texture_stretch(flat.vertices * [3.0, 1.0, 1.0], flat.triangles, flat.uvs), 6)
    3.0
    """
    corners = np.asarray(triangles)
    points = np.asarray(vertices, dtype=np.float64)[corners]
    texels = np.asarray(uvs, dtype=np.float64)[corners]
    edges, steps = points[:, 1:] - points[:, :1], texels[:, 1:] - texels[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1)
    flat = np.abs(np.linalg.det(steps)) <= 1e-14
    steps[flat] = np.eye(2)
    values = np.linalg.svd(np.linalg.solve(steps, edges), compute_uv=False)
    ratio = np.where(flat, np.inf, values[:, 0] / np.maximum(values[:, 1], 1e-300))
    order = np.argsort(ratio)
    middle = np.searchsorted(np.cumsum(area[order]), area.sum() / 2)
    return float(ratio[order][min(middle, len(order) - 1)])
