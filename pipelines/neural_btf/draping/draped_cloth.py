"""The fallen cloth as a smooth mesh, with places in the material."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.meshes import grid_triangles
from pipelines.neural_btf.draping.simulation import PARTICLES, SIDE, fallen_cloth
from pipelines.neural_btf.surface_lookup import unit

FINER = 4
"""Steps of the mesh between two particles."""


class DrapedCloth(NamedTuple):
    """A cloth; vectors in world space, V vertices, F triangles, metres."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    normals: NDArray[np.float64]
    """(V, 3) unit vectors; up on the table's top."""
    tangents: NDArray[np.float64]
    """(V, 3) unit vectors along u on the surface."""
    places: NDArray[np.float64]
    """(V, 2) on the cloth before it fell, metres from its middle, u to the right and v up."""


@functools.cache
def draped_cloth() -> DrapedCloth:
    """A cloth of 2 m by 2 m over a round table; the same each time.

    A bicubic spline through the simulated particles; normals and tangents are its own.

    >>> cloth = draped_cloth()
    >>> cloth.vertices.shape, cloth.triangles.shape
    ((58081, 3), (115200, 3))
    """
    from scipy.interpolate import RectBivariateSpline

    particles = fallen_cloth()
    knots = np.linspace(-SIDE / 2, SIDE / 2, PARTICLES)
    fine = np.linspace(-SIDE / 2, SIDE / 2, FINER * (PARTICLES - 1) + 1)
    # Rows of particles go along v, so v is the splines' first variable.
    splines = [RectBivariateSpline(knots, knots, particles[..., k]) for k in range(3)]
    points, along_u, along_v = (
        np.stack([spline(fine, fine, dx=dv, dy=du) for spline in splines], axis=-1)
        for du, dv in ((0, 0), (1, 0), (0, 1))
    )
    u, v = np.meshgrid(fine, fine)
    return DrapedCloth(
        points.reshape(-1, 3),
        grid_triangles(*u.shape),
        unit(np.cross(along_u, along_v)).reshape(-1, 3),
        unit(along_u).reshape(-1, 3),
        np.stack([u, v], axis=-1).reshape(-1, 2),
    )
