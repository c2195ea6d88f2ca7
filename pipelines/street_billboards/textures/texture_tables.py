"""The textures of billboards: as sampled, and compressed. Tables of views are ragged.

The views of billboard b are rows ``first[b]`` to ``first[b + 1]``, in rising order of direction.
Row 0 of a texture is its top (t = 1), column 0 its left (s = -1); texel (y, x) stands for the
middle of its cell: s = (2 x + 1) / 32 - 1, t = 1 - (2 y + 1) / 32.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

SIDE = 32
"""Texels of a texture's side."""
UNSEEN, SEEN, EMPTY = 0, 1, 2
"""States of a texel: nobody looked there; the surface was seen; it was looked through."""


class ViewTextures(NamedTuple):
    """v views of b billboards."""

    first: NDArray[np.int64]
    """(b + 1,), row of the first view."""
    direction: NDArray[np.uint8]
    """(v,), 0 to 31, of the billboard's fan."""
    colours: NDArray[np.uint8]
    """(v, 32, 32, 3), sRGB; where the state is not SEEN they mean nothing."""
    states: NDArray[np.uint8]
    """(v, 32, 32)."""
    sharpness: NDArray[np.float32]
    """(v,), pixels of the photograph to a texel's side."""


class CompressedTextures(NamedTuple):
    """Eigen-textures in 8 bit (Eq. 1): what is stored, and what the shader reads.

    A channel c of view i at a texel, in codes of 0 to 255, is

        mean[i, c] + sum_k  scale[c][k] * (weight[c][i, k] - 128) / 127 * (plane[c][k] - 128) / 127

    over the billboard's ranks[b, c] planes. Channels are R, G, B, or Y, Co, Cg (``colour``), where
    the codes of Co and Cg have 128 added: R = Y + Co - Cg, G = Y + Cg, B = Y - Co - Cg. Planes of a
    lower resolution are interpolated between the middles of their texels and clamped at the rim.
    """

    colour: str
    """"rgb" or "ycocg"."""
    first: NDArray[np.int64]
    """(b + 1,), row of the first view."""
    direction: NDArray[np.uint8]
    """(v,)."""
    means: NDArray[np.uint8]
    """(v, 3), the views' mean colours."""
    ranks: NDArray[np.uint8]
    """(b, 3), r of each channel."""
    planes: tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]
    """V_k by channel, (sum of ranks[:, c], side, side), billboard by billboard; side 32 or less."""
    scales: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
    """By channel, (sum of ranks[:, c],), in codes."""
    weights: tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]
    """w_ik by channel, ragged: billboard by billboard, view by view, ranks[b, c] each."""
    first_mask: NDArray[np.int64]
    """(b + 1,), row of the first mask: one a billboard, or one a view."""
    masks: NDArray[np.uint8]
    """(m, 32, 4), alpha, a bit a texel, the leftmost in a byte's highest bit."""


def join_views(parts: list[ViewTextures]) -> ViewTextures:
    """One table of several, billboard after billboard; the list is empty afterwards.

    Parts are let go one by one, so that not everything is there twice.
    """
    counts = np.concatenate([np.diff(part.first) for part in parts])
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    whole = [np.empty((first[-1], *field.shape[1:]), field.dtype) for field in parts[0][1:]]
    at = 0
    while parts:
        part = parts.pop(0)
        rows = slice(at, at + len(part.direction))
        for field, own in zip(whole, part[1:], strict=True):
            field[rows] = own
        at = rows.stop
    return ViewTextures(first, *whole)
