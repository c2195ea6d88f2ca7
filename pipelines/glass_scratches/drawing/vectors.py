"""Vectors as three numbers, compiled: a tuple stays in registers where an array is allocated."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def row_vector(array, row):  # type: ignore[no-untyped-def]
    """A row of an array (N, 3), in double precision."""
    return np.float64(array[row, 0]), np.float64(array[row, 1]), np.float64(array[row, 2])


@njit(cache=True, nogil=True)
def set_row(array, row, vector):  # type: ignore[no-untyped-def]
    """Write a vector into a row of an array (N, 3)."""
    array[row, 0], array[row, 1], array[row, 2] = vector


@njit(cache=True, nogil=True)
def dot(a, b):  # type: ignore[no-untyped-def]
    """The scalar product, never -0."""
    return 0.0 + a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, nogil=True)
def cross(a, b):  # type: ignore[no-untyped-def]
    """The vector product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@njit(cache=True, nogil=True)
def scaled(factor, a):  # type: ignore[no-untyped-def]
    """factor a."""
    return factor * a[0], factor * a[1], factor * a[2]


@njit(cache=True, nogil=True)
def divided(a, by):  # type: ignore[no-untyped-def]
    """a / by."""
    return a[0] / by, a[1] / by, a[2] / by


@njit(cache=True, nogil=True)
def stepped(a, factor, b):  # type: ignore[no-untyped-def]
    """a + factor b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@njit(cache=True, nogil=True)
def normalised(a):  # type: ignore[no-untyped-def]
    """a at length 1."""
    return divided(a, np.sqrt(dot(a, a)))
