"""Colours of vertices and faces, as scanners and modellers write them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from storage.readers.pictures.srgb_curve import light_of_srgb


def linear_colours(coded: NDArray[np.float64], full: float) -> NDArray[np.float64] | None:
    """Colours of PLY and OBJ files (N, 3 or 4), red, green, blue and perhaps opacity, to linear
    ones and opacity (N, 4) in [0, 1].

    ``full`` is the number of full brightness. No standard says what is between; every viewer
    shows these numbers as they are, as sRGB codes.
    None for numbers that are no colours: not finite or outside.
    """
    if not ((coded >= 0) & (coded <= full)).all():
        return None
    shares = coded / full
    linear = light_of_srgb(shares)
    opacity = shares[:, 3] if coded.shape[1] == 4 else np.ones(len(coded))
    return np.column_stack([linear[:, :3], opacity])
