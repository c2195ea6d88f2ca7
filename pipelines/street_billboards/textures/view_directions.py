"""The directions from which a billboard has textures: a fan of 32, 6 degrees apart (4.2, 5.2).

Directions are azimuths, from the billboard to the viewer, of a circle of 60. Thirty-two of them
span 186 degrees, from the billboard's own first one on.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

DIRECTIONS = 32
"""d, directions of a billboard."""
CIRCLE = 60
"""Directions all around."""
SPACING = 360.0 / CIRCLE
"""Degrees between neighbours."""


def fan_position(
    offsets: NDArray[np.floating], first: NDArray[np.integer] | int
) -> NDArray[np.float64]:
    """Where viewers stand in fans, in [-14.5, 45.5): 0 is the first direction, 31 the last.

    offsets (…, 2 or 3): from the billboard's centre to the viewer; first: the fan's first
    direction, 0 to 59.

    >>> fan_position(np.array([[0.0, -5.0, 1.0], [2.0, -2.0, 1.0]]), first=30)
    array([15. , 22.5])
    """
    azimuth = np.degrees(np.arctan2(offsets[..., 1], offsets[..., 0])) / SPACING
    outside = (CIRCLE - DIRECTIONS + 1) / 2
    return np.mod(azimuth - first + outside, CIRCLE) - outside
