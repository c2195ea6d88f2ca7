"""Shells: the mesh's vertices offset along their normals, one set a layer (section 3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.meshes import Mesh
from pipelines.photo_fur.attenuation import require_layers

USUAL_THICKNESS = 0.06
"""Thickness of the fur per radius of the mesh, where none is given."""


class ShellMesh(NamedTuple):
    """A mesh with its vertices offset along the normals, one set a layer.

    vertices: (N, V, 3), mesh units; the first layer at the tips, the last on the surface.
    normals: (V, 3), unit.
    triangles: (F, 3), the same for every layer.
    uvs: (V, 2), in photographs, origin bottom left.
    """

    vertices: NDArray[np.float32]
    normals: NDArray[np.floating]
    triangles: NDArray[np.integer]
    uvs: NDArray[np.floating]
    thickness: float
    """hb, mesh units."""

    @property
    def layers(self) -> int:
        """N."""
        return len(self.vertices)

    @property
    def heights(self) -> NDArray[np.float64]:
        """(N,): heights of the layers above the surface, mesh units (Eq. 3)."""
        return shell_heights(self.thickness, self.layers)


def make_shell_mesh(
    mesh: Mesh, layers: int, *, thickness: float | None = None, repeats: float = 1.0
) -> ShellMesh:
    """Offset a mesh's vertices along its normals, one set a layer (section 3).

    ``thickness`` of the fur in mesh units, by default ``usual_thickness``; ``repeats``: times the
    photograph is repeated along its texture axes. Raises ValueError as ``shell_heights`` does.

    >>> from pipelines.geometry.shapes import square
    >>> shells = make_shell_mesh(square(4), 5, thickness=0.1)
    >>> shells.vertices.shape, shells.vertices.dtype.name
    ((5, 25, 3), 'float32')
    >>> shells.heights.round(3).tolist()
    [0.08, 0.06, 0.04, 0.02, 0.0]
    """
    if thickness is None:
        thickness = usual_thickness(mesh.vertices)
    vertices = shell_vertices(mesh.vertices, mesh.normals, thickness, layers)
    return ShellMesh(vertices, mesh.normals, mesh.triangles, mesh.uvs * repeats, thickness)


def usual_thickness(vertices: NDArray[np.floating]) -> float:
    """USUAL_THICKNESS of the mesh's radius, mesh units."""
    return USUAL_THICKNESS * mesh_radius(vertices)


def mesh_radius(vertices: NDArray[np.floating]) -> float:
    """Of the sphere about the middle of a mesh's box that holds all vertices (V, 3)."""
    from_the_middle = vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    return float(np.linalg.norm(from_the_middle, axis=1).max())


def shell_heights(thickness: float, layers: int) -> NDArray[np.float64]:
    """Heights of the layers 1 … N above the surface: thickness (1 - n/N) (Eq. 3).

    The last layer lies on the surface itself; the first is one step below the full thickness.
    Units of the mesh. Raises ValueError for a thickness that is not positive and finite.

    >>> shell_heights(0.2, 4).round(3).tolist()
    [0.15, 0.1, 0.05, 0.0]
    """
    require_layers(layers)
    if not (np.isfinite(thickness) and thickness > 0):
        raise ValueError(f"thickness is {thickness:g}; expected a positive length in mesh units.")
    return thickness * (1.0 - np.arange(1, layers + 1) / layers)


def shell_vertices(
    vertices: NDArray[np.floating],
    normals: NDArray[np.floating],
    thickness: float,
    layers: int,
) -> NDArray[np.float32]:
    """Vertices of every layer, (layers, V, 3): at equal steps along the unit normals."""
    heights = shell_heights(thickness, layers)
    return (vertices[None] + heights[:, None, None] * normals[None]).astype(np.float32)
