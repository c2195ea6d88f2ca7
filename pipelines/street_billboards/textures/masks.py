"""Which texels of a billboard are opaque, from the states of what its views saw."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.textures.texture_tables import (
    EMPTY,
    SEEN,
    SIDE,
    UNSEEN,
    ViewTextures,
)


def opacity_masks(
    views: ViewTextures, turns: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """``first_mask`` (b + 1,) and ``masks`` (m, 32, 4) of CompressedTextures.

    A billboard that stands still has one: a texel is opaque where some view saw the surface and not
    more looked through it. Texels that none saw are opaque where most of their eight neighbours
    are: they are the holes between a point cloud's points.

    One that turns (turns, (b,)) shows each view another outline, so it has one a view: unseen
    texels are as in the view nearest in direction that knows, and texels without a neighbour are
    dropped.
    """
    first = views.first.astype(np.int64)
    counts = np.where(turns, np.diff(first), 1)
    first_mask = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    opaque = np.zeros((first_mask[-1], SIDE, SIDE), np.bool_)
    _opaque(first, views.direction, views.states, turns, first_mask, opaque)
    return first_mask, np.packbits(opaque, axis=-1)


@njit(cache=True, nogil=True)
def _opaque(
    first: NDArray[np.int64],
    direction: NDArray[np.uint8],
    states: NDArray[np.uint8],
    turns: NDArray[np.bool_],
    first_mask: NDArray[np.int64],
    opaque: NDArray[np.bool_],
) -> None:
    for b in range(len(turns)):
        begin, end = first[b], first[b + 1]
        if turns[b]:
            for i in range(begin, end):
                mask = opaque[first_mask[b] + i - begin]
                _mask_of_view(direction[begin:end], states[begin:end], i - begin, mask)
        elif end > begin:
            _mask_of_all(states[begin:end], opaque[first_mask[b]])


@njit(cache=True, nogil=True)
def _mask_of_all(states: NDArray[np.uint8], mask: NDArray[np.bool_]) -> None:
    unknown = np.zeros(mask.shape, np.bool_)
    for y in range(SIDE):
        for x in range(SIDE):
            seen, through = 0, 0
            for i in range(len(states)):
                seen += states[i, y, x] == SEEN
                through += states[i, y, x] == EMPTY
            mask[y, x] = seen > 0 and seen >= through
            unknown[y, x] = seen + through == 0
    voted = mask.copy()
    for y in range(SIDE):
        for x in range(SIDE):
            # More than half of eight; what lies beyond the rim is not opaque.
            if unknown[y, x] and _neighbours(voted, y, x) > 4:
                mask[y, x] = True


@njit(cache=True, nogil=True)
def _mask_of_view(
    direction: NDArray[np.uint8], states: NDArray[np.uint8], view: int, mask: NDArray[np.bool_]
) -> None:
    far = np.empty(len(states), np.int64)
    for i in range(len(states)):
        # Of two that are as near, the one of the lower direction.
        far[i] = 2 * abs(np.int64(direction[i]) - np.int64(direction[view])) + (i > view)
    order = np.argsort(far)
    for y in range(SIDE):
        for x in range(SIDE):
            for i in order:
                if states[i, y, x] != UNSEEN:
                    mask[y, x] = states[i, y, x] == SEEN
                    break
    whole = mask.copy()
    for y in range(SIDE):
        for x in range(SIDE):
            if mask[y, x] and _neighbours(whole, y, x) == 0:
                mask[y, x] = False


@njit(cache=True, nogil=True)
def _neighbours(mask: NDArray[np.bool_], y: int, x: int) -> int:
    count = 0
    for v in range(max(y - 1, 0), min(y + 2, SIDE)):
        for u in range(max(x - 1, 0), min(x + 2, SIDE)):
            count += mask[v, u]
    return count - mask[y, x]
