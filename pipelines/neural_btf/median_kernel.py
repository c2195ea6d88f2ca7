"""Medians of clusters, compiled: a module of its own, as importing numba takes half a second."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray


@numba.njit(parallel=True, cache=True, nogil=True)
def segment_medians(
    values: NDArray[np.float32],
    order: NDArray[np.int64],
    starts: NDArray[np.int64],
    result: NDArray[np.float32],
) -> None:
    """Element-wise medians (segment, column) of the rows ``order[starts[i] : starts[i + 1]]``."""
    for cluster in numba.prange(len(starts) - 1):
        first, count = starts[cluster], starts[cluster + 1] - starts[cluster]
        column_values = np.empty(count, np.float32)
        for column in range(values.shape[1]):
            for member in range(count):
                column_values[member] = values[order[first + member], column]
            column_values.sort()
            low, high = column_values[(count - 1) // 2], column_values[count // 2]
            result[cluster, column] = 0.5 * (low + high)
