"""Billboards: what they are (4.1)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Billboards(NamedTuple):
    """b rectangles in the world, in metres.

    One turns about its centre to face the viewer: its normal is from the centre to the eye, its row
    axis is horizontal (``turned_axes``). One whose points lie in a plane stands still. Texture
    coordinates (s, t) in [-1, 1] are ``centre + s * half_s + t * half_t``.
    """

    centre: NDArray[np.float64]
    """(b, 3), of the rectangle."""
    voxel: NDArray[np.float64]
    """(b, 3), middle of the octree's leaf."""
    turns: NDArray[np.bool_]
    """(b,)."""
    half_s: NDArray[np.float32]
    """(b, 3), half of the rectangle along a row of texels, to the right; turning: (h, 0, 0)."""
    half_t: NDArray[np.float32]
    """(b, 3), half of it along a column, from bottom to top; turning: (0, 0, h)."""
    fan: NDArray[np.int32]
    """(b,), first direction of the fan of views, 0 to 59."""


def turned_axes(
    centre: NDArray[np.floating], eye: NDArray[np.floating]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit vectors of rows and columns, (…, 3) each, of squares at ``centre`` that face ``eye``."""
    normal = np.asarray(eye, np.float64) - centre
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    row = np.stack([-normal[..., 1], normal[..., 0], np.zeros_like(normal[..., 0])], axis=-1)
    row /= np.maximum(np.linalg.norm(row, axis=-1, keepdims=True), 1e-12)
    return row, np.cross(normal, row)
