"""Rotations and places as files have them, and rigid motions made of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput

FARTHEST = 1e8
"""Metres: more than any coordinate on earth, in whatever grid."""

_ROTATION_TOLERANCE = 5e-3  # of matrices written with three decimals


def rotation(
    file: Path, field: str, matrix: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """The nearest rotation (3, 3) of a matrix that is one, but for decimals and a scale; the scale.

    Raises BadInput for a matrix that is mirrored, sheared or scaled differently along its axes.
    """
    expected = "orthonormal, right-handed axes in columns 1 to 3"
    largest = np.abs(matrix).max()
    # Divided first: squares of large entries overflow, those of small ones vanish.
    scaled = matrix / largest if 1e-150 < largest < np.inf else np.zeros((3, 3))
    determinant = float(scaled[:, 0] @ np.cross(scaled[:, 1], scaled[:, 2]))
    if abs(determinant) < 1e-9:
        raise BadInput(file, field, "no rotation (its axes lie in a plane)", expected)
    scale = np.cbrt(abs(determinant))
    off = np.abs(scaled.T @ scaled / scale**2 - np.eye(3)).max()
    if off > _ROTATION_TOLERANCE:
        found = "no rotation (sheared, or scaled differently along its axes)"
        raise BadInput(file, field, found, expected)
    if determinant < 0:
        raise BadInput(file, field, "no rotation (mirrored)", expected)
    # Whoever uses a pose takes the transpose for the inverse; a few decimals are not enough.
    left, _, right = np.linalg.svd(scaled)
    return left @ right, float(scale * largest)


def place(file: Path, field: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """A camera's place as it is; raises BadInput where it cannot be one on earth."""
    if not np.isfinite(values).all():
        raise BadInput(file, field, "not finite", "a place in finite numbers")
    if np.abs(values).max() > FARTHEST:
        raise BadInput(
            file, field, f"a place {np.abs(values).max():.3g} m away", "a place on earth"
        )
    return values


def quaternion_rotation(
    file: Path, field: str, quaternion: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(3, 3) of a quaternion w, x, y, z, made a unit one; raises BadInput where it is none."""
    largest = float(np.abs(quaternion).max())
    length = float(np.linalg.norm(quaternion)) if largest < 2 else largest  # no squares of 1e200
    if not 0.5 < length < 2:
        found = f"a quaternion of length {length:.3g}"
        raise BadInput(file, field, found, "a unit quaternion w, x, y, z")
    w, x, y, z = quaternion / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rigid(turn: NDArray[np.float64], where: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4) of a rotation (3, 3) and a place (3,)."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, where
    return pose


def inverse(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4) of a rigid motion, the other way."""
    return rigid(pose[:3, :3].T, -pose[:3, :3].T @ pose[:3, 3])
