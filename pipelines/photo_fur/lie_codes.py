"""How hair lies on a mesh, in two bytes a vertex, as packages hold it.

The direction is an angle in the tangent plane, from where nose to tail leads, counter-clockwise as
seen from outside, in 256 steps of a full turn; the length is in steps of 1 / 255 of the thickness.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.photo_fur.laid_fur import Hair

_STEPS = 256
_LEAST = 1e-3
"""Of the way from nose to tail along the surface, that has a direction."""


def lie_codes(
    hair: Hair, normals: NDArray[np.floating], backwards: NDArray[np.floating]
) -> NDArray[np.uint8]:
    """Codes (2, V) of direction and length; normals (V, 3), backwards: from nose to tail.

    >>> normals = np.array([[0.0, 0.0, 1.0]])
    >>> hair = Hair(np.array([[0.0, 1.0, 0.0]]), np.array([0.5]))
    >>> lie_codes(hair, normals, np.array([1.0, 0.0, 0.0])).tolist()
    [[64], [128]]
    """
    east, north = _axes(normals, backwards)
    angle = np.arctan2(
        np.einsum("vi,vi->v", hair.tangents, north), np.einsum("vi,vi->v", hair.tangents, east)
    )
    direction = np.rint(angle * (_STEPS / (2 * np.pi))).astype(np.int64) % _STEPS
    length = np.rint(255 * np.clip(hair.lengths, 0.0, 1.0))
    return np.stack([direction, length]).astype(np.uint8)


def hair_of_codes(
    codes: NDArray[np.uint8], normals: NDArray[np.floating], backwards: NDArray[np.floating]
) -> Hair:
    """The hair that codes (2, V) stand for: tangents to the surface, in double precision.

    >>> normals = np.array([[0.0, 0.0, 1.0]])
    >>> hair = hair_of_codes(np.array([[64], [255]], np.uint8), normals, np.array([1.0, 0.0, 0.0]))
    >>> hair.tangents.round(3).tolist(), hair.lengths.tolist()
    ([[0.0, 1.0, 0.0]], [1.0])
    """
    east, north = _axes(normals, backwards)
    angle = codes[0, :, None].astype(np.float64) * (2 * np.pi / _STEPS)
    return Hair(np.cos(angle) * east + np.sin(angle) * north, codes[1] / 255.0)


def _axes(
    normals: NDArray[np.floating], backwards: NDArray[np.floating]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit vectors (V, 3) along the surface: towards the tail, or where that is straight out
    towards the coordinate axis that is farthest from it; and to the left of it."""
    up = normals.astype(np.float64)
    other = np.eye(3)[np.argmin(np.abs(backwards))]
    along, aside = (way - up * (up @ way)[:, None] for way in (backwards, other))
    length = np.linalg.norm(along, axis=1, keepdims=True)
    east = np.where(length < _LEAST * np.linalg.norm(backwards), aside, along)
    east = east / np.maximum(np.linalg.norm(east, axis=1, keepdims=True), 1e-30)
    return east, np.cross(up, east)
