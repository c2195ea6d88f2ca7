"""Meshes for fur: repaired whatever way a file has them, and mapped where it has no map."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from benchmarks.captures.case import FILES
from pipelines.geometry.mended_meshes import MendedMesh, mend_mesh
from pipelines.geometry.shapes import square
from pipelines.geometry.texture_coordinates import texture_stretch
from storage.readers.meshes import read_mesh

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_BALL = trimesh.creation.icosphere(1)
BALL, BALL_TRIANGLES = np.array(_BALL.vertices), np.array(_BALL.faces, np.int64)
PLACES = np.array([[0, 0, 0], [5, 0, 0], [0, 7, 0]], float)


def balls() -> tuple[Array, Rows]:
    vertices = np.concatenate([BALL + place for place in PLACES])
    return vertices, np.concatenate([BALL_TRIANGLES + n * len(BALL) for n in range(3)])


def assert_same(one: MendedMesh, other: MendedMesh) -> None:
    np.testing.assert_array_equal(one.mesh.vertices, other.mesh.vertices)
    np.testing.assert_array_equal(one.mesh.triangles, other.mesh.triangles)
    np.testing.assert_array_equal(one.mesh.uvs, other.mesh.uvs)
    np.testing.assert_array_equal(one.mesh.normals, other.mesh.normals)


@settings(max_examples=12, deadline=None)
@given(
    inside_out=st.lists(st.booleans(), min_size=3, max_size=3),
    copies=st.lists(st.integers(0, 239), max_size=5),
    seed=st.integers(0, 2**32 - 1),
)
def test_neither_the_sides_nor_copies_nor_where_triangles_begin_matter(
    inside_out: list[bool], copies: list[int], seed: int
) -> None:
    """Bodies inside out, triangles written twice, corners turned around: one mesh, to the bit."""
    vertices, triangles = balls()
    first = np.random.default_rng(seed).integers(0, 3, len(triangles))
    turned = np.take_along_axis(triangles, (np.arange(3) + first[:, None]) % 3, axis=1)
    flipped = np.repeat(inside_out, len(BALL_TRIANGLES))
    turned[flipped] = turned[flipped, ::-1]
    turned = np.concatenate([turned, turned[copies]])
    mended = mend_mesh(vertices, turned)
    assert_same(mended, mend_mesh(vertices, triangles))
    outwards = np.repeat(PLACES, len(BALL), axis=0)
    around = (
        mended.mesh.vertices
        - outwards[
            np.argmin(
                np.linalg.norm(mended.mesh.vertices[:, None] - vertices[None], axis=2), axis=1
            )
        ]
    )
    assert (np.einsum("vi,vi->v", around, mended.mesh.normals) > 0.99).all()
    words = " ".join(mended.notes)
    assert ("closed pieces turned over" in words) == any(inside_out)
    assert ("the same corners as others" in words) == bool(copies)


def test_seams_keep_their_texture_and_have_one_normal() -> None:
    """A ball split along a meridian, whose sides have other texture coordinates, by rounding."""
    vertices, triangles = balls()
    left = vertices[triangles[:80]].mean(axis=1)[:, 0] < 0
    doubled = np.concatenate([BALL, BALL + 1e-12])
    faces = BALL_TRIANGLES + np.where(left, len(BALL), 0)[:, None]
    flat = BALL @ np.array([[0.8, 0.13], [-0.37, 0.7], [0.45, 0.66]])
    uvs = np.concatenate([flat, flat + 5.0])
    mesh, notes = mend_mesh(doubled, faces, uvs)
    assert any("merged" in note for note in notes)
    np.testing.assert_allclose(
        mesh.uvs[mesh.triangles].sum(axis=1), uvs[faces].sum(axis=1), atol=1e-12
    )
    np.testing.assert_allclose(mesh.normals, mesh.vertices, atol=0.1)
    _, copies = np.unique(mesh.vertices, axis=0, return_inverse=True)
    for number in range(copies.max() + 1):
        assert np.ptp(mesh.normals[copies.reshape(-1) == number], axis=0).max() == 0


def test_a_plain_mesh_stays_as_it_is() -> None:
    flat = square(4)
    mesh, notes = mend_mesh(flat.vertices, flat.triangles, flat.uvs)
    np.testing.assert_allclose(
        mesh.vertices[mesh.triangles].sum(axis=1), flat.vertices[flat.triangles].sum(axis=1)
    )
    np.testing.assert_allclose(mesh.uvs, mesh.vertices[:, :2] + 0.5)
    assert notes == ("the mesh is open along 16 border edges.",)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda uvs: uvs * 0 + 0.25, "have no area: unwrapped anew"),
        (lambda uvs: uvs * [1, 0], "have no area: unwrapped anew"),
        (lambda uvs: uvs * np.nan, "have no area: unwrapped anew"),
        (lambda uvs: uvs * [8, 1], "stretch a photograph 8 times: unwrapped anew"),
        (lambda uvs: uvs * [2.5, 1], None),
        (lambda uvs: uvs * 40 - 7, None),
    ],
)
def test_texture_coordinates_that_are_of_no_use(
    change: Callable[[Array], Array], said: str | None
) -> None:
    flat = square(4)
    given_uvs = change(flat.uvs)
    mesh, notes = mend_mesh(flat.vertices, flat.triangles, given_uvs)
    assert np.isfinite(mesh.uvs).all()
    assert texture_stretch(mesh.vertices, mesh.triangles, mesh.uvs) < 3
    if said is None:
        assert len(notes) == 1
        np.testing.assert_allclose(mesh.uvs, change(mesh.vertices[:, :2] + 0.5))
    else:
        assert said in notes[-1]


def test_some_triangles_without_texture_are_unwrapped_to_scale() -> None:
    flat = square(4)
    uvs = flat.uvs * 3
    rows = np.flatnonzero((flat.vertices[flat.triangles][:, :, 0] > 0).any(axis=1))[:6]
    apart = np.arange(3 * len(flat.triangles)).reshape(-1, 3)
    uvs = uvs[flat.triangles].reshape(-1, 2)
    uvs[apart[rows].ravel()] = np.nan
    mesh, notes = mend_mesh(flat.vertices[flat.triangles].reshape(-1, 3), apart, uvs)
    assert notes[-1] == "6 triangles without area on the texture unwrapped anew."
    a, b, c = np.moveaxis(mesh.uvs[mesh.triangles], 1, 0)
    area = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    np.testing.assert_allclose(area, 9 / 16, rtol=0.02)


def test_shapes_of_texture_coordinates() -> None:
    with pytest.raises(ValueError, match=r"uvs have the shape \(4, 2\); expected \(25, 2\)"):
        mend_mesh(square(4).vertices, square(4).triangles, np.zeros((4, 2)))


def test_a_scan_that_is_inside_out_is_its_twin() -> None:
    """The egg and the egg inside out, as they were met: what fur grows on is equal to the bit."""
    twins = [read_mesh(FILES / f"obj_{name}.obj") for name in ("egg_closed", "inside_out_closed")]
    one, other = (mend_mesh(twin.vertices, twin.triangles, twin.uvs) for twin in twins)
    assert_same(one, other)
    assert one.notes == ()
    assert other.notes == ("960 triangles of closed pieces turned over to face outwards.",)
