"""Leaves against Open3D's octree and a dictionary of cells; Morton order; neighbours."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.street_billboards.octree import (
    MOST_DEPTH,
    Leaves,
    morton_codes,
    neighbouring_leaves,
    octree_leaves,
)


def scattered_points(count: int, seed: int, reach: float = 3.0) -> NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    # Clusters: some leaves hold many points, most hold none.
    return (
        rng.normal(0, 0.3, (count, 3))
        + rng.uniform(-reach, reach, (7, 3))[rng.integers(0, 7, count)]
    )


def members(leaves: Leaves) -> dict[tuple[int, ...], set[int]]:
    """Point numbers by cell."""
    return {
        tuple(cell.tolist()): set(leaves.order[start:stop].tolist())
        for cell, start, stop in zip(leaves.cell, leaves.first[:-1], leaves.first[1:], strict=True)
    }


@pytest.mark.parametrize("least", [1, 3])
def test_leaves_are_those_of_open3d(least: int) -> None:
    import open3d as o3d

    points = scattered_points(400, 3)
    leaves = octree_leaves(points, 0.4, least)
    leaf, inner = o3d.geometry.OctreePointColorLeafNode, o3d.geometry.OctreeInternalPointNode
    tree = o3d.geometry.Octree(leaves.depth, leaves.corner, leaves.side * 2**leaves.depth)
    for number, point in enumerate(points):
        tree.insert_point(
            point,
            leaf.get_init_function(),
            leaf.get_update_function(number, np.zeros(3)),
            inner.get_init_function(),
            inner.get_update_function(number),
        )
    theirs: dict[tuple[int, ...], set[int]] = {}

    def look(node, info) -> bool:  # type: ignore[no-untyped-def]
        if isinstance(node, leaf):
            assert info.size == pytest.approx(leaves.side)
            assert info.depth == leaves.depth
            cell = np.rint((np.asarray(info.origin) - leaves.corner) / leaves.side).astype(int)
            theirs[tuple(cell.tolist())] = set(node.indices)
        return False

    tree.traverse(look)
    assert members(leaves) == {c: own for c, own in theirs.items() if len(own) >= least}


@settings(deadline=None, max_examples=40)
@given(
    count=st.integers(1, 200),
    seed=st.integers(0, 1000),
    side=st.floats(0.05, 9.0),
    least=st.integers(1, 5),
    shift=st.floats(-1000, 1000),
)
def test_leaves_partition_the_points(
    count: int, seed: int, side: float, least: int, shift: float
) -> None:
    points = scattered_points(count, seed) + shift
    leaves = octree_leaves(points, side, least)
    assert np.allclose(leaves.corner / side, np.rint(leaves.corner / side), atol=1e-6)
    # The root holds all points, and half of it would not.
    across = (points.max(axis=0) - leaves.corner).max()
    assert across <= side * 2**leaves.depth * (1 + 1e-9)
    assert leaves.depth == 0 or across > side * 2 ** (leaves.depth - 1) * (1 - 1e-9)

    expected = defaultdict(set)
    for number, point in enumerate(points):
        expected[tuple(int((point[i] - leaves.corner[i]) / side) for i in range(3))].add(number)
    assert members(leaves) == {c: own for c, own in expected.items() if len(own) >= least}

    middles = np.repeat(leaves.middle, np.diff(leaves.first), axis=0)
    assert (np.abs(points[leaves.order] - middles) <= side / 2 * (1 + 1e-6)).all()
    codes = morton_codes(leaves.cell)
    assert (np.diff(codes) > 0).all()


def test_points_on_the_far_faces_are_inside() -> None:
    points = np.array([[0.0, 0, 0], [1.0, 2.0, 2.0], [2.0, 0.5, 0.5]])
    leaves = octree_leaves(points, 0.5, 1)
    assert sum(map(len, members(leaves).values())) == 3
    assert (np.abs(points[leaves.order] - leaves.middle) <= 0.25 + 1e-12).all()


def test_one_point_is_a_root() -> None:
    leaves = octree_leaves(np.array([[3.3, -0.2, 7.0]]), 1.0, 1)
    assert leaves.depth == 0
    np.testing.assert_allclose(leaves.middle, [[3.5, -0.5, 7.5]])


@given(st.lists(st.tuples(*[st.integers(0, 2**MOST_DEPTH - 1)] * 3), min_size=1, max_size=8))
def test_morton_codes_interleave_bits(cells: list[tuple[int, int, int]]) -> None:
    for cell, code in zip(cells, morton_codes(np.array(cells)).tolist(), strict=True):
        x, y, z = (format(value, f"0{MOST_DEPTH}b") for value in cell)
        bits = "".join(c + b + a for a, b, c in zip(x, y, z, strict=True))
        assert code == int(bits, 2)


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 1000), most=st.integers(1, 6), at_the_end=st.booleans())
def test_neighbours_by_brute_force(seed: int, most: int, at_the_end: bool) -> None:
    rng = np.random.default_rng(seed)
    cell = np.unique(rng.integers(0, most, (40, 3)), axis=0)
    if at_the_end:
        # Beyond the last cell of the deepest octree is nothing, not the first cell.
        cell = np.where(rng.random(3) < 0.5, cell, 2**MOST_DEPTH - 1 - cell)
        cell = np.concatenate([cell, [[0, 0, 0]]])
        cell = np.unique(cell, axis=0)
    cell = cell[np.argsort(morton_codes(cell))]
    rows = {tuple(one): row for row, one in enumerate(cell.tolist())}
    found = neighbouring_leaves(cell)
    number = 0
    for dx in (-1, 0, 1):
        for dy in (-1, 0, 1):
            for dz in (-1, 0, 1):
                wanted = [rows.get((x + dx, y + dy, z + dz), -1) for x, y, z in cell.tolist()]
                assert found[:, number].tolist() == wanted
                number += 1
    assert (found[:, 13] == np.arange(len(cell))).all()


def test_nothing_and_too_much_are_refused() -> None:
    with pytest.raises(ValueError, match="found none"):
        octree_leaves(np.empty((0, 3)), 0.5, 1)
    with pytest.raises(ValueError, match="levels of an octree; expected at most 20"):
        octree_leaves(np.array([[0.0, 0, 0], [1e6, 0, 0]]), 0.1, 1)
