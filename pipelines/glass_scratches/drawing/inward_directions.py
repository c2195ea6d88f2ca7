"""Where light goes that a scratch scatters into the glass, compiled.

Directions aim at what is bright in the environment as it is seen through a face parallel to this
one, or to one of the solid's flat faces. Total reflection on the way only mirrors: for a plate that
covers whatever becomes of the light, for thin walls most of it.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pipelines.glass_scratches.drawing.vectors import divided, dot, row_vector, stepped
from pipelines.light.environment_sampling import direction_pdf, sample_direction


@njit(cache=True, nogil=True)
def aimed_inward(environment, flats, normal, index, numbers):  # type: ignore[no-untyped-def]
    """A direction (x, y, z) below the surface, towards what is bright outside.

    ``numbers``: three in [0, 1), that of the face to go out through first.
    """
    pick, u1, u2 = numbers
    x, y, z, _ = sample_direction(
        environment.row_cdf, environment.column_cdf, environment.density, u1, u2
    )
    axes = _axis_count(flats, normal)
    axis = _axis(flats, normal, min(int(pick * axes), axes - 1))
    outer = dot((x, y, z), axis)
    way = divided(stepped((x, y, z), -outer, axis), index)
    way = stepped(way, np.sign(outer) * np.sqrt(max(1.0 - dot(way, way), 0.0)), axis)
    above = dot(way, normal)
    return stepped(way, -2.0 * above, normal) if above > 0.0 else way


@njit(cache=True, nogil=True)
def inward_pdf(environment, flats, normal, index, way):  # type: ignore[no-untyped-def]
    """Density per steradian of the directions (x, y, z) of `aimed_inward`."""
    axes = _axis_count(flats, normal)
    below = -dot(way, normal)
    density = 0.0
    for mirrored in range(2):
        from_here = stepped(way, 2.0 * below, normal) if mirrored else way
        for number in range(axes):
            axis = _axis(flats, normal, number)
            inner = dot(from_here, axis)
            outer2 = 1.0 - index * index * (1.0 - inner * inner)
            if outer2 > 1e-9:  # it would leave through such a face
                outer = np.sqrt(outer2)
                across = stepped(from_here, -inner, axis)
                onward = np.sign(inner) * outer
                there = direction_pdf(
                    environment.density,
                    index * across[0] + onward * axis[0],
                    index * across[1] + onward * axis[1],
                    index * across[2] + onward * axis[2],
                )
                density += 1.0 / axes * there * index * index * abs(inner) / outer
    return density


@njit(cache=True, nogil=True)
def _axis_count(flats, normal):  # type: ignore[no-untyped-def]
    axes = 1
    for flat in range(len(flats)):
        if abs(dot(row_vector(flats, flat), normal)) < 0.99:
            axes += 1
    return axes


@njit(cache=True, nogil=True)
def _axis(flats, normal, number):  # type: ignore[no-untyped-def]
    """The surface's own normal, then those of flat faces that are not parallel to it."""
    if number == 0:
        return normal
    for flat in range(len(flats)):
        axis = row_vector(flats, flat)
        if abs(dot(axis, normal)) < 0.99:
            number -= 1
            if number == 0:
                return axis
    return normal
