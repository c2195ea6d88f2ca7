"""Closed meshes, their orientation and normals; the plate and the glass teapot."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from pipelines.geometry import shapes
from pipelines.geometry.rays import FirstHits, build_scene, first_hits
from pipelines.geometry.solids import Solid, check_closed, glass_teapot, make_solid, plate

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


def volume(vertices: Array, triangles: NDArray[np.integer]) -> float:
    return float(np.linalg.det(vertices[triangles]).sum() / 6)


def face_normals(solid: Solid) -> Array:
    a, b, c = np.moveaxis(solid.vertices[solid.triangles], 1, 0)
    normals: Array = np.cross(b - a, c - a)
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


@cache
def teapot() -> Solid:
    return glass_teapot()


def cast(solid: Solid, origins: Array, directions: Array) -> FirstHits:
    return first_hits(build_scene(solid.vertices, solid.triangles), origins, directions)


def on_sphere(count: int, seed: int, radius: float = 1.0) -> Array:
    points = np.random.default_rng(seed).normal(size=(count, 3))
    scaled: Array = radius * points / np.linalg.norm(points, axis=1, keepdims=True)
    return scaled


# --- Closed meshes ------------------------------------------------------------------------------


def test_a_closed_mesh_is_kept() -> None:
    mesh = check_closed(CUBE, CUBE_TRIANGLES)
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], CUBE[CUBE_TRIANGLES])
    assert mesh.triangles.dtype == np.int32


def test_a_mesh_inside_out_is_turned_and_keeps_its_order() -> None:
    mesh = check_closed(CUBE, INSIDE_OUT)
    assert volume(*mesh) == pytest.approx(1)
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], CUBE[INSIDE_OUT[:, [0, 2, 1]]])


def test_triangles_that_disagree_are_turned() -> None:
    for seed in range(8):
        mixed = CUBE_TRIANGLES.copy()
        over = np.random.default_rng(seed).random(12) < 0.5
        mixed[over] = mixed[over][:, ::-1]
        mesh = check_closed(CUBE + 10, mixed)
        assert volume(*mesh) == pytest.approx(1)
        assert_closed(make_solid(CUBE + 10, mixed))


def test_seams_are_welded_and_what_is_no_surface_is_dropped() -> None:
    split = CUBE[CUBE_TRIANGLES].reshape(-1, 3)
    split[split == 0] *= -1  # -0.0 is 0.0
    split = np.concatenate([split[::-1] * -1 + 1, [[9.0, 9.0, 9.0]]])  # and one vertex unused
    triangles = np.concatenate([np.arange(36).reshape(-1, 3), [[4, 4, 5]]])
    mesh = check_closed(split, triangles)
    assert mesh.vertices.shape == (8, 3)
    assert mesh.triangles.shape == (12, 3)
    assert volume(*mesh) == pytest.approx(1)


@pytest.mark.parametrize("turned", list(itertools.product((False, True), repeat=2)))
def test_a_cavity_faces_into_the_cavity(turned: tuple[bool, bool]) -> None:
    mesh = check_closed(*cubes((0, 2), (0.5, 1), turned=turned))
    assert volume(*mesh) == pytest.approx(4**3 - 2**3)


def test_surfaces_face_by_turns_however_deep_they_lie() -> None:
    """A ball in the cavity of a ball, a second cavity, and a neighbour in the outer one's box."""
    nested = ((0, 4), (-2, 1.5), (-2, 1), (2, 1), (9, 1))
    for seed in range(4):
        turned = tuple(bool(over) for over in np.random.default_rng(seed).random(5) < 0.5)
        mesh = check_closed(*cubes(*nested, turned=turned))
        assert volume(*mesh) == pytest.approx(8**3 - 3**3 + 2**3 - 2**3 + 2**3)


def test_a_surface_in_anothers_box_but_outside_is_no_cavity() -> None:
    """A ball amid a ring, which winds around it, but not in the glass."""
    around, along = np.meshgrid(*2 * [np.linspace(0, 2 * np.pi, 25)], indexing="ij")
    radius = 2 + 0.5 * np.cos(along)
    ring = np.stack([radius * np.cos(around), radius * np.sin(around), np.sin(along) / 2], axis=-1)
    ring[-1], ring[:, -1] = ring[0], ring[:, 0]
    faces = shapes.grid_triangles(25, 25)
    hull = check_closed(ring.reshape(-1, 3), faces)
    vertices, cube = cubes((0, 0.3), turned=(True,))
    both = check_closed(
        np.concatenate([ring.reshape(-1, 3), vertices]), np.concatenate([faces, cube + 625])
    )
    assert volume(*both) == pytest.approx(volume(*hull) + 0.6**3)
    assert volume(*hull) == pytest.approx(2 * np.pi**2 * 2 * 0.5**2, rel=0.04)


def test_open_meshes_are_refused() -> None:
    open_teapot = shapes.teapot(4)
    with pytest.raises(ValueError, match=r"open along 64 border edges; expected two triangles"):
        check_closed(open_teapot.vertices, open_teapot.triangles)
    with pytest.raises(ValueError, match="open along 3 border edges"):
        check_closed(CUBE, CUBE_TRIANGLES[:-1])


def test_a_fin_is_refused() -> None:
    vertices = np.concatenate([CUBE, [[2.0, 2.0, 2.0]]])
    with pytest.raises(ValueError, match=r"1 edges are in more than two triangles"):
        check_closed(vertices, np.concatenate([CUBE_TRIANGLES, [[*CUBE_TRIANGLES[0, :2], 8]]]))


def test_cubes_that_touch_along_an_edge_are_refused() -> None:
    vertices = np.concatenate([CUBE, CUBE + np.array([1, 1, 0])])
    with pytest.raises(ValueError, match=r"1 edges are in more than two"):
        check_closed(vertices, np.concatenate([CUBE_TRIANGLES, CUBE_TRIANGLES + 8]))


def test_a_klein_bottle_is_refused() -> None:
    n = 6
    row, column = np.divmod(np.arange((n + 1) * (n + 1)), n + 1)
    last = row == n  # joined to the first row, mirrored
    number = np.where(last, (-column) % n, row * n + column % n)
    faces = number[shapes.grid_triangles(n + 1, n + 1)]
    vertices = np.random.default_rng(0).random((n * n, 3))
    with pytest.raises(ValueError, match="1 of 1 surfaces have one side only"):
        check_closed(vertices, faces)


@pytest.mark.parametrize(
    ("vertices", "triangles", "reason"),
    [
        (CUBE, CUBE_TRIANGLES[:0], "no triangles"),
        (CUBE, [[0, 1, 8]], "vertices 0 to 8"),
        (CUBE * 0, CUBE_TRIANGLES, "no triangle has three corners apart"),
        (CUBE + 3, [[0, 1, 2], [0, 2, 1]], "1 of 1 surfaces enclose no volume"),
        (CUBE, [[0, 1, 2], [0, 2, 1]], "1 of 1 surfaces enclose no volume"),
    ],
)
def test_what_is_no_solid(vertices: Array, triangles: Rows, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        check_closed(vertices, triangles)


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
    faces = shapes.grid_triangles(4, 9)
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


# --- Plate --------------------------------------------------------------------------------------


def test_the_plate_stands_upright() -> None:
    solid = plate(3.0, 2.0, 0.25)
    assert_closed(solid)
    assert solid.triangles.shape == (12, 3)
    assert volume(solid.vertices, solid.triangles) == pytest.approx(3.0 * 2.0 * 0.25)
    np.testing.assert_allclose(solid.vertices.max(axis=0), [1.5, 0.125, 1.0])
    np.testing.assert_allclose(solid.vertices.min(axis=0), [-1.5, -0.125, -1.0])
    hit = cast(solid, np.array([[0.1, -5, 0.2], [0.1, 5, 0.2]]), np.array([[0, 1, 0], [0, -1, 0]]))
    np.testing.assert_allclose(hit.distance, 5 - 0.125, rtol=1e-6)
    np.testing.assert_allclose(
        solid.corner_normals[hit.triangle, 0], [[0, -1, 0], [0, 1, 0]], atol=1e-6
    )


@pytest.mark.parametrize("size", [(0, 1, 1), (1, -1, 1), (1, 1, float("inf"))])
def test_plates_without_size(size: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="expected positive, finite lengths"):
        plate(*size)


# --- Teapot -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("segments", "thickness"), [(4, 0.035), (5, 0.02), (8, 0.005), (8, 0.08), (12, 0.035)]
)
def test_the_teapot_is_one_closed_surface(segments: int, thickness: float) -> None:
    solid = glass_teapot(segments, thickness)
    assert_closed(solid)
    assert volume(solid.vertices, solid.triangles) > thickness
    # V - E + F = 0: a ring, which the handle makes it; the hollow is open through the spout.
    assert len(solid.vertices) == len(solid.triangles) / 2
    alone = check_closed(solid.vertices, solid.triangles)
    np.testing.assert_array_equal(alone.triangles, solid.triangles)


def test_each_teapot_is_the_same() -> None:
    for ours, again in zip(teapot(), glass_teapot(), strict=True):
        np.testing.assert_array_equal(ours, again)


def test_the_glass_teapot_looks_like_the_teapot_from_outside() -> None:
    origins, targets = on_sphere(20_000, 1, radius=3.0), on_sphere(20_000, 2, radius=0.5)
    pot = shapes.teapot(12)
    directions = targets - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    there = first_hits(build_scene(pot.vertices, pot.triangles), origins, directions).distance
    here = cast(teapot(), origins, directions).distance
    assert ((there < np.inf) == (here < np.inf)).mean() > 0.998
    hit = (there < np.inf) & (here < np.inf)
    assert hit.mean() > 0.5
    # Not those that look through the gap around the lid or into the spout.
    assert (np.abs(there[hit] - here[hit]) < 0.01).mean() > 0.98


@pytest.mark.parametrize("thickness", [0.02, 0.035, 0.06])
def test_walls_are_as_thick_as_asked(thickness: float) -> None:
    """Along the normals of the body, all around but at the handle and the spout."""
    solid = glass_teapot(12, thickness)
    azimuth = np.radians(np.concatenate([np.arange(35, 146), np.arange(215, 326)]))
    across = np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=-1)
    axis = np.array([-shapes.TEAPOT_CENTRE[0], 0, 0])
    for height in (-0.3, -0.2, 0.0, 0.15):
        outer = cast(solid, axis + across * 2 + [0, 0, height], -across)
        inwards = -face_normals(solid)[outer.triangle]
        surface = axis + across * (2 - outer.distance[:, None]) + [0, 0, height]
        inner = cast(solid, surface + 1e-3 * inwards, inwards)
        wall = inner.distance + 1e-3
        assert np.abs(wall / thickness - 1).max() < 0.25
        assert (np.einsum("ni,ni->n", face_normals(solid)[inner.triangle], inwards) > 0.9).all()


def test_bottom_lid_knob_and_handle() -> None:
    """What a plumb line and a level one through the handle meet."""
    solid = teapot()

    def crossings(origin: tuple[float, float, float], direction: tuple[int, int, int]) -> Array:
        found: list[float] = []
        passed = 0.0
        way = np.array([direction], np.float64)
        while True:
            hit = cast(solid, np.array([origin]) + passed * way, way).distance[0]
            if not np.isfinite(hit):
                return np.array(found)
            passed += float(hit) + 1e-4
            found.append(passed)

    middle = -float(shapes.TEAPOT_CENTRE[0])
    knob = np.diff(crossings((middle + 1e-3, 2e-3, 2.0), (0, 0, -1)))
    assert len(knob) == 3  # glass from the knob's top to the lid's underside, hollow, bottom
    assert knob[0] == pytest.approx(0.17, abs=0.03)
    assert knob[2] == pytest.approx(0.035, rel=0.1)
    lid = np.diff(crossings((middle + 0.2, 2e-3, 2.0), (0, 0, -1)))
    assert len(lid) == 3
    assert lid[0] == pytest.approx(0.035, rel=0.1)
    handle = np.diff(crossings((-2.0, 1e-3, 0.0), (1, 0, 0)))
    assert handle[0] == pytest.approx(0.1, abs=0.03)


def test_light_enters_the_hollow_through_the_spout() -> None:
    """Down the channel and around its bend, not through glass: down from the lip, each step
    sees the next."""
    scale = 3.34029113
    newell = np.array([[3.05, 0, 2.6], [2.95, 0, 2.38], [2.75, 0, 2.2], [2.57, 0, 1.8]])
    newell = np.concatenate([newell, [[2.4, 0, 1.4], [2.0, 0, 1.05], [0.0, 0, 1.0]]])
    path = newell / scale - shapes.TEAPOT_CENTRE
    ways = np.diff(path, axis=0)
    assert (cast(teapot(), path[:-1], ways).distance > 1).all()


def test_rays_enter_and_leave_by_turns() -> None:
    solid = teapot()
    scene = build_scene(solid.vertices, solid.triangles)
    normals = face_normals(solid)
    origins, targets = on_sphere(20_000, 3, radius=2.0), on_sphere(20_000, 4, radius=0.6)
    ways = targets - origins
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    inside = np.zeros(len(origins), bool)
    right = np.ones(len(origins), bool)
    crossed = 0
    here, alive = origins.copy(), np.arange(len(origins))
    while len(alive):
        hit = first_hits(scene, here[alive], ways[alive])
        met = np.isfinite(hit.distance)
        right[alive[~met]] &= ~inside[alive[~met]]  # a line that ends has left
        alive = alive[met]
        crossed += len(alive)
        leaves = np.einsum("ni,ni->n", ways[alive], normals[hit.triangle[met]]) > 0
        right[alive] &= leaves == inside[alive]
        inside[alive] = ~leaves
        here[alive] += ways[alive] * (hit.distance[met, None] + 2e-6)
    assert crossed > 2 * len(origins)
    assert (~right).mean() < 0.002


def test_the_teapots_normals_are_smooth_but_where_parts_meet() -> None:
    solid = teapot()
    normals, faces = solid.corner_normals.astype(np.float64), face_normals(solid)
    agreement = np.einsum("fci,fi->fc", normals, faces)
    assert agreement.min() > 0.7  # never turned away, on the slivers along the seams neither
    start, end = solid.triangles, np.roll(solid.triangles, -1, axis=1)
    corner = np.stack([start.ravel(), end.ravel()], axis=-1)
    order = np.lexsort(np.sort(corner, axis=1).T)
    first, second = order[::2], order[1::2]  # half-edges: this one's start is the other's end
    follower = 3 * (second // 3) + (second + 1) % 3
    flat = normals.reshape(-1, 3)
    jump = np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", flat[first], flat[follower]), -1, 1)))
    length = np.linalg.norm(
        solid.vertices[corner[first, 0]] - solid.vertices[corner[first, 1]], axis=1
    )
    creased = jump > 1
    assert creased.any()
    assert jump[creased].min() > 5
    # The groove's two edges, the hollow's corners below it, and where parts meet: about 20 long.
    assert 10 < length[creased].sum() < 25
    assert length[creased].sum() / length.sum() < 0.05


@pytest.mark.parametrize(
    ("segments", "thickness", "reason"),
    [
        (3, 0.035, "segments is 3; expected at least 4"),
        (8, 0.004, "thickness is 0.004 radii; expected 0.005 to 0.08"),
        (8, float("nan"), "thickness is nan"),
    ],
)
def test_teapots_that_cannot_be_blown(segments: int, thickness: float, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        glass_teapot(segments, thickness)
