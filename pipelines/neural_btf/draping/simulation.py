"""A square cloth that falls onto the table: extended position based dynamics.

Small steps with one pass over the constraints each (Macklin and others, "Small steps in physics
simulation", 2019): threads keep their length, the weave shears more easily, and curvature along
threads costs energy, quadratic as for a sheet that does not stretch (Bergou and others, 2006).
Friction is Coulomb's. The same bits each time: one thread, and a fixed order.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.neural_btf.draping.table import HEIGHT, distance_and_normal

FloatArray = NDArray[np.float64]

SIDE = 2.0
"""Of the cloth, metres."""
PARTICLES = 61
"""A side."""
CLEARANCE = 0.006
"""Of threads above the table and the floor: half of the cloth's thickness, and what the smooth
surface sags between particles."""

_SECONDS, _STEP = 4.0, 1.0 / 1200.0
_TURN = math.radians(27.0)
_OFFSET = (0.05, -0.04)
_GRAVITY = 9.81
_FRICTION = 0.3
_SHEAR = 0.002
"""Part of a shear that a step takes back; of a stretch it is all."""
_BENDING = 0.004
"""Part of a curvature that a step takes back."""
_DRAG, _LATE_DRAG = 1.0, 5.0
"""Speed lost a second, while the cloth falls and while it comes to rest."""


@functools.cache
def fallen_cloth() -> FloatArray:
    """Positions (PARTICLES, PARTICLES, 3) of the cloth at rest, metres; rows go along v.

    >>> fallen_cloth().shape
    (61, 61, 3)
    """
    along = np.linspace(-SIDE / 2, SIDE / 2, PARTICLES)
    u, v = (values.ravel() for values in np.meshgrid(along, along))
    sine, cosine = math.sin(_TURN), math.cos(_TURN)
    x, y = cosine * u - sine * v + _OFFSET[0], sine * u + cosine * v + _OFFSET[1]
    position = np.stack([x, y, np.full_like(u, HEIGHT + 2 * CLEARANCE)], axis=-1)
    _simulate(position, PARTICLES, SIDE / (PARTICLES - 1), round(_SECONDS / _STEP))
    fallen = position.reshape(PARTICLES, PARTICLES, 3)
    fallen.setflags(write=False)
    return fallen


@njit(cache=True, nogil=True, error_model="numpy")
def _simulate(position: FloatArray, side: int, spacing: float, steps: int) -> None:
    """Moves positions (side * side, 3), spaced evenly at first, for so many steps."""
    before = position.copy()
    velocity = np.zeros_like(position)
    for step in range(steps):
        keep = 1.0 - (_LATE_DRAG if 2 * step > steps else _DRAG) * _STEP
        for i in range(len(position)):
            velocity[i, 2] -= _GRAVITY * _STEP
            for k in range(3):
                before[i, k] = position[i, k]
                position[i, k] += velocity[i, k] * _STEP
        _hold_weave(position, side, spacing)
        for i in range(len(position)):
            away, x, y, z = distance_and_normal(position[i, 0], position[i, 1], position[i, 2])
            _push(position, before, i, CLEARANCE - away, x, y, z)
            _push(position, before, i, CLEARANCE - position[i, 2], 0.0, 0.0, 1.0)
            for k in range(3):
                velocity[i, k] = keep * (position[i, k] - before[i, k]) / _STEP


@njit(cache=True, nogil=True, error_model="numpy")
def _hold_weave(position: FloatArray, side: int, spacing: float) -> None:
    """One pass over all constraints, those without a common particle together: no side is first."""
    diagonal = spacing * math.sqrt(2.0)
    for first in range(3):
        for row in range(side):
            for column in range(first, side - 2, 3):
                i, j = row * side + column, column * side + row
                _unbend(position, i, i + 1, i + 2)
                _unbend(position, j, j + side, j + 2 * side)
    for first in range(2):
        for row in range(side - 1):
            for column in range(first, side - 1, 2):
                i = row * side + column
                _hold(position, i, i + side + 1, diagonal, _SHEAR)
                _hold(position, i + 1, i + side, diagonal, _SHEAR)
    for first in range(2):
        for row in range(side):
            for column in range(first, side - 1, 2):
                i, j = row * side + column, column * side + row
                _hold(position, i, i + 1, spacing, 1.0)
                _hold(position, j, j + side, spacing, 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _hold(position: FloatArray, i: int, j: int, length: float, share: float) -> None:
    """Brings two points towards a distance."""
    x = position[j, 0] - position[i, 0]
    y = position[j, 1] - position[i, 1]
    z = position[j, 2] - position[i, 2]
    part = 0.5 * share * (1.0 - length / math.sqrt(x * x + y * y + z * z))
    position[i, 0] += part * x
    position[i, 1] += part * y
    position[i, 2] += part * z
    position[j, 0] -= part * x
    position[j, 1] -= part * y
    position[j, 2] -= part * z


@njit(cache=True, nogil=True, error_model="numpy")
def _unbend(position: FloatArray, i: int, middle: int, j: int) -> None:
    """Brings three points towards a line with even steps."""
    for k in range(3):
        part = _BENDING / 6.0 * (position[i, k] - 2.0 * position[middle, k] + position[j, k])
        position[i, k] -= part
        position[middle, k] += 2.0 * part
        position[j, k] -= part


@njit(cache=True, nogil=True, error_model="numpy")
def _push(
    position: FloatArray, before: FloatArray, i: int, depth: float, x: float, y: float, z: float
) -> None:
    """Moves a point by a depth along a normal, and back along the surface as friction does."""
    if depth <= 0.0:
        return
    dx = position[i, 0] + depth * x - before[i, 0]
    dy = position[i, 1] + depth * y - before[i, 1]
    dz = position[i, 2] + depth * z - before[i, 2]
    along = dx * x + dy * y + dz * z
    dx, dy, dz = dx - along * x, dy - along * y, dz - along * z
    slid = math.sqrt(dx * dx + dy * dy + dz * dz)
    part = 1.0 if slid <= _FRICTION * depth else _FRICTION * depth / slid
    position[i, 0] += depth * x - part * dx
    position[i, 1] += depth * y - part * dy
    position[i, 2] += depth * z - part * dz
