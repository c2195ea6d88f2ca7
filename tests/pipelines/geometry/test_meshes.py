"""Normals against trimesh, meshes with and without texture coordinates."""

from __future__ import annotations

import itertools
from random import Random

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from pipelines.geometry.meshes import make_mesh, vertex_normals, y_up_to_z_up
from pipelines.geometry.shapes import sphere, teapot
from tests.pipelines.geometry.mesh_figures import merged

CUBE = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
CUBE_SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@given(st.lists(st.booleans(), min_size=6, max_size=6))
def test_a_cubes_normals_do_not_depend_on_its_diagonals(diagonals: list[bool]) -> None:
    triangles = []
    for (a, b, c, d), other in zip(CUBE_SIDES, diagonals, strict=True):
        triangles += [(b, c, d), (d, a, b)] if other else [(a, b, c), (c, d, a)]
    normals = vertex_normals(CUBE, np.array(triangles))
    np.testing.assert_allclose(normals, (2 * CUBE - 1) / np.sqrt(3), atol=1e-12)


def test_normals_agree_with_trimesh() -> None:
    positions, triangles = merged(teapot(8))
    reference = trimesh.Trimesh(positions, triangles, process=False)
    ours = vertex_normals(positions, triangles)
    np.testing.assert_allclose(ours, reference.vertex_normals, atol=1e-6)


@settings(max_examples=20, deadline=None)
@given(st.randoms(use_true_random=False))
def test_split_vertices_get_the_normals_of_the_closed_surface(random: Random) -> None:
    positions, triangles = merged(sphere(6))
    together = vertex_normals(positions, triangles)
    copies = np.array([random.random() < 0.5 for _ in range(triangles.size)])
    copies = copies.reshape(triangles.shape)
    split = np.where(copies, triangles + len(positions), triangles)
    apart = vertex_normals(np.concatenate([positions, positions]), split)
    np.testing.assert_allclose(apart[split], together[triangles], atol=1e-12)


def test_a_sheet_with_two_sides_keeps_both() -> None:
    front = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    normals = vertex_normals(np.concatenate([front, front]), np.array([[0, 1, 2], [3, 5, 4]]))
    np.testing.assert_array_equal(normals[:, 2], [1, 1, 1, -1, -1, -1])


def test_normals_without_triangles_or_area_are_unit_and_finite() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 5, 5]], float)
    normals = vertex_normals(points, np.array([[0, 1, 2]]))
    np.testing.assert_array_equal(normals, np.tile([0, 0, 1], (4, 1)))


# --- Making meshes -------------------------------------------------------------------------------


def test_given_texture_coordinates_are_kept() -> None:
    uvs = CUBE[:, :2] * 3
    mesh = make_mesh(CUBE, np.array([[0, 1, 3], [0, 3, 2]]), uvs)
    np.testing.assert_array_equal(mesh.uvs, uvs)
    np.testing.assert_array_equal(mesh.vertices, CUBE)


FLAT = CUBE[:, :2]


@pytest.mark.parametrize(
    ("vertices", "triangles", "uvs", "reason"),
    [
        (CUBE[:, :2], [[0, 1, 2]], FLAT, r"vertices have the shape \(8, 2\)"),
        (CUBE * np.nan, [[0, 1, 2]], FLAT, "vertices have the shape .* finite"),
        (CUBE, [[0.0, 1.0, 2.0]], FLAT, "triangles have the shape .* integers"),
        (CUBE, [[0, 1, 2, 3]], FLAT, r"triangles have the shape \(1, 4\)"),
        (CUBE, np.zeros((0, 3), int), FLAT, "there are no triangles"),
        (CUBE, [[0, 1, 8]], FLAT, "vertices 0 to 8; expected 0 to 7"),
        (CUBE, [[0, 1, -1]], FLAT, "vertices -1 to 1"),
        (CUBE, [[0, 1, 2]], CUBE, r"uvs have the shape \(8, 3\); expected \(8, 2\)"),
        (CUBE, [[0, 1, 2]], np.full((8, 2), np.inf), "finite"),
    ],
)
def test_meshes_that_cannot_be_made(
    vertices: ArrayLike, triangles: ArrayLike, uvs: ArrayLike, reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        make_mesh(vertices, triangles, uvs)


def test_turning_up_is_a_rotation_that_takes_y_to_z() -> None:
    turned = y_up_to_z_up(np.eye(3))
    np.testing.assert_array_equal(turned, [[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    assert np.linalg.det(turned) == pytest.approx(1.0)
