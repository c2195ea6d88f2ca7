"""Latents as textures: looked up between texels, at coarser levels, and moved by parallax.

A texture of h x w texels repeats without end; columns run to the right, rows down, and a texel's
middle lies at whole numbers. Level l of it has ceil(h / 2^l) x ceil(w / 2^l) texels, each of which
stands for the part of the texture that it covers; the last level is one texel.

Detail does not stay where it is when it is seen from a side: what stands above the plane that
photographs are rectified to moves against the view, and at grazing views the highest yarns are
mostly what is seen. `parallax` says by how many texels, as a polynomial of the view's place.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

MONOMIALS = 9
"""x, y, x², xy, y², x³, x²y, xy², y³ of the view's stereographic place: 0 from straight above."""

Floats = NDArray[np.float32]


def parallax_terms(views: NDArray[np.floating]) -> Floats:
    """The monomials (n, 9) of views' stereographic places (n, 2).

    >>> parallax_terms(np.array([[2.0, -1.0]])).tolist()
    [[2.0, -1.0, 4.0, -2.0, 1.0, 8.0, -4.0, 2.0, -1.0]]
    """
    x, y = views.astype(np.float32).T
    return np.stack([x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3], axis=1)


def level_sizes(height: int, width: int) -> list[tuple[int, int]]:
    """Rows and columns of all levels, the finest first.

    >>> level_sizes(5, 2)
    [(5, 2), (3, 1), (2, 1), (1, 1)]
    """
    last = max(height - 1, width - 1).bit_length()
    return [(-(-height // 2**level), -(-width // 2**level)) for level in range(last + 1)]


def cover(fine: int, coarse: int) -> NDArray[np.float64]:
    """What part of each coarse texel a fine one fills, (coarse, fine); rows sum to 1.

    >>> cover(3, 2).round(3).tolist()
    [[0.667, 0.333, 0.0], [0.0, 0.333, 0.667]]
    """
    edges = np.arange(coarse + 1) * (fine / coarse)
    starts = np.arange(fine)
    shared = np.minimum(edges[1:, None], starts + 1) - np.maximum(edges[:-1, None], starts)
    return np.clip(shared, 0.0, None) * (coarse / fine)


def between_texels(
    table: Floats, size: tuple[int, int], rows: NDArray[np.floating], columns: NDArray[np.floating]
) -> Floats:
    """Latents (n, c) between four texels, bilinear; the texture repeats.

    table (h * w, c) row by row, ``size`` (h, w); places (n,) in texels, middles at whole numbers.

    >>> table = np.array([[0.0], [4.0]], np.float32)
    >>> between_texels(table, (1, 2), np.zeros(3), np.array([0.0, 0.25, 1.5])).ravel().tolist()
    [0.0, 1.0, 2.0]
    """
    height, width = size
    top, left = np.floor(rows), np.floor(columns)
    down, right = ((rows - top)[:, None], (columns - left)[:, None])
    down, right = down.astype(np.float32), right.astype(np.float32)
    above, before = top.astype(np.int64) % height, left.astype(np.int64) % width
    below, behind = (above + 1) % height, (before + 1) % width
    upper = table[above * width + before] * (1 - right) + table[above * width + behind] * right
    lower = table[below * width + before] * (1 - right) + table[below * width + behind] * right
    found: Floats = upper * (1 - down) + lower * down
    return found


def between_levels(
    levels: Sequence[Floats],
    size: tuple[int, int],
    places: tuple[NDArray[np.floating], NDArray[np.floating]],
    footprint: NDArray[np.floating],
) -> Floats:
    """Latents (n, c) between two levels, each bilinear.

    levels: tables of `level_sizes`, the finest first; ``places``: rows and columns (n,) in texels
    of the finest; ``footprint`` (n,): width of what is seen, in the same texels.
    """
    sizes = level_sizes(*size)
    level = np.clip(np.log2(np.maximum(footprint, 1e-6)), 0.0, len(levels) - 1.0)
    lower = np.minimum(level.astype(np.int64), max(len(levels) - 2, 0))
    share = (level - lower).astype(np.float32)[:, None]
    result = np.empty((len(level), levels[0].shape[1]), np.float32)
    for number in np.unique(lower):
        chosen = np.flatnonzero(lower == number)
        pair = [
            between_texels(
                levels[at],
                sizes[at],
                *(
                    (axis[chosen] + 0.5) * (coarse / fine) - 0.5
                    for axis, coarse, fine in zip(places, sizes[at], size, strict=True)
                ),
            )
            for at in range(number, min(number + 2, len(levels)))
        ]
        result[chosen] = pair[0] + (pair[-1] - pair[0]) * share[chosen]
    return result


def averaged(
    values: NDArray[np.floating], size: tuple[int, int], coarse: tuple[int, int]
) -> Floats:
    """Values (h * w, …) of a texture averaged over the texels of a coarser one, (h' * w', …).

    >>> averaged(np.arange(4.0)[:, None], (2, 2), (1, 2)).ravel().tolist()
    [1.0, 2.0]
    """
    grid = values.reshape(*size, -1).astype(np.float32)
    down, across = (cover(a, b).astype(np.float32) for a, b in zip(size, coarse, strict=True))
    found = np.einsum("ah,hwc->awc", down, np.einsum("bw,hwc->hbc", across, grid))
    return found.reshape(coarse[0] * coarse[1], *values.shape[1:])
