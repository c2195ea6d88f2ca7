"""What a path does at a scratch, compiled: see `path_tracing` for the model."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from pipelines.glass_scratches.drawing.inward_directions import aimed_inward, inward_pdf
from pipelines.glass_scratches.drawing.path_numbers import DIRECTION, LIGHT, WALL, path_numbers
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
from pipelines.glass_scratches.tables.sampling import phi_bin
from pipelines.light.environment_lookup import radiance_from_direction
from pipelines.light.environment_sampling import sample_direction

_LEAST_REFLECTED = 0.25
_SCATTERED_ANGLE = 0.3
"""Opening angle of the cone that stands for a path's width after it was scattered, radians."""


class Frame(NamedTuple):
    """The scratch's frame in the scene: vectors along it, across it, and out of the glass."""

    along: tuple[float, float, float]
    across: tuple[float, float, float]
    normal: tuple[float, float, float]


class AtScratch(NamedTuple):
    """Where a path meets a scratch: its ``frame``, the place of the lobe across it, and whether the
    path comes from ``outside`` the glass."""

    frame: Frame
    place: int
    outside: bool


class _View(NamedTuple):
    """Where a path comes from, in the scratch's frame, and what the scratch does about that.

    ``fresnel``: F, and ``returned``: the part of all light that comes back by it, both 0 from
    inside; ``out_chance``: of going on outside.
    """

    direction: Direction
    fresnel: float
    returned: float
    out_chance: float


@njit(cache=True, nogil=True)
def fresnel_factor(surface, direction):  # type: ignore[no-untyped-def]
    """F of a view (u, v, n) by Eq. 3 and 4, with F = 1 at theta_o = pi / 2."""
    u, v, n = direction
    view = phi_bin(v, n, len(surface.gamma))
    theta = abs(np.arcsin(min(max(u, -1.0), 1.0)))
    share = (2.0 * theta / np.pi) ** surface.gamma[view]
    return share + (1.0 - share) * surface.head_on[view]


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
def scatter(glass, paths, i, at, event, u, results):  # type: ignore[no-untyped-def]
    """Light at a scratch: what the environment sends directly, and where path i goes on; returns
    whether it does.

    ``u`` in [0, 1) chooses between outside and inside.
    """
    paths.cone_angle[i] = _SCATTERED_ANGLE
    u_theta, u_wall = path_numbers(event, WALL)
    clear = u_wall >= glass.surface.roughness
    if clear and not at.outside:
        _leave_or_reflect(glass.surface, paths, i, at.frame, u)
        return True
    view = _view(glass.surface, at, row_vector(paths.direction, i))
    if not glass.uniform:
        _add_light(glass, paths, i, at, view, event, results)
    density = 0.0
    if u < view.out_chance:
        way, gain, density = _scattered_out(glass, at, view, event, u_theta)
    elif clear:  # inside, bent as by the smooth surface
        gain = (1.0 - view.fresnel) / (1.0 - view.out_chance)
        way = _bent(view.direction, glass.surface.refractive_index)
    else:
        pick = (u - view.out_chance) / (1.0 - view.out_chance)
        way, gain = _scattered_in(glass, at, view, event, pick)
    if gain <= 0.0 or way.n == 0.0:
        return False
    paths.pdf[i] = density
    set_row(paths.direction, i, _in_scene(at.frame, way))
    set_row(paths.throughput, i, scaled(gain, row_vector(paths.throughput, i)))
    return True


@njit(cache=True, nogil=True)
def _leave_or_reflect(surface, paths, i, frame, u):  # type: ignore[no-untyped-def]
    """At the mirror-like part of a scratch's walls, from inside: out again where the smooth surface
    would let it out, by 1 - F of the way outside (so it is reciprocal), or back."""
    came = row_vector(paths.direction, i)
    up = dot(came, frame.normal)
    sine_u = surface.refractive_index * dot(came, frame.along)
    sine_v = surface.refractive_index * dot(came, frame.across)
    outer2 = 1.0 - sine_u * sine_u - sine_v * sine_v
    paths.pdf[i] = 0.0
    if outer2 > 0.0:
        way = Direction(sine_u, sine_v, np.sqrt(outer2))
        if u >= fresnel_factor(surface, way):
            set_row(paths.direction, i, _in_scene(frame, way))
            return
    set_row(paths.direction, i, stepped(came, -2.0 * up, frame.normal))


@njit(cache=True, nogil=True)
def _view(surface, at, came):  # type: ignore[no-untyped-def]
    u, v, n = _in_frame(at.frame, came)
    direction = Direction(-u, -v, -n)
    if not at.outside:
        return _View(direction, 0.0, 0.0, 0.5)
    fresnel = fresnel_factor(surface, direction)
    returned = fresnel * surface.lobe.share[at.place, phi_bin(-v, -n, len(surface.gamma))]
    out_chance = max(returned / (returned + 1.0 - fresnel), _LEAST_REFLECTED)
    return _View(direction, fresnel, returned, out_chance)


@njit(cache=True, nogil=True)
def _add_light(glass, paths, i, at, view, event, results):  # type: ignore[no-untyped-def]
    """A direction drawn from the environment, weighted by the balance heuristic: to be added where
    its shadow ray meets nothing."""
    environment, surface = glass.environment, glass.surface
    u1, u2 = path_numbers(event, LIGHT)
    x, y, z, density = sample_direction(
        environment.row_cdf, environment.column_cdf, environment.density, u1, u2
    )
    light = _in_frame(at.frame, (x, y, z))
    if light.n <= 0.0 or density <= 0.0:
        return
    if at.outside:
        f = sampling.evaluate(surface.lobe, at.place, view.direction, light)
        scale = view.fresnel * light.n * f
        own = sampling.pdf(surface.lobe, at.place, view.direction, light)
    else:
        let_out = 1.0 - fresnel_factor(surface, light)
        scale = let_out * light.n / (np.pi * surface.refractive_index**2)
        own = light.n / np.pi
    gain = scale / (density + view.out_chance * own)
    if gain > 0.0:
        r, g, b = radiance_from_direction(environment.radiance, x, y, z)
        set_row(results.shadow_direction, i, (x, y, z))
        results.shadow_radiance[i, 0] = paths.throughput[i, 0] * gain * r
        results.shadow_radiance[i, 1] = paths.throughput[i, 1] * gain * g
        results.shadow_radiance[i, 2] = paths.throughput[i, 2] * gain * b


@njit(cache=True, nogil=True)
def _scattered_out(glass, at, view, event, u_theta):  # type: ignore[no-untyped-def]
    """A direction outside, what light from there is multiplied with, and its density."""
    surface = glass.surface
    u1, u2 = path_numbers(event, DIRECTION)
    density = 0.0
    if glass.uniform:
        way = _even_direction(u1, u2)
        if at.outside:
            f = sampling.evaluate(surface.lobe, at.place, view.direction, way)
            gain = view.fresnel * f
        else:
            gain = (1.0 - fresnel_factor(surface, way)) / (np.pi * surface.refractive_index**2)
        gain *= 2.0 * np.pi * way.n
    elif at.outside:
        way = sampling.sample(surface.lobe, at.place, view.direction, u1, u2, u_theta)
        gain = view.returned
        own = sampling.pdf(surface.lobe, at.place, view.direction, way)
        density = view.out_chance * own
    else:
        way = _cosine_direction(u1, u2)
        gain = (1.0 - fresnel_factor(surface, way)) / surface.refractive_index**2
        density = view.out_chance * way.n / np.pi
    return way, gain / view.out_chance, density


@njit(cache=True, nogil=True)
def _bent(view, index):  # type: ignore[no-untyped-def]
    """Where the smooth surface would bend a view's ray to, inside."""
    u, v = -view.u / index, -view.v / index
    return Direction(u, v, -np.sqrt(max(1.0 - u * u - v * v, 0.0)))


@njit(cache=True, nogil=True)
def _scattered_in(glass, at, view, event, pick):  # type: ignore[no-untyped-def]
    """A direction inside, of walls that scatter evenly, and what light from there is multiplied
    with; ``pick`` in [0, 1) chooses how it is drawn."""
    surface, flats, frame = glass.surface, glass.faces.flats, at.frame
    kept = 1.0 - (1.0 - surface.mean_fresnel) / surface.refractive_index**2
    gain = (1.0 - view.fresnel if at.outside else kept) / (1.0 - view.out_chance)
    u1, u2 = path_numbers(event, DIRECTION)
    if glass.uniform:
        u, v, n = _even_direction(u1, u2)
        return Direction(u, v, -n), gain * (2.0 * n)
    if pick < 0.5:
        u, v, n = _cosine_direction(u1, u2)
        way = _in_scene(frame, Direction(u, v, -n))
    else:
        numbers = ((pick - 0.5) * 2.0, u1, u2)
        way = aimed_inward(
            glass.environment, flats, frame.normal, surface.refractive_index, numbers
        )
    density = inward_pdf(glass.environment, flats, frame.normal, surface.refractive_index, way)
    inward = _in_frame(frame, way)
    return inward, gain * (-inward.n / np.pi / density if density > 0.0 else 0.0)


@njit(cache=True, nogil=True)
def _cosine_direction(u1, u2):  # type: ignore[no-untyped-def]
    radius, turn = np.sqrt(u1), 2.0 * np.pi * u2
    return Direction(radius * np.cos(turn), radius * np.sin(turn), np.sqrt(max(1.0 - u1, 0.0)))


@njit(cache=True, nogil=True)
def _even_direction(u1, u2):  # type: ignore[no-untyped-def]
    radius, turn = np.sqrt(max(1.0 - u1 * u1, 0.0)), 2.0 * np.pi * u2
    return Direction(radius * np.cos(turn), radius * np.sin(turn), u1)


@njit(cache=True, nogil=True)
def _in_frame(frame, vector):  # type: ignore[no-untyped-def]
    return Direction(dot(vector, frame.along), dot(vector, frame.across), dot(vector, frame.normal))


@njit(cache=True, nogil=True)
def _in_scene(frame, direction):  # type: ignore[no-untyped-def]
    u, v, n = direction
    return stepped(stepped(scaled(u, frame.along), v, frame.across), n, frame.normal)
