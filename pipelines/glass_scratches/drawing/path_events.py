"""What happens to paths where they meet the glass, compiled: one event at a time.

See `path_tracing` for the model.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pipelines.glass_scratches.drawing.path_numbers import (
    AXIS,
    CHOICE,
    ROULETTE,
    PathEvent,
    path_numbers,
)
from pipelines.glass_scratches.drawing.path_state import SurfacePoint
from pipelines.glass_scratches.drawing.scratch_lookup import (
    projection_axis,
    scratch_here,
    tile_point,
)
from pipelines.glass_scratches.drawing.scratch_scattering import scatter, scratch_frame
from pipelines.glass_scratches.drawing.smooth_glass import reflect_or_refract
from pipelines.glass_scratches.drawing.vectors import (
    divided,
    dot,
    normalised,
    row_vector,
    set_row,
    stepped,
)
from pipelines.light.environment_lookup import (
    radiance_from_direction,
    smooth_radiance_from_direction,
)
from pipelines.light.environment_sampling import direction_pdf

DEEPEST = 24
"""Events of a path at most."""
_ROULETTE_FROM = 12


@njit(cache=True, nogil=True)
def advance_paths(first, last, glass, paths, hits, depth, results):  # type: ignore[no-untyped-def]
    """Take paths ``first`` to ``last`` - 1 to their next event, from what their rays hit."""
    for i in range(first, last):
        if hits.triangle[i] < 0:
            _add_environment(glass, paths, i, results)
        elif depth < DEEPEST - 1:
            _meet_glass(glass, paths, i, hits, depth, results)


@njit(cache=True, nogil=True)
def _add_environment(glass, paths, i, results):  # type: ignore[no-untyped-def]
    """The environment's radiance: as it is looked at, or, where shadow rays look for it, that of
    its texel, shared by the balance heuristic."""
    environment, number = glass.environment, paths.number[i]
    x, y, z = row_vector(paths.direction, i)
    r, g, b = smooth_radiance_from_direction(environment.radiance, x, y, z)
    share = 1.0
    if paths.pdf[i] > 0.0 and not glass.uniform:
        r, g, b = radiance_from_direction(environment.radiance, x, y, z)
        share = paths.pdf[i] / (paths.pdf[i] + direction_pdf(environment.density, x, y, z))
    results.radiance[number, 0] += paths.throughput[i, 0] * r * share
    results.radiance[number, 1] += paths.throughput[i, 1] * g * share
    results.radiance[number, 2] += paths.throughput[i, 2] * b * share


@njit(cache=True, nogil=True)
def _meet_glass(glass, paths, i, hits, depth, results):  # type: ignore[no-untyped-def]
    surface = glass.surface
    event = PathEvent(paths.seed[i], paths.number[i], glass.samples, depth)
    paths.cone_width[i] += paths.cone_angle[i] * hits.distance[i]
    came = row_vector(paths.direction, i)
    point = _surface_point(glass.faces, paths, i, hits)
    u_axis, u_level = path_numbers(event, AXIS)
    u_layer, u_choice = path_numbers(event, CHOICE)
    axis = projection_axis(point.face, u_axis)
    slant = max(np.sqrt(abs(dot(came, point.face))), 0.1)
    width = paths.cone_width[i] / slant / surface.tile
    place = tile_point(point, axis, surface.tile)
    scratch = scratch_here(surface, place, width, u_layer, u_level)
    goes_on = True
    if scratch.found:
        results.met_scratch[event.number] = True
        set_row(results.shadow_origin, i, stepped(point.position, glass.offset, point.face))
        goes_on, frame = scratch_frame(point.normal, axis, scratch.angle)
        if goes_on:
            place = _lobe_place(surface.lobe, scratch.place)
            goes_on = scatter(glass, paths, i, frame, place, event, u_choice, results)
    else:
        reflect_or_refract(paths, i, point, surface.lobe.refractive_index, u_choice, depth)
    if goes_on:
        side = 1.0 if dot(row_vector(paths.direction, i), point.face) > 0.0 else -1.0
        set_row(paths.origin, i, stepped(point.position, side * glass.offset, point.face))
        results.alive[i] = _survives(paths, i, event)


@njit(cache=True, nogil=True)
def _surface_point(faces, paths, i, hits):  # type: ignore[no-untyped-def]
    triangle = hits.triangle[i]
    came, face = row_vector(paths.direction, i), row_vector(faces.normals, triangle)
    x = y = z = 0.0
    for corner in range(3):
        x += hits.barycentric[i, corner] * faces.corner_normals[triangle, corner, 0]
        y += hits.barycentric[i, corner] * faces.corner_normals[triangle, corner, 1]
        z += hits.barycentric[i, corner] * faces.corner_normals[triangle, corner, 2]
    normal = normalised((x, y, z))
    outside = dot(came, face) < 0.0
    if (dot(came, normal) < 0.0) != outside:
        normal = face
    position = stepped(row_vector(paths.origin, i), hits.distance[i], came)
    return SurfacePoint(position, face, normal, 1.0 if outside else -1.0)


@njit(cache=True, nogil=True)
def _lobe_place(lobe, across):  # type: ignore[no-untyped-def]
    """The lobe's number for a place across the opening, in [-1, 1]."""
    places = lobe.rho.shape[1]
    return min(max(int((across + 1.0) / 2.0 * places), 0), places - 1)


@njit(cache=True, nogil=True)
def _survives(paths, i, event):  # type: ignore[no-untyped-def]
    """Russian roulette: whether a path that has come far goes on, for those that do not."""
    if event.depth < _ROULETTE_FROM:
        return True
    throughput = row_vector(paths.throughput, i)
    kept = min(4.0 * max(throughput[0], max(throughput[1], throughput[2])), 0.98)
    _, v = path_numbers(event, ROULETTE)
    if v >= kept:
        return False
    set_row(paths.throughput, i, divided(throughput, kept))
    return True
