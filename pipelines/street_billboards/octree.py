"""The octree that splits space down to voxels of one size (4.1)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MOST_DEPTH = 20
"""Three times 20 bits and a sign fit a 64-bit code."""


class Leaves(NamedTuple):
    """The octree's b leaves that hold enough points, in Morton order: near ones are near."""

    corner: NDArray[np.float64]
    """(3,), lowest corner of the root cube, m."""
    depth: int
    """Levels below the root."""
    side: float
    """Of a leaf, m."""
    cell: NDArray[np.int64]
    """(b, 3), which leaf along each axis."""
    order: NDArray[np.int64]
    """(n,), point numbers, leaf by leaf; points of leaves with too few are left out."""
    first: NDArray[np.int64]
    """(b + 1,), where a leaf's points begin in ``order``."""

    @property
    def middle(self) -> NDArray[np.float64]:
        """(b, 3), middles of the leaves, m."""
        middles: NDArray[np.float64] = self.corner + (self.cell + 0.5) * self.side
        return middles


def octree_leaves(positions: NDArray[np.floating], side: float, least_points: int) -> Leaves:
    """Split the points' cube until its leaves have this side, in metres; keep those with enough.

    positions (n, 3); the root is the smallest cube of side ``2 ** depth * side`` that holds all,
    its corner on a multiple of ``side``. least_points: that a leaf must hold.

    Raises ValueError where there are no points, or more than 20 levels would be needed.

    >>> points = np.random.default_rng(0).uniform(0, 2, (1000, 3))
    >>> leaves = octree_leaves(points, side=0.5, least_points=5)
    >>> leaves.depth, leaves.cell.shape, len(leaves.order)
    (2, (64, 3), 1000)
    """
    if len(positions) == 0:
        raise ValueError("points: found none; expected some to put an octree around.")
    corner = np.floor(positions.min(axis=0) / side) * side
    across = float((positions.max(axis=0) - corner).max())
    depth = math.ceil(math.log2(max(across / side * (1.0 + 1e-12), 1.0)))
    if depth > MOST_DEPTH:
        raise ValueError(
            f"voxel is {side:g} m for points {across:g} m across: {depth} levels of an octree; "
            f"expected at most {MOST_DEPTH}."
        )
    cell = np.minimum(((positions - corner) / side).astype(np.int64), 2**depth - 1)
    code = morton_codes(cell)
    order = np.argsort(code, kind="stable")
    _, first, counts = np.unique(code[order], return_index=True, return_counts=True)
    enough = counts >= least_points
    kept = np.repeat(enough, counts)
    return Leaves(
        corner,
        depth,
        side,
        cell[order[first[enough]]],
        order[kept],
        np.concatenate([[0], np.cumsum(counts[enough])]),
    )


def morton_codes(cell: NDArray[np.int64]) -> NDArray[np.int64]:
    """Path from the root to each cell (n, 3): three bits a level, z's highest."""
    code = np.zeros(len(cell), np.int64)
    for bit in range(MOST_DEPTH):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code


def neighbouring_leaves(cell: NDArray[np.int64]) -> NDArray[np.int64]:
    """The 27 leaves around each leaf, itself in the middle: (b, 27) rows of ``cell``, or -1."""
    code = morton_codes(cell)
    steps = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    found = np.full((len(cell), len(steps)), -1, np.int64)
    for number, step in enumerate(steps):
        beside = cell + step
        # A code holds no more bits: the cell after the last would pass for the first.
        inside = ((beside >= 0) & (beside < 2**MOST_DEPTH)).all(axis=1)
        wanted = morton_codes(np.maximum(beside, 0))
        at = np.minimum(np.searchsorted(code, wanted), len(code) - 1)
        found[:, number] = np.where(inside & (code[at] == wanted), at, -1)
    return found
