"""The M equal bins of the angle phi over (-pi/2, pi/2), from n towards v (section 3.1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def check_bins(count: int) -> None:
    """Raises ValueError for a number of bins that is odd or below 8."""
    if count < 8 or count % 2:
        raise ValueError(f"bins is {count}; expected an even number of at least 8 (M).")


def bin_edges(count: int) -> NDArray[np.float64]:
    """Borders (count + 1,) of the bins, radians. Raises ValueError as :func:`check_bins`."""
    check_bins(count)
    return np.linspace(-np.pi / 2, np.pi / 2, count + 1)


def bin_centres(count: int) -> NDArray[np.float64]:
    """Middles (count,) of the bins, radians."""
    edges = bin_edges(count)
    return (edges[1:] + edges[:-1]) / 2


def bin_weights(count: int) -> NDArray[np.float64]:
    """Integral of cos phi over each bin (count,): its share of a beam. Sums to 2."""
    # Symmetric to the last bit, as the table's laws are.
    half = np.diff(np.sin(bin_edges(count)))
    return (half + half[::-1]) / 2
