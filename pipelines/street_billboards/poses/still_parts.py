"""What stands still in a film's pictures: the bonnet, a logo, a date stamp.

While the car moves, everything of the world moves through the picture. What is left of a picture
when its large-scale brightness is taken off (detail) has a mean over the film and a deviation about
it. Where something stands still the mean is much and the deviation little; where the world passes
it is the other way about. The bonnet's inside has neither: it is what hangs together with the lower
edge of the picture, below a rim that stands still, and shows no passing detail.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

FEWEST = 12
"""Frames, chosen by motion, that tell."""
_BLUR = 4.0
"""Pixels of what counts as detail, of a picture 640 wide."""
_STANDS = 2.5
"""Mean over deviation of the detail of what stands still."""
_LEAST_DETAIL, _LEAST_CONTRAST = 2.5, 12.0
"""Codes, of the mean: of a rim, of letters."""
_SMOOTH = 0.4
"""Deviation of the detail, of the picture's median, below which nothing passes."""
_SHARE = 0.2
"""Of the pixels around one that stand still, where it does, too."""
_LEAST_AREA = 3e-4
"""Of the picture: a smaller spot is chance."""
_RIM = 0.35
"""Share of the columns of what lies below that have a rim which stands still."""
_GROWN = 4
"""Pixels, of a picture 640 wide, by which what was found is widened."""


def still_parts(pictures: Iterable[NDArray[np.uint8]]) -> NDArray[np.bool_]:
    """Where something stands still in a film's pictures: (h, w), True there.

    pictures: grey ones (h, w) uint8 of frames chosen by motion, one at a time in memory. Raises
    ValueError for fewer than 12.
    """
    count = 0
    total: Any = 0.0
    squares: Any = 0.0
    for picture in pictures:
        both = np.stack([_detail(picture), picture.astype(np.float32)])
        total, squares, count = total + both, squares + both**2, count + 1
    if count < FEWEST:
        raise ValueError(f"still parts: found {count} frames; expected at least {FEWEST}.")
    mean = total / count
    deviation = np.sqrt(np.maximum(squares / count - mean**2, 0))
    detail = np.abs(mean[0])
    # A bonnet's rim stays as much brighter as it is than what is around. Letters stay as bright as
    # they are, whatever passes around them; so does the sky beside a roof, which is no letter.
    rims = (detail > _STANDS * deviation[0]) & (detail > _LEAST_DETAIL)
    letters = (detail > _STANDS * deviation[1]) & (detail > _LEAST_CONTRAST)
    return _found(rims | letters, deviation[0])


def _scaled(pixels: float, width: int) -> float:
    return pixels * width / 640


def _detail(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    import cv2

    values = picture.astype(np.float32)
    return np.asarray(values - cv2.GaussianBlur(values, (0, 0), _scaled(_BLUR, picture.shape[1])))


def _found(much: NDArray[np.bool_], deviation: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Of pixels that stand still and the deviation of the detail."""
    import cv2

    height, width = much.shape
    size = int(2 * round(_scaled(_BLUR, width)) + 1)
    # Single pixels of a wall that passes are by chance as bright in every frame: some together.
    stands = cv2.boxFilter(much.astype(np.float32), -1, (size, size)) > _SHARE
    stands = _large(stands, _LEAST_AREA * height * width)
    passing = np.sqrt(cv2.boxFilter(np.asarray(deviation) ** 2, -1, (size, size)))
    smooth = passing < _SMOOTH * np.median(passing)
    grown = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    below = _below(_closed(smooth | stands, grown), stands)
    widened = int(2 * round(_scaled(_GROWN, width)) + 1)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (widened, widened))
    return cv2.dilate((stands | below).astype(np.uint8), kernel) > 0


def _closed(where: NDArray[np.bool_], kernel: NDArray[np.generic]) -> NDArray[np.bool_]:
    import cv2

    return cv2.morphologyEx(where.astype(np.uint8), cv2.MORPH_CLOSE, np.asarray(kernel)) > 0


def _large(where: NDArray[np.bool_], area: float) -> NDArray[np.bool_]:
    """Without what hangs together over less than an area."""
    import cv2

    _, labels, statistics, _ = cv2.connectedComponentsWithStats(where.astype(np.uint8))
    kept = statistics[:, cv2.CC_STAT_AREA] >= area
    kept[0] = False
    return np.asarray(kept[labels])


def _below(quiet: NDArray[np.bool_], stands: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The quiet part at the lower edge, if its rim stands still."""
    import cv2

    height = len(quiet)
    _, labels = cv2.connectedComponents(quiet.astype(np.uint8))
    found = np.zeros_like(quiet)
    for label in np.unique(labels[-1][labels[-1] > 0]):
        part = labels == label
        columns = part[-1]
        if part.any(axis=1).sum() > height // 2:  # up into the sky
            continue
        if (part & stands).any(axis=0)[columns].mean() >= _RIM:
            # What a rim closes in below is the bonnet's, reflections too.
            found |= (np.maximum.accumulate(part, axis=0)) & part.any(axis=0)
    return found
