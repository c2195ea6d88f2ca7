"""What is true of every solid, for tests to ask."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.solids import Solid


def volume(vertices: NDArray[np.float64], triangles: NDArray[np.integer]) -> float:
    return float(np.linalg.det(vertices[triangles]).sum() / 6)


def face_normals(solid: Solid) -> NDArray[np.float64]:
    a, b, c = np.moveaxis(solid.vertices[solid.triangles], 1, 0)
    normals: NDArray[np.float64] = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def assert_closed(solid: Solid) -> None:
    """Each edge in two triangles that pass it in opposite senses; arrays as documented."""
    start, end = solid.triangles.ravel(), np.roll(solid.triangles, -1, axis=1).ravel()
    passed = np.stack([start, end], axis=1)
    there, back = np.unique(passed, axis=0), np.unique(passed[:, ::-1], axis=0)
    assert len(there) == len(passed)
    np.testing.assert_array_equal(there, back)
    assert len(np.unique(solid.vertices, axis=0)) == len(solid.vertices)
    assert solid.vertices.dtype == np.float64
    assert solid.triangles.dtype == np.int32
    assert solid.corner_normals.dtype == np.float32
    assert solid.corner_normals.shape == (len(solid.triangles), 3, 3)
    np.testing.assert_allclose(np.linalg.norm(solid.corner_normals, axis=-1), 1, atol=1e-5)
