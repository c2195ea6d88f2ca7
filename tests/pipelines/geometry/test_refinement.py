"""Long edges are halved: the surface stays, neighbours share the new vertices."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.geometry import shapes
from pipelines.geometry.mesh_edges import mesh_edges
from pipelines.geometry.refinement import refine_mesh
from pipelines.geometry.repair import repair_mesh


def _areas(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return np.cross(b - a, c - a) / 2


@pytest.mark.parametrize("longest", [0.9, 0.31, 0.1])
def test_no_edge_is_long_and_the_surface_is_the_same(longest: float) -> None:
    given = shapes.sphere(6)
    ball = repair_mesh(given.vertices, given.triangles)
    fine = refine_mesh(ball.vertices, ball.triangles, longest)
    corners = fine.vertices[fine.triangles]
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max() <= longest
    whole = _areas(ball.vertices, ball.triangles)
    parts = np.zeros_like(whole)
    np.add.at(parts, fine.owner, _areas(fine.vertices, fine.triangles))
    np.testing.assert_allclose(parts, whole, atol=1e-12)
    # Closed as before: no vertex lies on an edge of a neighbour.
    assert (mesh_edges(fine.triangles.astype(np.int64)).uses == 2).all()


def test_weights_give_the_corners() -> None:
    ball = shapes.sphere(4)
    fine = refine_mesh(ball.vertices, ball.triangles, 0.2)
    found = fine.weights @ ball.vertices[ball.triangles][fine.owner]
    np.testing.assert_allclose(found, fine.vertices[fine.triangles], atol=1e-12)
    np.testing.assert_array_equal(fine.vertices[: len(ball.vertices)], ball.vertices)


def test_what_has_no_long_edge_is_not_changed() -> None:
    ball = shapes.sphere(8)
    fine = refine_mesh(ball.vertices, ball.triangles, 10.0)
    np.testing.assert_array_equal(fine.triangles, ball.triangles)
    np.testing.assert_array_equal(fine.owner, np.arange(len(ball.triangles)))
