"""The six faces of a cube, as a picture holds them, to an equirectangular picture.

Two layouts mean one thing only: a cross, being the cube's net, and the column of faces in a file
whose ``envmap`` attribute says so (OpenEXR's ``ImfEnvmap.h``: +X, -X, +Y, -Y, +Z, -Z; y up, and x
to the left for who looks along +z, the middle of OpenEXR's equirectangular pictures). A bare row or
column of faces comes in several orders and hands, and is none of them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Triple = tuple[int, int, int]


class _Face(NamedTuple):
    """Where it lies in the layout, in faces; its middle, its right and its upper side as seen from
    within: x to the right, y up, z ahead."""

    row: int
    column: int
    middle: Triple
    right: Triple
    up: Triple


_RIGHT, _UP, _AHEAD = (1, 0, 0), (0, 1, 0), (0, 0, 1)
_LEFT, _DOWN, _BACK = (-1, 0, 0), (0, -1, 0), (0, 0, -1)
_ARMS = (
    _Face(0, 1, _UP, _RIGHT, _BACK),
    _Face(1, 0, _LEFT, _AHEAD, _UP),
    _Face(1, 1, _AHEAD, _RIGHT, _UP),
    _Face(1, 2, _RIGHT, _BACK, _UP),
    _Face(2, 1, _DOWN, _RIGHT, _AHEAD),
)
_LYING = (*_ARMS, _Face(1, 3, _BACK, _LEFT, _UP))  # 4 x 3 faces
_STANDING = (*_ARMS, _Face(3, 1, _BACK, _RIGHT, _DOWN))  # 3 x 4
_COLUMN = (
    _Face(0, 0, _LEFT, _AHEAD, _UP),
    _Face(1, 0, _RIGHT, _BACK, _UP),
    _Face(2, 0, _UP, _LEFT, _AHEAD),
    _Face(3, 0, _DOWN, _LEFT, _BACK),
    _Face(4, 0, _AHEAD, _RIGHT, _UP),
    _Face(5, 0, _BACK, _LEFT, _UP),
)
_BLOCK = 64  # rows at once
_EMPTY = 1e-3  # of the picture's mean, by which the corners of a cross may differ


def is_cross(width: int, height: int) -> bool:
    """Whether a picture of this size may be the net of a cube."""
    return (3 * width == 4 * height and width % 4 == 0) or (
        4 * width == 3 * height and width % 3 == 0
    )


def of_cross(picture: NDArray[Any]) -> NDArray[np.float32] | None:
    """(rows, columns, channels) to (2 n, 4 n, channels) of faces of n pixels; None where the
    corners that a cross leaves free are not of one value, so that it is none."""
    height, width, _ = picture.shape
    faces = _LYING if width > height else _STANDING
    size = max(width, height) // 4
    free = np.ones((height // size, width // size), bool)
    for face in faces:
        free[face.row, face.column] = False
    corners = picture[np.kron(free, np.ones((size, size), bool))]
    if np.ptp(corners, axis=0).max() > _EMPTY * picture.mean():
        return None
    return _unfolded(picture, faces, size)


def of_column(picture: NDArray[Any]) -> NDArray[np.float32]:
    """OpenEXR's (6 n, n, channels) to (2 n, 4 n, channels)."""
    return _unfolded(picture, _COLUMN, picture.shape[1])


def _unfolded(picture: NDArray[Any], faces: tuple[_Face, ...], size: int) -> NDArray[np.float32]:
    """Linear between a face's texels."""
    import cv2

    texels = np.ascontiguousarray(picture, np.float32)
    longitude = (np.arange(4 * size) + 0.5) / (4 * size) * 2 * np.pi - np.pi
    whole = np.empty((2 * size, 4 * size, picture.shape[2]), np.float32)
    for first in range(0, 2 * size, _BLOCK):
        rows = np.arange(first, min(first + _BLOCK, 2 * size))
        latitude = (np.pi / 2 - (rows + 0.5) / (2 * size) * np.pi)[:, None]
        x, z = np.cos(latitude) * np.sin(longitude), np.cos(latitude) * np.cos(longitude)
        direction = np.stack([x, np.sin(latitude) + 0 * longitude, z], axis=-1).astype(np.float32)
        across, down = _places(direction, faces, size)
        seen = cv2.remap(texels, across, down, cv2.INTER_LINEAR)
        whole[rows] = seen.reshape(*seen.shape[:2], -1)
    return whole


def _places(
    direction: NDArray[np.float32], faces: tuple[_Face, ...], size: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Column and row in the layout of what is seen in each direction, within its face."""
    across = np.empty(direction.shape[:2], np.float32)
    down = np.empty_like(across)
    nearest = np.stack([direction @ np.array(face.middle, "f4") for face in faces]).argmax(axis=0)
    for number, face in enumerate(faces):
        here = nearest == number
        seen = direction[here]
        seen = seen / (seen @ np.array(face.middle, "f4"))[:, None]
        column = (1 + seen @ np.array(face.right, "f4")) / 2 * size - 0.5
        row = (1 - seen @ np.array(face.up, "f4")) / 2 * size - 0.5
        across[here] = face.column * size + column.clip(0, size - 1)
        down[here] = face.row * size + row.clip(0, size - 1)
    return across, down
