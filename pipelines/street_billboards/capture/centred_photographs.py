"""Photographs with square pixels and the principal point in their middle, for the stage."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def centred_intrinsics(
    intrinsics: NDArray[np.float64], width: int, height: int
) -> NDArray[np.float64]:
    """K (3, 3) of the widest such photograph that lies inside one of K ``intrinsics``."""
    fx, fy, cx, cy = (float(intrinsics[place]) for place in ((0, 0), (1, 1), (0, 2), (1, 2)))
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    slopes = (cx / fx, (width - 1 - cx) / fx, cy / fy, (height - 1 - cy) / fy)
    focal = max(middle[0] / min(slopes[:2]), middle[1] / min(slopes[2:]))
    return np.array([[focal, 0.0, middle[0]], [0.0, focal, middle[1]], [0.0, 0.0, 1.0]])


def centre_photographs(
    photographs: NDArray[np.uint8], intrinsics: NDArray[np.float64]
) -> NDArray[np.uint8]:
    """Photographs (c, y, x, 3) of cameras with K (c, 3, 3), taken anew with ``centred_intrinsics``.

    Those that have it already come back as they are.
    """
    import cv2

    _, height, width, _ = photographs.shape
    made = photographs.copy()
    for number, lens in enumerate(intrinsics):
        wanted = centred_intrinsics(lens, width, height)
        if not np.allclose(wanted, lens, rtol=0, atol=1e-6):
            turn = wanted @ np.linalg.inv(lens)
            made[number] = cv2.warpPerspective(
                photographs[number],
                turn,
                (width, height),
                flags=cv2.INTER_CUBIC,
                borderMode=cv2.BORDER_REPLICATE,
            )
    return made
