"""Rays through the pixels of the stage's camera, and its view vectors."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera

FloatArray = NDArray[np.float64]


def camera_rays(
    camera: Camera, size: tuple[int, int], places: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Origins and unit directions (P, 3) of the rays through places (P, 2) of the picture.

    ``size`` is (width, height); a place is (column, row) in pixels from the upper left corner: the
    middle of the first pixel is (0.5, 0.5).
    """
    width, height = size
    position, target = np.asarray(camera.position, float), np.asarray(camera.target, float)
    forward = _unit(target - position)
    right = _unit(np.cross(forward, np.asarray(camera.up, float)))
    up = np.cross(right, forward)
    extent = (
        camera.height
        if camera.height is not None
        else 2 * math.tan(math.radians(camera.view_angle) / 2)
    )
    along = (places - np.array([width, height]) / 2) * (extent / height)
    offsets = along[:, :1] * right - along[:, 1:] * up
    if camera.height is not None:
        return position + offsets, np.broadcast_to(forward, offsets.shape)
    return np.broadcast_to(position, offsets.shape), _unit(forward + offsets)


def pixel_centres(size: tuple[int, int]) -> FloatArray:
    """Places (width * height, 2) of the pixels' middles, row by row from the top."""
    width, height = size
    column, row = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    return np.stack([column.ravel(), row.ravel()], axis=-1)


def eye(camera: Camera) -> NDArray[np.float64]:
    """(4,): the view vector of a point x is the direction of eye[:3] - eye[3] x."""
    position, target = np.asarray(camera.position, float), np.asarray(camera.target, float)
    if camera.height is not None:
        return np.append(_unit(position - target), 0.0)
    return np.append(position, 1.0)


def view_vectors(camera: Camera, points: FloatArray) -> FloatArray:
    """Unit vectors (P, 3) from points (P, 3) towards the camera."""
    seen_from = eye(camera)
    return _unit(seen_from[:3] - seen_from[3] * points)


def _unit(vectors: FloatArray) -> FloatArray:
    unit: FloatArray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit
