"""Strokes on a body along which its hair is to lie."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

_EXPECTED = "expected points x,y,z with spaces between them, as in '0,0,1 1,0,1'"
_STRENGTH = 10.0
"""Of a stroke's guides, in the longest of the others."""


def strokes_of(text: str) -> list[NDArray[np.float64]]:
    """Strokes, points (n, 3), of a text. Raises ValueError where it is none.

    >>> [stroke.tolist() for stroke in strokes_of("0,0,1 1,0,1; 0,1,0 0,2,0.5")]
    [[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0]], [[0.0, 1.0, 0.0], [0.0, 2.0, 0.5]]]
    """
    strokes = []
    for line in filter(str.strip, text.split(";")):
        try:
            points = np.array([[float(x) for x in point.split(",")] for point in line.split()])
        except ValueError as error:
            raise ValueError(f"{line.strip()!r}: {_EXPECTED}") from error
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise ValueError(f"{line.strip()!r}: {_EXPECTED}")
        strokes.append(points)
    return strokes


def guides_along(
    strokes: Sequence[ArrayLike],
    reach: float,
    vertices: NDArray[np.floating],
    others: NDArray[np.floating],
) -> NDArray[np.float64]:
    """Guides (V, 3) with those within ``reach`` of a stroke replaced by its direction, tenfold.

    strokes: points (n, 3) from roots to tips, n >= 2, in mesh units as ``reach`` is; of several the
    last one counts. vertices (V, 3); others (V, 3): the guides elsewhere. Raises ValueError for a
    stroke of fewer than two different points, and one that no vertex is near.

    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> guides_along([[(0, 0, 0), (1, 0, 0)]], 0.2, corners, np.zeros((3, 3))).tolist()
    [[10.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    """
    from scipy.spatial import cKDTree

    guides = np.array(others, np.float64)
    strength = _STRENGTH * max(1.0, float(np.linalg.norm(guides, axis=1).max(initial=0.0)))
    for number, stroke in enumerate(strokes, 1):
        middles, ways = _pieces(np.asarray(stroke, np.float64), reach, number)
        distance, nearest = cKDTree(middles).query(vertices)
        near = distance <= reach
        if not near.any():
            raise ValueError(
                f"stroke {number} passes the mesh at {distance.min():.3g}; expected it within "
                f"{reach:.3g} of a vertex."
            )
        guides[near] = strength * ways[nearest[near]]
    return guides


def _pieces(
    points: NDArray[np.float64], reach: float, number: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A stroke cut into pieces shorter than its reach: their middles and directions (n, 3)."""
    begin, end = points[:-1], points[1:]
    lengths = np.linalg.norm(end - begin, axis=1)
    if not (len(lengths) and lengths.max() > 0):
        raise ValueError(f"stroke {number} has no length; expected two different points.")
    counts = np.maximum(1, np.ceil(4 * lengths / reach)).astype(int)
    ways = np.repeat((end - begin) / np.maximum(lengths, 1e-30)[:, None], counts, axis=0)
    middles = [
        a + (np.arange(count)[:, None] + 0.5) / count * (b - a)
        for a, b, count in zip(begin, end, counts, strict=True)
    ]
    return np.concatenate(middles), ways
