"""Square, sphere and teapot against closed forms, topology and trimesh."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from pipelines.geometry.meshes import Mesh
from pipelines.geometry.shapes import sphere, square, teapot
from pipelines.geometry.teapot_patches import HANDLE, KNOB, RIM, SPOUT, swept_quarter
from tests.pipelines.geometry.mesh_figures import merged, quantiles, stretches


def edge_counts(triangles: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """How many triangles share each edge; and how often each is passed in one direction."""
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    _, once = np.unique(directed, axis=0, return_counts=True)
    _, shared = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    return shared, once


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
