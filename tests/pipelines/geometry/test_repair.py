"""Repaired meshes against what they were made from, and against brute force over small ones."""

from __future__ import annotations

from collections import defaultdict
from functools import cache
from itertools import combinations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.geometry import repair as repairing
from pipelines.geometry import shapes
from pipelines.geometry.repair import RepairedMesh, repair_mesh
from pipelines.geometry.solid_shapes import glass_teapot
from pipelines.geometry.solids import make_closed_mesh

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_BOX = trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]])
CUBE = np.array(_BOX.vertices, np.float64)
CUBE_TRIANGLES = np.array(_BOX.faces, np.int64)
INSIDE_OUT = CUBE_TRIANGLES[:, ::-1]

Edge = tuple[int, int]


@cache
def closed_shapes() -> dict[str, tuple[Array, Rows]]:
    pot, ball = glass_teapot(4), shapes.sphere(8)
    closed = {
        "cube": (CUBE, CUBE_TRIANGLES),
        "sphere": make_closed_mesh(ball.vertices, ball.triangles)[:2],
        "teapot": (pot.vertices, pot.triangles),
    }
    return {name: (np.array(v), np.array(f, np.int64)) for name, (v, f) in closed.items()}


def volume(vertices: Array, triangles: NDArray[np.integer]) -> float:
    return float(np.linalg.det((vertices - vertices.mean(axis=0))[triangles]).sum() / 6)


def turned_to_least(triangles: NDArray[np.integer]) -> Rows:
    """Triangles with the lowest corner first, in the same sense."""
    turn = (np.argmin(triangles, axis=1)[:, None] + np.arange(3)) % 3
    return np.take_along_axis(np.asarray(triangles, np.int64), turn, axis=1)


def senses(triangles: NDArray[np.integer]) -> dict[Edge, list[tuple[int, bool]]]:
    """For each edge its triangles, and whether they pass it from the lower vertex."""
    passed = defaultdict(list)
    for row, triangle in enumerate(triangles.tolist()):
        for begin, end in zip(triangle, triangle[1:] + triangle[:1], strict=True):
            passed[min(begin, end), max(begin, end)].append((row, begin < end))
    return passed


def assert_as_documented(mesh: RepairedMesh) -> None:
    assert mesh.vertices.dtype == np.float64
    assert mesh.triangles.dtype == np.int32
    assert mesh.kept.dtype == np.int64
    assert len(np.unique(mesh.vertices, axis=0)) == len(mesh.vertices)
    np.testing.assert_array_equal(np.unique(mesh.triangles), np.arange(len(mesh.vertices)))
    assert (np.diff(mesh.kept) > 0).all()
    for note in mesh.notes:
        assert note.endswith(".")
        assert ". " not in note


def assert_not_changed_by(mesh: RepairedMesh, again: RepairedMesh) -> None:
    np.testing.assert_array_equal(again.vertices, mesh.vertices)
    np.testing.assert_array_equal(again.triangles, mesh.triangles)
    np.testing.assert_array_equal(again.kept, np.arange(len(mesh.triangles)))


# --- Closed meshes ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["cube", "sphere", "teapot"])
def test_a_sound_mesh_is_kept(name: str) -> None:
    vertices, triangles = closed_shapes()[name]
    mesh = repair_mesh(vertices, triangles)
    assert mesh.notes == ()
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.triangles, triangles)
    np.testing.assert_array_equal(mesh.kept, np.arange(len(triangles)))


@settings(max_examples=40, deadline=None)
@given(
    name=st.sampled_from(["cube", "sphere", "teapot"]),
    seed=st.integers(0, 2**32 - 1),
    flipped=st.sampled_from([0.0, 0.1, 0.5, 1.0]),
    size=st.sampled_from([1e-3, 1.0, 1e6]),
    offset=st.sampled_from([0.0, -1e6]),
    jitter=st.sampled_from([0.0, 2e-8]),
)
def test_splits_and_flips_of_a_closed_mesh_are_undone(
    name: str, seed: int, flipped: float, size: float, offset: float, jitter: float
) -> None:
    """Each triangle with corners of its own, some copies a little beside, in any order."""
    random = np.random.default_rng(seed)
    shape, triangles = closed_shapes()[name]
    vertices = shape * size + offset
    extent = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    order = random.permutation(len(triangles))
    over = random.random(len(triangles)) < flipped
    mixed = np.where(over[:, None], triangles[:, ::-1], triangles)[order]
    corners = random.permutation(mixed.size)
    split = np.empty((mixed.size, 3))
    split[corners] = vertices[mixed.ravel()]
    if jitter and not offset:  # far away the doubles are too far apart for that
        split += random.uniform(-1, 1, split.shape) * jitter * extent
    mesh = repair_mesh(split, corners.reshape(-1, 3))

    assert_as_documented(mesh)
    np.testing.assert_array_equal(mesh.kept, np.arange(len(triangles)))
    away = np.linalg.norm(mesh.vertices[:, None] - vertices, axis=2)
    number = np.argmin(away, axis=1)
    assert away.min(axis=1).max() <= 1e-7 * extent
    np.testing.assert_array_equal(np.sort(number), np.arange(len(vertices)))
    expected = turned_to_least(triangles[order])
    np.testing.assert_array_equal(turned_to_least(number[mesh.triangles]), expected)
    assert volume(mesh.vertices, mesh.triangles) > 0
    turned = f"{over.sum()} triangle{'' if over.sum() == 1 else 's'} of closed pieces turned over"
    assert any(note.startswith(turned) for note in mesh.notes) == over.any()
    assert any("merged" in note for note in mesh.notes) == bool(jitter and not offset)
    assert_not_changed_by(mesh, repair_mesh(mesh.vertices, mesh.triangles))


def test_each_closed_piece_faces_outwards_by_itself() -> None:
    vertices = np.concatenate([CUBE, CUBE * 0.01 + 1e4, CUBE - 3])
    mesh = repair_mesh(vertices, np.concatenate([INSIDE_OUT, INSIDE_OUT + 8, CUBE_TRIANGLES + 16]))
    assert mesh.notes == ("24 triangles of closed pieces turned over to face outwards.",)
    for part, expected in enumerate((1.0, 1e-6, 1.0)):
        mine = mesh.triangles[12 * part : 12 * part + 12]
        assert volume(mesh.vertices[8 * part : 8 * part + 8], mine - 8 * part) == pytest.approx(
            expected
        )


def test_cubes_that_touch_along_an_edge_face_outwards() -> None:
    """Their common edge is in four triangles, of two surfaces that are closed."""
    vertices = np.concatenate([CUBE, CUBE + np.array([1, 1, 0])])
    mesh = repair_mesh(vertices, np.concatenate([CUBE_TRIANGLES, INSIDE_OUT + 8]))
    assert len(mesh.vertices) == 14
    assert mesh.notes == (
        "12 triangles of closed pieces turned over to face outwards.",
        "1 edge is in more than two triangles: pieces end there.",
    )
    assert volume(mesh.vertices, mesh.triangles) == pytest.approx(2)
    assert volume(mesh.vertices, mesh.triangles[12:]) == pytest.approx(1)


# --- Open meshes, and what has no sides ---------------------------------------------------------


@pytest.mark.parametrize("turned", [(0,), (1, 2), (0, 1, 2), ()])
def test_an_open_piece_faces_as_most_of_its_area(turned: tuple[int, ...]) -> None:
    """A large triangle and two small ones beside it, of less area together."""
    vertices = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, -1, 0], [4, -1, 0]], float)
    triangles = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 4]])
    given = triangles.copy()
    given[list(turned)] = given[list(turned)][:, ::-1]
    mesh = repair_mesh(vertices, given)
    up = np.cross(*np.moveaxis(np.diff(mesh.vertices[mesh.triangles], axis=1), 1, 0))[:, 2]
    assert (np.sign(up) == (-1 if 0 in turned else 1)).all()
    changed = {(0,): 2, (1, 2): 2, (0, 1, 2): 0, (): 0}[turned]
    said = f"{changed} triangles of open pieces turned over to face as most of their piece's area."
    assert mesh.notes == ((said,) if changed else ()) + ("the mesh is open along 5 border edges.",)


def test_a_seam_of_the_texture_is_no_border() -> None:
    """Newell's teapot is open at its rims: its borders by brute force over its positions."""
    pot = shapes.teapot(4)
    mesh = repair_mesh(pot.vertices, pot.triangles)
    assert_as_documented(mesh)
    place = {position: row for row, position in enumerate(map(tuple, mesh.vertices + 0.0))}
    number = np.array([place[position] for position in map(tuple, pot.vertices + 0.0)])
    np.testing.assert_array_equal(number[pot.triangles], mesh.triangles)
    borders = sum(len(triangles) == 1 for triangles in senses(number[pot.triangles]).values())
    assert mesh.notes == (f"the mesh is open along {borders} border edges.",)


def strip(length: int, twisted: bool) -> tuple[Array, Rows]:
    """A band of 2 x length triangles around z, joined to itself with half a turn or without."""
    angle = 2 * np.pi * np.arange(length) / length
    out = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    half = angle / 2 if twisted else 0 * angle + np.pi / 2
    across = 0.3 * (np.cos(half)[:, None] * out + np.sin(half)[:, None] * [0, 0, 1])
    here, there = np.arange(length), np.arange(length) + length
    ahead, ahead_there = np.roll(here, -1), np.roll(there, -1)
    if twisted:
        ahead[-1], ahead_there[-1] = ahead_there[-1], ahead[-1]
    first = np.stack([here, ahead, there], axis=-1)
    second = np.stack([ahead, ahead_there, there], axis=-1)
    return np.concatenate([out - across, out + across]), np.concatenate([first, second])


def test_a_moebius_strip_is_left_as_given() -> None:
    vertices, triangles = strip(12, twisted=True)
    over = np.random.default_rng(3).random(24) < 0.5
    triangles[over] = triangles[over][:, ::-1]
    both = np.concatenate([triangles, INSIDE_OUT + len(vertices)])
    mesh = repair_mesh(np.concatenate([vertices, CUBE + 5]), both)
    np.testing.assert_array_equal(mesh.triangles[:24], triangles)
    assert mesh.notes == (
        "12 triangles of closed pieces turned over to face outwards.",
        "1 piece has one side only (like a Moebius strip): left as given.",
        "the mesh is open along 24 border edges.",
    )


def test_a_band_that_is_not_twisted_has_two_sides() -> None:
    vertices, triangles = strip(12, twisted=False)
    mesh = repair_mesh(
        vertices, np.where(np.arange(24)[:, None] == 7, triangles[:, ::-1], triangles)
    )
    np.testing.assert_array_equal(turned_to_least(mesh.triangles), turned_to_least(triangles))
    assert mesh.notes[0].startswith("1 triangle of open pieces turned over")


def test_an_edge_in_three_triangles_separates_pieces() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], float)
    triangles = np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4]])
    mesh = repair_mesh(vertices, triangles)
    np.testing.assert_array_equal(mesh.triangles, triangles)
    assert mesh.notes == (
        "1 edge is in more than two triangles: pieces end there.",
        "the mesh is open along 6 border edges.",
    )


# --- Brute force --------------------------------------------------------------------------------


def pieces_by_search(triangles: NDArray[np.integer]) -> list[tuple[list[int], bool]]:
    """Rows of triangles joined by edges in two triangles, and whether all can be made to agree."""
    links = defaultdict(list)
    for ends in senses(triangles).values():
        if len(ends) == 2:
            (one, forwards), (other, forwards_there) = ends
            links[one].append((other, forwards == forwards_there))
            links[other].append((one, forwards == forwards_there))
    turned: dict[int, bool] = {}
    found = []
    for start in range(len(triangles)):
        if start in turned:
            continue
        turned[start], rows, orientable = False, [start], True
        for row in rows:  # grows while it is gone through
            for other, disagree in links[row]:
                if other not in turned:
                    turned[other] = turned[row] != disagree
                    rows.append(other)
                orientable &= turned[other] == (turned[row] != disagree)
        found.append((rows, orientable))
    return found


@settings(max_examples=150, deadline=None)
@given(
    corners=st.lists(st.tuples(*[st.integers(0, 6)] * 3), min_size=1, max_size=24),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_triangles(corners: list[tuple[int, int, int]], seed: int) -> None:
    """Of seven vertices in general position: closed, open, one-sided and branching surfaces."""
    vertices = np.random.default_rng(seed).normal(size=(7, 3))
    given_ = np.array(corners)
    expected: dict[frozenset[int], int] = {}
    for row, triangle in enumerate(corners):
        if len(set(triangle)) == 3:
            expected.setdefault(frozenset(triangle), row)
    if not expected:
        with pytest.raises(ValueError, match="no triangle has an area"):
            repair_mesh(vertices, given_)
        return
    mesh = repair_mesh(vertices, given_)
    assert_as_documented(mesh)
    assert mesh.kept.tolist() == list(expected.values())
    position = mesh.vertices[mesh.triangles]
    before = vertices[given_[mesh.kept]]
    np.testing.assert_array_equal(position[:, 0], before[:, 0])
    same = (position == before).all(axis=(1, 2))
    np.testing.assert_array_equal(position[~same], before[~same][:, [0, 2, 1]])
    area = np.linalg.norm(
        np.cross(before[:, 1] - before[:, 0], before[:, 2] - before[:, 0]), axis=1
    )

    edges = senses(mesh.triangles)
    for rows, orientable in pieces_by_search(mesh.triangles):
        if not orientable:
            assert same[rows].all()
            continue
        mine = set(rows)
        closed = True
        for ends in edges.values():
            inside = [forwards for row, forwards in ends if row in mine]
            if inside and len(ends) == 2:
                assert sorted(inside) == [False, True]
            closed &= 2 * sum(inside) == len(inside)
        if closed:
            assert volume(mesh.vertices, mesh.triangles[rows]) > 0
        elif not any("seen from behind" in note for note in mesh.notes):
            assert area[rows] @ np.where(same[rows], 1, -1) >= 0
    one_sided = sum(not orientable for _, orientable in pieces_by_search(mesh.triangles))
    assert any(f"{one_sided} piece" in note for note in mesh.notes) == (one_sided > 0)
    branching = sum(len(ends) > 2 for ends in edges.values())
    assert any(f"{branching} edge" in note for note in mesh.notes) == (branching > 0)
    border = sum(len(ends) == 1 for ends in edges.values())
    assert any(f"along {border} border" in note for note in mesh.notes) == (border > 0)
    assert_not_changed_by(mesh, repair_mesh(mesh.vertices, mesh.triangles))


def groups_by_chains(points: Array, step: float) -> list[int]:
    """The lowest row that each point is linked to by steps of at most ``step``."""
    group = list(range(len(points)))
    for one, other in combinations(range(len(points)), 2):
        if np.linalg.norm(points[one] - points[other]) <= step and group[one] != group[other]:
            low, high = sorted((group[one], group[other]))
            group = [low if number == high else number for number in group]
    return group


@settings(max_examples=60, deadline=None)
@given(
    rows=st.lists(st.tuples(*[st.integers(0, 9)] * 3), min_size=4, max_size=30),
    tolerance=st.sampled_from([0.0, 1e-12, 0.07, 0.11, 0.2]),
)
def test_vertices_within_the_tolerance_are_one(
    rows: list[tuple[int, int, int]], tolerance: float
) -> None:
    """Tolerances between the distances of a lattice; triangles that only list vertices."""
    points = np.array([(-20, -20, -20), *rows], float)
    step = tolerance * float(np.linalg.norm(np.ptp(points, axis=0)))
    group = groups_by_chains(points, step)
    triangles = np.array(list(combinations(range(len(points)), 3)))
    notes: list[str] = []
    merged, faces = repairing._merged(points, triangles, tolerance, notes)
    np.testing.assert_array_equal(merged, points[sorted(set(group))])
    np.testing.assert_array_equal(merged[faces], points[np.array(group)[triangles]])
    fewer = len(np.unique(points, axis=0)) - len(merged)
    assert (notes and notes[0].split()[0]) == (f"{fewer}" if fewer else [])


def test_crowds_of_vertices_are_thinned(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where millions of pairs are within the tolerance: what is left is farther apart, and
    only what chains of steps link has become one."""
    monkeypatch.setattr(repairing, "_MANY_PAIRS", 10)
    random = np.random.default_rng(1)
    middles = random.random((30, 3))
    points = np.repeat(middles, 20, axis=0) + random.uniform(-0.01, 0.01, (600, 3))
    points = np.concatenate([points, [[0, 0, 0], [1, 1, 1]]])
    step = 0.03 / float(np.linalg.norm(np.ptp(points, axis=0)))
    place = repairing._joined(points, np.arange(len(points)), step)
    group = np.array(groups_by_chains(points, 0.03))
    left = [points[place == number][0] for number in range(place.max() + 1)]
    assert len(left) < 40
    assert min(np.linalg.norm(one - other) for one, other in combinations(left, 2)) > 0.03
    for number in range(place.max() + 1):
        assert len(set(group[place == number])) == 1


# --- Open bodies --------------------------------------------------------------------------------


def ball_without(share: float) -> tuple[Array, Rows]:
    """A ball whose lowest triangles are missing, a share of all."""
    ball = trimesh.creation.icosphere(3)
    height = ball.triangles_center[:, 2]
    return np.array(ball.vertices), np.array(ball.faces)[height > np.quantile(height, share)]


@settings(max_examples=20, deadline=None)
@given(
    share=st.floats(0.001, 0.03),
    turned=st.booleans(),
    mixed=st.booleans(),
    size=st.sampled_from([1e-7, 1.0, 1e7]),
    seed=st.integers(0, 99),
)
def test_a_body_with_small_holes_faces_outwards(
    share: float, turned: bool, mixed: bool, size: float, seed: int
) -> None:
    vertices, triangles = ball_without(share)
    given_ = triangles[:, ::-1] if turned else triangles.copy()
    if mixed:
        some = np.random.default_rng(seed).random(len(given_)) < 0.3
        given_[some] = given_[some, ::-1]
    mesh = repair_mesh(vertices * size + [0, 0, 9 * size], given_)
    a, b, c = np.moveaxis((mesh.vertices / size - [0, 0, 9])[mesh.triangles], 1, 0)
    assert (np.einsum("fi,fi->f", np.cross(b - a, c - a), a) > 0).all()
    words = f"{len(triangles)} triangles of open pieces turned over: they were seen"
    assert any(words in note for note in mesh.notes) == (turned and not mixed)
    assert_not_changed_by(mesh, repair_mesh(mesh.vertices, mesh.triangles))


@pytest.mark.parametrize("name", ["bowl", "open box", "sheet"])
@pytest.mark.parametrize("turned", [False, True])
def test_what_is_looked_into_faces_as_it_did(name: str, turned: bool) -> None:
    """Half a ball, a box without its lid, into which one may look from inside a room, a sheet."""
    vertices, triangles = CUBE, CUBE_TRIANGLES[(CUBE[CUBE_TRIANGLES][:, :, 2] < 1).any(axis=1)]
    if name == "bowl":
        vertices, triangles = ball_without(0.5)
    if name == "sheet":
        flat = shapes.square(3)
        vertices, triangles = flat.vertices, flat.triangles.astype(np.int64)
    given_ = triangles[:, ::-1] if turned else triangles
    mesh = repair_mesh(vertices, given_)
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], vertices[given_])


def test_a_floor_under_houses_stays() -> None:
    """Of its upper side hardly anything is seen from outside; of its lower one all."""
    floor = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    house = CUBE * [0.97, 0.97, 1] + [0.015, 0.015, 0.001]
    triangles = np.concatenate([[[0, 1, 2], [0, 2, 3]], CUBE_TRIANGLES + 4])
    mesh = repair_mesh(np.concatenate([floor, house]), triangles)
    np.testing.assert_array_equal(mesh.triangles, triangles)


def test_given_corners_are_found_again() -> None:
    """Across what was merged, dropped and turned over."""
    random = np.random.default_rng(3)
    apart = CUBE[CUBE_TRIANGLES].reshape(-1, 3)
    rows = np.arange(36).reshape(-1, 3)
    rows[::2] = rows[::2, ::-1]
    given_ = np.concatenate([rows, rows[random.integers(0, 12, 5)], [[0, 1, 1]]])
    mesh = repair_mesh(apart, given_)
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], apart[mesh.corners])
    np.testing.assert_array_equal(np.sort(mesh.corners), np.sort(given_[mesh.kept]))


# --- What is dropped ----------------------------------------------------------------------------


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e6])
def test_triangles_without_area_are_dropped(offset: float, size: float) -> None:
    """Along a slanted line, of which rounding far from the origin makes slivers."""
    ends = np.array([[0.1, 0.2, 0.3], [0.9, 0.7, 1.0], [0.0, 1.0, 0.0], [7.0, 7.0, 7.0]])
    middle = ends[0] + 0.37 * (ends[1] - ends[0])
    vertices = np.concatenate([ends, [middle]]) * size + offset
    triangles = np.array([[0, 4, 1], [0, 1, 2], [0, 0, 2], [2, 2, 2], [2, 1, 4]])
    mesh = repair_mesh(vertices, triangles)
    assert mesh.kept.tolist() == [1, 4]
    np.testing.assert_array_equal(mesh.vertices, vertices[[0, 1, 2, 4]])
    assert mesh.notes[0] == "3 triangles dropped: repeated corners or no area."


def test_thin_triangles_are_kept() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-6, 0], [1e6, 0, 1], [1e6, 1e-3, 1]])
    triangles = np.array([[0, 1, 2], [2, 3, 4]])
    np.testing.assert_array_equal(repair_mesh(vertices, triangles, tolerance=0).kept, [0, 1])


def test_triangles_that_merging_flattens_are_dropped() -> None:
    needle = np.array([[0, 0, 0], [0, 1e-8, 0], [1, 0, 0], [0, 1, 0]])
    mesh = repair_mesh(needle, [[0, 2, 1], [1, 2, 3]])
    assert mesh.kept.tolist() == [1]
    np.testing.assert_array_equal(mesh.vertices, needle[[0, 2, 3]])
    assert mesh.notes[:2] == (
        "1 vertex merged with others within 1e-07 of the mesh's extent.",
        "1 triangle dropped: repeated corners or no area.",
    )
    assert repair_mesh(needle, [[0, 2, 1], [1, 2, 3]], tolerance=1e-9).kept.tolist() == [0, 1]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_of_equal_triangles_the_first_is_kept(seed: int) -> None:
    random = np.random.default_rng(seed)
    copies = random.integers(0, 12, 20)
    turned = [CUBE_TRIANGLES[row][random.permutation(3)] for row in copies]
    order = random.permutation(32)
    triangles = np.concatenate([CUBE_TRIANGLES, turned])[order]
    origin = np.concatenate([np.arange(12), copies])[order]
    mesh = repair_mesh(CUBE, triangles)
    assert mesh.kept.tolist() == sorted(int(np.argmax(origin == row)) for row in range(12))
    assert mesh.notes[0] == "20 triangles dropped: the same corners as others."
    assert volume(mesh.vertices, mesh.triangles) == pytest.approx(1)


def test_vertices_without_a_triangle_say_nothing() -> None:
    vertices = np.concatenate([[[1e9, 0, 0]], CUBE, [[-1e9, 0, 0]]])
    mesh = repair_mesh(vertices, CUBE_TRIANGLES + 1)
    np.testing.assert_array_equal(mesh.vertices, CUBE)
    assert mesh.notes == ()


# --- What is refused ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("vertices", "triangles", "tolerance", "reason"),
    [
        (CUBE[:, :2], CUBE_TRIANGLES, 1e-7, r"vertices have the shape \(8, 2\)"),
        (CUBE * np.nan, CUBE_TRIANGLES, 1e-7, "finite"),
        (CUBE + np.inf, CUBE_TRIANGLES, 1e-7, "finite"),
        (CUBE, CUBE_TRIANGLES[:, :2], 1e-7, r"triangles have the shape \(12, 2\)"),
        (CUBE, CUBE_TRIANGLES * 1.0, 1e-7, "integers"),
        (CUBE, CUBE_TRIANGLES[:0], 1e-7, "no triangles"),
        (CUBE, [[0, 1, 8]], 1e-7, "vertices 0 to 8"),
        (CUBE, [[0, 1, -1]], 1e-7, "vertices -1 to 1"),
        (CUBE, [[0, 1, 1]], 1e-7, "no triangle has an area"),
        (CUBE * 0 + 5, CUBE_TRIANGLES, 1e-7, "no triangle has an area"),
        (CUBE, CUBE_TRIANGLES, 1.0, "no triangle has an area"),
        (CUBE, CUBE_TRIANGLES, -1.0, "tolerance is -1.0; expected a finite number"),
        (CUBE, CUBE_TRIANGLES, np.nan, "tolerance is nan"),
        (CUBE, CUBE_TRIANGLES, np.inf, "tolerance is inf"),
    ],
)
def test_what_cannot_be_repaired(
    vertices: Array, triangles: Rows, tolerance: float, reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        repair_mesh(vertices, triangles, tolerance=tolerance)
