"""The sphere of directions as a square of n x n texels: the octahedral map.

A direction is projected onto the octahedron |x| + |y| + |z| = 1; its upper half, seen from above,
fills the diamond in the middle of the square, the lower half is folded out into the corners
(Meyer, Süßmuth, Sußner, Stamminger, Greiner, "On floating-point normal vectors", 2010). Column
runs with x, row with y. Texel (row, column) is direction number ``row * n + column``.

Edges of texels are arcs of great circles, for each face of the octahedron is projected from the
sphere's centre; so solid angles are exact. Texels differ 5 : 1 in them.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

NO_EDGE = math.pi
"""|d| where nothing is hidden, or everything: the farthest that an edge could be."""


class BilinearTaps(NamedTuple):
    """Bilinear interpolation: ``texels`` (..., 4) int32 numbers and ``weights`` (..., 4) float64,
    which sum to 1."""

    texels: NDArray[np.int32]
    weights: FloatArray


class DelaunaySides(NamedTuple):
    """``ends`` (E, 2) int32, directions at both ends of each side; ``triangles`` (T, 3) int32,
    directions at the corners; ``of_triangle`` (T, 3) int32, the sides after each corner."""

    ends: NDArray[np.int32]
    triangles: NDArray[np.int32]
    of_triangle: NDArray[np.int32]


def resolution_of(directions: int) -> int:
    """n of n x n directions. Raises ValueError for a count that is no even n squared, n >= 4."""
    n = math.isqrt(max(directions, 0))
    if n * n != directions or n % 2 or n < 4:
        raise ValueError(
            f"directions is {directions}; expected the square of an even number from 4 on, "
            "such as 1024, 4096 or 147456."
        )
    return n


def directions_of(square: ArrayLike) -> FloatArray:
    """Unit vectors (..., 3) of places (..., 2), x and y in [-1, 1], on the square."""
    x, y = np.moveaxis(np.asarray(square, dtype=np.float64), -1, 0)
    z = 1.0 - np.abs(x) - np.abs(y)
    lower = z < 0.0
    folded_x = np.where(lower, (1.0 - np.abs(y)) * _sign(x), x)
    folded_y = np.where(lower, (1.0 - np.abs(x)) * _sign(y), y)
    vectors = np.stack([folded_x, folded_y, z], axis=-1)
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def square_of(directions: ArrayLike) -> FloatArray:
    """Places (..., 2) in [-1, 1] on the square of directions (..., 3), not 0, of any length."""
    vectors = np.asarray(directions, dtype=np.float64)
    x, y, z = np.moveaxis(vectors / np.abs(vectors).sum(axis=-1, keepdims=True), -1, 0)
    lower = z < 0.0
    folded_x = np.where(lower, (1.0 - np.abs(y)) * _sign(x), x)
    folded_y = np.where(lower, (1.0 - np.abs(x)) * _sign(y), y)
    return np.stack([folded_x, folded_y], axis=-1)


def _sign(values: FloatArray) -> FloatArray:
    return np.where(values < 0.0, -1.0, 1.0)


@functools.lru_cache(maxsize=8)
def texel_directions(n: int) -> FloatArray:
    """Unit vectors (n * n, 3) to the texels' centres, read-only.

    >>> texel_directions(32).shape
    (1024, 3)
    """
    places = (np.arange(n) + 0.5) * (2.0 / n) - 1.0
    rows, columns = np.meshgrid(places, places, indexing="ij")
    made = directions_of(np.stack([columns, rows], axis=-1)).reshape(-1, 3)
    made.flags.writeable = False
    return made


@functools.lru_cache(maxsize=8)
def solid_angles(n: int) -> FloatArray:
    """Steradians (n * n,) of the texels, exact, read-only; they sum to 4 pi. ``n`` is even.

    A texel is two spherical triangles, cut along that of its diagonals which may be an edge of
    the octahedron (van Oosterom and Strackee 1983 for the triangles).
    """
    places = np.arange(n + 1) * (2.0 / n) - 1.0
    rows, columns = np.meshgrid(places, places, indexing="ij")
    corners = directions_of(np.stack([columns, rows], axis=-1))
    a, b = corners[:-1, :-1], corners[:-1, 1:]
    d, c = corners[1:, :-1], corners[1:, 1:]
    middle = (np.arange(n) + 0.5) * (2.0 / n) - 1.0
    # The octahedron's edges between its halves run as x + y = ±1 where x y > 0.
    falling = np.multiply.outer(middle, middle) > 0.0
    areas = np.where(
        falling,
        _triangle(a, b, d) + _triangle(b, c, d),
        _triangle(a, b, c) + _triangle(a, c, d),
    ).ravel()
    areas.flags.writeable = False
    return areas


def _triangle(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    volume = np.abs(np.einsum("...i,...i->...", a, np.cross(b, c)))
    sides = (np.einsum("...i,...i->...", *pair) for pair in ((a, b), (b, c), (c, a)))
    return 2.0 * np.arctan2(volume, 1.0 + sum(sides))


@functools.lru_cache(maxsize=8)
def delaunay_triangles(n: int) -> NDArray[np.int32]:
    """Triangles (2 n² - 4, 3) of direction numbers: the directions' Delaunay triangulation on the
    sphere, which is their convex hull; seen from outside counter-clockwise; read-only."""
    from scipy.spatial import ConvexHull

    points = texel_directions(n)
    corners = ConvexHull(points).simplices.astype(np.int32)
    a, b, c = points[corners].transpose(1, 0, 2)
    inward = np.einsum("ij,ij->i", a, np.cross(b - a, c - a)) < 0.0
    corners[inward] = corners[inward][:, [0, 2, 1]]
    corners.flags.writeable = False
    return corners


@functools.lru_cache(maxsize=4)
def delaunay_sides(n: int) -> DelaunaySides:
    """Sides of the Delaunay triangles of n x n directions."""
    triangles = delaunay_triangles(n)
    ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1), axis=-1)
    sides, number = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    return DelaunaySides(sides, triangles, number.reshape(-1, 3).astype(np.int32))


def bilinear_taps(directions: ArrayLike, n: int) -> BilinearTaps:
    """The four texels around directions (..., 3), and their weights.

    Beyond the square's border lies the same border, mirrored about its middle.

    >>> found = bilinear_taps([0.0, 0.0, 1.0], 4)
    >>> found.texels.tolist(), found.weights.tolist()
    ([5, 6, 9, 10], [0.25, 0.25, 0.25, 0.25])
    """
    place = (square_of(directions) + 1.0) * (n / 2.0) - 0.5
    first = np.floor(place).astype(np.int64)
    share = place - first
    column, row = first[..., 0], first[..., 1]
    texels = np.stack(
        [_wrapped(row + down, column + right, n) for down in (0, 1) for right in (0, 1)], axis=-1
    )
    right, down = share[..., 0], share[..., 1]
    weights = np.stack(
        [(1 - down) * (1 - right), (1 - down) * right, down * (1 - right), down * right], axis=-1
    )
    return BilinearTaps(texels, weights)


def _wrapped(row: NDArray[np.int64], column: NDArray[np.int64], n: int) -> NDArray[np.int32]:
    beyond = (row < 0) | (row >= n)
    row, column = np.clip(row, 0, n - 1), np.where(beyond, n - 1 - column, column)
    beyond = (column < 0) | (column >= n)
    row, column = np.where(beyond, n - 1 - row, row), np.clip(column, 0, n - 1)
    return (row * n + column).astype(np.int32)
