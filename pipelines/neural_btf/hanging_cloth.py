"""A cloth that hangs from a rod, and what is around it: meshes for live pictures.

z is up; the cloth's front looks along -y. It is 2 wide, and hangs down some 1.8.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

_COLUMNS, _ROWS = 56, 28
"""Few: pixels are shaded in blocks of four, and blocks on edges of triangles more than once."""
_TOP, _BOTTOM = 0.88, -0.92
_ROD_RADIUS = 0.022
_ROD_HALF = 1.2
_ROD_SIDES = 24
_ROD_COLOUR = (0.30, 0.19, 0.10)
_DOME_RADIUS = 14.0
_DOME_COLUMNS, _DOME_ROWS = 48, 24
_DOME_GLOW = (0.052, 0.055, 0.064)
_DOME_DARK = (0.009, 0.010, 0.012)


class HangingCloth(NamedTuple):
    """A cloth; vectors in world space, V vertices, F triangles."""

    vertices: Floats
    triangles: NDArray[np.uint32]
    normals: Floats
    tangents: Floats
    """(V, 3) unit vectors along u on the surface."""
    places: Floats
    """(V, 2) in the material, where the cloth's width is 1: times tiles, a tile is 1."""


class Surroundings(NamedTuple):
    """What is not cloth: it shines by itself."""

    vertices: Floats
    triangles: NDArray[np.uint32]
    radiance: Floats
    """(V, 3) linear RGB, as it is shown."""


def hanging_cloth(aspect: float) -> HangingCloth:
    """A cloth held at three places of its upper edge, with folds that deepen downwards.

    ``aspect`` is the height of the material's photographs over their width.

    >>> cloth = hanging_cloth(1.0)
    >>> cloth.vertices.shape, float(cloth.normals[:, 1].max()) < 0
    ((1568, 3), True)
    """
    across, up = np.meshgrid(np.linspace(-1, 1, _COLUMNS), np.linspace(0, 1, _ROWS))
    down = 1.0 - up
    sag = 0.075 * np.sin(math.pi * across) ** 2 * np.exp(-1.6 * down)
    height = _BOTTOM + (_TOP - _BOTTOM) * up - sag
    phase = 2.5 * math.pi * (across + 0.07 * np.sin(2.1 * height) - 0.1)
    depth = (0.03 + 0.07 * down**0.8) * np.sin(phase)
    depth += 0.022 * down * np.sin(1.9 * phase + 1.3) + 0.03 * down * across
    narrow = across * (1.0 - 0.06 * down * (1.0 - down) - 0.02 * down)
    points = np.stack([narrow, depth - 0.03, height], axis=-1)
    along_u, along_v = np.gradient(points, axis=1), np.gradient(points, axis=0)
    normals = np.cross(along_u, along_v)
    places = np.stack([across / 2, up * (_TOP - _BOTTOM) / 2 / aspect], axis=-1)
    return HangingCloth(
        _rows(points), _grid(_ROWS, _COLUMNS), _unit(normals), _unit(along_u), _rows(places)
    )


def surroundings() -> Surroundings:
    """A wooden rod that the cloth hangs from, in a dark room that glows behind it."""
    rod, dome = _rod(), _dome()
    return Surroundings(
        np.concatenate([rod.vertices, dome.vertices]),
        np.concatenate([rod.triangles, dome.triangles + np.uint32(len(rod.vertices))]),
        np.concatenate([rod.radiance, dome.radiance]),
    )


def _rod() -> Surroundings:
    angle, x = np.meshgrid(
        np.linspace(0, 2 * math.pi, _ROD_SIDES + 1), [-_ROD_HALF, _ROD_HALF], indexing="ij"
    )
    outward = np.stack([np.zeros_like(x), np.cos(angle), np.sin(angle)], axis=-1)
    points = _ROD_RADIUS * outward + np.array([0.0, -0.03, _TOP + 0.6 * _ROD_RADIUS])
    points[..., 0] = x
    lit = 0.06 + np.clip(outward @ np.array([0.0, -0.5, 0.85]), 0.0, None)
    radiance = lit[..., None] * np.array(_ROD_COLOUR)
    return Surroundings(_rows(points), _grid(_ROD_SIDES + 1, 2), _rows(radiance))


def _dome() -> Surroundings:
    around, above = np.meshgrid(
        np.linspace(0, 2 * math.pi, _DOME_COLUMNS + 1),
        np.linspace(-math.pi / 2, math.pi / 2, _DOME_ROWS + 1),
    )
    outward = np.stack(
        [np.cos(above) * np.cos(around), np.cos(above) * np.sin(around), np.sin(above)], axis=-1
    )
    behind = np.clip(0.5 + 0.5 * (outward @ np.array([-0.30, 0.95, -0.08])), 0.0, 1.0)
    glow = behind[..., None] ** 14
    radiance = glow * np.array(_DOME_GLOW) + (1.0 - glow) * np.array(_DOME_DARK)
    return Surroundings(
        _rows(_DOME_RADIUS * outward), _grid(_DOME_ROWS + 1, _DOME_COLUMNS + 1), _rows(radiance)
    )


def _grid(rows: int, columns: int) -> NDArray[np.uint32]:
    """Triangles of a grid of vertices, counter-clockwise where columns go right and rows up."""
    corner = np.arange(rows * columns, dtype=np.uint32).reshape(rows, columns)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def _rows(values: NDArray[np.float64]) -> Floats:
    return np.ascontiguousarray(values.reshape(-1, values.shape[-1]), np.float32)


def _unit(vectors: NDArray[np.float64]) -> Floats:
    return _rows(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
