"""How far pictures of a compressed BTF are from the measured BTF's, beside what knows nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def error_over_flat(compared: NDArray[np.floating]) -> float:
    """RMSE of a picture against the measured BTF's over that of its mean colour.

    ``compared`` (3, y, x, 3) of the compressed BTF, the measured one and its mean colour. 1 is what
    the mean colour has, which knows nothing of texels and directions.

    >>> pictures = np.stack([np.full((2, 2, 3), value) for value in (0.4, 0.5, 0.7)])
    >>> round(error_over_flat(pictures), 6)
    0.5
    """
    compressed, measured, flat = compared.astype(np.float64)
    return picture_rmse(compressed, measured) / picture_rmse(flat, measured)


def picture_rmse(picture: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    """Root of the mean square of the differences of all values."""
    return float(np.sqrt(np.mean((picture.astype(np.float64) - other) ** 2)))
