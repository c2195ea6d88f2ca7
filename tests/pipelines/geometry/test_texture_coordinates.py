"""Unwrapped charts and stretched ones against what they were made from."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.geometry.meshes import make_mesh
from pipelines.geometry.shapes import sphere, square
from pipelines.geometry.texture_coordinates import texture_stretch, unwrap
from tests.pipelines.geometry.mesh_figures import merged, quantiles, stretches


def test_unwrapped_charts_are_to_scale_and_not_mirrored() -> None:
    positions, triangles = merged(sphere(32))
    vertices, faces, uvs = unwrap(7 * positions + [100, 0, 0], triangles)
    np.testing.assert_array_equal(vertices[faces], (7 * positions + [100, 0, 0])[triangles])
    again = unwrap(7 * positions + [100, 0, 0], triangles)[2]
    np.testing.assert_array_equal(again, uvs)
    mesh = make_mesh(vertices, faces, uvs)
    singular, determinant, area = stretches(mesh)
    assert (determinant > 0).all()
    assert quantiles(singular[:, 0] / singular[:, 1], area, 0.9)[0] < 1.1
    # One photograph is as wide as the radius.
    assert quantiles(7 * np.sqrt(determinant), area, 0.5)[0] == pytest.approx(1, abs=0.05)
    outwards = (mesh.vertices - [100, 0, 0]) / 7
    assert (np.einsum("ij,ij->i", mesh.normals, outwards) > 0.99).all()  # no cracks


def test_nothing_to_unwrap() -> None:
    with pytest.raises(ValueError, match="all vertices are at one position"):
        unwrap(np.ones((3, 3)), np.array([[0, 1, 2]]))


def test_texture_stretch_is_the_ratio_of_the_sides_of_a_drawn_out_square() -> None:
    plane = square(4)
    for factor in (1.0, 2.0, 5.0):
        drawn = plane.vertices * [factor, 1.0, 1.0]
        found = texture_stretch(drawn, plane.triangles, plane.uvs)
        assert found == pytest.approx(factor)
    flat = texture_stretch(plane.vertices, plane.triangles, np.zeros_like(plane.uvs))
    assert flat == np.inf
