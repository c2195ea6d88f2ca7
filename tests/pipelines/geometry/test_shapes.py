"""Shapes, normals and texture coordinates against closed forms, topology and trimesh."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from random import Random

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray

from pipelines.geometry import shapes
from pipelines.geometry.shapes import (
    Mesh,
    make_mesh,
    sphere,
    square,
    teapot,
    unwrap,
    vertex_normals,
)
from pipelines.geometry.teapot_patches import HANDLE, KNOB, RIM, SPOUT, swept_quarter


def merged(mesh: Mesh) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Positions and triangles without the copies along the charts' borders."""
    positions, number = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return positions, number.reshape(-1)[mesh.triangles]


def edge_counts(triangles: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """How many triangles share each edge; and how often each is passed in one direction."""
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    _, once = np.unique(directed, axis=0, return_counts=True)
    _, shared = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    return shared, once


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


def shown_texel(uvs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where a photograph repeated with mirrors is looked up: OpenGL 4.6, 8.14.2."""
    return np.abs((uvs + 1) % 2 - 1)


def positions_that_show_two_texels(mesh: Mesh) -> int:
    _, number = np.unique(mesh.vertices, axis=0, return_inverse=True)
    number = number.reshape(-1)
    texels = shown_texel(mesh.uvs)
    low, high = np.full((2, number.max() + 1, 2), [[[np.inf]], [[-np.inf]]])
    np.minimum.at(low, number, texels)
    np.maximum.at(high, number, texels)
    return int(((high - low).max(axis=1) > 1e-9).sum())


# --- Square and sphere --------------------------------------------------------------------------


@pytest.mark.parametrize("segments", [1, 4, 7])
def test_the_square_shows_one_photograph_texel_on_texel(segments: int) -> None:
    mesh = square(segments)
    assert mesh.vertices.shape == ((segments + 1) ** 2, 3)
    assert mesh.triangles.shape == (2 * segments**2, 3)
    assert mesh.triangles.dtype == np.int32
    np.testing.assert_array_equal(mesh.vertices[:, :2] + 0.5, mesh.uvs)
    np.testing.assert_array_equal(mesh.normals, np.tile([0, 0, 1], (len(mesh.normals), 1)))
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    np.testing.assert_allclose(np.cross(b - a, c - a)[:, 2], 1 / segments**2)


def test_the_spheres_area_and_volume_approach_the_closed_form() -> None:
    errors = []
    for segments in (16, 32):
        body = trimesh.Trimesh(*merged(sphere(segments)), process=False)
        assert body.is_watertight
        assert body.is_winding_consistent
        assert body.euler_number == 2
        errors.append([4 * np.pi - body.area, 4 / 3 * np.pi - body.volume])
    coarse, fine = np.array(errors)
    assert (fine > 0).all()  # inscribed
    assert (fine < 0.05).all()
    np.testing.assert_allclose(coarse / fine, 4, rtol=0.05)  # second order


def test_the_spheres_normals_point_outwards() -> None:
    mesh = sphere(24)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1)
    assert (np.einsum("ij,ij->i", mesh.normals, mesh.vertices) > 0.999).all()


def test_the_sphere_shows_no_seam_and_little_stretch() -> None:
    mesh = sphere(32)
    assert len(mesh.vertices) == len(merged(mesh)[0]) + 64  # copies along the equator
    assert positions_that_show_two_texels(mesh) == 0
    singular, determinant, area = stretches(mesh)
    assert (determinant > 0).all()
    assert (singular[:, 0] / singular[:, 1]).max() < 1.35
    assert quantiles(np.sqrt(determinant), area, 0.01, 0.99) == pytest.approx(
        [0.84, 1.24], abs=0.02
    )


@pytest.mark.parametrize(
    ("shape", "segments"), [(square, 0), (sphere, 2), (sphere, 9), (teapot, 1)]
)
def test_too_few_segments(shape: Callable[[int], Mesh], segments: int) -> None:
    with pytest.raises(ValueError, match=f"segments is {segments}; expected"):
        shape(segments)


# --- Teapot -------------------------------------------------------------------------------------


def test_control_points_are_newells() -> None:
    """Some of his 306 numbered points, from the published list."""
    np.testing.assert_array_equal(swept_quarter(RIM)[1, 1], [1.3375, -0.749, 2.53125])  # 6
    np.testing.assert_array_equal(swept_quarter(KNOB)[1, 2], [0.45, -0.8, 3.15])
    np.testing.assert_array_equal(HANDLE[1, 3, 2], [-1.9, -0.3, 0.6])
    np.testing.assert_array_equal(SPOUT[1, 1, 2], [3.525, -0.25, 2.49375])
    for patches in (HANDLE, SPOUT):
        np.testing.assert_array_equal(patches[0, 3], patches[1, 0])  # joined
        assert (patches[:, :, [0, 3], 1] == 0).all()  # the halves end on the plane of symmetry


@pytest.mark.parametrize(
    ("segments", "vertices", "triangles"),
    [(2, 171, 240), (8, 2205, 4032), (20, 13185, 25440), (33, 35480, 69432)],
)
def test_teapot_counts(segments: int, vertices: int, triangles: int) -> None:
    mesh = teapot(segments)
    assert mesh.vertices.shape == mesh.normals.shape == (vertices, 3)
    assert mesh.triangles.shape == (triangles, 3)
    assert mesh.uvs.shape == (vertices, 2)
    # The surfaces' positions, less the one in which the handle's end touches the body.
    assert len(merged(mesh)[0]) == 32 * segments**2 + 4 * segments + 2 - 1
    radius = np.linalg.norm(mesh.vertices, axis=1).max()
    assert 0.99 < radius < 1.000001


def test_the_teapot_has_the_papers_vertices() -> None:
    bodies = trimesh.Trimesh(*merged(teapot(8)), process=False).split(only_watertight=False)
    assert sum(len(body.vertices) for body in bodies) == 2082


def test_the_teapots_topology() -> None:
    """The body with its bottom and the lid are discs, handle and spout are tubes."""
    _, triangles = merged(teapot(8))
    shared, once = edge_counts(triangles)
    assert set(shared) == {1, 2}  # borders and inner edges, never three triangles
    assert (once == 1).all()  # all neighbours agree which side is outside
    assert (shared == 1).sum() == 2 * 32 + 4 * 16  # rim, lid, two ends each
    bodies = trimesh.Trimesh(*merged(teapot(8)), process=False).split(only_watertight=False)
    assert sorted(body.euler_number for body in bodies) == [0, 0, 1, 1]


def test_the_teapots_normals_point_outwards() -> None:
    mesh = teapot(8)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, rtol=1e-12)
    corners = mesh.vertices[mesh.triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    middle = corners.mean(axis=1)
    for part, axis in (
        (np.ones(len(middle), bool), [0, 0, 1]),  # the knob's top
        (np.ones(len(middle), bool), [0, 0, -1]),  # the bottom
        (np.abs(middle[:, 0]) < 0.3, [0, 1, 0]),  # the body's side
        (middle[:, 0] > 0.7, [0, 1, 0]),  # the spout's side
        (middle[:, 0] < -0.7, [0, -1, 0]),  # the handle's side
        (middle[:, 0] < -0.7, [-1, 0, 0]),  # the handle's back
    ):
        extreme = np.argmax(np.where(part, middle @ axis, -np.inf))
        assert faces[extreme] @ axis > 0, axis
    assert (np.einsum("fi,fci->fc", faces, mesh.normals[mesh.triangles]) > 0).mean() > 0.99


def test_copies_of_a_teapots_vertex_share_the_normal() -> None:
    mesh = teapot(8)
    _, number, copies = np.unique(mesh.vertices, axis=0, return_inverse=True, return_counts=True)
    number = number.reshape(-1)
    # The borders body-bottom and knob-lid, the seams of body, handle and spout; the body's seam
    # meets a border, and the handle's seam ends on it.
    assert (copies > 1).sum() == 32 + 32 + 25 + 17 + 17 - 1 - 1
    first = np.full((len(copies), 3), np.nan)
    first[number] = mesh.normals
    apart = np.abs(mesh.normals - first[number]).max(axis=1) > 1e-12
    # Only where the handle's end touches the body do two surfaces keep their own.
    assert len(np.unique(number[apart])) <= 1


@pytest.mark.parametrize("segments", [8, 20])
def test_the_teapots_charts(segments: int) -> None:
    mesh = teapot(segments)
    singular, determinant, area = stretches(mesh)
    assert (determinant > 0).all()  # nothing mirrored or folded
    ratio = singular[:, 0] / singular[:, 1]
    median, most, nearly_all = quantiles(ratio, area, 0.5, 0.9, 0.99)
    assert median < 1.05
    assert most < 1.1
    assert nearly_all < 1.4
    assert ratio.max() < 3
    scale = quantiles(np.sqrt(determinant), area, 0.01, 0.5, 0.99)
    assert scale == pytest.approx([0.76, 1.0, 1.28], abs=0.03)


def test_the_teapots_seams_show_only_between_charts() -> None:
    """The body's, the handle's and the spout's closing seams do not show."""
    segments = 8
    between_charts = 4 * segments + 4 * segments  # body and bottom, knob and lid
    touching = 1  # the handle's end and the body
    mesh = teapot(segments)
    assert positions_that_show_two_texels(mesh) == between_charts + touching
    smaller = Mesh(mesh.vertices, mesh.triangles, mesh.uvs * [2.7, 3.9], mesh.normals)
    assert positions_that_show_two_texels(smaller) == between_charts + touching


# --- Normals ------------------------------------------------------------------------------------

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


# --- Meshes without texture coordinates ---------------------------------------------------------


def test_unwrapped_charts_are_to_scale_and_not_mirrored() -> None:
    positions, triangles = merged(sphere(32))
    vertices, faces, uvs = unwrap(7 * positions + [100, 0, 0], triangles)
    np.testing.assert_array_equal(vertices[faces], (7 * positions + [100, 0, 0])[triangles])
    mesh = make_mesh(7 * positions + [100, 0, 0], triangles)
    np.testing.assert_array_equal(mesh.uvs, uvs)  # the same each time
    singular, determinant, area = stretches(mesh)
    assert (determinant > 0).all()
    assert quantiles(singular[:, 0] / singular[:, 1], area, 0.9)[0] < 1.1
    # One photograph is as wide as the radius.
    assert quantiles(7 * np.sqrt(determinant), area, 0.5)[0] == pytest.approx(1, abs=0.05)
    outwards = (mesh.vertices - [100, 0, 0]) / 7
    assert (np.einsum("ij,ij->i", mesh.normals, outwards) > 0.99).all()  # no cracks


def test_given_texture_coordinates_are_kept() -> None:
    uvs = CUBE[:, :2] * 3
    mesh = make_mesh(CUBE, np.array([[0, 1, 3], [0, 3, 2]]), uvs)
    np.testing.assert_array_equal(mesh.uvs, uvs)
    np.testing.assert_array_equal(mesh.vertices, CUBE)


@pytest.mark.parametrize(
    ("vertices", "triangles", "uvs", "reason"),
    [
        (CUBE[:, :2], [[0, 1, 2]], None, r"vertices have the shape \(8, 2\)"),
        (CUBE * np.nan, [[0, 1, 2]], None, "vertices have the shape .* finite"),
        (CUBE, [[0.0, 1.0, 2.0]], None, "triangles have the shape .* integers"),
        (CUBE, [[0, 1, 2, 3]], None, r"triangles have the shape \(1, 4\)"),
        (CUBE, np.zeros((0, 3), int), None, "there are no triangles"),
        (CUBE, [[0, 1, 8]], None, "vertices 0 to 8; expected 0 to 7"),
        (CUBE, [[0, 1, -1]], None, "vertices -1 to 1"),
        (CUBE, [[0, 1, 2]], CUBE, r"uvs have the shape \(8, 3\); expected \(8, 2\)"),
        (CUBE, [[0, 1, 2]], np.full((8, 2), np.inf), "finite"),
        (CUBE * 0, [[0, 1, 2]], None, "all vertices are at one position"),
    ],
)
def test_meshes_that_cannot_be_made(
    vertices: ArrayLike, triangles: ArrayLike, uvs: ArrayLike | None, reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        make_mesh(vertices, triangles, uvs)


def test_turning_up_is_a_rotation_that_takes_y_to_z() -> None:
    turned = shapes.turned_up(np.eye(3))
    np.testing.assert_array_equal(turned, [[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    assert np.linalg.det(turned) == pytest.approx(1.0)


def test_texture_stretch_is_the_ratio_of_the_sides_of_a_drawn_out_square() -> None:
    plane = shapes.square(4)
    for factor in (1.0, 2.0, 5.0):
        drawn = plane.vertices * [factor, 1.0, 1.0]
        found = shapes.texture_stretch(drawn, plane.triangles, plane.uvs)
        assert found == pytest.approx(factor)
    flat = shapes.texture_stretch(plane.vertices, plane.triangles, np.zeros_like(plane.uvs))
    assert flat == np.inf
