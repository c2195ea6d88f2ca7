"""Figures of meshes that tests compare: positions without copies, stretch of charts, quantiles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.meshes import Mesh


def merged(mesh: Mesh) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Positions and triangles without the copies along the charts' borders."""
    positions, number = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return positions, number.reshape(-1)[mesh.triangles]


def stretches(mesh: Mesh) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Singular values (F, 2) and determinants (F,) of the maps from the surface to the chart,
    and the triangles' areas (F,)."""
    corners, uvs = mesh.vertices[mesh.triangles], mesh.uvs[mesh.triangles]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(first, second)
    area = np.linalg.norm(normal, axis=1)
    x = first / np.linalg.norm(first, axis=1, keepdims=True)
    y = np.cross(normal / area[:, None], x)
    surface = np.einsum("afi,bfi->fba", [first, second], [x, y])
    chart = np.stack([uvs[:, 1] - uvs[:, 0], uvs[:, 2] - uvs[:, 0]], axis=-1)
    jacobian = chart @ np.linalg.inv(surface)
    singular = np.linalg.svd(jacobian, compute_uv=False).astype(np.float64)
    return singular, np.linalg.det(jacobian), area / 2


def quantiles(values: NDArray[np.float64], weights: NDArray[np.float64], *at: float) -> list[float]:
    order = np.argsort(values)
    passed = np.cumsum(weights[order]) / weights.sum()
    return [float(values[order][np.searchsorted(passed, level)]) for level in at]
