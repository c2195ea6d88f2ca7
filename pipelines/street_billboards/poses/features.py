"""Points of pictures that are found again in other pictures: SIFT, and its matches.

Lowe, "Distinctive image features from scale-invariant keypoints" (2004), by OpenCV; descriptors are
compared as Arandjelovic and Zisserman do ("Three things everyone should know to improve object
retrieval", 2012): by Hellinger's distance.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

MOST = 2000
"""Features of a picture."""
_CELLS = (12, 4)
"""A picture's parts across and down, each of which gets its share of the features."""
_RATIO = 0.8
"""Lowe's: the best match is nearer by this than the next best."""
_CONTRAST = 0.01
_LARGEST = 1280
"""Pixels of the longer side."""


class Features(NamedTuple):
    """n features of one picture."""

    places: NDArray[np.float32]
    """(n, 2), pixels; the middle of the first pixel is at (0, 0)."""
    descriptors: NDArray[np.float32]
    """(n, 128), of length 1: their inner products are nearness."""


def sift_features(
    picture: NDArray[np.uint8], mask: NDArray[np.bool_] | None = None, most: int = MOST
) -> Features:
    """SIFT features of a picture (h, w) or (h, w, 3) uint8, spread over it.

    mask (h, w): False where none is wanted (the bonnet). At most ``most``: the strongest of each
    part of the picture, so that a tree does not take all of them. They are looked for in a picture
    of at most 1280 pixels across: finer ones take memory and seconds, and are noise of the film.

    >>> found = sift_features(np.zeros((60, 80), np.uint8))
    >>> found.places.shape, found.descriptors.shape
    ((0, 2), (0, 128))
    """
    import cv2

    grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    scale = max(1.0, max(picture.shape[:2]) / _LARGEST)
    if scale > 1.0:
        size = round(grey.shape[1] / scale), round(grey.shape[0] / scale)
        grey = cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
        mask = None if mask is None else cv2.resize(mask.astype(np.uint8), size) > 0
    sift = cv2.SIFT.create(contrastThreshold=_CONTRAST, enable_precise_upscale=True)
    allowed = None if mask is None else mask.astype(np.uint8)
    points = _spread(sift.detect(grey, allowed), (grey.shape[1], grey.shape[0]), most)
    if not points:
        return Features(np.zeros((0, 2), np.float32), np.zeros((0, 128), np.float32))
    kept, descriptors = sift.compute(grey, points)
    places = np.array([point.pt for point in kept], np.float32)
    shares = descriptors / np.maximum(descriptors.sum(axis=1, keepdims=True), 1e-9)
    by_axis = np.array([picture.shape[1] / grey.shape[1], picture.shape[0] / grey.shape[0]])
    return Features(((places + 0.5) * by_axis - 0.5).astype(np.float32), np.sqrt(shares))


def _spread(points: Any, size: tuple[int, int], most: int) -> list[Any]:
    """The strongest in each cell, one a place."""
    best: dict[tuple[float, float], Any] = {}
    for point in points:
        known = best.get(point.pt)
        if known is None or point.response > known.response:  # a place with two directions
            best[point.pt] = point
    across, down = _CELLS
    cells: dict[tuple[int, int], list[Any]] = {}
    for point in sorted(best.values(), key=lambda point: -point.response):
        x, y = point.pt
        place = int(x * across / size[0]), int(y * down / size[1])
        cells.setdefault(place, []).append(point)
    # Rank by rank, so that what poor cells leave goes to the rich ones.
    order = sorted(
        (
            (rank, -point.response, point)
            for cell in cells.values()
            for rank, point in enumerate(cell)
        ),
        key=lambda row: row[:2],
    )
    return [point for _, _, point in order[:most]]


def match_features(first: Features, second: Features) -> NDArray[np.uint32]:
    """Rows (m, 2) of features that are each other's nearest, clearly before the next nearest."""
    if min(len(first.places), len(second.places)) < 2:
        return np.zeros((0, 2), np.uint32)
    near = first.descriptors @ second.descriptors.T
    best = near.argmax(axis=1)
    rows = np.arange(len(near))
    back = near.argmax(axis=0)
    mutual = rows[back[best] == rows]
    nearest = near[mutual, best[mutual]]
    near[mutual, best[mutual]] = -1.0
    next_best = near[mutual].max(axis=1)
    # Distances of unit vectors from their inner products.
    clear = np.sqrt(np.maximum(2 - 2 * nearest, 0)) < _RATIO * np.sqrt(2 - 2 * next_best)
    kept = mutual[clear]
    return np.stack([kept, best[kept]], axis=1).astype(np.uint32)
