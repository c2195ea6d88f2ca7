"""Charts about a vertex, followed edge by edge: compiled."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def follow(
    order: NDArray[np.int64],
    far: NDArray[np.float64],
    first: NDArray[np.int64],
    to: NDArray[np.int64],
    length: NDArray[np.float64],
    step: NDArray[np.float64],
    place: NDArray[np.float64],
) -> None:
    """Fill places in the order of distance: the mean of what the neighbours before say."""
    for position in range(1, len(order)):
        vertex = order[position]
        x, y, total = 0.0, 0.0, 0.0
        for edge in range(first[vertex], first[vertex + 1]):
            before = to[edge]
            if far[before] < far[vertex]:
                weight = 1.0 / (far[before] + length[edge] - far[vertex] + 0.1 * length[edge])
                x += weight * (place[before, 0] - step[edge, 0])
                y += weight * (place[before, 1] - step[edge, 1])
                total += weight
        if total > 0.0:
            place[vertex, 0], place[vertex, 1] = x / total, y / total
