"""Patches against plane geometry, on bodies against what they promise."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.geometry.meshes import Mesh
from pipelines.geometry.shapes import sphere, square, teapot
from pipelines.photo_fur.laying import (
    SLOTS,
    Body,
    Laying,
    Piece,
    choose_patches,
    lay,
    least_spacing,
)
from pipelines.photo_fur.lie import guides_backwards, lie_field


def pieces(count: int = 60, direction: float | None = None) -> Piece:
    random = np.random.default_rng(1)
    ways = random.uniform(0, 2 * np.pi, count) if direction is None else np.full(count, direction)
    return Piece(random.uniform(0.3, 0.7, (count, 2)), ways)


def laid(
    mesh: Mesh, piece: Piece, *, spacing: float = 0.4, width: float = 2.0, seed: int = 0
) -> Laying:
    guides = guides_backwards(mesh.normals, np.array([1.0, 0.0, 0.0]))
    tangents = lie_field(mesh.vertices, mesh.normals, mesh.triangles, guides, 0.2).tangents
    body = Body(mesh.vertices, mesh.triangles, tangents, mesh.normals)
    patches = choose_patches(body, piece, spacing=spacing, seed=seed)
    return lay(body, patches, spacing=spacing, width=width)


def gradients(
    mesh: Mesh, laying: Laying, slot: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Derivatives (F, 2, 3) of the coordinates along the surface, and where the slot counts."""
    corners = mesh.vertices[laying.vertex][laying.triangles]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    frame = np.stack([one, two, np.cross(one, two)], axis=1)
    uvs = laying.uvs[laying.triangles][:, :, slot].astype(np.float64)
    steps = np.stack([uvs[:, 1] - uvs[:, 0], uvs[:, 2] - uvs[:, 0], 0 * uvs[:, 0]], axis=1)
    found = np.linalg.solve(frame, steps).transpose(0, 2, 1)
    return found, (laying.weights[laying.triangles][:, :, slot] > 0.2).all(axis=1)


def test_a_plane_keeps_lengths_and_directions() -> None:
    """East is the photograph's 30 degrees, one photograph is 2 long, nothing is drawn out."""
    mesh = square(24)
    laying = laid(mesh, pieces(direction=np.pi / 6))
    for slot in range(SLOTS):
        found, counts = gradients(mesh, laying, slot)
        east = found[counts][:, :, 0]
        np.testing.assert_allclose(
            east, np.tile([np.cos(np.pi / 6) / 2, 0.25], (len(east), 1)), atol=1e-5
        )
        north = found[counts][:, :, 1]
        np.testing.assert_allclose(
            north, np.tile([-0.25, np.cos(np.pi / 6) / 2], (len(north), 1)), atol=1e-5
        )


@pytest.mark.parametrize("mesh", [(sphere(40)), (teapot(10))])
def test_patches_share_out_the_surface(mesh: Mesh) -> None:
    laying = laid(mesh, pieces())
    np.testing.assert_allclose(laying.weights.sum(axis=1), 1.0, atol=1e-6)
    assert laying.weights.min() >= 0
    np.testing.assert_array_equal(
        mesh.vertices[laying.vertex[laying.triangles]], mesh.vertices[mesh.triangles]
    )
    assert len(laying.vertex) < 4 * len(mesh.vertices)
    # Every patch is seen, and none is seen far from its middle.
    assert set(laying.patches[laying.patches >= 0]) == set(range(laying.patches.max() + 1))
    assert laying.patches.max() > 3


def test_weights_hardly_jump_at_edges() -> None:
    """What a corner has of a patch is the same in all triangles there, but for what a triangle with
    four patches leaves out."""
    mesh = sphere(40)
    laying = laid(mesh, pieces())
    shown = np.repeat(laying.patches, 3, axis=0)
    corner = laying.triangles.ravel()
    share = np.zeros((len(mesh.vertices), laying.patches.max() + 1))
    for slot in range(SLOTS):
        has = shown[:, slot] >= 0
        np.maximum.at(
            share, (laying.vertex[corner[has]], shown[has, slot]), laying.weights[corner[has], slot]
        )
    for slot in range(SLOTS):
        has = shown[:, slot] >= 0
        most = share[laying.vertex[corner[has]], shown[has, slot]]
        step = most - laying.weights[corner[has], slot]
        assert step.mean() < 0.02
        assert np.quantile(step, 0.99) < 0.2


@pytest.mark.parametrize("mesh", [(sphere(40)), (teapot(10))])
def test_hairs_are_equally_wide_and_follow_the_lie(mesh: Mesh) -> None:
    guides = guides_backwards(mesh.normals, np.array([1.0, 0.0, 0.0]))
    lie = lie_field(mesh.vertices, mesh.normals, mesh.triangles, guides, 0.2)
    piece = pieces(direction=0.7)
    laying = laid(mesh, piece, spacing=0.25)
    scales, angles = [], []
    tangents = lie.tangents[mesh.triangles].mean(axis=1)
    for slot in range(SLOTS):
        found, counts = gradients(mesh, laying, slot)
        scales.append(2 * np.linalg.svd(found[counts], compute_uv=False).ravel())
        along = np.einsum("fuk,fk->fu", found[counts], tangents[counts])
        angles.append(np.degrees(np.arctan2(along[:, 1], along[:, 0]) - 0.7))
    low, high = np.quantile(np.concatenate(scales), [0.1, 0.9])
    assert high / low < 1.5
    assert np.median(np.abs(np.concatenate(angles))) < 5


def test_neighbours_take_different_pieces() -> None:
    mesh = sphere(40)
    piece = pieces()
    laying = laid(mesh, piece, spacing=0.5)
    both = (laying.patches >= 0).all(axis=1)
    assert both.any()
    middle = laying.uvs[laying.triangles[both]].mean(axis=1)
    apart = np.linalg.norm(middle[:, 0] - middle[:, 1], axis=-1)
    assert np.median(apart) > 0.1


def test_equal_seeds_give_equal_patches_and_lengths_must_be_positive() -> None:
    mesh = sphere(20)
    first, again, other = (laid(mesh, pieces(), seed=seed) for seed in (0, 0, 1))
    np.testing.assert_array_equal(first.uvs, again.uvs)
    assert (first.uvs != other.uvs).any()
    with pytest.raises(ValueError, match=r"spacing is 0; expected a positive length\."):
        laid(mesh, pieces(), spacing=0.0)
    with pytest.raises(ValueError, match=r"width is -1; expected a positive length\."):
        laid(mesh, pieces(), width=-1.0)


def test_coarse_meshes_have_patches_as_wide_as_their_triangles() -> None:
    """Else no patch would hold a whole triangle, and what is shown on it would be one colour."""
    mesh = square(2)
    spacing = least_spacing(mesh.vertices, mesh.triangles)
    side = float(np.ptp(mesh.vertices[:, 0])) / 2
    assert spacing == pytest.approx(1.2 * side * 2**0.5, rel=1e-6)
    laying = laid(mesh, pieces(direction=0.0), spacing=spacing)
    best = laying.weights[laying.triangles].mean(axis=1).argmax(axis=1)
    for slot in range(SLOTS):
        found, _ = gradients(mesh, laying, slot)
        east = found[best == slot][:, :, 0]
        np.testing.assert_allclose(east, np.tile([0.5, 0.0], (len(east), 1)), atol=1e-5)


def test_a_body_smaller_than_a_patch_has_one() -> None:
    mesh = square(3)
    laying = laid(mesh, pieces(), spacing=100.0)
    assert laying.patches.max() == 0
    assert (laying.weights[:, 0] == 1).all()
    assert (laying.patches[:, 1:] == -1).all()
