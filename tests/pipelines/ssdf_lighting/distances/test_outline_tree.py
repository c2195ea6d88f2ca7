"""The tree of outline edges: which edges are in it, and that its bounds hold."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.geometry import shapes
from pipelines.ssdf_lighting.distances.outline_tree import OutlineTree, outline_tree
from pipelines.ssdf_lighting.scene import built_in_scene


def box() -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """A cube of twelve triangles, seen from outside counter-clockwise."""
    corners = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)])
    quads = ([0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3])
    faces = [[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)]
    return corners, np.array(faces, np.int32)


def test_of_a_cube_the_twelve_edges_are_there_and_the_diagonals_are_not() -> None:
    tree = outline_tree(*box())
    assert len(tree.ends) == 12
    np.testing.assert_allclose(np.linalg.norm(tree.ends[:, 0] - tree.ends[:, 1], axis=1), 1.0)
    np.testing.assert_allclose(np.einsum("eij,eij->ei", tree.normals, tree.normals), 1.0)
    away = tree.ends.mean(axis=1) - 0.5  # out of both faces
    assert (np.einsum("eij,ej->ei", tree.normals, away) > 0.4).all()


def test_vertices_at_one_place_are_one_and_a_border_has_no_normals() -> None:
    corners, faces = box()
    split = outline_tree(corners[faces.ravel()], np.arange(36).reshape(-1, 3))
    assert len(split.ends) == 12
    assert (np.linalg.norm(split.normals, axis=2) > 0.5).all()
    open_box = outline_tree(corners, faces[2:])
    borders = np.linalg.norm(open_box.normals, axis=2).max(axis=1) == 0.0
    assert len(open_box.ends) == 12
    assert borders.sum() == 4


def test_triangles_that_disagree_on_the_outside_are_made_to_agree() -> None:
    corners, faces = box()
    turned = faces.copy()
    turned[::2] = turned[::2][:, ::-1]
    tree = outline_tree(corners, turned)
    away = tree.ends.mean(axis=1) - 0.5
    sides = np.einsum("eij,ej->ei", tree.normals, away)
    assert (sides[:, 0] * sides[:, 1] > 0.0).all()


@pytest.fixture(scope="module")
def teapot() -> OutlineTree:
    scene = built_in_scene("teapot", 6, 8)
    return outline_tree(scene.vertices, scene.triangles)


def below(tree: OutlineTree, node: int) -> list[int]:
    """Edges of the leaves from a node to the one that follows it, where it is skipped."""
    leaves = range(node, int(tree.after[node]))
    return [edge for leaf in leaves for edge in range(tree.first[leaf], tree.last[leaf])]


def test_every_edge_is_in_one_leaf_and_children_are_in_their_parents(teapot: OutlineTree) -> None:
    assert below(teapot, 0) == list(range(len(teapot.ends)))
    assert (teapot.after > np.arange(len(teapot.after))).all()
    for node in range(len(teapot.after)):
        if teapot.last[node] == 0:  # an inner node: two children, one after the other
            second = teapot.after[node + 1]
            assert teapot.after[second] == teapot.after[node]


def test_balls_hold_their_edges_and_cones_their_normals(teapot: OutlineTree) -> None:
    for node in range(0, len(teapot.after), 7):
        edges = below(teapot, node)
        away = np.linalg.norm(teapot.ends[edges] - teapot.middle[node], axis=2)
        assert away.max() <= teapot.radius[node] * (1 + 1e-12)
        normals = teapot.normals[edges].reshape(-1, 3)
        bare = np.linalg.norm(normals, axis=1) == 0.0
        if bare.any():
            assert teapot.spread[node] >= np.pi
        else:
            cosines = normals @ teapot.axis[node]
            assert np.arccos(np.clip(cosines, -1, 1)).max() <= teapot.spread[node]


def test_a_square_in_many_triangles_has_its_border_alone() -> None:
    flat = shapes.square(8)
    tree = outline_tree(flat.vertices, flat.triangles)
    assert len(tree.ends) == 32
    assert (np.abs(tree.ends[:, :, :2]).max(axis=2) == 0.5).all()
