"""Shells: the mesh's vertices offset along their normals, one set a layer (section 3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.photo_fur.attenuation import require_layers


def shell_heights(thickness: float, layers: int) -> NDArray[np.float64]:
    """Heights of the layers 1 … N above the surface: thickness (1 - n/N) (Eq. 3).

    The last layer lies on the surface itself; the first is one step below the full thickness.
    Units of the mesh. Raises ValueError for a thickness that is not positive and finite.
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
