"""The lit mesh pixel by pixel in NumPy: what the shader of :mod:`.stage_view` must show."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera
from pipelines.geometry.rays import build_scene, first_hits
from pipelines.ssdf_lighting.drawing.camera_rays import camera_rays, pixel_centres, view_vectors
from pipelines.ssdf_lighting.light.shading import lobe_tables, lobes, shaded
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, visible_table
from pipelines.ssdf_lighting.scene import LitMesh

DistancesAt = Callable[[NDArray[np.float32]], NDArray[np.floating]]
"""Axes (V, L, 3) float32 at the vertices -> d (V, L), radians. An axis of zeros asks for nothing:
its d may be any number that is finite."""

_AT_ONCE = 8192  # pixels whose lobes are in memory together


def render_numpy(
    mesh: LitMesh,
    distances_at: DistancesAt,
    lights: Lights,
    camera: Camera,
    size: tuple[int, int],
    bounced: NDArray[np.floating] | None = None,
) -> NDArray[np.float64]:
    """Linear radiance and coverage (height, width, 4) float64, row 0 at the top.

    ``size`` is (width, height). One ray through each pixel's middle; normals and the vertices'
    distances are interpolated by barycentric weights; textures are not looked at. ``bounced``
    (V, 3) is what albedo 1 would show of light that other surfaces reflect. Raises ValueError
    as ``build_scene`` and ``lobe_tables``.
    """
    points, corners, shading, material, materials, _ = mesh
    tables, shares = lobe_tables(materials, lights), visible_table()
    at_vertices = lobes(
        shading, view_vectors(camera, points), material, materials, lights, tables=tables
    )
    distances = np.asarray(distances_at(at_vertices.axes.astype(np.float32)), np.float64)
    origins, ways = camera_rays(camera, size, pixel_centres(size))
    hits = first_hits(build_scene(points, corners), origins, ways)
    picture = np.zeros((len(origins), 4))
    seen = np.flatnonzero(hits.triangle >= 0)
    for first in range(0, len(seen), _AT_ONCE):
        block = seen[first : first + _AT_ONCE]
        corner, weight = corners[hits.triangle[block]], hits.barycentric[block].astype(np.float64)
        at = np.einsum("pk,pkc->pc", weight, points[corner])
        normal = np.einsum("pk,pkc->pc", weight, shading[corner])
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        found = lobes(
            normal,
            view_vectors(camera, at),
            material[corner[:, 0]],
            materials,
            lights,
            tables=tables,
        )
        between = np.einsum("pk,pkl->pl", weight, distances[corner])
        picture[block, :3] = shaded(found, between, shares)
        if bounced is not None:
            reflected = np.einsum("pk,pkc->pc", weight, bounced[corner])
            picture[block, :3] += materials.albedo[material[corner[:, 0]]] * reflected
        picture[block, 3] = 1.0
    width, height = size
    return picture.reshape(height, width, 4)
