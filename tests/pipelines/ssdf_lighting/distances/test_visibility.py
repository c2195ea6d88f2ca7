"""Visibility against known horizons: convex bodies, half spaces, contacts, sheets, gaps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.geometry import shapes
from pipelines.geometry.meshes import vertex_normals
from pipelines.geometry.rays import build_scene
from pipelines.ssdf_lighting.distances.octahedral import texel_directions
from pipelines.ssdf_lighting.distances.visibility import (
    RayOrigins,
    ray_origins,
    scene_visibility,
    stand_ins_for_buried,
    unpacked,
    visible_directions,
)
from pipelines.ssdf_lighting.light.microfacets import Materials
from pipelines.ssdf_lighting.scene import Scene, built_in_scene, make_scene

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]
Mesh = tuple[Floats, Ints]

N = 16
WAYS = texel_directions(N)
LEVEL = 1e-3
"""Directions nearer than this to a horizon are left to either side: some texels lie on it."""


class Seen(NamedTuple):
    """A scene, where its vertices were, what they see, what is stored for them."""

    scene: Scene
    places: Floats
    origins: RayOrigins
    visible: Bools
    stored: NDArray[np.int64]


def look(*meshes: Mesh) -> Seen:
    starts = np.cumsum([0, *(len(mesh[0]) for mesh in meshes)])
    triangles = [mesh[1] + start for mesh, start in zip(meshes, starts[:-1], strict=True)]
    part = np.repeat(np.arange(len(meshes)), [len(mesh[1]) for mesh in meshes])
    count = len(meshes)
    materials = Materials(np.full((count, 3), 0.5), np.zeros(count), np.full(count, 0.2))
    return look_around(
        make_scene(
            np.concatenate([mesh[0] for mesh in meshes]),
            np.concatenate(triangles),
            part,
            materials,
        )
    )


def look_around(scene: Scene) -> Seen:
    rays = build_scene(scene.vertices, scene.triangles)
    around = scene.vertices, scene.triangles, scene.normals
    origins = ray_origins(rays, *around)
    visible = visible_directions(rays, origins, WAYS)
    stored = stand_ins_for_buried(rays, *around, origins, visible.mean(axis=1), WAYS)
    places = scene.vertices * scene.scale + scene.middle
    return Seen(scene, places, origins, visible, stored)


def plane(low: Sequence[float], high: Sequence[float], z: float, segments: int) -> Mesh:
    """Facing up."""
    flat = shapes.square(segments)
    size = np.array([high[0] - low[0], high[1] - low[1]])
    at = (flat.vertices[:, :2] + 0.5) * size + low
    return np.concatenate([at, np.full((len(at), 1), z)], axis=1), flat.triangles


def box(low: Sequence[float], high: Sequence[float], segments: int) -> Mesh:
    """Closed; corners of all six sides are doubled."""
    flat = shapes.square(segments)
    sides, faces = [], []
    for axis in range(3):
        for end in (0.0, 1.0):
            side = np.empty_like(flat.vertices)
            side[:, [(axis + 1) % 3, (axis + 2) % 3]] = flat.vertices[:, :2] + 0.5
            side[:, axis] = end
            turned = flat.triangles if end else flat.triangles[:, ::-1]
            faces.append(turned + len(flat.vertices) * len(sides))
            sides.append(side)
    return np.concatenate(sides) * (np.array(high) - low) + low, np.concatenate(faces)


def tube(start: float, end: float, radius: float, rings: int, around: int = 16) -> Mesh:
    """Along the x axis, facing outwards; open at both ends."""
    x, turn = np.meshgrid(
        np.linspace(start, end, rings), np.arange(around) * 2 * np.pi / around, indexing="ij"
    )
    vertices = np.stack([x, radius * np.cos(turn), radius * np.sin(turn)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    a, b = i * around + j, i * around + (j + 1) % around
    quads = np.stack([a, b, a + around, b, b + around, a + around], -1)
    return vertices, quads.reshape(-1, 3).astype(np.int32)


def facing(seen: Seen, normal: Sequence[float]) -> Bools:
    """Vertices of a flat side: along sharp edges each side has its own."""
    found: Bools = seen.scene.normals @ np.array(normal) > 0.99
    return found


def above(normal: Sequence[float]) -> tuple[Bools, Bools]:
    """Directions surely above a horizon, and surely below it."""
    cosine = WAYS @ np.array(normal)
    return cosine > LEVEL, cosine < -LEVEL


# ---- open surfaces ---------------------------------------------------------------------------


def test_a_convex_body_sees_what_is_above_its_facets() -> None:
    """All that is above the planes of all triangles at a vertex is seen; what is below them all is
    not; and the horizon is within a facet's angle of the tangent plane."""
    ball = shapes.sphere(24)
    seen = look((ball.vertices, ball.triangles))
    a, b, c = seen.scene.vertices[seen.scene.triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    height = normals @ WAYS.T
    for vertex in range(0, len(seen.places), 7):
        own = height[(seen.scene.triangles == vertex).any(axis=1)]
        assert seen.visible[vertex][(own > LEVEL).all(axis=0)].all()
        assert not seen.visible[vertex][(own < -LEVEL).all(axis=0)].any()
    cosine = seen.scene.vertices @ WAYS.T  # of unit length: the sphere's own normals
    facet = np.sin(np.pi / 24)
    assert seen.visible[cosine > facet].all()
    assert not seen.visible[cosine < -facet].any()
    assert not seen.origins.sealed.any()
    np.testing.assert_array_equal(seen.stored, np.arange(len(seen.places)))


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize("segments", [1, 7, 60])
def test_a_vertex_on_a_floor_sees_half_of_all(segments: int, size: float) -> None:
    seen = look(plane((-size, -size), (size, size), 0.0, segments))
    inner = (np.abs(seen.places[:, :2]) < 0.999 * size).all(axis=1)
    over, under = above((0, 0, 1))
    assert seen.visible[:, over].all()
    assert not seen.visible[inner][:, under].any()
    assert not seen.origins.sealed.any()


def test_origins_lie_on_the_outer_side_and_near() -> None:
    ball = shapes.sphere(16)
    seen = look((ball.vertices, ball.triangles))
    offset = seen.origins.points - seen.scene.vertices
    height = np.einsum("vi,vi->v", offset, seen.scene.normals)
    edge = np.pi / 16
    assert (height > 1e-6).all()
    assert (np.linalg.norm(offset, axis=1) < 1e-3 * edge).all()


@pytest.mark.parametrize(
    ("scale", "away"),
    [(1e-3, 0.0), (1e5, 0.0), (1.0, 1e6), (0.02, 3e3)],
)
def test_neither_size_nor_place_change_what_is_seen(scale: float, away: float) -> None:
    meshes = [box((0, 0, 0), (1, 1, 1), 3), box((1.5, 0.2, 0), (2, 1, 2), 3)]
    expected = look(*meshes)
    moved = [(vertices * scale + [away, -away, away / 2], faces) for vertices, faces in meshes]
    found = look(*moved)
    np.testing.assert_allclose(found.scene.vertices, expected.scene.vertices, atol=1e-6)
    assert (found.visible != expected.visible).mean() < 2e-3  # directions along edges
    np.testing.assert_array_equal(found.origins.sealed, expected.origins.sealed)


# ---- contacts --------------------------------------------------------------------------------


@pytest.mark.parametrize("segments", [2, 3, 4, 5, 7])
def test_a_box_on_a_floor_neither_leaks_nor_shadows_itself(segments: int) -> None:
    """Its foot stands in the floor's plane, its underside on it: whatever is seen from there is
    above the floor. What the box covers of the floor has stand-ins; of its underside nothing is
    open, it stays dark."""
    seen = look(
        plane((-2, -2), (2, 2), 0.0, 9), box((-0.47, -0.53, 0.0), (0.5, 0.511, 1.0), segments)
    )
    low = np.abs(seen.places[:, 2]) < 1e-9
    inner = low & (np.abs(seen.places[:, :2]) < 1.9).all(axis=1)
    _, under = above((0, 0, 1))
    stored = seen.visible[seen.stored]
    assert not stored[inner][:, under].any()
    covered = low & (np.abs(seen.places[:, :2]) < 0.46).all(axis=1)
    assert covered.sum() > 4
    assert not seen.visible[covered].any()
    on_floor = facing(seen, (0, 0, 1))
    assert (stored[covered & on_floor].mean(axis=1) > 0.05).all()
    assert not seen.visible[low & facing(seen, (0, 0, -1))].any()
    assert not seen.origins.sealed[~low].any()
    # Walls see their half of the sky above the floor; on the foot, too.
    wall = np.isclose(seen.places[:, 0], 0.5) & (np.abs(seen.places[:, 1]) < 0.5)
    wall &= (seen.places[:, 2] < 0.99) & facing(seen, (1, 0, 0))
    assert wall.sum() >= (segments - 1) * segments
    out, _ = above((1, 0, 0))
    up, _ = above((0, 0, 1))
    assert stored[wall][:, out & up].all()
    assert not stored[wall][:, above((1, 0, 0))[1]].any()


@pytest.mark.parametrize("segments", [3, 4, 5, 6])
@pytest.mark.parametrize("foot", [0.0, -0.2])
def test_where_a_wall_meets_vertices_of_the_floor_both_see_their_open_side(
    foot: float, segments: int
) -> None:
    """Vertices of the floor lie in the planes of the walls, and (sunk, of five or six segments)
    vertices of the walls in that of the floor: whatever starts there starts on a surface."""
    seen = look(
        plane((-2, -2), (2, 2), 0.0, 16), box((-0.5, -0.5, foot), (0.5, 0.5, 1.0), segments)
    )
    stored = seen.visible[seen.stored]
    at = np.abs(seen.places)
    rim = (at[:, 2] < 1e-9) & np.isclose(at[:, :2].max(axis=1), 0.5)
    rim &= at[:, :2].min(axis=1) < 0.45
    floor = rim & facing(seen, (0, 0, 1))
    assert floor.sum() >= 12
    assert not stored[floor][:, above((0, 0, 1))[1]].any()
    # Open is the quarter of the sphere that is above both; behind the wall nothing is.
    for vertex in np.flatnonzero(floor):
        side = np.zeros(3)
        axis = int(at[vertex, :2].argmax())
        side[axis] = np.sign(seen.places[vertex, axis])
        out, back = above(side.tolist())
        assert stored[vertex][out & above((0, 0, 1))[0]].all()
        assert not stored[vertex][back].any()
        assert seen.stored[vertex] == vertex


@pytest.mark.parametrize("segments", [(4, 6), (3, 5), (4, 4)])
def test_boxes_that_touch_hide_the_contact_and_nothing_else(segments: tuple[int, int]) -> None:
    seen = look(box((-1, 0, 0), (0, 1, 1), segments[0]), box((0, 0, 0), (1, 1, 1), segments[1]))
    contact = np.abs(seen.places[:, 0]) < 1e-9
    inner = contact & (np.abs(seen.places[:, 1:] - 0.5) < 0.499).all(axis=1)
    assert not seen.visible[inner].any()
    for axis in (1, 2):  # the sides around it: one flat surface, over the seam
        for end in (-1, 1):
            flat = np.isclose(seen.places[:, axis], (end + 1) / 2)
            other = 3 - axis
            flat &= np.abs(seen.places[:, other] - 0.5) < 0.499
            flat &= np.abs(seen.places[:, 0]) < 0.999
            normal = [0.0, 0.0, 0.0]
            normal[axis] = float(end)
            flat &= facing(seen, normal)
            over, under = above(normal)
            assert flat.any()
            assert seen.visible[flat][:, over].all()
            assert not seen.visible[flat][:, under].any()


@pytest.mark.parametrize("thickness", [1e-2, 1e-3, 1e-4, 2e-5])
def test_a_thin_sheet_hides_what_is_behind_it(thickness: float) -> None:
    seen = look(box((-1, -1, 0), (1, 1, thickness), 8))
    inner = (np.abs(seen.places[:, :2]) < 0.999).all(axis=1)
    for side, normal in [(thickness, (0, 0, 1)), (0.0, (0, 0, -1))]:
        there = inner & (np.abs(seen.places[:, 2] - side) < thickness / 4)
        over, under = above(normal)
        assert there.sum() == 49
        assert seen.visible[there][:, over].all()
        assert not seen.visible[there][:, under].any()
    assert not seen.origins.sealed.any()


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 2e-5, 6e-6])
def test_from_a_thin_gap_nothing_is_seen_but_along_it(gap: float) -> None:
    """Thinner than the usual height of the origins (1e-4 of the edges, or about 2e-5 here)."""
    seen = look(box((-1, -1, -1), (1, 1, 0), 8), box((-1.5, -1.5, gap), (1.5, 1.5, 1), 11))
    inside = (np.abs(seen.places[:, :2]) < 0.8).all(axis=1)
    lower = inside & (np.abs(seen.places[:, 2]) < gap / 4)
    upper = inside & (np.abs(seen.places[:, 2] - gap) < gap / 4)
    steep = np.abs(WAYS[:, 2]) > 10 * gap / 0.2 + LEVEL
    for there, level in [(lower, 0.0), (upper, gap)]:
        assert there.sum() >= 36
        assert not seen.visible[there][:, steep].any()
        assert not seen.origins.sealed[there].any()
        height = seen.origins.points[there, 2] * seen.scene.scale + seen.scene.middle[2] - level
        assert (np.abs(height) < gap).all()
    # The opposite of the gap: the lower box' other sides see as ever.
    bottom = (np.abs(seen.places[:, 2] + 1) < 1e-9) & inside
    assert seen.visible[bottom][:, above((0, 0, -1))[0]].all()


def test_what_is_covered_on_all_sides_is_sealed_and_sees_nothing() -> None:
    """A plate that fills a slot in all three directions but its outline."""
    seen = look(box((-1, -1, -1), (1, 1, 0), 4), box((-1, -1, 0), (1, 1, 1), 5))
    inner = (np.abs(seen.places[:, 2]) < 1e-9) & (np.abs(seen.places[:, :2]) < 0.99).all(axis=1)
    middle = inner & (np.abs(seen.places[:, :2]).max(axis=1) > 1e-9)
    assert middle.sum() > 16
    assert seen.origins.sealed[middle].all()
    assert not seen.visible[middle].any()
    outward = np.einsum("vi,vi->v", seen.places, seen.scene.normals) > 0.5
    assert outward.sum() > 100
    assert not seen.origins.sealed[outward].any()
    assert (seen.visible[outward].mean(axis=1) > 0.4).all()


def test_sealed_origins_see_nothing_whatever_the_rays_say() -> None:
    ball = shapes.sphere(8)
    rays = build_scene(ball.vertices, ball.triangles)
    origins = RayOrigins(np.float32([[0, 0, 5], [0, 0, 5]]), np.array([False, True]))
    seen = visible_directions(rays, origins, WAYS)
    assert seen[0].mean() > 0.9
    assert not seen[1].any()


def test_no_vertex_of_the_court_sees_the_sky_through_its_floor() -> None:
    """Walls that stand on the floor and touch each other, a ball that touches it in one point."""
    seen = look_around(built_in_scene("court", 8, 40))
    low = (np.abs(seen.places[:, :2]) < 1.95).all(axis=1) & (np.abs(seen.places[:, 2]) < 1e-9)
    low &= ~facing(seen, (0, 0, -1))  # undersides, which stand on the floor: nobody sees them
    assert low.sum() > 800
    _, under = above((0, 0, 1))
    assert not seen.visible[seen.stored][low][:, under].any()


# ---- stand-ins -------------------------------------------------------------------------------


def test_buried_vertices_take_what_the_nearest_open_one_sees() -> None:
    """A tube that runs into a ball: its rings inside take the sky of the last ring outside."""
    ball = shapes.sphere(24)
    pipe = tube(0.3, 2.0, 0.2, 18)
    seen = look((ball.vertices, ball.triangles), pipe)
    on_pipe = np.isclose(np.hypot(seen.places[:, 1], seen.places[:, 2]), 0.2, atol=1e-6)
    on_pipe &= np.abs(np.linalg.norm(seen.places, axis=1) - 1) > 1e-3
    deep = on_pipe & (np.linalg.norm(seen.places, axis=1) < 0.95)
    out = on_pipe & (np.linalg.norm(seen.places, axis=1) > 1.05)
    assert deep.sum() >= 5 * 16
    assert not seen.visible[deep].any()
    own = np.arange(len(seen.places))
    np.testing.assert_array_equal(seen.stored[out], own[out])
    chosen = seen.stored[deep]
    assert (np.linalg.norm(seen.places[chosen], axis=1) > 0.98).all()
    assert on_pipe[chosen].all()  # along the surface, not across
    assert (seen.visible[chosen].mean(axis=1) > 0.05).all()
    # Straight along the tube, to the first ring that is outside.
    across = seen.places[deep][:, 1:] - seen.places[chosen][:, 1:]
    assert np.abs(across).max() < 0.1
    # The ball's own vertices outside the tube keep what they see.
    np.testing.assert_array_equal(
        seen.stored[~on_pipe & (seen.places[:, 0] < 0.9)],
        own[~on_pipe & (seen.places[:, 0] < 0.9)],
    )


def test_dark_corners_that_are_not_inside_keep_what_they_see() -> None:
    """At the bottom of a deep well: next to no sky, but nothing is seen from behind."""
    wall = 0.2
    walls = [
        box((-1 - wall, -1 - wall, 0), (-1, 1 + wall, 8), 4),
        box((1, -1 - wall, 0), (1 + wall, 1 + wall, 8), 4),
        box((-1, -1 - wall, 0), (1, -1, 8), 4),
        box((-1, 1, 0), (1, 1 + wall, 8), 4),
    ]
    seen = look(plane((-1, -1), (1, 1), 0.5, 6), *walls)
    bottom = np.isclose(seen.places[:, 2], 0.5) & (np.abs(seen.places[:, :2]) < 0.9).all(axis=1)
    assert bottom.sum() == 25
    assert (seen.visible[bottom].mean(axis=1) < 0.05).all()
    np.testing.assert_array_equal(seen.stored[bottom], np.flatnonzero(bottom))


def test_where_all_or_none_are_buried_each_keeps_its_own() -> None:
    ball = shapes.sphere(8)
    around = ball.vertices, ball.triangles, vertex_normals(ball.vertices, ball.triangles)
    rays = build_scene(ball.vertices, ball.triangles)
    origins = ray_origins(rays, *around)
    count = len(ball.vertices)
    for sealed in (np.zeros(count, bool), np.ones(count, bool)):
        given = RayOrigins(origins.points, sealed)
        share = np.where(sealed, 0.0, 0.5)
        found = stand_ins_for_buried(rays, *around, given, share, WAYS)
        np.testing.assert_array_equal(found, np.arange(count))


# ---- whole scenes ------------------------------------------------------------------------------


def test_a_scene_by_blocks_is_what_its_vertices_see() -> None:
    """The court has vertices where its walls stand on the floor: their stand-ins' rows."""
    seen = look_around(built_in_scene("court", 6, 16))
    scene, told = seen.scene, list[float]()
    found = scene_visibility(scene.vertices, scene.triangles, scene.normals, N, told.append)
    np.testing.assert_array_equal(found.stored, seen.stored)
    assert found.buried == (seen.stored != np.arange(len(seen.stored))).sum() > 0
    assert found.sealed == seen.origins.sealed.sum()
    np.testing.assert_array_equal(unpacked(found.visible, N * N), seen.visible[seen.stored])
    np.testing.assert_array_equal(found.origins.points, seen.origins.points[seen.stored])
    np.testing.assert_array_equal(found.origins.sealed, seen.origins.sealed[seen.stored])
    assert told == sorted(told)
    assert len(told) > 1
