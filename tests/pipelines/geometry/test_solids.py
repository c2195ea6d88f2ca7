"""Closed meshes, their orientation and normals."""

from __future__ import annotations

import itertools
import re

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from pipelines.geometry import shapes
from pipelines.geometry.meshes import grid_triangles
from pipelines.geometry.solids import make_closed_mesh, make_solid
from tests.pipelines.geometry.solid_figures import assert_closed, face_normals, volume

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_BOX = trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]])
CUBE = np.array(_BOX.vertices, np.float64)
CUBE_TRIANGLES = np.array(_BOX.faces, np.int64)
INSIDE_OUT = CUBE_TRIANGLES[:, ::-1]


def cubes(*placed: tuple[float, float], turned: tuple[bool, ...]) -> tuple[Array, Rows]:
    """Cubes (middle's x, half the width), the ones that are turned inside out."""
    vertices = [(2 * CUBE - 1) * half + [x, 0, 0] for x, half in placed]
    triangles = [INSIDE_OUT if over else CUBE_TRIANGLES for over in turned]
    numbered = [faces + 8 * row for row, faces in enumerate(triangles)]
    return np.concatenate(vertices), np.concatenate(numbered)


# --- Closed meshes ------------------------------------------------------------------------------


def test_a_closed_mesh_is_kept() -> None:
    mesh = make_closed_mesh(CUBE, CUBE_TRIANGLES)
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], CUBE[CUBE_TRIANGLES])
    assert mesh.triangles.dtype == np.int32


def test_a_mesh_inside_out_is_turned_and_keeps_its_order() -> None:
    mesh = make_closed_mesh(CUBE, INSIDE_OUT)
    assert volume(mesh.vertices, mesh.triangles) == pytest.approx(1)
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], CUBE[INSIDE_OUT[:, [0, 2, 1]]])


def test_triangles_that_disagree_are_turned() -> None:
    for seed in range(8):
        mixed = CUBE_TRIANGLES.copy()
        over = np.random.default_rng(seed).random(12) < 0.5
        mixed[over] = mixed[over][:, ::-1]
        mesh = make_closed_mesh(CUBE + 10, mixed)
        assert volume(mesh.vertices, mesh.triangles) == pytest.approx(1)
        assert_closed(make_solid(CUBE + 10, mixed))


def test_seams_are_welded_and_what_is_no_surface_is_dropped() -> None:
    split = CUBE[CUBE_TRIANGLES].reshape(-1, 3)
    split[split == 0] *= -1  # -0.0 is 0.0
    split = np.concatenate([split[::-1] * -1 + 1, [[9.0, 9.0, 9.0]]])  # and one vertex unused
    triangles = np.concatenate([np.arange(36).reshape(-1, 3), [[4, 4, 5]]])
    mesh = make_closed_mesh(split, triangles)
    assert mesh.vertices.shape == (8, 3)
    assert mesh.triangles.shape == (12, 3)
    assert volume(mesh.vertices, mesh.triangles) == pytest.approx(1)


@pytest.mark.parametrize("turned", list(itertools.product((False, True), repeat=2)))
def test_a_cavity_faces_into_the_cavity(turned: tuple[bool, bool]) -> None:
    mesh = make_closed_mesh(*cubes((0, 2), (0.5, 1), turned=turned))
    assert volume(mesh.vertices, mesh.triangles) == pytest.approx(4**3 - 2**3)


def test_surfaces_face_by_turns_however_deep_they_lie() -> None:
    """A ball in the cavity of a ball, a second cavity, and a neighbour in the outer one's box."""
    nested = ((0, 4), (-2, 1.5), (-2, 1), (2, 1), (9, 1))
    for seed in range(4):
        turned = tuple(bool(over) for over in np.random.default_rng(seed).random(5) < 0.5)
        mesh = make_closed_mesh(*cubes(*nested, turned=turned))
        assert volume(mesh.vertices, mesh.triangles) == pytest.approx(
            8**3 - 3**3 + 2**3 - 2**3 + 2**3
        )


def test_a_surface_in_anothers_box_but_outside_is_no_cavity() -> None:
    """A ball amid a ring, which winds around it, but not in the glass."""
    around, along = np.meshgrid(*2 * [np.linspace(0, 2 * np.pi, 25)], indexing="ij")
    radius = 2 + 0.5 * np.cos(along)
    ring = np.stack([radius * np.cos(around), radius * np.sin(around), np.sin(along) / 2], axis=-1)
    ring[-1], ring[:, -1] = ring[0], ring[:, 0]
    faces = grid_triangles(25, 25)
    hull = make_closed_mesh(ring.reshape(-1, 3), faces)
    vertices, cube = cubes((0, 0.3), turned=(True,))
    both = make_closed_mesh(
        np.concatenate([ring.reshape(-1, 3), vertices]), np.concatenate([faces, cube + 625])
    )
    assert volume(*both[:2]) == pytest.approx(volume(*hull[:2]) + 0.6**3)
    assert volume(*hull[:2]) == pytest.approx(2 * np.pi**2 * 2 * 0.5**2, rel=0.04)


def split_cube(gap: float, extra: Rows) -> tuple[Array, Rows]:
    """The cube, each triangle with corners of its own, apart by ``gap``, and further triangles."""
    random = np.random.default_rng(0)
    apart = CUBE[CUBE_TRIANGLES].reshape(-1, 3) + random.uniform(-gap, gap, (36, 3)) / 2
    triangles = np.concatenate([np.arange(36).reshape(-1, 3), extra])
    return apart, triangles


@pytest.mark.parametrize("gap", [0.0, 1e-16, 1e-9, 5e-8])
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e9])
def test_gaps_far_below_the_size_are_none(gap: float, size: float) -> None:
    vertices, triangles = split_cube(gap, np.array([[0, 0, 1], [4, 4, 4]]))
    mesh = make_closed_mesh(vertices * size, triangles)
    assert volume(*mesh[:2]) == pytest.approx(size**3)
    assert "2 triangles dropped: repeated corners or no area." in mesh.notes


def test_gaps_that_are_seen_are_open() -> None:
    with pytest.raises(ValueError, match=r"open along 36 border edges.*fill its holes"):
        make_closed_mesh(*split_cube(1e-3, np.zeros((0, 3), np.int64)))


def test_a_triangle_without_area_stays_where_it_closes_a_slit() -> None:
    """A corner in the middle of the edge between two triangles, of which one does not have it."""
    edge = CUBE_TRIANGLES[0, :2]
    middle = CUBE[edge].mean(axis=0)
    a, b = (int(end) for end in edge)
    c = int(CUBE_TRIANGLES[0, 2])
    triangles = np.concatenate(
        [np.delete(CUBE_TRIANGLES, 0, axis=0), [[a, 8, c], [8, b, c], [a, b, 8]]]
    )
    mesh = make_closed_mesh(np.concatenate([CUBE, [middle]]), triangles)
    assert len(mesh.triangles) == 14
    assert volume(*mesh[:2]) == pytest.approx(1)


@pytest.mark.parametrize("turned", [False, True])
def test_small_holes_get_lids(turned: bool) -> None:
    """Two of a ball's triangles are missing, at its poles: flat lids are these triangles."""
    ball = trimesh.creation.icosphere(2)
    vertices, faces = np.array(ball.vertices), np.array(ball.faces)
    height = vertices[faces][:, :, 2].mean(axis=1)
    rest = np.delete(faces, [height.argmin(), height.argmax()], axis=0)
    mesh = make_closed_mesh(vertices, rest[:, ::-1] if turned else rest)
    assert volume(*mesh[:2]) == pytest.approx(ball.volume)
    assert len(mesh.triangles) == len(rest) + 6
    assert re.fullmatch(r"2 holes closed by lids, at most 0\.00\d+ of a surface\.", mesh.notes[0])


def test_large_holes_and_holes_that_touch_are_refused() -> None:
    ball = trimesh.creation.icosphere(2)
    vertices, faces = np.array(ball.vertices), np.array(ball.faces)
    height = vertices[faces][:, :, 2].mean(axis=1)
    with pytest.raises(ValueError, match="open along"):
        make_closed_mesh(vertices, faces[height > -0.8])
    corner = faces[0, 0]
    opposite = np.flatnonzero((faces == corner).any(axis=1))[[0, 3]]
    with pytest.raises(ValueError, match="open along 6 border edges"):
        make_closed_mesh(vertices, np.delete(faces, opposite, axis=0))
    # A small cup beside a large body is not filled.
    cup = vertices[faces[height > 0]].reshape(-1, 3) / 50 + [5, 0, 0]
    rows = np.arange(len(cup)).reshape(-1, 3) + len(vertices)
    with pytest.raises(ValueError, match="open along"):
        make_closed_mesh(np.concatenate([vertices, cup]), np.concatenate([faces, rows]))


def test_what_was_turned_over_is_told() -> None:
    assert make_closed_mesh(CUBE, CUBE_TRIANGLES).notes == ()
    turned = "12 triangles turned over to face out of the material."
    assert make_closed_mesh(CUBE, INSIDE_OUT).notes == (turned,)
    nested = cubes((0, 2), (0.5, 1), turned=(False, True))
    assert make_closed_mesh(*nested).notes == ()  # a cavity faces inwards


def test_open_meshes_are_refused() -> None:
    open_teapot = shapes.teapot(4)
    with pytest.raises(ValueError, match=r"open along 64 border edges; expected two triangles"):
        make_closed_mesh(open_teapot.vertices, open_teapot.triangles)
    with pytest.raises(ValueError, match="open along 3 border edges"):
        make_closed_mesh(CUBE, CUBE_TRIANGLES[:-1])


def test_a_fin_is_refused() -> None:
    vertices = np.concatenate([CUBE, [[2.0, 2.0, 2.0]]])
    with pytest.raises(ValueError, match=r"1 edges are in more than two triangles"):
        make_closed_mesh(vertices, np.concatenate([CUBE_TRIANGLES, [[*CUBE_TRIANGLES[0, :2], 8]]]))


def test_cubes_that_touch_along_an_edge_are_refused() -> None:
    vertices = np.concatenate([CUBE, CUBE + np.array([1, 1, 0])])
    with pytest.raises(ValueError, match=r"1 edges are in more than two"):
        make_closed_mesh(vertices, np.concatenate([CUBE_TRIANGLES, CUBE_TRIANGLES + 8]))


def test_a_klein_bottle_is_refused() -> None:
    n = 6
    row, column = np.divmod(np.arange((n + 1) * (n + 1)), n + 1)
    last = row == n  # joined to the first row, mirrored
    number = np.where(last, (-column) % n, row * n + column % n)
    faces = number[grid_triangles(n + 1, n + 1)]
    vertices = np.random.default_rng(0).random((n * n, 3))
    with pytest.raises(ValueError, match="1 of 1 surfaces have one side only"):
        make_closed_mesh(vertices, faces)


FLAT = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)


@pytest.mark.parametrize(
    ("vertices", "triangles", "reason"),
    [
        (CUBE, CUBE_TRIANGLES[:0], "no triangles"),
        (CUBE, [[0, 1, 8]], "vertices 0 to 8"),
        (CUBE * 0, CUBE_TRIANGLES, "no triangle has an area"),
        (CUBE, [[0, 1, 2], [0, 2, 1]], "open along 3 border edges.*give a sheet some thickness"),
        (FLAT, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]], "1 of 1 surfaces enclose no volume"),
        (FLAT + 3, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]], "1 surfaces enclose no volume"),
    ],
)
def test_what_is_no_solid(vertices: Array, triangles: Rows, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        make_closed_mesh(vertices, triangles)


# --- Normals ------------------------------------------------------------------------------------


def test_a_fine_spheres_normals_are_exact() -> None:
    ball = shapes.sphere(48)
    solid = make_solid(ball.vertices, ball.triangles)
    assert_closed(solid)
    exact = solid.vertices[solid.triangles]
    cosine = np.einsum("fci,fci->fc", solid.corner_normals, exact)
    assert cosine.min() > np.cos(np.radians(2))


def test_a_boxs_normals_are_those_of_its_faces() -> None:
    solid = make_solid(CUBE, CUBE_TRIANGLES)
    expected = face_normals(solid)[:, None].repeat(3, axis=1)
    np.testing.assert_allclose(solid.corner_normals, expected, atol=1e-6)


def test_the_crease_says_what_is_smooth() -> None:
    """A prism of eight sides turns by 45 degrees at its edges and by 90 at its ends."""
    angle = np.radians(45 * np.arange(9) + 22.5)
    angle[-1] = angle[0]
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    up = np.array([0.0, 0.0, 1.0])
    rows = np.stack([ring * 0 + up, ring + up, ring, ring * 0])
    faces = grid_triangles(4, 9)
    sharp, round_, blunt = (
        make_solid(rows.reshape(-1, 3), faces, crease=crease) for crease in (44.0, 46.0, 91.0)
    )
    flat = face_normals(sharp)
    np.testing.assert_allclose(sharp.corner_normals, flat[:, None].repeat(3, axis=1), atol=1e-6)
    side = np.abs(flat[:, 2]) < 0.5
    radial = sharp.vertices[sharp.triangles][side] * [1, 1, 0]
    np.testing.assert_allclose(round_.corner_normals[side], radial, atol=1e-6)
    np.testing.assert_allclose(round_.corner_normals[~side], sharp.corner_normals[~side])
    tilted = np.abs(blunt.corner_normals[side][..., 2])
    assert ((tilted > 0.3) & (tilted < 0.8)).all()


@pytest.mark.parametrize("crease", [-1.0, 181.0, float("nan")])
def test_creases_that_are_no_angle(crease: float) -> None:
    with pytest.raises(ValueError, match=f"crease is {crease} degrees; expected 0 to 180"):
        make_solid(CUBE, CUBE_TRIANGLES, crease=crease)
