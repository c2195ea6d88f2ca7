"""Axes of all lobes at all vertices, fast: where d has to be known in a frame.

The same axes as ``shading.lobes`` has, in float32 and without the rest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from pipelines.ssdf_lighting.light.microfacets import LEAST_VIEW
from pipelines.ssdf_lighting.light.shading import LobeTables
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights

Array = NDArray[np.float32]


class AxisTables:
    """Tables for ``lobe_axes``, of the lights and materials of ``tables``."""

    def __init__(self, tables: LobeTables, has_gloss: NDArray[np.bool_]) -> None:
        cosine, gloss = tables
        self.matt: Array = np.stack([cosine.along, cosine.up], axis=-1).astype(np.float32)
        """(N, columns, 2)"""
        self.gloss: Array = np.stack([gloss.sharpness, gloss.along, gloss.up], axis=-1).astype(
            np.float32
        )
        """(M, columns, 3)"""
        self.gloss[~has_gloss, :, 0] = -1.0


class _Sources(NamedTuple):
    """What all vertices share: the tables of ``AxisTables``; the lights' axes (N, 3) and their
    sharpness (N,), single precision."""

    matt: Array
    gloss: Array
    towards: Array
    sharpness: Array


def lobe_axes(
    points: Array,
    normals: Array,
    material: NDArray[np.int32],
    eye: NDArray[np.floating],
    tables: AxisTables,
    lights: Lights,
) -> Array:
    """Axes (V, 2 N, 3) float32 unit vectors: N of the matt part, then N of the gloss.

    points, normals: (V, 3); material: (V,); eye: (4,), see ``camera_rays.eye``. Zeros stand for the
    gloss of what has none: no distance is needed there.
    """
    axes = np.empty((len(points), 2 * len(lights.sharpness), 3), np.float32)
    towards, sharpness = lights.axes.astype(np.float32), lights.sharpness.astype(np.float32)
    sources = _Sources(tables.matt, tables.gloss, towards, sharpness)
    _fill(points, normals, material, np.asarray(eye, np.float32), sources, axes)
    return axes


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "arcp", "nsz"})
def _at_vertex(
    point: Array, n: Array, material: int, eye: Array, sources: _Sources, axes: Array
) -> None:
    matt, gloss, towards, sharpness = sources
    one = np.float32(1.0)
    count, last = len(sharpness), matt.shape[1] - 1
    for k in range(count):
        px, py, pz = towards[k, 0], towards[k, 1], towards[k, 2]
        cosine = n[0] * px + n[1] * py + n[2] * pz
        place = min(max((cosine + one) * np.float32(0.5), np.float32(0.0)), one) * np.float32(last)
        left = min(int(place), last - 1)
        part = place - np.float32(left)
        a = matt[k, left, 0] + part * (matt[k, left + 1, 0] - matt[k, left, 0])
        b = matt[k, left, 1] + part * (matt[k, left + 1, 1] - matt[k, left, 1])
        x, y, z = a * px + b * n[0], a * py + b * n[1], a * pz + b * n[2]
        scale = one / math.sqrt(x * x + y * y + z * z)
        axes[k, 0], axes[k, 1], axes[k, 2] = x * scale, y * scale, z * scale
    if gloss[material, 0, 0] < 0:
        axes[count:] = np.float32(0.0)
        return
    vx, vy, vz = eye[0] - eye[3] * point[0], eye[1] - eye[3] * point[1], eye[2] - eye[3] * point[2]
    scale = one / math.sqrt(vx * vx + vy * vy + vz * vz)
    vx, vy, vz = vx * scale, vy * scale, vz * scale
    n_o = vx * n[0] + vy * n[1] + vz * n[2]
    held = min(max(n_o, np.float32(LEAST_VIEW)), one)
    last = gloss.shape[1] - 1
    place = held * np.float32(last)
    left = min(int(place), last - 1)
    part = place - np.float32(left)
    kappa = gloss[material, left, 0] * (one - part) + part * gloss[material, left + 1, 0]
    a = gloss[material, left, 1] * (one - part) + part * gloss[material, left + 1, 1]
    b = gloss[material, left, 2] * (one - part) + part * gloss[material, left + 1, 2]
    b += np.float32(2.0) * a * n_o
    rx, ry, rz = b * n[0] - a * vx, b * n[1] - a * vy, b * n[2] - a * vz
    scale = kappa / math.sqrt(rx * rx + ry * ry + rz * rz)
    rx, ry, rz = rx * scale, ry * scale, rz * scale
    for k in range(count):
        x = rx + sharpness[k] * towards[k, 0]
        y = ry + sharpness[k] * towards[k, 1]
        z = rz + sharpness[k] * towards[k, 2]
        scale = one / math.sqrt(x * x + y * y + z * z)
        row = count + k
        axes[row, 0], axes[row, 1], axes[row, 2] = x * scale, y * scale, z * scale


@njit(cache=True, error_model="numpy", parallel=True, nogil=True)
def _fill(
    points: Array,
    normals: Array,
    material: NDArray[np.int32],
    eye: Array,
    sources: _Sources,
    axes: Array,
) -> None:
    for v in prange(len(points)):
        _at_vertex(points[v], normals[v], material[v], eye, sources, axes[v])
