"""Directions on the hemisphere above a surface, and the tables that goniometers measure.

A direction is (theta, phi) in radians: theta from the surface's normal z, phi from the texture's
axis x (u, to the right) towards y (v, up). A pair is a view with a light; pairs are numbered
``view * lights + light``, so that all photographs of one view stand together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Ring = tuple[float, int, float]
"""Degrees from the normal, number of azimuths, degrees of the first one."""

_BONN_2003: Sequence[_Ring] = (
    (0.0, 1, 0.0), (15.0, 6, 0.0), (30.0, 12, 0.0), (45.0, 18, 0.0), (60.0, 20, 0.0),
    (75.0, 24, 0.0),
)  # fmt: skip
_BONN_2014: Sequence[_Ring] = (
    (0.0, 1, 0.0), (11.0, 6, 15.0), (23.5, 12, 0.0), (30.0, 12, 15.0), (37.5, 12, 0.0),
    (45.0, 18, 0.0), (52.5, 18, 7.5), (60.0, 24, 0.0), (67.5, 24, 7.5), (75.0, 24, 0.0),
)  # fmt: skip
_HALF: Sequence[_Ring] = (
    (0.0, 1, 0.0), (15.0, 6, 0.0), (30.0, 6, 0.0), (45.0, 6, 0.0), (60.0, 10, 0.0),
    (75.0, 12, 0.0),
)  # fmt: skip
_COARSE: Sequence[_Ring] = ((0.0, 1, 0.0), (30.0, 6, 0.0), (60.0, 8, 0.0))

_TABLES = {15: _COARSE, 41: _HALF, 81: _BONN_2003, 151: _BONN_2014}


class Pairs(NamedTuple):
    """Light and view of every photograph: (image, 2) float64 each, theta and phi in radians."""

    light: NDArray[np.float64]
    view: NDArray[np.float64]


def hemisphere_table(count: int) -> NDArray[np.float64]:
    """Directions (count, 2) of a goniometer, ring by ring, radians.

    81 are those of UBO2003, ATRIUM and UTIA, 151 those of UBO2014; 41 are about half of the 81,
    and 15 a coarse table for quick looks. Raises ValueError for another count.
    """
    if count not in _TABLES:
        known = ", ".join(map(str, _TABLES))
        raise ValueError(f"directions is {count}; expected one of {known}.")
    rings = [
        (theta, first + 360.0 * step / number)
        for theta, number, first in _TABLES[count]
        for step in range(number)
    ]
    return np.radians(np.array(rings))


def all_pairs(views: NDArray[np.float64], lights: NDArray[np.float64]) -> Pairs:
    """Every view (V, 2) with every light (L, 2), as V * L pairs.

    >>> table = hemisphere_table(81)
    >>> pairs = all_pairs(table, table)
    >>> table.shape, pairs.light.shape, pairs.view.shape
    ((81, 2), (6561, 2), (6561, 2))
    """
    return Pairs(light=np.tile(lights, (len(views), 1)), view=np.repeat(views, len(lights), axis=0))


def unit_vectors(directions: ArrayLike) -> NDArray[np.float64]:
    """Directions (..., 2) as unit vectors (..., 3)."""
    theta, phi = np.moveaxis(np.asarray(directions, dtype=np.float64), -1, 0)
    return np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )


def stereographic(directions: ArrayLike) -> NDArray[np.float64]:
    """Directions (..., 2) on the plane (..., 2): radius tan(theta / 2) (paper 1, Eq. 7-9).

    The normal is the origin, the horizon the unit circle.

    >>> stereographic([[0.0, 0.0], [np.pi / 2, 0.0]]).round(6).tolist()
    [[0.0, 0.0], [1.0, 0.0]]
    """
    theta, phi = np.moveaxis(np.asarray(directions, dtype=np.float64), -1, 0)
    radius = np.tan(theta / 2)
    return np.stack([radius * np.cos(phi), radius * np.sin(phi)], axis=-1)


def stereographic_of_vectors(vectors: ArrayLike) -> NDArray[np.float64]:
    """Unit vectors (..., 3), z >= 0, on the same plane (..., 2)."""
    x, y, z = np.moveaxis(np.asarray(vectors, dtype=np.float64), -1, 0)
    return np.stack([x, y], axis=-1) / (1.0 + z)[..., None]


def angles_between(directions: ArrayLike, other: ArrayLike) -> NDArray[np.float64]:
    """Angle between directions (..., 2) and (..., 2) in radians; accurate where it is small."""
    one, two = unit_vectors(directions), unit_vectors(other)
    across = np.linalg.norm(np.cross(one, two), axis=-1)
    return np.arctan2(across, np.sum(one * two, axis=-1))
