"""The traced picture without its noise: Open Image Denoise (Áfra 2023), told albedo and normals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera
from pipelines.geometry.rays import build_scene, first_hits
from pipelines.ssdf_lighting.drawing.camera_rays import camera_rays, pixel_centres
from pipelines.ssdf_lighting.drawing.hit_looks import HitLooks
from pipelines.ssdf_lighting.scene import LitMesh


def denoised(
    radiance: NDArray[np.floating], mesh: LitMesh, camera: Camera, size: tuple[int, int]
) -> NDArray[np.float32]:
    """Radiance (H, W, 3) float32, never negative, of what was traced through the pixels' middles
    of a camera: (H, W, 3) of a picture of ``size`` = (width, height).

    Albedo and normals of what is seen there are the mesh's own, without noise, so that their edges
    stay; what light makes, shadows and glints, is told by the noisy picture alone.
    """
    from pyoidn import denoise

    albedo, normal = _features(mesh, camera, size)
    traced = np.ascontiguousarray(radiance, np.float32)
    return np.maximum(denoise(traced, albedo, normal, hdr=True, clean_aux=True), np.float32(0.0))


def _features(
    mesh: LitMesh, camera: Camera, size: tuple[int, int]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    places = pixel_centres(size)
    hits = first_hits(
        build_scene(mesh.vertices, mesh.triangles), *camera_rays(camera, size, places)
    )
    hit = hits.triangle >= 0
    weight = hits.barycentric[hit].astype(np.float64)
    normals, looks = HitLooks(mesh, camera, size, 1.0).at(hits.triangle[hit], weight, places[hit])
    albedo, normal = (np.zeros((len(places), 3), np.float32) for _ in range(2))
    albedo[hit], normal[hit] = looks.albedo, normals
    width, height = size
    return albedo.reshape(height, width, 3), normal.reshape(height, width, 3)
