"""Billboards: what they are, and how they are laid through points (4.1).

The paper stands a square in the middle of each voxel that turns to face the viewer. Where the
points of a voxel lie in a plane, a rectangle in that plane shows them with the right parallax and
its textures fit on each other from all sides, so it stands still here; others turn.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.cameras import Cameras, project_points
from pipelines.street_billboards.octree import Leaves, neighbouring_leaves
from pipelines.street_billboards.textures.view_directions import CIRCLE, DIRECTIONS, SPACING

OVERLAP = 0.03
"""By how much a voxel is enlarged on every side, so that neighbours leave no crack."""
_FLAT = 0.09
"""Largest deviation from the plane, in voxel sides (root mean square), of points that are flat."""
_NARROW = 0.13
"""Least deviation along the plane's shorter direction; those of a pole are narrower."""
_LIKE_DEGREES, _LIKE_STEP = 25.0, 0.15
"""Neighbours whose planes differ by less, in angle and in voxel sides, share their points."""
_NEAREST = 1.0
"""Metres; a camera that is nearer counts no more."""
_LEVEL = 0.8
"""Vertical part of a unit normal from which on a rectangle has no upright axis."""

HEADER_BYTES = 52
"""Of where a billboard stands, as it is drawn: centre, both halves, fan, whether it turns."""


class Billboards(NamedTuple):
    """b rectangles in the world, in metres.

    One turns about its centre to face the viewer: its normal is from the centre to the eye, its row
    axis is horizontal (``axes_facing``). One whose points lie in a plane stands still. Texture
    coordinates (s, t) in [-1, 1] are ``centre + s * half_s + t * half_t``.
    """

    centre: NDArray[np.float64]
    """(b, 3), of the rectangle."""
    voxel: NDArray[np.float64]
    """(b, 3), middle of the octree's leaf."""
    turns: NDArray[np.bool_]
    """(b,)."""
    half_s: NDArray[np.float32]
    """(b, 3), half of the rectangle along a row of texels, to the right; turning: (h, 0, 0)."""
    half_t: NDArray[np.float32]
    """(b, 3), half of it along a column, from bottom to top; turning: (0, 0, h)."""
    fan: NDArray[np.int32]
    """(b,), first direction of the fan of views, 0 to 59."""


def axes_facing(
    centre: NDArray[np.floating], eye: NDArray[np.floating]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit vectors of rows and columns, (…, 3) each, of squares at ``centre`` that face ``eye``."""
    normal = np.asarray(eye, np.float64) - centre
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    row = np.stack([-normal[..., 1], normal[..., 0], np.zeros_like(normal[..., 0])], axis=-1)
    row /= np.maximum(np.linalg.norm(row, axis=-1, keepdims=True), 1e-12)
    return row, np.cross(normal, row)


def fit_billboards(
    leaves: Leaves,
    positions: NDArray[np.floating],
    cameras: Cameras,
    *,
    all_turn: bool = False,
) -> Billboards:
    """A billboard for each leaf; of two that would show the same plane twice, one.

    positions (n, 3): the points that the leaves hold; cameras: that saw them. all_turn: as in the
    paper.

    >>> from pipelines.street_billboards.octree import octree_leaves
    >>> wall = np.random.default_rng(0).uniform([0, 0, 0], [2, 0.01, 2], (2000, 3))
    >>> lens = np.array([[50.0, 0, 50], [0, 50, 50], [0, 0, 1]])
    >>> north = np.array([[1.0, 0, 0, 1], [0, 0, 1, -3], [0, -1, 0, 1], [0, 0, 0, 1]])
    >>> seen = Cameras(lens[None], north[None], width=101, height=101)
    >>> billboards = fit_billboards(octree_leaves(wall, 1.0, 10), wall, seen)
    >>> billboards.centre.shape, int(billboards.turns.sum())
    ((4, 3), 0)
    """
    middle = leaves.middle
    towards = _towards_viewers(middle, cameras)
    turns = np.ones(len(middle), bool)
    reach = np.float32(np.sqrt(3.0) / 2 * leaves.side * (1 + 2 * OVERLAP))
    centre = middle.copy()
    half_s = np.tile(np.array([reach, 0, 0], np.float32), (len(middle), 1))
    half_t = np.tile(np.array([0, 0, reach], np.float32), (len(middle), 1))
    kept = np.ones(len(middle), bool)
    if not all_turn:
        mean, normal, turns = _planes(leaves, positions)
        normal *= np.where((normal * towards).sum(axis=1) < 0, -1.0, 1.0)[:, None]
        cut = _cut(mean - middle, normal, leaves.side * (0.5 + OVERLAP))
        # Their plane left the voxel when it was laid through the neighbours' points as well: it
        # lies in a neighbour, which shows it.
        kept = turns | cut.meets
        still = ~turns & kept
        centre[still] = (middle + cut.centre)[still]
        half_s[still], half_t[still] = cut.half_s[still], cut.half_t[still]
    return Billboards(
        centre[kept],
        middle[kept],
        turns[kept],
        half_s[kept],
        half_t[kept],
        _fans(towards[kept]),
    )


def _towards_viewers(middle: NDArray[np.float64], cameras: Cameras) -> NDArray[np.float64]:
    """Unit vectors (b, 3) to the cameras that have it in their picture, the near ones above all."""
    total = np.zeros_like(middle)
    for intrinsics, to_world in zip(cameras.intrinsics, cameras.to_world, strict=True):
        pixels, depth = project_points(intrinsics, to_world, middle)
        offset = to_world[:3, 3] - middle
        away = np.maximum(np.linalg.norm(offset, axis=1), _NEAREST)
        with np.errstate(invalid="ignore"):
            shown = (depth > 0) & (pixels >= 0).all(axis=1)
            shown &= (pixels[:, 0] < cameras.width) & (pixels[:, 1] < cameras.height)
        # One that nobody has in the picture still has a side that faces the road.
        weight = np.where(shown, 1.0, 1e-6) / away**2
        total += weight[:, None] * offset / away[:, None]
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12))


def _fans(towards: NDArray[np.float64]) -> NDArray[np.int32]:
    azimuth = np.degrees(np.arctan2(towards[:, 1], towards[:, 0])) / SPACING
    return np.mod(np.rint(azimuth - (DIRECTIONS - 1) / 2), CIRCLE).astype(np.int32)


# ---- planes ----------------------------------------------------------------------------------


class _Moments(NamedTuple):
    points: NDArray[np.float64]
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]


def _planes(
    leaves: Leaves, positions: NDArray[np.floating]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Means and normals (b, 3) of the leaves' planes, and which leaves are not flat."""
    own = _moments(leaves, positions)
    _, axes = np.linalg.eigh(own.covariance)
    normal = axes[:, :, 0]
    # Stereo noise tilts the plane of one voxel: neighbours that agree lend their points.
    beside = neighbouring_leaves(leaves.cell)
    there = np.maximum(beside, 0)
    like = np.abs(np.einsum("bi,bki->bk", normal, normal[there])) > np.cos(
        np.radians(_LIKE_DEGREES)
    )
    step = np.einsum("bi,bki->bk", normal, own.mean[there] - own.mean[:, None])
    like &= (np.abs(step) < _LIKE_STEP * leaves.side) & (beside >= 0)
    joined = _joined(own, there, like)
    lengths, axes = np.linalg.eigh(joined.covariance)
    deviations = np.sqrt(np.maximum(lengths, 0.0)) / leaves.side
    turns = (deviations[:, 0] > _FLAT) | (deviations[:, 1] < _NARROW)
    return joined.mean, axes[:, :, 0], turns


def _moments(leaves: Leaves, positions: NDArray[np.floating]) -> _Moments:
    rows = np.repeat(np.arange(len(leaves.cell)), np.diff(leaves.first))
    offsets = positions[leaves.order] - leaves.middle[rows]
    count = np.diff(leaves.first).astype(np.float64)
    starts = leaves.first[:-1]
    mean = np.add.reduceat(offsets, starts) / count[:, None]
    squares = np.add.reduceat(offsets[:, :, None] * offsets[:, None, :], starts)
    covariance = squares / count[:, None, None] - mean[:, :, None] * mean[:, None, :]
    return _Moments(count, mean + leaves.middle, covariance)


def _joined(own: _Moments, there: NDArray[np.int64], like: NDArray[np.bool_]) -> _Moments:
    """Moments of all points of the leaves that are alike, (b, k) rows ``there``."""
    weight = np.where(like, own.points[there], 0.0)
    count = weight.sum(axis=1)
    offset = own.mean[there] - own.mean[:, None]
    shift = (weight[..., None] * offset).sum(axis=1) / count[:, None]
    spread = own.covariance[there] + offset[..., :, None] * offset[..., None, :]
    second = (weight[..., None, None] * spread).sum(axis=1) / count[:, None, None]
    covariance = second - shift[:, :, None] * shift[:, None, :]
    return _Moments(count, own.mean + shift, covariance)


# ---- a plane in a box ------------------------------------------------------------------------


class _Cut(NamedTuple):
    """The rectangle around the cut of each plane with its box, from the box's middle."""

    meets: NDArray[np.bool_]
    centre: NDArray[np.float64]
    half_s: NDArray[np.float32]
    half_t: NDArray[np.float32]


def _cut(point: NDArray[np.float64], normal: NDArray[np.float64], half: float) -> _Cut:
    """point, normal (b, 3): planes from the middle of boxes of side ``2 * half``."""
    row, column = plane_axes(normal)
    corners = np.array(list(itertools.product((-half, half), repeat=3)))
    edges = [
        (a, b)
        for a, b in itertools.combinations(range(8), 2)
        if np.count_nonzero(corners[a] != corners[b]) == 1
    ]
    height = normal @ corners.T - (normal * point).sum(axis=1)[:, None]
    least = np.full((len(normal), 2), np.inf)
    most = np.full((len(normal), 2), -np.inf)
    for a, b in edges:
        above, below = height[:, a], height[:, b]
        crossed = (above > 0) != (below > 0)
        share = np.where(crossed, above / np.where(crossed, above - below, 1.0), 0.0)
        where = corners[a] + share[:, None] * (corners[b] - corners[a])
        flat = np.stack([(where * row).sum(axis=1), (where * column).sum(axis=1)], axis=1)
        least = np.where(crossed[:, None], np.minimum(least, flat), least)
        most = np.where(crossed[:, None], np.maximum(most, flat), most)
    meets: NDArray[np.bool_] = np.all(most > least, axis=1)
    least, most = np.where(meets[:, None], least, 0.0), np.where(meets[:, None], most, 0.0)
    middle, reach = (least + most) / 2, (most - least) / 2
    off = (normal * point).sum(axis=1)[:, None] * normal
    return _Cut(
        meets,
        off + middle[:, :1] * row + middle[:, 1:] * column,
        (reach[:, :1] * row).astype(np.float32),
        (reach[:, 1:] * column).astype(np.float32),
    )


def plane_axes(
    normal: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit vectors (b, 3) in planes: rows level and to the right as seen against the normal.

    Columns go up. In a plane that is nearly level itself, columns go along x.
    """
    level = np.abs(normal[:, 2]) > _LEVEL
    row = np.cross(np.array([0.0, 0.0, 1.0]), normal)
    along = np.array([1.0, 0.0, 0.0]) - normal[:, :1] * normal
    row = np.where(level[:, None], np.cross(along, normal), row)
    row /= np.maximum(np.linalg.norm(row, axis=1, keepdims=True), 1e-12)
    return row, np.cross(normal, row)
