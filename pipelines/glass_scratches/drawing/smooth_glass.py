"""What a path does at smooth glass, compiled: reflection or refraction by Fresnel's equations."""

from __future__ import annotations

import numpy as np
from numba import njit

from pipelines.glass_scratches.drawing.vectors import (
    dot,
    normalised,
    row_vector,
    scaled,
    set_row,
    stepped,
)


@njit(cache=True, nogil=True)
def reflectance(cosine, ratio):  # type: ignore[no-untyped-def]
    """Fresnel's reflectance of unpolarised light and the cosine behind the surface.

    ``ratio``: index in front / index behind. Total reflection gives (1, 0).
    """
    sine2 = ratio * ratio * (1.0 - cosine * cosine)
    if sine2 >= 1.0:
        return 1.0, 0.0
    behind = np.sqrt(1.0 - sine2)
    along = (ratio * cosine - behind) / (ratio * cosine + behind)
    across = (cosine - ratio * behind) / (cosine + ratio * behind)
    return 0.5 * (along * along + across * across), behind


@njit(cache=True, nogil=True)
def reflect_or_refract(paths, i, point, index, u, depth):  # type: ignore[no-untyped-def]
    """Send path i on; of what is seen first, a quarter is reflected and a quarter refracted at
    least."""
    came = row_vector(paths.direction, i)
    ratio = 1.0 / index if point.side > 0.0 else index
    for attempt in range(2):
        facing = scaled(point.side, point.normal if attempt == 0 else point.face)
        cosine = -dot(came, facing)
        part, behind = reflectance(min(cosine, 1.0), ratio)
        chance = min(max(part, 0.25), 0.75) if depth == 0 and part < 1.0 else part
        if u < chance:
            gain = part / chance
            way = stepped(came, 2.0 * cosine, facing)
            right = dot(way, point.face) * point.side > 0.0
        else:
            gain = (1.0 - part) / (1.0 - chance)
            way = stepped(scaled(ratio, came), ratio * cosine - behind, facing)
            right = dot(way, point.face) * point.side < 0.0
        if right:  # a smoothed normal may send light to the wrong side
            break
    set_row(paths.direction, i, normalised(way))
    set_row(paths.throughput, i, scaled(gain, row_vector(paths.throughput, i)))
    paths.pdf[i] = 0.0
