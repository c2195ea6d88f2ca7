"""Noise along a scratch, compiled: what fades it and breaks it."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

KNOTS = 7.0
"""Knots of the noise along a scratch, end to end: gaps of about a seventh of it and more."""


@njit(cache=True, nogil=True, inline="always")
def hashed(a: int, b: int) -> float:
    """Hash two numbers to [0, 1): splitmix64's output function on both halves of a word."""
    z = (np.uint64(a) << np.uint64(32)) ^ np.uint64(b & 0xFFFFFFFF)
    z += np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@njit(cache=True, nogil=True, error_model="numpy")
def noise_along(seed: int, place: float) -> float:
    """Smooth noise in [0, 1], one knot a unit, uniformly distributed at every place.

    Two knots' numbers a, b are mixed to (1 - w) a + w b, whose distribution is a trapezium's; its
    distribution function makes it uniform, so that "noise below q" has probability q exactly.
    """
    knot = math.floor(place)
    t = place - knot
    w = t * t * (3.0 - 2.0 * t)
    mixed = (1.0 - w) * hashed(seed, int(knot)) + w * hashed(seed, int(knot) + 1)
    less, more = min(w, 1.0 - w), max(w, 1.0 - w)
    low = min(mixed, 1.0 - mixed)
    below = 0.5 * low * low / (less * more) if low < less else (low - 0.5 * less) / more
    return below if mixed <= 0.5 else 1.0 - below
