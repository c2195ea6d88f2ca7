"""Which scratch lies at a point of a solid, compiled.

Tiles of scratches are laid on the surface from the three axes (box projection): from the one that
the normal lies along, or from two or three at random where it lies between, so that there are no
seams. Of several layers that have a scratch there, one is taken at random.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from pipelines.glass_scratches.drawing.path_numbers import mixed, unit
from pipelines.glass_scratches.layers.coverage import filtered_coverage
from pipelines.glass_scratches.layers.feature_search import scratch_at


class ScratchHere(NamedTuple):
    """Whether there is a scratch; ``place`` across it, in [-1, 1]; its direction ``angle`` in the
    tile, radians."""

    found: bool
    place: float
    angle: float


@njit(cache=True, nogil=True)
def projection_axis(normal, u):  # type: ignore[no-untyped-def]
    """The axis that a tile is laid on from, at random by the fourth power of the normal."""
    x, y, z = normal[0] ** 4, normal[1] ** 4, normal[2] ** 4
    pick = u * (x + y + z)
    if pick < x:
        return 0
    return 1 if pick < x + y else 2


@njit(cache=True, nogil=True)
def tile_point(point, axis, tile):  # type: ignore[no-untyped-def]
    """The place (x, y) in the tile of a point of the surface, seen along an axis."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    facing = 1.0 if point.face[axis] > 0.0 else 0.0
    # Each side of each axis has its own part of the tile.
    x = point.position[first] / tile + 0.37 * axis + 0.11 * facing
    y = point.position[second] / tile + 0.61 * axis + 0.23 * facing
    return x, y


@njit(cache=True, nogil=True)
def scratch_here(surface, place, width, u, v):  # type: ignore[no-untyped-def]
    """The scratch at a place (x, y) of the tile, for a cone so many tiles wide.

    Close up the features themselves are asked; where the cone is wider than a texel, the coverage
    averaged over as much is the chance that there is a scratch.
    """
    chosen, covering = -1, 0
    chosen_across, chosen_angle = 0.0, 0.0
    x, y = place
    level = np.floor(np.log2(max(width * surface.resolution, 1e-9)) + v)
    state = mixed(np.uint64(u * 4503599627370496.0) + np.uint64(77))
    for layer in range(len(surface.layers.angle)):
        state = mixed(state + np.uint64(0x9E3779B97F4A7C15))
        if level < 0:
            opacity, across, angle = scratch_at(surface.layers, layer, x, y)
        else:
            opacity = filtered_coverage(
                surface.coverage, surface.offsets, surface.resolution, layer, int(level), x, y
            )
            across = 2.0 * unit(mixed(state + np.uint64(3))) - 1.0
            angle = np.float64(surface.layers.angle[layer])
        if unit(state) < opacity:
            covering += 1
            # One of those at random: the n-th replaces the last choice with chance 1 / n.
            if unit(mixed(state + np.uint64(5))) * covering < 1.0:
                chosen, chosen_across, chosen_angle = layer, across, angle
    return ScratchHere(chosen >= 0, chosen_across, chosen_angle)
