"""Sums of products, added up in a fixed order, for the kernels of the textures."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float32]

_LANES = 16
"""Sums side by side, which a processor adds in one go. With leave to reorder (fastmath), a kernel
that was compiled in this process and the same one from numba's cache gave different last bits, so
the same street was stored twice."""


@njit(cache=True, nogil=True)
def dot(one: FloatArray, other: FloatArray) -> np.float32:
    """Sum of products of two vectors (P,), added up in a fixed order."""
    sums = np.zeros(_LANES, np.float32)
    whole = len(one) // _LANES * _LANES
    for p in range(0, whole, _LANES):
        for lane in range(_LANES):
            sums[lane] += one[p + lane] * other[p + lane]
    total = np.float32(0.0)
    for lane in range(_LANES):
        total += sums[lane]
    for p in range(whole, len(one)):
        total += one[p] * other[p]
    return total


@njit(cache=True, nogil=True)
def total_of(values: FloatArray) -> np.float32:
    """Sum of a vector (P,), in the same order."""
    return dot(values, np.ones(len(values), np.float32))


@njit(cache=True, nogil=True)
def matrix_product(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Product of two small matrices: numba takes seconds to compile its own, for the messages."""
    product = np.zeros((one.shape[0], other.shape[1]), np.float64)
    for i in range(one.shape[0]):
        for j in range(other.shape[1]):
            for k in range(one.shape[1]):
                product[i, j] += one[i, k] * other[k, j]
    return product
