"""Bundle adjustment: poses, points and a focal length that together explain what was seen.

Triggs and others, "Bundle adjustment: a modern synthesis" (2000): Levenberg and Marquardt's steps
on the normal equations with the points eliminated (Schur's complement). The cameras of a rig move
as one; poses and the focal length may have priors. ``focal_deviation`` uses the same derivatives.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.integer[Any]]

_HUBER = 1.0
"""Pixels, from which on a residual counts by its size instead of its square."""
_STEPS = 40
_ENOUGH = 1e-6
"""Relative fall of the cost that ends it."""


class Sightings(NamedTuple):
    """m places of pictures at which points were found."""

    frame: IntArray
    """(m,), instants."""
    camera: IntArray
    """(m,), cameras of the rig."""
    point: IntArray
    """(m,)."""
    places: FloatArray
    """(m, 2), pixels; the middle of the first pixel is at (0, 0)."""

    def some(self, chosen: NDArray[Any]) -> Sightings:
        """Those at ``chosen``: rows, or a bool for each."""
        return Sightings(
            self.frame[chosen], self.camera[chosen], self.point[chosen], self.places[chosen]
        )


class Bundle(NamedTuple):
    """f instants of a rig of c cameras, n points."""

    poses: FloatArray
    """(f, 4, 4), rig to world."""
    rig: FloatArray
    """(c, 4, 4), camera to rig; of one camera the identity."""
    intrinsics: FloatArray
    """(c, 3, 3), K."""
    points: FloatArray
    """(n, 3)."""


class Priors(NamedTuple):
    """What is known before, as standard deviations about the bundle's own values; inf: nothing."""

    place: float = np.inf
    """Of each pose's place, in the world's unit."""
    turn: float = np.inf
    """Of each pose's direction, radians."""
    focal: float = 0.0
    """Of the logarithm of the focal lengths' common factor; 0: they are known."""


class Derivatives(NamedTuple):
    """Of the residuals (m, 2) by what is sought."""

    pose: FloatArray
    """(m, 2, 6), a turn in the rig's axes, then a shift in the world's."""
    point: FloatArray
    """(m, 2, 3)."""
    focal: FloatArray
    """(m, 2), the logarithm of the focal lengths' factor."""


def residuals(bundle: Bundle, seen: Sightings) -> tuple[FloatArray, FloatArray]:
    """Where points are seen less where they were found (m, 2), pixels, and their depths (m,)."""
    camera, _ = _in_cameras(bundle, seen)
    lens = bundle.intrinsics[seen.camera]
    flat = camera[:, :2] / camera[:, 2:]
    places = flat * lens[:, [0, 1], [0, 1]] + lens[:, [0, 1], [2, 2]]
    return places - seen.places, camera[:, 2]


def derivatives(bundle: Bundle, seen: Sightings) -> Derivatives:
    """Of :func:`residuals`."""
    camera, in_rig = _in_cameras(bundle, seen)
    lens = bundle.intrinsics[seen.camera]
    scale = lens[:, [0, 1], [0, 1]] / camera[:, 2:]
    flat = camera[:, :2] / camera[:, 2:]
    by_camera = np.zeros((len(camera), 2, 3))
    by_camera[:, [0, 1], [0, 1]] = scale
    by_camera[:, :, 2] = -scale * flat
    to_camera = np.swapaxes(bundle.rig[:, :3, :3], 1, 2)[seen.camera]
    by_rig = by_camera @ to_camera
    to_rig = np.swapaxes(bundle.poses[:, :3, :3], 1, 2)[seen.frame]
    by_point = by_rig @ to_rig
    by_turn = -by_rig @ _cross_matrices(in_rig)
    focal = flat * lens[:, [0, 1], [0, 1]]
    return Derivatives(np.concatenate([by_turn, -by_point], axis=2), by_point, focal)


def adjust_bundle(
    bundle: Bundle,
    seen: Sightings,
    priors: Priors = Priors(),  # noqa: B008
    *,
    steps: int = _STEPS,
) -> Bundle:
    """The bundle that explains the sightings best.

    Residuals count by Huber's loss at one pixel. Without a prior of poses the bundle keeps the
    place, direction and scale it has as a whole only nearly: put it back by a similarity. Raises
    ValueError where a point is seen less than twice or no residual is left.
    """
    counts = np.bincount(seen.point, minlength=len(bundle.points))
    if not len(seen.point) or counts.min() < 2:
        raise ValueError("bundle: a point is seen less than twice; expected two sightings of each.")
    first, damping = bundle, 1e-4
    cost = _cost(bundle, first, seen, priors)
    for _ in range(steps):
        system = _System(bundle, first, seen, priors)
        while damping < 1e8:
            trial = system.moved(damping)
            new = _cost(trial, first, seen, priors)
            if new < cost:
                break
            damping *= 10
        else:
            return bundle
        fallen, bundle, cost = (cost - new) / cost, trial, new
        damping = max(damping / 10, 1e-9)
        if fallen < _ENOUGH:
            break
    return bundle


class _System:
    """The normal equations at a bundle, points eliminated."""

    def __init__(self, bundle: Bundle, first: Bundle, seen: Sightings, priors: Priors) -> None:
        self.bundle, self.seen = bundle, seen
        off, _ = residuals(bundle, seen)
        d = derivatives(bundle, seen)
        weight = np.sqrt(huber_weights(off))
        self.off = off * weight[:, None]
        self.free_focal = priors.focal > 0
        columns = d.pose * weight[:, None, None]
        self.by_point = d.point * weight[:, None, None]
        self.cameras = sparse_columns(
            columns, seen.frame, len(bundle.poses), (d.focal * weight[:, None])
        )
        if not self.free_focal:
            self.cameras = self.cameras[:, :-1]
        self.prior, self.prior_off = _prior_rows(bundle, first, priors, self.cameras.shape[1])

    def moved(self, damping: float) -> Bundle:
        """The bundle after one step."""
        points = len(self.bundle.points)
        squares = sum_by(self.seen.point, self.by_point.swapaxes(1, 2) @ self.by_point, points)
        squares += damping * squares * np.eye(3) + 1e-12 * np.eye(3)
        pull = sum_by(self.seen.point, (self.by_point.swapaxes(1, 2) @ self.off[..., None]), points)
        inverse = np.linalg.inv(squares)
        mixed = mixed_rows(self.by_point, self.seen.point, points, self.cameras)  # (3 n, k)
        gradient = self.cameras.T @ self.off.reshape(-1) + self.prior * self.prior_off
        whitened = block_rows(np.linalg.cholesky(inverse).swapaxes(1, 2), mixed)
        full = (self.cameras.T @ self.cameras).toarray() + np.diag(self.prior)
        full[np.diag_indices_from(full)] *= 1 + damping
        reduced = full - (whitened.T @ whitened).toarray()
        right = gradient - mixed.T @ (inverse @ pull).reshape(-1)
        reduced[np.diag_indices_from(reduced)] += 1e-12 * reduced.diagonal().max()
        step = -np.linalg.solve(reduced, right)
        by_points = -(inverse @ (pull + (mixed @ step).reshape(points, 3, 1)))[..., 0]
        return moved_bundle(self.bundle, step, by_points)


def moved_bundle(bundle: Bundle, step: FloatArray, by_points: FloatArray) -> Bundle:
    """Turns and shifts (6 f,) of the poses applied, then the logarithm of the focal lengths' factor
    where there is one more, and shifts (n, 3) of the points."""
    from scipy.spatial.transform import Rotation

    frames = len(bundle.poses)
    by_pose = step[: 6 * frames].reshape(frames, 6)
    poses = bundle.poses.copy()
    # A turn of what is seen is the contrary turn of who sees it.
    poses[:, :3, :3] = poses[:, :3, :3] @ Rotation.from_rotvec(-by_pose[:, :3]).as_matrix()
    poses[:, :3, 3] += by_pose[:, 3:]
    intrinsics = bundle.intrinsics
    if len(step) > 6 * frames:
        intrinsics = intrinsics.copy()
        intrinsics[:, [0, 1], [0, 1]] *= np.exp(step[-1])
    return Bundle(poses, bundle.rig, intrinsics, bundle.points + by_points)


def huber_weights(off: FloatArray) -> FloatArray:
    """(m,), of squares of residuals (m, 2)."""
    return np.minimum(1.0, _HUBER / np.maximum(np.linalg.norm(off, axis=1), 1e-12))


# ---- sparse parts ------------------------------------------------------------------------------


def sparse_columns(by_pose: FloatArray, frame: IntArray, frames: int, by_focal: FloatArray) -> Any:
    """(2 m, 6 frames + 1) sparse: residuals by poses, and by the focal length at the end."""
    from scipy.sparse import csr_array

    count = len(by_pose)
    columns = 6 * frame[:, None] + np.arange(6)
    columns = np.column_stack([columns, np.full(count, 6 * frames)]).astype(np.int64)
    values = np.concatenate([by_pose, by_focal[:, :, None]], axis=2)
    starts = np.arange(0, 14 * count + 1, 7)
    return csr_array(
        (values.reshape(-1), np.repeat(columns, 2, axis=0).reshape(-1), starts),
        shape=(2 * count, 6 * frames + 1),
    )


def mixed_rows(by_point: FloatArray, point: IntArray, points: int, cameras: Any) -> Any:
    """(3 points, k) sparse: the transpose of derivatives (m, 2, 3) by points times ``cameras``."""
    from scipy.sparse import csr_array

    count = len(by_point)
    columns = np.repeat(3 * point[:, None] + np.arange(3), 2, axis=0)
    starts = np.arange(0, 6 * count + 1, 3)
    sparse = csr_array(
        (by_point.reshape(-1), columns.reshape(-1), starts), shape=(2 * count, 3 * points)
    )
    return (sparse.T @ cameras).tocsr()


def block_rows(blocks: FloatArray, rows: Any) -> Any:
    """Blocks (n, 3, 3) on a diagonal times sparse rows (3 n, k)."""
    from scipy.sparse import bsr_array

    count = len(blocks)
    diagonal = bsr_array((blocks, np.arange(count), np.arange(count + 1)))
    return (diagonal.tocsr() @ rows).tocsr()


def sum_by(number: IntArray, values: FloatArray, count: int) -> FloatArray:
    """Sums (count, …) of values (m, …) of each number (m,)."""
    flat = values.reshape(len(values), math.prod(values.shape[1:]))
    sums = [np.bincount(number, column, count) for column in flat.T]
    return np.stack(sums, axis=1).astype(np.float64).reshape(count, *values.shape[1:])


# ---- geometry and priors -----------------------------------------------------------------------


def _in_cameras(bundle: Bundle, seen: Sightings) -> tuple[FloatArray, FloatArray]:
    """Points (m, 3) in the axes of their cameras, and of their rigs."""
    poses, rig = bundle.poses[seen.frame], bundle.rig[seen.camera]
    away = bundle.points[seen.point] - poses[:, :3, 3]
    in_rig = np.einsum("mji,mj->mi", poses[:, :3, :3], away)
    return np.einsum("mji,mj->mi", rig[:, :3, :3], in_rig - rig[:, :3, 3]), in_rig


def _cross_matrices(vectors: FloatArray) -> FloatArray:
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), -1, 0)


def _cost(bundle: Bundle, first: Bundle, seen: Sightings, priors: Priors) -> float:
    off, depth = residuals(bundle, seen)
    if not (depth > 0).all():
        behind = depth <= 0
        if behind.any() and not (residuals(first, seen)[1][behind] <= 0).all():
            return np.inf
    size = np.linalg.norm(off, axis=1)
    cost = np.where(size < _HUBER, size**2, 2 * _HUBER * size - _HUBER**2).sum()
    columns = 6 * len(bundle.poses) + (priors.focal > 0)
    weight, apart = _prior_rows(bundle, first, priors, columns)
    return float(cost + (weight * apart**2).sum())


def _prior_rows(
    bundle: Bundle, first: Bundle, priors: Priors, columns: int
) -> tuple[FloatArray, FloatArray]:
    """Weights and residuals (columns,) of what is known of poses and the focal length."""
    from scipy.spatial.transform import Rotation

    frames = len(bundle.poses)
    weight, apart = np.zeros(columns), np.zeros(columns)
    turned = first.poses[:, :3, :3].swapaxes(1, 2) @ bundle.poses[:, :3, :3]
    by_pose = np.column_stack(
        [
            -Rotation.from_matrix(turned).as_rotvec(),
            bundle.poses[:, :3, 3] - first.poses[:, :3, 3],
        ]
    )
    apart[: 6 * frames] = by_pose.reshape(-1)
    deviation = np.repeat([priors.turn, priors.place], 3)
    weight[: 6 * frames] = np.tile(1 / deviation**2, frames)
    if columns > 6 * frames:
        apart[-1] = np.log(bundle.intrinsics[0, 0, 0] / first.intrinsics[0, 0, 0])
        weight[-1] = 1 / priors.focal**2
    return weight, apart
