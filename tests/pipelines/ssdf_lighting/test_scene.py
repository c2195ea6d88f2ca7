"""Scenes: counts of the paper, closed boxes, positions that can be had back."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.geometry import shapes
from pipelines.geometry.mesh_edges import connected_components, mesh_edges
from pipelines.ssdf_lighting.light.microfacets import Materials, check_materials
from pipelines.ssdf_lighting.scene import (
    SCENES,
    Scene,
    built_in_scene,
    make_scene,
    split_by_part,
)
from pipelines.ssdf_lighting.surface_textures import SurfaceTextures, TexturedMaterial

Floats = NDArray[np.float64]

ONE = Materials(np.full((1, 3), 0.5), np.zeros(1), np.full(1, 0.2))
TWO = Materials(np.full((2, 3), 0.5), np.zeros(2), np.full(2, 0.2))


@pytest.fixture(scope="module")
def court() -> Scene:
    return built_in_scene("court", 10, 16)


def places(scene: Scene) -> Floats:
    return scene.vertices * scene.scale + scene.middle


def check(scene: Scene) -> None:
    """What every scene promises."""
    rows = np.concatenate([scene.vertices, scene.normals.round(4)], axis=1)
    assert len(np.unique(rows, axis=0)) == len(rows)  # doubled only where normals differ
    np.testing.assert_array_equal(np.unique(scene.triangles), np.arange(len(scene.vertices)))
    np.testing.assert_allclose(np.linalg.norm(scene.normals, axis=1), 1, atol=1e-12)
    assert scene.part.shape == (len(scene.triangles),)
    assert set(scene.part.tolist()) == set(range(len(scene.materials.albedo)))
    check_materials(scene.materials)
    low, high = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
    np.testing.assert_allclose(low, -high, atol=1e-9)
    assert np.linalg.norm(scene.vertices, axis=1).max() == pytest.approx(1)


def test_the_teapot_has_as_many_vertices_as_the_papers() -> None:
    """The paper has 12 801 + 4225, the latter 65 x 65. Ours of 20 segments has 12 881
    positions, and some twice, along sharp edges."""
    scene = built_in_scene("teapot", 20, 64)
    check(scene)
    floor = np.unique(scene.triangles[scene.part == 1])
    pot = np.unique(scene.triangles[scene.part == 0])
    assert len(floor) == 65**2
    assert len(np.unique(scene.vertices[pot], axis=0)) == 12_881
    assert len(pot) == 12_918
    assert len(scene.vertices) == len(pot) + len(floor)
    assert len(scene.triangles) - 2 * 64**2 == pytest.approx(2 * 32 * 20**2, rel=0.01)
    np.testing.assert_allclose(scene.normals[floor], [[0, 0, 1]] * len(floor), atol=1e-12)
    assert scene.vertices[pot, 2].min() >= scene.vertices[floor, 2].min() - 1e-9
    assert scene.materials.specular[0] > 0 == scene.materials.specular[1]


def corner_angles(scene: Scene) -> Floats:
    """Degrees between triangles and the normals of their corners, (F, 3)."""
    a, b, c = scene.vertices[scene.triangles].transpose(1, 0, 2)
    face = np.cross(b - a, c - a)
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    cosine = np.einsum("fi,fki->fk", face, scene.normals[scene.triangles])
    angles: Floats = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    return angles


def test_normals_are_smooth_on_round_surfaces_and_not_over_sharp_edges(court: Scene) -> None:
    angles = corner_angles(court)
    np.testing.assert_allclose(angles[court.part < 2], 0, atol=1e-4)  # floor and boxes: flat
    assert 1 < angles[court.part == 2].max() < 20  # the ball
    # A cube: three vertices at each corner; a bent sheet of 30 degrees: one.
    cube = 8 * 3
    corners = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    scene = make_scene(corners, faces, np.zeros(12, int), ONE)
    assert len(scene.vertices) == cube
    assert len(np.unique(scene.vertices, axis=0)) == 8
    for degrees, count in ((30.0, 6), (60.0, 8)):
        turn = np.radians(degrees)
        along = [(-1.0, 0.0), (0.0, 0.0), (np.cos(turn), np.sin(turn))]
        sheet = np.array([[x, y, z] for x, z in along for y in (0.0, 1.0)])
        faces = [(0, 2, 3), (0, 3, 1), (2, 4, 5), (2, 5, 3)]
        assert len(make_scene(sheet, faces, np.zeros(4, int), ONE).vertices) == count


def signed_volume(vertices: Floats, triangles: NDArray[np.integer]) -> float:
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    return float(np.einsum("fi,fi->f", a, np.cross(b, c)).sum() / 6)


def test_walls_of_the_court_are_closed_and_face_outwards(court: Scene) -> None:
    check(court)
    positions, welded = np.unique(court.vertices, axis=0, return_inverse=True)
    vertices = positions * court.scale + court.middle
    walls = welded.reshape(-1)[court.triangles[court.part == 1]].astype(np.int64)
    # The sum over all five boxes, as they are described, whatever vertices they share.
    expected = 0.1 * 0.86 + 0.1 * 0.8 + 1.6 * 0.1 * 0.7 + 0.03 * 1.2 * 0.6 + 0.15 * 0.15 * 1.3
    assert signed_volume(vertices, walls) == pytest.approx(expected, rel=1e-9)
    directed = np.stack([walls, np.roll(walls, -1, axis=1)], axis=-1).reshape(-1, 2)
    there, counts = np.unique(directed, axis=0, return_counts=True)
    back, back_counts = np.unique(directed[:, ::-1], axis=0, return_counts=True)
    np.testing.assert_array_equal(there, back)
    np.testing.assert_array_equal(counts, back_counts)
    piece = connected_components(mesh_edges(walls).pairs() // 3, len(walls))
    for number in range(int(piece.max()) + 1):
        own = walls[piece == number]
        assert signed_volume(vertices - vertices[own[0, 0]], own) > 0
    assert len(np.unique(piece)) == 5
    area = np.linalg.norm(
        np.cross(
            vertices[walls[:, 1]] - vertices[walls[:, 0]],
            vertices[walls[:, 2]] - vertices[walls[:, 0]],
        ),
        axis=1,
    ).sum() / 2  # fmt: skip
    sizes = [(0.1, 0.86, 1), (0.1, 0.8, 1), (1.6, 0.1, 0.7), (0.03, 1.2, 0.6), (0.15, 0.15, 1.3)]
    assert area == pytest.approx(sum(2 * (a * b + b * c + c * a) for a, b, c in sizes), rel=1e-9)


def test_the_court_stands_on_its_floor(court: Scene) -> None:
    vertices = places(court)
    floor = np.unique(court.triangles[court.part == 0])
    np.testing.assert_allclose(vertices[floor, 2], 0, atol=1e-12)
    assert vertices[:, 2].min() == pytest.approx(0, abs=1e-12)
    ball = np.unique(court.triangles[court.part == 2])
    away = np.linalg.norm(vertices[ball] - [0.2, 0.1, 0.35], axis=1)
    np.testing.assert_allclose(away, 0.35, atol=1e-9)
    assert signed_volume(vertices, court.triangles[court.part == 2]) == pytest.approx(
        4 / 3 * np.pi * 0.35**3, rel=0.06
    )


def test_other_scenes_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^scene is 'kitchen'; expected one of teapot, court\.$"):
        built_in_scene("kitchen", 4, 4)
    assert SCENES == ("teapot", "court")


@pytest.mark.parametrize(("size", "away"), [(1.0, 0.0), (1e-4, 7.0), (5e4, -1e6)])
def test_given_positions_can_be_had_back(size: float, away: float) -> None:
    ball = shapes.sphere(8)
    given = ball.vertices * [size, size / 2, size / 3] + away
    scene = make_scene(given, ball.triangles, np.zeros(len(ball.triangles), int), ONE)
    check(scene)
    found = places(scene)
    distance = np.linalg.norm(found[:, None] - given[None], axis=2).min(axis=1)
    assert distance.max() < 1e-9 * max(size, abs(away))
    assert scene.scale == pytest.approx(size, rel=1e-6)
    np.testing.assert_allclose(scene.middle, away, atol=1e-6 * size)


def test_vertices_of_no_triangle_do_not_count() -> None:
    ball = shapes.sphere(8)
    vertices = np.concatenate([ball.vertices, [[1e6, 0, 0]]])
    scene = make_scene(vertices, ball.triangles, np.zeros(len(ball.triangles), int), ONE)
    check(scene)
    assert scene.scale == pytest.approx(1)


def test_triangles_keep_their_part_when_others_are_dropped() -> None:
    """One has no area, one is there twice, one is turned over."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]])
    triangles = [[0, 1, 1], [0, 1, 4], [1, 2, 4], [4, 1, 0], [2, 3, 4], [3, 4, 0]]
    scene = make_scene(corners, triangles, [0, 1, 0, 0, 1, 0], TWO)
    np.testing.assert_array_equal(scene.part, [1, 0, 1, 0])
    np.testing.assert_allclose(scene.normals, [[0, 0, 1]] * 5, atol=1e-12)
    assert len(scene.vertices) == 5
    assert len(scene.notes) >= 3


def test_no_mesh_is_refused() -> None:
    with pytest.raises(ValueError, match="all vertices are at one position"):
        make_scene(np.ones((3, 3)), [[0, 1, 2]], [0], ONE)
    with pytest.raises(ValueError, match="there are no triangles"):
        make_scene(np.ones((3, 3)), np.zeros((0, 3), int), np.zeros(0, int), ONE)
    with pytest.raises(ValueError, match="vertices"):
        make_scene(np.full((3, 3), np.nan), [[0, 1, 2]], [0], ONE)


def test_drawn_vertices_have_one_material_and_make_the_same_triangles(court: Scene) -> None:
    for scene in (court, two_colours()):
        mesh, source = split_by_part(scene)
        np.testing.assert_array_equal(source[mesh.triangles], scene.triangles)
        np.testing.assert_array_equal(
            mesh.object_of_vertex[mesh.triangles], np.repeat(scene.part[:, None], 3, axis=1)
        )
        np.testing.assert_array_equal(mesh.vertices, scene.vertices[source])
        np.testing.assert_array_equal(mesh.normals, scene.normals[source])
        pairs = np.stack([source, mesh.object_of_vertex], axis=1)
        assert len(np.unique(pairs, axis=0)) == len(pairs)
        np.testing.assert_array_equal(np.unique(mesh.triangles), np.arange(len(source)))


def two_colours() -> Scene:
    """A sphere in two halves, which share the vertices of a line."""
    ball = shapes.sphere(8)
    right = (ball.vertices[ball.triangles].mean(axis=1)[:, 0] > 0).astype(int)
    scene = make_scene(ball.vertices, ball.triangles, right, TWO)
    assert len(split_by_part(scene).source) > len(scene.vertices)
    return scene


def test_textures_stay_where_they_are_through_repair_and_refinement() -> None:
    """Corners know their place in the texture: here it is their own position, x and y."""
    flat = shapes.square(3)
    triangles = flat.triangles.copy()
    triangles[4] = triangles[4, ::-1]  # turned over: the repair turns it back
    triangles = np.concatenate([triangles[:2], [[0, 0, 1]], triangles[2:], triangles[:1]])
    places = flat.vertices[triangles][..., None, :2].repeat(2, axis=2).astype(np.float32)
    colours = (flat.vertices[triangles] + 0.5).astype(np.float32)
    material = TexturedMaterial(0, (1.0, 1.0, 1.0), 0.0, (0.0, 0.0, 0.0), 1.0)
    textures = SurfaceTextures(places, colours, (material,))
    part = np.zeros(len(triangles), int)
    for longest in (np.inf, 0.2):
        scene = make_scene(flat.vertices, triangles, part, ONE, textures, longest)
        assert scene.textures is not None
        given = scene.vertices * scene.scale + scene.middle
        np.testing.assert_allclose(
            scene.textures.uvs[:, :, 1], given[scene.triangles][..., :2], atol=1e-6
        )
        np.testing.assert_allclose(scene.textures.colours, given[scene.triangles] + 0.5, atol=1e-6)
        mesh, source = split_by_part(scene)
        assert mesh.textures is not None
        assert (np.diff(source) >= 0).all()  # as whoever knows the distances needs them
        np.testing.assert_array_equal(mesh.vertices, scene.vertices[source])
        drawn = mesh.vertices * scene.scale + scene.middle
        np.testing.assert_allclose(mesh.textures.uvs[:, 0], drawn[:, :2], atol=1e-6)


def test_a_seam_of_the_texture_doubles_drawn_vertices_only() -> None:
    flat = shapes.square(1)
    uvs = np.zeros((2, 3, 2, 2), np.float32)
    uvs[1] = 0.5
    material = TexturedMaterial(0, (1.0, 1.0, 1.0), 0.0, (0.0, 0.0, 0.0), 1.0)
    textures = SurfaceTextures(uvs, np.ones((2, 3, 3), np.float32), (material,))
    scene = make_scene(flat.vertices, flat.triangles, [0, 0], ONE, textures)
    assert len(scene.vertices) == 4
    assert len(split_by_part(scene).source) == 6
