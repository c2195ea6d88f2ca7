"""What a path does at a scratch, compiled: see `path_tracing` for the model."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from pipelines.glass_scratches.drawing.inward_directions import aimed_inward, inward_pdf
from pipelines.glass_scratches.drawing.path_numbers import (
    DIRECTION,
    LIGHT,
    WALL,
    path_numbers,
)
from pipelines.glass_scratches.drawing.vectors import (
    cross,
    divided,
    dot,
    row_vector,
    scaled,
    set_row,
    stepped,
)
from pipelines.glass_scratches.tables import sampling
from pipelines.glass_scratches.tables.lobe import Direction
from pipelines.light.environment_lookup import radiance_from_direction
from pipelines.light.environment_sampling import sample_direction

_SCATTERED_ANGLE = 0.3
"""Opening angle of the cone that stands for a path's width after it was scattered, radians."""


class Frame(NamedTuple):
    """The scratch's frame in the scene: vectors along it, across it, and out of the glass."""

    along: tuple[float, float, float]
    across: tuple[float, float, float]
    normal: tuple[float, float, float]


class AtScratch(NamedTuple):
    """Where a path meets a scratch: its ``frame``, the place of the lobe across it, the direction
    ``viewer`` in that frame that the path comes from, and the chance that it goes on in a direction
    that is aimed at light (`inward_directions`)."""

    frame: Frame
    place: int
    viewer: Direction
    aimed: float


@njit(cache=True, nogil=True)
def scratch_frame(normal, axis, angle):  # type: ignore[no-untyped-def]
    """Whether a scratch has a direction on the surface, and its frame.

    ``angle``: its direction in the tile, which is laid on from ``axis``.
    """
    cosine, sine = np.cos(angle), np.sin(angle)
    if axis == 0:
        along = (0.0, cosine, sine)
    elif axis == 1:
        along = (sine, 0.0, cosine)
    else:
        along = (cosine, sine, 0.0)
    along = stepped(along, -dot(along, normal), normal)
    length = np.sqrt(dot(along, along))
    if length < 1e-6:
        return False, Frame(along, along, normal)
    along = divided(along, length)
    return True, Frame(along, cross(normal, along), normal)


@njit(cache=True, nogil=True)
def scatter(glass, paths, i, frame, place, event, u, results):  # type: ignore[no-untyped-def]
    """Light at a scratch: what the environment sends directly, and where path i goes on; returns
    whether it does. ``u`` in [0, 1) decides what else has to be chosen."""
    paths.cone_angle[i] = _SCATTERED_ANGLE
    lobe = glass.surface.lobe
    came = _in_frame(frame, row_vector(paths.direction, i))
    view = Direction(-came.u, -came.v, -came.n)
    aimed = 0.0
    if not (lobe.keeps or glass.uniform):
        # Half of what goes into the glass is aimed; where walls keep the lean no aim would hit.
        outside, inside = sampling.leaving_share(lobe, place, view)
        aimed = 0.5 * inside / max(outside + inside, 1e-12)
    at = AtScratch(frame, place, view, aimed)
    if not glass.uniform:
        _add_light(glass, paths, i, at, event, results)
    light, density = _drawn(glass, at, event, u)
    if density <= 0.0 or light.n == 0.0:
        return False
    gain = sampling.evaluate(lobe, place, view, light) / density
    if gain <= 0.0:
        return False
    paths.pdf[i] = density if light.n > 0.0 and not glass.uniform else 0.0
    set_row(paths.direction, i, _in_scene(frame, light))
    set_row(paths.throughput, i, scaled(gain, row_vector(paths.throughput, i)))
    return True


@njit(cache=True, nogil=True)
def _add_light(glass, paths, i, at, event, results):  # type: ignore[no-untyped-def]
    """A direction drawn from the environment, weighted by the balance heuristic: to be added where
    its shadow ray meets nothing."""
    environment = glass.environment
    u1, u2 = path_numbers(event, LIGHT)
    x, y, z, density = sample_direction(
        environment.row_cdf, environment.column_cdf, environment.density, u1, u2
    )
    light = _in_frame(at.frame, (x, y, z))
    if light.n <= 0.0 or density <= 0.0:
        return
    part = sampling.evaluate(glass.surface.lobe, at.place, at.viewer, light)
    gain = part / (density + _density(glass, at, light))
    if gain > 0.0:
        r, g, b = radiance_from_direction(environment.radiance, x, y, z)
        set_row(results.shadow_direction, i, (x, y, z))
        results.shadow_radiance[i, 0] = paths.throughput[i, 0] * gain * r
        results.shadow_radiance[i, 1] = paths.throughput[i, 1] * gain * g
        results.shadow_radiance[i, 2] = paths.throughput[i, 2] * gain * b


@njit(cache=True, nogil=True)
def _drawn(glass, at, event, u):  # type: ignore[no-untyped-def]
    """A direction to go on in, in the scratch's frame, and its density."""
    surface = glass.surface
    u1, u2 = path_numbers(event, DIRECTION)
    u3, _ = path_numbers(event, WALL)
    if glass.uniform:
        side = 1.0 if u < 0.5 else -1.0
        radius, turn = np.sqrt(max(1.0 - u1 * u1, 0.0)), 2.0 * np.pi * u2
        return Direction(radius * np.cos(turn), radius * np.sin(turn), side * u1), 0.25 / np.pi
    if u < at.aimed:
        way = aimed_inward(
            glass.environment,
            glass.faces.flats,
            at.frame.normal,
            surface.lobe.refractive_index,
            (u / at.aimed, u1, u2),
        )
        light = _in_frame(at.frame, way)
    else:
        rest = (u - at.aimed) / (1.0 - at.aimed)
        light = sampling.sample(surface.lobe, at.place, at.viewer, (rest, u1, u2, u3))
    return light, _density(glass, at, light)


@njit(cache=True, nogil=True)
def _density(glass, at, light):  # type: ignore[no-untyped-def]
    """Density of the directions that `_drawn` gives."""
    lobe = glass.surface.lobe
    density = (1.0 - at.aimed) * sampling.pdf(lobe, at.place, at.viewer, light)
    if at.aimed > 0.0 and light.n < 0.0:
        way = _in_scene(at.frame, light)
        density += at.aimed * inward_pdf(
            glass.environment, glass.faces.flats, at.frame.normal, lobe.refractive_index, way
        )
    return density


@njit(cache=True, nogil=True)
def _in_frame(frame, vector):  # type: ignore[no-untyped-def]
    return Direction(dot(vector, frame.along), dot(vector, frame.across), dot(vector, frame.normal))


@njit(cache=True, nogil=True)
def _in_scene(frame, direction):  # type: ignore[no-untyped-def]
    u, v, n = direction
    return stepped(stepped(scaled(u, frame.along), v, frame.across), n, frame.normal)
