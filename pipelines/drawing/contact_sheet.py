"""Several pictures on one sheet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def contact_sheet(pictures: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Pictures (n, y, x, 3) side by side, in two rows where there are more than two."""
    columns = len(pictures) if len(pictures) <= 2 else (len(pictures) + 1) // 2
    blank = np.zeros_like(pictures[:1])
    padded = np.concatenate([pictures, blank.repeat(-len(pictures) % columns, axis=0)])
    rows = padded.reshape(-1, columns, *pictures.shape[1:])
    return np.vstack([np.hstack(list(row)) for row in rows])
