"""A furnished room by day, as a map: what there is to see behind a glass that stands in it.

The map was traced once, by `docs.room`: a living room of 6 x 6 metres with three windows, a low sun
outside, bookshelves, a rug on floorboards, an armchair, lamps. It lies beside this file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipelines.light.environment_maps import Radiance

ROOM_ROWS = 1024
"""Of the map."""
_FILE = Path(__file__).parent / "room.exr"


def room(height: int) -> Radiance:
    """The room seen from where its glass stands: (H, W, 3) float32, in [0.001, 20] or so.

    The north wall, at azimuth 90 degrees, has a window and shelves, the west wall two windows. A
    smaller map has means over the whole one's texels, with the same light.

    Raises ValueError for a height below 16 or above 1024.

    >>> room(64).shape
    (64, 128, 3)
    """
    import cv2
    import OpenEXR

    if not 16 <= height <= ROOM_ROWS:
        raise ValueError(f"height is {height}; expected 16 to {ROOM_ROWS}.")
    with OpenEXR.File(str(_FILE)) as file:
        radiance = file.channels()["RGB"].pixels.astype(np.float32)
    if height < ROOM_ROWS:
        radiance = cv2.resize(radiance, (2 * height, height), interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(np.maximum(radiance, np.float32(1e-4)))
