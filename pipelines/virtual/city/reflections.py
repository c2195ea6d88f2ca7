"""What panes and paint mirror: both fronts of the street, as seen squarely from its middle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.rays import build_scene, first_hits
from pipelines.virtual.city.city import City
from pipelines.virtual.city.parts import MATERIALS, MEAN_TEXEL, POSTERS

_STEP = 0.15
"""Metres to a texel; also how soft reflections are."""
_ROAD = (0.10, 0.10, 0.10)
_PICTURES = {"interior": 0.06, "shop": 0.08, "page": 0.5} | dict.fromkeys(POSTERS, 0.25)
"""Mean linear values of the textures that are not of MEAN_TEXEL."""


class Elevations(NamedTuple):
    """The fronts at y = -7 and y = 7, one above the other."""

    picture: NDArray[np.float32]
    """(2 rows, columns, 4), radiance times coverage, and coverage; the upper half is y = 7."""
    low: tuple[float, float]
    """x and z at the lower left corner of each half, metres."""
    size: tuple[float, float]
    """Metres across, and up each half."""


def street_elevations(city: City, light: NDArray[np.floating]) -> Elevations:
    """Look at both fronts of a city whose vertices get light (v, 3) of an albedo of 1.

    Under the road's level there is the road's colour; what is not covered is sky.
    """
    start, end = float(city.vertices[:, 0].min()), float(city.vertices[:, 0].max())
    low, high = -6.0, 17.0
    x = np.arange(start + _STEP / 2, end, _STEP)
    z = np.arange(high - _STEP / 2, low, -_STEP)
    scene = build_scene(city.vertices, city.triangles)
    mean = np.array([_PICTURES.get(name, MEAN_TEXEL) for name in MATERIALS])
    halves = []
    for side in (1.0, -1.0):
        picture = np.zeros((len(z), len(x), 4), np.float32)
        picture[z < 0.02] = (*_ROAD, 1.0)
        above = z >= 0.02
        points = np.stack(np.broadcast_arrays(x[None], 0.0, z[above][:, None]), axis=-1).reshape(
            -1, 3
        )
        hits = first_hits(scene, points, np.array([0.0, side, 0.0]))
        found = hits.triangle >= 0
        triangle, weights = hits.triangle[found], hits.barycentric[found]
        shade = (city.tint * light)[city.triangles[triangle]]
        seen = np.zeros((len(points), 4), np.float32)
        seen[found, :3] = np.einsum("ij,ijc->ic", weights, shade)
        seen[found, :3] *= mean[city.material[triangle]][:, None]
        seen[found, 3] = 1.0
        picture[above] = seen.reshape(-1, len(x), 4)
        halves.append(picture)
    return Elevations(np.concatenate(halves), (start, low), (len(x) * _STEP, len(z) * _STEP))


def shader_values(elevations: Elevations) -> dict[str, list[float]]:
    """Where the fronts lie in the picture: names in capitals of shaders/city_fragment.glsl."""
    inset = 1.0 / len(elevations.picture)
    return {
        "ELEVATION_BOX": [round(value, 3) for value in (*elevations.low, *elevations.size)],
        "ELEVATION_ROWS": [round(inset, 6), round(1 - inset, 6)],
    }
