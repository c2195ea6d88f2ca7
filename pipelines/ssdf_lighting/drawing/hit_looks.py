"""What rays hit: normals and materials, of textures the mean over the pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera
from pipelines.ssdf_lighting.drawing.camera_rays import camera_rays
from pipelines.ssdf_lighting.scene import LitMesh
from pipelines.ssdf_lighting.surface_textures import (
    Looks,
    Sampler,
    SurfaceTextures,
    bent_normals,
    plain_looks,
)

FloatArray = NDArray[np.float64]


class HitLooks:
    """A mesh's materials where rays through a camera's pixels hit it.

    spacing: distance in pixels of neighbouring samples, over which textures are averaged.
    """

    def __init__(
        self, mesh: LitMesh, camera: Camera, size: tuple[int, int], spacing: float
    ) -> None:
        self._mesh, self._camera, self._size, self._spacing = mesh, camera, size, spacing
        made = () if mesh.textures is None else mesh.textures.materials
        self._samplers = {material.row: Sampler(material) for material in made}

    def at(
        self,
        triangle: NDArray[np.integer],
        weight: FloatArray,
        places: FloatArray,
    ) -> tuple[FloatArray, Looks]:
        """Unit normals (S, 3) and looks of hits: triangles (S,) and barycentric weights (S, 3).

        places: (S, 2) pixels, where in the picture textures are looked up: on the plane of the
        triangle that was hit, though the ray hit it at another place of the pixel.
        """
        mesh = self._mesh
        corner = mesh.triangles[triangle]
        normals = np.einsum("sk,skc->sc", weight, mesh.normals[corner])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        rows = np.asarray(mesh.object_of_vertex)[corner[:, 0]]
        looks = plain_looks(mesh.materials, rows)
        if mesh.textures is None:
            return normals, looks
        looks = Looks(*(np.array(values) for values in looks))
        for row, sampler in self._samplers.items():
            chosen = np.flatnonzero(rows == row)
            if not len(chosen):
                continue
            found, edges = self._sampled(
                sampler, mesh.textures, corner[chosen], weight[chosen], places[chosen]
            )
            for values, new in zip(looks, found, strict=True):
                values[chosen] = new
            if sampler.material.normal is not None:
                normals[chosen] = bent_normals(normals[chosen], *edges, found.bumps)
        return normals, looks

    def _sampled(
        self,
        sampler: Sampler,
        textures: SurfaceTextures,
        corner: NDArray[np.integer],
        weight: FloatArray,
        places: FloatArray,
    ) -> tuple[Looks, tuple[FloatArray, FloatArray]]:
        """Looks, and of each triangle two edges and these in the normals' texture coordinates."""
        points, uvs = self._mesh.vertices[corner], textures.uvs[corner].astype(np.float64)
        shares = self._on_plane(points, places)
        here = np.einsum("sk,skmc->smc", shares, uvs)
        apart = np.zeros((len(corner), 2))
        for step in ((1.0, 0.0), (0.0, 1.0)):
            beside = np.einsum("sk,skmc->smc", self._on_plane(points, places + step), uvs)
            apart = np.maximum(apart, np.linalg.norm(beside - here, axis=2))
        colours = np.einsum("sk,skc->sc", weight, textures.colours[corner])
        mapping = sampler.material.normal.mapping if sampler.material.normal else 0
        edges = points[:, 1:] - points[:, :1], (uvs[:, 1:] - uvs[:, :1])[:, :, mapping]
        return sampler.looks_at(here, colours, self._spacing * apart), edges

    def _on_plane(self, points: FloatArray, places: FloatArray) -> FloatArray:
        """Weights (S, 3) of the triangles' corners (S, 3, 3) where rays through places (S, 2) of
        the picture meet their planes."""
        origins, ways = camera_rays(self._camera, self._size, places)
        one, other = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
        away = np.cross(ways, other)
        area = np.sum(one * away, axis=1)
        area = np.where(np.abs(area) < 1e-30, 1e-30, area)
        start = origins - points[:, 0]
        b = np.sum(start * away, axis=1) / area
        c = np.sum(ways * np.cross(start, one), axis=1) / area
        return np.stack([1 - b - c, b, c], axis=1)
