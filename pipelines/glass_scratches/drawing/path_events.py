"""What happens to a path where it meets the glass: compiled, one event at a time.

See `path_tracing` for the model.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.glass_scratches.drawing.path_numbers import mixed, path_numbers, unit
from pipelines.glass_scratches.layers.coverage import filtered_coverage
from pipelines.glass_scratches.layers.feature_search import LayerArrays, scratch_at
from pipelines.glass_scratches.tables import sampling
from pipelines.glass_scratches.tables.sampling import Lobe, bin_of
from pipelines.light.environment_lookup import radiance_from_direction
from pipelines.light.environment_sampling import direction_pdf, sample_direction

DEEPEST = 24
"""Events of a path at most."""
_ROULETTE_FROM = 12
_LEAST_REFLECTED = 0.25
_SCATTERED_ANGLE = 0.3
"""Opening angle of the cone that stands for a path's width after it was scattered, radians."""


class Surface(NamedTuple):
    """What lies on a glass solid, as the kernels take it.

    ``layers`` and their ``coverage`` averaged over 1, 2, 4 … texels a side, flat, each level from
    its ``offsets`` on, ``resolution`` texels a side at first; ``tile``: scene units a tile;
    ``lobe`` and ``roughness`` of the walls; ``head_on``, ``gamma`` (M,): F at theta_o = 0 and the
    exponent towards pi / 2; ``refraction``: index of the glass; ``mean_factor``: F averaged over
    the hemisphere by the cosine.
    """

    layers: LayerArrays
    coverage: NDArray[np.float32]
    offsets: NDArray[np.int64]
    resolution: int
    tile: float
    lobe: Lobe
    roughness: float
    head_on: NDArray[np.float64]
    gamma: NDArray[np.float64]
    refraction: float
    mean_factor: float


class Facing(NamedTuple):
    """``normals`` (F, 3), ``corner_normals`` (F, 3, 3) of the triangles; ``flats`` (K, 3): axes
    along which at least a hundredth of the surface faces, either way."""

    normals: NDArray[np.float32]
    corner_normals: NDArray[np.float32]
    flats: NDArray[np.float64]


class Paths(NamedTuple):
    """One row a path that is still on its way."""

    number: NDArray[np.int64]
    origin: NDArray[np.float64]
    way: NDArray[np.float64]
    weight: NDArray[np.float64]
    density: NDArray[np.float64]
    """Per steradian, of the last sampled direction; 0 where only that direction was possible."""
    width: NDArray[np.float64]
    angle: NDArray[np.float64]
    seed: NDArray[np.uint64]


class Outcome(NamedTuple):
    """What an event adds, to be filled.

    By the path's number: ``gathered`` (N, 3) radiance, and whether it ``met`` a scratch. By its
    row: whether it is ``alive`` (goes on), and light ``offered`` from ``starts`` ``towards`` a
    direction, to be added where nothing stands between.
    """

    gathered: NDArray[np.float64]
    met: NDArray[np.bool_]
    alive: NDArray[np.bool_]
    starts: NDArray[np.float64]
    towards: NDArray[np.float64]
    offered: NDArray[np.float64]


@njit(cache=True)
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


@njit(cache=True)
def _box(normal, u):  # type: ignore[no-untyped-def]
    """The axis that a point is seen along, at random by the fourth power of the normal."""
    x, y, z = normal[0] ** 4, normal[1] ** 4, normal[2] ** 4
    pick = u * (x + y + z)
    if pick < x:
        return 0
    return 1 if pick < x + y else 2


@njit(cache=True)
def _scratch(surface, axis, facing, x, y, width, u, v):  # type: ignore[no-untyped-def]
    """The scratch at a point of the tile: (whether, place across, its direction in the tile)."""
    chosen, covering = -1, 0
    place, angle = 0.0, 0.0
    level = np.floor(np.log2(max(width * surface.resolution, 1e-9)) + v)
    state = mixed(np.uint64(u * 4503599627370496.0) + np.uint64(77))
    for layer in range(len(surface.layers.angle)):
        # Each side of each axis has its own part of the tile.
        sx = x + 0.37 * axis + 0.11 * facing
        sy = y + 0.61 * axis + 0.23 * facing
        state = mixed(state + np.uint64(0x9E3779B97F4A7C15))
        if level < 0:
            opacity, across, direction = scratch_at(surface.layers, layer, sx, sy)
        else:
            opacity = filtered_coverage(
                surface.coverage, surface.offsets, surface.resolution, layer, int(level), sx, sy
            )
            across = 2.0 * unit(mixed(state + np.uint64(3))) - 1.0
            direction = np.float64(surface.layers.angle[layer])
        if unit(state) < opacity:
            covering += 1
            # One of those at random: the n-th replaces the last choice with chance 1 / n.
            if unit(mixed(state + np.uint64(5))) * covering < 1.0:
                chosen, place, angle = layer, across, direction
    return chosen >= 0, place, angle


@njit(cache=True, nogil=True)
def advance(  # type: ignore[no-untyped-def]
    first, last, shape, surface, environment, paths, hits, outcome, depth, samples, offset, uniform
):
    """Take paths ``first`` to ``last`` - 1 to their next event, from what their rays met."""
    for i in range(first, last):
        _event(
            shape, surface, environment, paths, i, hits, outcome, depth, samples, offset, uniform
        )


@njit(cache=True)
def _event(  # type: ignore[no-untyped-def]
    shape, surface, environment, paths, i, hits, outcome, depth, samples, offset, uniform
):
    distance, triangle = hits.distance[i], hits.triangle[i]
    number, seed = paths.number[i], paths.seed[i]
    way, weight = paths.way[i], paths.weight[i]
    if triangle < 0:
        r, g, b = radiance_from_direction(environment.radiance, way[0], way[1], way[2])
        share = 1.0
        if paths.density[i] > 0.0 and not uniform:
            other = direction_pdf(environment.density, way[0], way[1], way[2])
            share = paths.density[i] / (paths.density[i] + other)
        outcome.gathered[number, 0] += weight[0] * r * share
        outcome.gathered[number, 1] += weight[1] * g * share
        outcome.gathered[number, 2] += weight[2] * b * share
        return
    if depth == DEEPEST - 1:
        return
    position = paths.origin[i] + distance * way
    paths.width[i] += paths.angle[i] * distance
    face = shape.normals[triangle].astype(np.float64)
    normal = np.zeros(3)
    for corner in range(3):
        for axis in range(3):
            normal[axis] += (
                hits.barycentric[i, corner] * shape.corner_normals[triangle, corner, axis]
            )
    normal /= np.sqrt((normal * normal).sum())
    outside = (way * face).sum() < 0.0
    if ((way * normal).sum() < 0.0) != outside:
        normal = face
    side = 1.0 if outside else -1.0

    u, v = path_numbers(seed, number, samples, depth, 0)
    axis = _box(face, u)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    facing = 1.0 if face[axis] > 0.0 else 0.0
    cosine = abs((way * face).sum())
    width = paths.width[i] / max(np.sqrt(cosine), 0.1) / surface.tile
    u, u_choice = path_numbers(seed, number, samples, depth, 1)
    found, place, angle = _scratch(
        surface,
        axis,
        facing,
        position[first] / surface.tile,
        position[second] / surface.tile,
        width,
        u,
        v,
    )
    if found:
        outcome.met[number] = True
        goes_on = _scatter(
            surface,
            environment,
            shape.flats,
            paths,
            i,
            normal,
            side,
            first,
            second,
            place,
            angle,
            u_choice,
            depth,
            samples,
            uniform,
            outcome,
        )
        outcome.starts[i] = position + offset * face
    else:
        goes_on = True
        _pass(paths, i, normal, face, side, surface.refraction, u_choice, depth)
    if not goes_on:
        return
    out = 1.0 if (paths.way[i] * face).sum() > 0.0 else -1.0
    paths.origin[i] = position + out * offset * face
    if depth >= _ROULETTE_FROM:
        kept = min(4.0 * paths.weight[i].max(), 0.98)
        u, v = path_numbers(seed, number, samples, depth, 5)
        if v >= kept:
            return
        paths.weight[i] /= kept
    outcome.alive[i] = True


@njit(cache=True)
def _pass(paths, i, normal, face, side, index, u, depth):  # type: ignore[no-untyped-def]
    """Reflect or refract at smooth glass; at what is seen first, a quarter of each at least."""
    way = paths.way[i].copy()
    ratio = 1.0 / index if side > 0.0 else index
    for attempt in range(2):
        facing = side * (normal if attempt == 0 else face)
        cosine = -(way * facing).sum()
        part, behind = reflectance(min(cosine, 1.0), ratio)
        chance = min(max(part, 0.25), 0.75) if depth == 0 and part < 1.0 else part
        if u < chance:
            gain = part / chance
            paths.way[i] = way + 2.0 * cosine * facing
            right = (paths.way[i] * face).sum() * side > 0.0
        else:
            gain = (1.0 - part) / (1.0 - chance)
            paths.way[i] = ratio * way + (ratio * cosine - behind) * facing
            right = (paths.way[i] * face).sum() * side < 0.0
        if right:  # a smoothed normal may send light to the wrong side
            break
    paths.way[i] /= np.sqrt((paths.way[i] * paths.way[i]).sum())
    paths.weight[i] *= gain
    paths.density[i] = 0.0


@njit(cache=True)
def _cosine_direction(u1, u2):  # type: ignore[no-untyped-def]
    radius, turn = np.sqrt(u1), 2.0 * np.pi * u2
    return radius * np.cos(turn), radius * np.sin(turn), np.sqrt(max(1.0 - u1, 0.0))


@njit(cache=True)
def _even_direction(u1, u2):  # type: ignore[no-untyped-def]
    radius, turn = np.sqrt(max(1.0 - u1 * u1, 0.0)), 2.0 * np.pi * u2
    return radius * np.cos(turn), radius * np.sin(turn), u1


@njit(cache=True)
def _let_out(surface, paths, i, along, across, normal, u):  # type: ignore[no-untyped-def]
    """At the mirror-like part of a scratch's walls, from inside: out again where the smooth surface
    would let it out, by 1 - F of the way outside (so it is reciprocal), or back."""
    way = paths.way[i].copy()
    up = (way * normal).sum()
    iu, iv = surface.refraction * (way * along).sum(), surface.refraction * (way * across).sum()
    outer2 = 1.0 - iu * iu - iv * iv
    paths.density[i] = 0.0
    if outer2 > 0.0:
        i_n = np.sqrt(outer2)
        if u >= lean_factor(surface, iu, iv, i_n):
            paths.way[i] = iu * along + iv * across + i_n * normal
            return True
    paths.way[i] = way - 2.0 * up * normal
    return True


@njit(cache=True)
def _inward(  # type: ignore[no-untyped-def]
    environment, flats, along, across, normal, index, pick, u1, u2
):
    """A direction into the glass, (u, v, n) with n < 0, and its density per steradian.

    Half of them by the cosine; half aim at what is bright in the environment as it is seen through
    a face parallel to this one, or to one of the solid's flat faces. Total reflection on the way
    only mirrors: for a plate that covers whatever becomes of the light, for thin walls most of it.
    """
    axes = 1
    for flat in range(len(flats)):
        if abs((flats[flat] * normal).sum()) < 0.99:
            axes += 1
    way = np.zeros(3)
    if pick < 0.5:
        iu, iv, i_n = _cosine_direction(u1, u2)
        way[:] = iu * along + iv * across - i_n * normal
    else:
        ex, ey, ez, _ = sample_direction(
            environment.row_cdf, environment.column_cdf, environment.density, u1, u2
        )
        way[0], way[1], way[2] = ex, ey, ez
        axis = _axis(flats, normal, min(int((pick - 0.5) * 2.0 * axes), axes - 1))
        outer = (way * axis).sum()
        way = (way - outer * axis) / index
        way += np.sign(outer) * np.sqrt(max(1.0 - (way * way).sum(), 0.0)) * axis
        below = (way * normal).sum()
        if below > 0.0:
            way -= 2.0 * below * normal
    below = -(way * normal).sum()
    density = 0.5 * max(below, 0.0) / np.pi
    for mirrored in range(2):
        from_here = way + 2.0 * below * normal if mirrored else way
        for number in range(axes):
            axis = _axis(flats, normal, number)
            inner = (from_here * axis).sum()
            outer2 = 1.0 - index * index * (1.0 - inner * inner)
            if outer2 > 1e-9:  # it would leave through such a face
                outer = np.sqrt(outer2)
                seen = index * (from_here - inner * axis) + np.sign(inner) * outer * axis
                there = direction_pdf(environment.density, seen[0], seen[1], seen[2])
                density += 0.5 / axes * there * index * index * abs(inner) / outer
    return (way * along).sum(), (way * across).sum(), -below, density


@njit(cache=True)
def _axis(flats, normal, number):  # type: ignore[no-untyped-def]
    """The surface's own normal, then those of flat faces that are not parallel to it."""
    if number == 0:
        return normal
    for flat in range(len(flats)):
        if abs((flats[flat] * normal).sum()) < 0.99:
            number -= 1
            if number == 0:
                return flats[flat]
    return normal


@njit(cache=True)
def lean_factor(surface, u, v, n):  # type: ignore[no-untyped-def]
    """F of a view (u, v, n) by Eq. 3 and 4, with F = 1 at theta_o = pi / 2."""
    view = bin_of(v, n, len(surface.gamma))
    theta = abs(np.arcsin(min(max(u, -1.0), 1.0)))
    share = (2.0 * theta / np.pi) ** surface.gamma[view]
    return share + (1.0 - share) * surface.head_on[view]


@njit(cache=True)
def _scatter(  # type: ignore[no-untyped-def]
    surface,
    environment,
    flats,
    paths,
    i,
    normal,
    side,
    first,
    second,
    place,
    angle,
    u_choice,
    depth,
    samples,
    uniform,
    outcome,
):
    """Light at a scratch: what the environment sends directly, and where the path goes on."""
    number, seed = paths.number[i], paths.seed[i]
    lobe = surface.lobe
    along = np.zeros(3)
    along[first], along[second] = np.cos(angle), np.sin(angle)
    along -= (along * normal).sum() * normal
    length = np.sqrt((along * along).sum())
    if length < 1e-6:
        return False
    along /= length
    across = np.cross(normal, along)
    way = paths.way[i]
    ou, ov, on = -(way * along).sum(), -(way * across).sum(), -(way * normal).sum()
    part = min(max(int((place + 1.0) / 2.0 * len(lobe.rho)), 0), len(lobe.rho) - 1)
    u1, u2 = path_numbers(seed, number, samples, depth, 2)
    e1, e2 = path_numbers(seed, number, samples, depth, 3)
    paths.angle[i] = _SCATTERED_ANGLE
    u3, u4 = path_numbers(seed, number, samples, depth, 4)
    clear = u4 >= surface.roughness
    if clear and side < 0.0:
        return _let_out(surface, paths, i, along, across, normal, u_choice)

    if side > 0.0:
        factor = lean_factor(surface, ou, ov, on)
        returned = factor * lobe.share[part, bin_of(ov, on, len(surface.gamma))]
        out_chance = max(returned / (returned + 1.0 - factor), _LEAST_REFLECTED)
    else:
        factor = returned = 0.0  # not used from inside
        out_chance = 0.5

    if not uniform:
        ex, ey, ez, density = sample_direction(
            environment.row_cdf, environment.column_cdf, environment.density, e1, e2
        )
        iu = ex * along[0] + ey * along[1] + ez * along[2]
        iv = ex * across[0] + ey * across[1] + ez * across[2]
        i_n = ex * normal[0] + ey * normal[1] + ez * normal[2]
        if i_n > 0.0 and density > 0.0:
            if side > 0.0:
                scale = factor * i_n * sampling.evaluate(lobe, part, (ou, ov, on), (iu, iv, i_n))
                own = sampling.pdf(lobe, part, (ou, ov, on), (iu, iv, i_n))
            else:
                let_out = 1.0 - lean_factor(surface, iu, iv, i_n)
                scale = let_out * i_n / (np.pi * surface.refraction**2)
                own = i_n / np.pi
            gain = scale / (density + out_chance * own)
            if gain > 0.0:
                r, g, b = radiance_from_direction(environment.radiance, ex, ey, ez)
                outcome.towards[i, 0], outcome.towards[i, 1], outcome.towards[i, 2] = ex, ey, ez
                outcome.offered[i, 0] = paths.weight[i, 0] * gain * r
                outcome.offered[i, 1] = paths.weight[i, 1] * gain * g
                outcome.offered[i, 2] = paths.weight[i, 2] * gain * b

    if u_choice < out_chance:  # the path goes on outside
        density = 0.0
        if uniform:
            iu, iv, i_n = _even_direction(u1, u2)
            if side > 0.0:
                gain = factor * sampling.evaluate(lobe, part, (ou, ov, on), (iu, iv, i_n))
            else:
                gain = (1.0 - lean_factor(surface, iu, iv, i_n)) / (np.pi * surface.refraction**2)
            gain *= 2.0 * np.pi * i_n
        elif side > 0.0:
            iu, iv, i_n = sampling.sample(lobe, part, (ou, ov, on), u1, u2, u3)
            gain = returned
            density = out_chance * sampling.pdf(lobe, part, (ou, ov, on), (iu, iv, i_n))
        else:
            iu, iv, i_n = _cosine_direction(u1, u2)
            gain = (1.0 - lean_factor(surface, iu, iv, i_n)) / surface.refraction**2
            density = out_chance * i_n / np.pi
        gain /= out_chance
        paths.density[i] = density
    elif clear:  # … or inside, bent as by the smooth surface
        paths.density[i] = 0.0
        gain = (1.0 - factor) / (1.0 - out_chance)
        iu, iv = -ou / surface.refraction, -ov / surface.refraction
        i_n = -np.sqrt(max(1.0 - iu * iu - iv * iv, 0.0))
    else:  # … or inside, evenly scattered
        paths.density[i] = 0.0
        gain = (
            1.0 - factor
            if side > 0.0
            else 1.0 - (1.0 - surface.mean_factor) / surface.refraction**2
        )
        gain /= 1.0 - out_chance
        if uniform:
            iu, iv, i_n = _even_direction(u1, u2)
            gain *= 2.0 * i_n
            i_n = -i_n
        else:
            pick = (u_choice - out_chance) / (1.0 - out_chance)
            iu, iv, i_n, density = _inward(
                environment, flats, along, across, normal, surface.refraction, pick, u1, u2
            )
            gain *= -i_n / np.pi / density if density > 0.0 else 0.0
    if gain <= 0.0 or i_n == 0.0:
        return False
    paths.way[i] = iu * along + iv * across + i_n * normal
    paths.weight[i] *= gain
    return True
