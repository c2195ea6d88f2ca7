"""A bent scratch's own coordinates, compiled: u along its arc from its middle, v across it, to the
left.

``curvature`` is that of the arc, 1 / tile, positive to the left. A point (px, py) is in the
straight frame of the arc's middle: px along the scratch's direction there, py to its left.
"""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, nogil=True, inline="always")
def across_arc(px: float, py: float, curvature: float) -> float:
    """v of a point (px, py)."""
    if curvature == 0.0:
        return py
    ahead, aside = curvature * px, 1.0 - curvature * py
    # (1 - h) / curvature without the cancellation.
    h = math.sqrt(ahead * ahead + aside * aside)
    return (2.0 * py - curvature * (px * px + py * py)) / (1.0 + h)


@njit(cache=True, nogil=True, inline="always")
def along_arc(px: float, py: float, curvature: float) -> float:
    """u of a point (px, py)."""
    if curvature == 0.0:
        return px
    return math.atan2(curvature * px, 1.0 - curvature * py) / curvature


@njit(cache=True, nogil=True, error_model="numpy")
def arc_coordinates(px: float, py: float, curvature: float) -> tuple[float, float]:
    """u, v of a point (px, py)."""
    return along_arc(px, py, curvature), across_arc(px, py, curvature)


@njit(cache=True, nogil=True, inline="always")
def arc_point(u: float, v: float, curvature: float) -> tuple[float, float]:
    """The point (px, py) at u, v."""
    if curvature == 0.0:
        return u, v
    turned = curvature * u
    sine, half = math.sin(turned), math.sin(0.5 * turned)
    return sine / curvature - v * sine, 2.0 * half * half / curvature + v * math.cos(turned)
