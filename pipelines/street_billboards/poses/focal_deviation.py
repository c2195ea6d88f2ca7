"""How well a bundle tells its focal length.

The covariance of a least squares fit (Hartley and Zisserman, "Multiple view geometry", 5.2), with
the points eliminated and the freedoms of place, direction and scale fixed; they say nothing
of a focal length, so it does not matter how. Residuals are no independent noise: a feature that is
found a little too far left is found so in frame after frame, and what moves or what the lens bends
pulls whole parts of the picture. So their sums are taken as they are, by clusters (Liang and Zeger,
"Longitudinal data analysis using generalized linear models", 1986): points, and cells of the
picture; the largest deviation counts.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.bundle import (
    Bundle,
    FloatArray,
    Sightings,
    block_rows,
    derivatives,
    huber_weights,
    mixed_rows,
    residuals,
    sparse_columns,
    sum_by,
)

_CELLS = 8
"""Of the picture, across and down, for errors that are common to a part of it."""


class FocalDeviation(NamedTuple):
    """Standard deviations of a focal length, each relative to it."""

    independent: float
    """If each residual stood for itself."""
    by_point: float
    """If those of one point err together."""
    by_cell: float
    """If those of one part of the picture err together."""

    @property
    def stated(self) -> float:
        """What is told: the largest."""
        return max(self)


def focal_deviation(bundle: Bundle, seen: Sightings) -> FocalDeviation:
    """How far the focal length of an adjusted bundle may be off, relative to it.

    The bundle is at its best (``adjust_bundle``), else the deviations mean nothing. All are inf
    where nothing tells the focal length (a camera that never turns) or less is seen than is sought.
    """
    off, _ = residuals(bundle, seen)
    free = _free_columns(bundle)
    freedom = 2 * len(off) - 3 * len(bundle.points) - len(free)
    if freedom <= 0:
        return FocalDeviation(np.inf, np.inf, np.inf)
    d = derivatives(bundle, seen)
    weight = huber_weights(off)
    root = np.sqrt(weight)[:, None]
    points = len(bundle.points)
    by_point = d.point * root[..., None]
    columns = sparse_columns(
        d.pose * root[..., None], seen.frame, len(bundle.poses), d.focal * root
    )
    columns = columns[:, free]
    squares = sum_by(seen.point, by_point.swapaxes(1, 2) @ by_point, points)
    size = np.trace(squares, axis1=1, axis2=2)[:, None, None]
    inverse = np.linalg.inv(squares + 1e-12 * size * np.eye(3))
    mixed = mixed_rows(by_point, seen.point, points, columns)
    whitened = block_rows(np.linalg.cholesky(inverse).swapaxes(1, 2), mixed)
    reduced = (columns.T @ columns - whitened.T @ whitened).toarray()
    answer = _last_column_of_inverse(reduced)
    if answer is None:
        return FocalDeviation(np.inf, np.inf, np.inf)
    # How much each residual moves the focal length.
    by_points = (inverse @ (mixed @ answer).reshape(points, 3, 1))[..., 0]
    pull = (columns @ answer).reshape(-1, 2) - np.einsum(
        "mij,mj->mi", by_point, by_points[seen.point]
    )
    moved = (pull * off * root).sum(axis=1)
    scale = float((weight[:, None] * off**2).sum()) / freedom
    # Residuals are smaller than errors, as they were fitted: so many freedoms are left of so many.
    inflation = 2 * len(off) / freedom
    by_track = np.bincount(seen.point, moved, points)
    return FocalDeviation(
        float(np.sqrt(scale * answer[-1])),
        float(np.sqrt(inflation * (by_track**2).sum())),
        float(np.sqrt(inflation * (_by_cell(moved, seen) ** 2).sum())),
    )


def _free_columns(bundle: Bundle) -> NDArray[np.int64]:
    """All but the first pose and, where no rig holds the scale, the largest shift of the pose that
    is farthest from it."""
    frames = len(bundle.poses)
    every = np.arange(6, 6 * frames + 1)
    if bundle.rig[:, :3, 3].any():
        return every
    away = bundle.poses[:, :3, 3] - bundle.poses[0, :3, 3]
    farthest = int(np.linalg.norm(away, axis=1).argmax())
    held = 6 * farthest + 3 + int(np.abs(away[farthest]).argmax())
    return every[every != held]


def _last_column_of_inverse(matrix: FloatArray) -> FloatArray | None:
    """None where the matrix is singular."""
    size = np.sqrt(matrix.diagonal())
    if not (size > 0).all():
        return None
    scaled = matrix / size / size[:, None]
    unit = np.zeros(len(matrix))
    unit[-1] = 1.0
    try:
        lower = np.linalg.cholesky(scaled)
    except np.linalg.LinAlgError:
        return None
    answer = np.linalg.solve(lower.T, np.linalg.solve(lower, unit))
    # Twice as exact: the focal length and the depths are nearly one.
    answer += np.linalg.solve(lower.T, np.linalg.solve(lower, unit - scaled @ answer))
    return np.asarray(answer / size / size[-1])


def _by_cell(moved: FloatArray, seen: Sightings) -> FloatArray:
    low, high = seen.places.min(axis=0), seen.places.max(axis=0)
    cell: NDArray[Any] = ((seen.places - low) / (high - low + 1e-9) * _CELLS).astype(np.int64)
    return np.asarray(np.bincount(cell[:, 0] * _CELLS + cell[:, 1], moved), np.float64)
