"""Fields of directions against Poincaré's and Hopf's theorem, symmetries and known directions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.geometry.meshes import Mesh, grid_triangles, make_mesh
from pipelines.geometry.shapes import sphere, square, teapot
from pipelines.photo_fur.lie import (
    LieField,
    guides_backwards,
    lie_field,
    nose_to_tail,
)


def torus(columns: int = 48, rows: int = 24) -> Mesh:
    around, about = np.meshgrid(
        np.linspace(0, 2 * np.pi, columns + 1), np.linspace(0, 2 * np.pi, rows + 1)
    )
    away = 1 + 0.4 * np.cos(about)
    points = np.stack([away * np.cos(around), away * np.sin(around), 0.4 * np.sin(about)], -1)
    points[:, -1], points[-1] = points[:, 0], points[0]
    uvs = np.stack([around, about], -1).reshape(-1, 2)
    return make_mesh(points.reshape(-1, 3), grid_triangles(rows + 1, columns + 1), uvs)


def laid(mesh: Mesh, guides: NDArray[np.floating], smoothness: float = 0.2) -> LieField:
    return lie_field(mesh.vertices, mesh.normals, mesh.triangles, guides, smoothness)


def random_guides(mesh: Mesh, seed: int) -> NDArray[np.float64]:
    """The same at copies of a vertex."""
    _, position = np.unique(mesh.vertices, axis=0, return_inverse=True)
    random = np.random.default_rng(seed)
    found: NDArray[np.float64] = random.standard_normal((position.max() + 1, 3))[position.ravel()]
    return found


@pytest.mark.parametrize(("mesh", "characteristic"), [(sphere(24), 2), (torus(), 0)])
@pytest.mark.parametrize("seed", range(4))
def test_indices_add_up_to_the_euler_characteristic(
    mesh: Mesh, characteristic: int, seed: int
) -> None:
    lie = laid(mesh, random_guides(mesh, seed), smoothness=0.05)
    assert len(lie.indices) > characteristic
    assert lie.indices.sum() == characteristic


def test_directions_are_unit_and_along_the_surface() -> None:
    mesh = teapot(4)
    lie = laid(mesh, guides_backwards(mesh.normals, np.array([1.0, 0.0, 0.0])))
    np.testing.assert_allclose(np.linalg.norm(lie.tangents, axis=1), 1.0)
    np.testing.assert_allclose(np.einsum("vi,vi->v", lie.tangents, mesh.normals), 0.0, atol=1e-9)


def test_copies_of_a_vertex_have_one_direction() -> None:
    mesh = sphere(16)
    lie = laid(mesh, random_guides(mesh, 3))
    _, position = np.unique(mesh.vertices, axis=0, return_inverse=True)
    position = position.ravel()
    assert len(position) > position.max() + 1
    first = np.unique(position, return_index=True)[1]
    np.testing.assert_array_equal(lie.tangents, lie.tangents[first][position])


def test_a_sphere_from_nose_to_tail_has_a_crown_at_each() -> None:
    mesh = sphere(48)
    lie = laid(mesh, guides_backwards(mesh.normals, np.array([1.0, 0.0, 0.0]), gravity=0.0))
    assert lie.indices.tolist() == [1, 1]
    middles = mesh.vertices[mesh.triangles[lie.singular_triangles]].mean(axis=1)
    np.testing.assert_allclose(np.sort(middles[:, 0]), [-1.0, 1.0], atol=0.02)
    beside = np.abs(mesh.vertices[:, 0]) < 0.9
    expected = np.array([1.0, 0, 0]) - mesh.vertices[:, :1] * mesh.vertices
    expected /= np.maximum(np.linalg.norm(expected, axis=1, keepdims=True), 1e-9)
    agreement = np.einsum("vi,vi->v", expected, lie.tangents)[beside]
    assert agreement.min() > np.cos(np.radians(2))


def test_a_torus_may_lie_along_itself_without_singularities() -> None:
    mesh = torus()
    around = np.cross([0.0, 0.0, 1.0], mesh.vertices)
    lie = laid(mesh, around)
    assert lie.indices.tolist() == []
    agreement = np.einsum("vi,vi->v", lie.tangents, around) / np.linalg.norm(around, axis=1)
    assert agreement.min() > 0.999


def test_noise_shorter_than_the_smoothness_is_evened_out() -> None:
    mesh = square(40)
    noisy = np.array([1.0, 0.0, 0.0]) + 1.5 * random_guides(mesh, 0)
    spread = [
        np.degrees(np.std(np.arctan2(*laid(mesh, noisy, s).tangents.T[1::-1]))) for s in (1e-4, 0.2)
    ]
    assert spread[0] > 30
    assert spread[1] < 5


def test_what_cannot_be_followed_is_refused() -> None:
    mesh = square(2)
    with pytest.raises(ValueError, match=r"smoothness is 0; expected a positive length\."):
        laid(mesh, mesh.normals, 0.0)
    with pytest.raises(ValueError, match=r"guides are all along the normals; expected"):
        laid(mesh, mesh.normals)


def test_the_nose_is_at_the_higher_end_of_the_longer_side() -> None:
    body = np.array([[-2.0, 0, 0], [2.0, 0, 0], [0, 1.0, 0.2], [0, -1.0, 0.2], [1.9, 0, 0.9]])
    assert nose_to_tail(body).tolist() == [-1.0, 0.0, 0.0]
    assert nose_to_tail(body * [-1, 1, 1]).tolist() == [1.0, 0.0, 0.0]
    assert nose_to_tail(body[:, [1, 0, 2]]).tolist() == [0.0, -1.0, 0.0]
