"""A body with legs, ears and a tail, for fur: round cones that flow into each other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.mended_meshes import mend_mesh
from pipelines.geometry.meshes import Mesh

_REACH = 1.35
"""Half the side of the cube that is looked at."""


class _Limb(NamedTuple):
    """A round cone from one place to another; ``blend`` is how far it flows into the rest."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radii: tuple[float, float]
    blend: float


_LIMBS = (
    _Limb((-0.5, 0.0, 0.1), (0.55, 0.0, 0.12), (0.36, 0.33), 0.1),
    *(
        _Limb((x, y, -0.05), (1.05 * x, y, -0.75), (0.16, 0.1), 0.12)
        for x in (-0.45, 0.45)
        for y in (-0.2, 0.2)
    ),
    _Limb((0.6, 0.0, 0.25), (0.85, 0.0, 0.5), (0.2, 0.2), 0.15),
    _Limb((0.85, 0.0, 0.5), (1.12, 0.0, 0.42), (0.22, 0.11), 0.1),
    *(_Limb((0.8, y, 0.62), (0.74, 1.86 * y, 0.9), (0.09, 0.05), 0.05) for y in (0.14, -0.14)),
    _Limb((-0.8, 0.0, 0.2), (-1.2, 0.0, 0.45), (0.1, 0.06), 0.1),
)


def eared_body(cells: int = 64) -> Mesh:
    """A closed mesh, z up, that looks along +x, about 2.5 long; cells: of the grid along a side.

    >>> body = eared_body(32)
    >>> low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    >>> bool(high[0] - low[0] > 2.2), bool(high[2] > 0.8), bool(low[2] < -0.8)
    (True, True, True)
    """
    from skimage.measure import marching_cubes

    if cells < 24:
        raise ValueError(f"cells is {cells}; expected at least 24, or the ears are lost.")
    along = np.linspace(-_REACH, _REACH, cells)
    grid = np.stack(np.meshgrid(along, along, along, indexing="ij"), axis=-1)
    distance = _distance(grid, _LIMBS[0])
    for limb in _LIMBS[1:]:
        distance = _blended(distance, _distance(grid, limb), limb.blend)
    spacing = (2 * _REACH / (cells - 1),) * 3
    vertices, triangles, _, _ = marching_cubes(
        distance, 0.0, spacing=spacing, gradient_direction="ascent"
    )
    return mend_mesh(vertices.astype(np.float64) - _REACH, triangles.astype(np.int32), None).mesh


def _distance(points: NDArray[np.floating], limb: _Limb) -> NDArray[np.float64]:
    """Of points (…, 3) to a round cone's surface, about; negative inside."""
    start, axis = np.asarray(limb.start), np.asarray(limb.end) - np.asarray(limb.start)
    along = np.clip((points - start) @ axis / (axis @ axis), 0.0, 1.0)
    radius = limb.radii[0] + (limb.radii[1] - limb.radii[0]) * along
    nearest = start + along[..., None] * axis
    return np.asarray(np.linalg.norm(points - nearest, axis=-1) - radius)


def _blended(
    one: NDArray[np.float64], other: NDArray[np.float64], blend: float
) -> NDArray[np.float64]:
    """The union of two distances, rounded off where they are within ``blend`` of each other."""
    share = np.clip(0.5 + 0.5 * (other - one) / blend, 0.0, 1.0)
    return other + (one - other) * share - blend * share * (1.0 - share)
