"""The scratch BRDF in the cross-section, as it is stored."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Table2D(NamedTuple):
    """One profile's table: rows are the bins of phi_o, columns those of phi_i.

    ``rho`` (M, M) float64; ``standard_error`` (M, M) float64, 0 for the exact one; ``absorbed``
    (M,) float64, part of each bin's beam that stays; ``across`` (places, M, M) float32: rho by the
    place at which the view's ray enters the opening, from its left end, rows being the view: its
    mean is rho transposed, which is rho but for the paths' noise.
    """

    rho: NDArray[np.float64]
    standard_error: NDArray[np.float64]
    absorbed: NDArray[np.float64]
    across: NDArray[np.float32]
