"""How a point of a surface is seen and lit in the material's frame.

The same as the shader `btf_directions.glsl`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

MOST_THETA = math.radians(75.0)
"""Goniometers measure so far; beyond, the value there is taken, dimmed with the cosine."""


def surface_frames(
    normals: NDArray[np.floating], tangents: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Rows are tangent, bitangent, normal (n, 3, 3): turns world vectors into the texture's."""
    up = unit(normals.astype(np.float64))
    along = tangents.astype(np.float64)
    along = unit(along - np.sum(along * up, axis=1, keepdims=True) * up)
    return np.stack([along, np.cross(up, along), up], axis=1)


def in_frames(frame: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """World vectors (n, 3) in frames (n, 3, 3)."""
    return np.einsum("nij,nj->ni", frame, vectors)


def held_directions(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors no lower than what was measured; lower ones are lifted, their azimuth kept."""
    least = math.cos(MOST_THETA)
    low = vectors[:, 2] < least
    lifted = vectors.copy()
    lifted[low & (vectors[:, 2] == -1.0), 0] = 1.0  # straight from below: any azimuth will do
    level = np.hypot(lifted[low, 0], lifted[low, 1])
    lifted[low, :2] *= (math.sin(MOST_THETA) / np.maximum(level, 1e-12))[:, None]
    lifted[low, 2] = least
    return lifted


def dimming(cosine: NDArray[np.float64]) -> NDArray[np.float64]:
    """1 down to 75°, then with the cosine of the light's angle to 0 at the horizon."""
    return np.clip(cosine / math.cos(MOST_THETA), 0.0, 1.0)


def unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors (…, 3) made as long as 1."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
