"""Compiled loops of the virtual gonioreflectometer: what is seen, rays to the lights, radiance.

Every loop in parallel writes to places of its own only, in an order of its own, so that results
do not depend on the number of threads. The bodies of such loops are functions of their own: numba
0.6x loses assignments to arrays of a named tuple inside ``prange`` itself (seen).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from pipelines.virtual.cloth.fibre_brdf import (
    diffuse_falloff,
    grazing_fresnel,
    mean_transmitted,
    microfacet_lobe,
    transmitted,
)
from pipelines.virtual.cloth.mesh import Cloth

FloatArray = NDArray[np.float32]
LEAST_COSINE = 1e-3  # of a view: interpolated normals turn away at silhouettes
LIFT = 2e-5  # of shadow rays off their surface, in sides of the tile


class ShadingPoints(NamedTuple):
    """N places on the surface, seen from one direction.

    position: (N, 3), x and y in the tile [0, 1), lifted off the surface.
    facing: (N, 3) normal of the triangle, to the viewer.
    frame: (N, 3, 3) rows fibre, across, normal. outgoing: (N, 3) to the viewer, in the frame.
    corner: (N, 3) vertices, -1 where nothing was hit; weight: (N, 3) of theirs.
    albedo, specular: (N, 3). roughness: (N, 2).
    """

    position: FloatArray
    facing: FloatArray
    frame: FloatArray
    outgoing: FloatArray
    corner: NDArray[np.int32]
    weight: FloatArray
    albedo: FloatArray
    specular: FloatArray
    roughness: FloatArray

    @staticmethod
    def empty(count: int) -> ShadingPoints:
        """Room for ``count`` places."""

        def room(*shape: int) -> FloatArray:
            return np.empty((count, *shape), np.float32)

        corner = np.empty((count, 3), np.int32)
        return ShadingPoints(
            room(3), room(3), room(3, 3), room(3), corner, room(3), room(3), room(3), room(2)
        )


@njit(cache=True, nogil=True, error_model="numpy")
def _scaled(x: float, y: float, z: float, sign: float) -> tuple[float, float, float]:
    scale = sign / max(math.sqrt(x * x + y * y + z * z), 1e-30)
    return scale * x, scale * y, scale * z


@njit(cache=True, nogil=True, error_model="numpy")
def _interpolated(
    values: FloatArray, corner: NDArray[np.int32], weight: FloatArray
) -> tuple[float, float, float]:
    """Interpolate (V, 3) figures in a triangle."""
    a, b, c = corner[0], corner[1], corner[2]
    u, v, w = weight[0], weight[1], weight[2]
    return (
        u * values[a, 0] + v * values[b, 0] + w * values[c, 0],
        u * values[a, 1] + v * values[b, 1] + w * values[c, 1],
        u * values[a, 2] + v * values[b, 2] + w * values[c, 2],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _triangle_normal(vertices: FloatArray, corner: NDArray[np.int32]) -> tuple[float, float, float]:
    a, b, c = corner[0], corner[1], corner[2]
    px, py, pz = vertices[a, 0], vertices[a, 1], vertices[a, 2]
    ux, uy, uz = vertices[b, 0] - px, vertices[b, 1] - py, vertices[b, 2] - pz
    vx, vy, vz = vertices[c, 0] - px, vertices[c, 1] - py, vertices[c, 2] - pz
    return _scaled(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx, 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _across_fibre(
    tx: float, ty: float, tz: float, nx: float, ny: float, nz: float
) -> tuple[float, float, float]:
    """Project the fibre into the surface; any direction there if it stands on end."""
    slope = tx * nx + ty * ny + tz * nz
    tx, ty, tz = tx - slope * nx, ty - slope * ny, tz - slope * nz
    if tx * tx + ty * ty + tz * tz < 1e-12:
        if abs(nx) < 0.6:
            tx, ty, tz = 1.0 - nx * nx, -nx * ny, -nx * nz
        else:
            tx, ty, tz = -ny * nx, 1.0 - ny * ny, -ny * nz
    return _scaled(tx, ty, tz, 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _find_point(
    origin: FloatArray,
    direction: FloatArray,
    distance: float,
    triangle: int,
    barycentric: FloatArray,
    surface: Cloth,
    points: ShadingPoints,
    i: int,
) -> None:
    if triangle < 0:
        points.corner[i] = -1
        points.position[i] = 0.0
        points.facing[i] = 0.0
        points.frame[i] = 0.0
        return
    dx, dy, dz = direction[0], direction[1], direction[2]
    corner, weight = points.corner[i], points.weight[i]
    for k in range(3):
        corner[k] = surface.triangles[triangle, k]
        weight[k] = barycentric[k]
    gx, gy, gz = _triangle_normal(surface.vertices, corner)
    side = 1.0 if gx * dx + gy * dy + gz * dz <= 0.0 else -1.0  # seen from outside or inside
    gx, gy, gz = side * gx, side * gy, side * gz
    nx, ny, nz = _interpolated(surface.normals, corner, weight)
    nx, ny, nz = _scaled(nx, ny, nz, side)
    tx, ty, tz = _interpolated(surface.fibres, corner, weight)
    tx, ty, tz = _across_fibre(tx, ty, tz, nx, ny, nz)
    bx, by, bz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
    frame = points.frame[i]
    frame[0, 0], frame[0, 1], frame[0, 2] = tx, ty, tz
    frame[1, 0], frame[1, 1], frame[1, 2] = bx, by, bz
    frame[2, 0], frame[2, 1], frame[2, 2] = nx, ny, nz
    points.facing[i, 0], points.facing[i, 1], points.facing[i, 2] = gx, gy, gz
    x = origin[0] + distance * dx + LIFT * gx
    y = origin[1] + distance * dy + LIFT * gy
    points.position[i, 0] = x - math.floor(x)
    points.position[i, 1] = y - math.floor(y)
    points.position[i, 2] = origin[2] + distance * dz + LIFT * gz
    oz = max(-(nx * dx + ny * dy + nz * dz), LEAST_COSINE)
    ox, oy, oz = _scaled(-(tx * dx + ty * dy + tz * dz), -(bx * dx + by * dy + bz * dz), oz, 1.0)
    points.outgoing[i, 0], points.outgoing[i, 1], points.outgoing[i, 2] = ox, oy, oz
    red, green, blue = _interpolated(surface.albedo, corner, weight)
    points.albedo[i, 0], points.albedo[i, 1], points.albedo[i, 2] = red, green, blue
    red, green, blue = _interpolated(surface.specular, corner, weight)
    points.specular[i, 0], points.specular[i, 1], points.specular[i, 2] = red, green, blue
    for k in range(2):
        total = 0.0
        for c in range(3):
            total += weight[c] * surface.roughness[corner[c], k]
        points.roughness[i, k] = total


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def find_shading_points(
    origins: FloatArray,
    direction: FloatArray,
    distance: FloatArray,
    triangle: NDArray[np.int64],
    barycentric: FloatArray,
    surface: Cloth,
    points: ShadingPoints,
) -> None:
    """Fill ``points`` with what rays along ``direction`` (3,) have hit first."""
    for i in prange(len(triangle)):
        _find_point(
            origins[i], direction, distance[i], triangle[i], barycentric[i], surface, points, i
        )


@njit(cache=True, nogil=True, error_model="numpy")
def light_is_above(facing: FloatArray, normal: FloatArray, light: FloatArray) -> bool:
    """Tell whether a light is above both the triangle and the smooth surface."""
    return (
        facing[0] * light[0] + facing[1] * light[1] + facing[2] * light[2] > 0.0
        and normal[0] * light[0] + normal[1] * light[1] + normal[2] * light[2] > 0.0
    )


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def count_lights_above(
    facing: FloatArray, normal: FloatArray, lights: FloatArray, count: NDArray[np.int64]
) -> None:
    """Count the lights (L, 3) that are above each place (N, 3)."""
    for i in prange(len(facing)):
        number = 0
        for k in range(len(lights)):
            number += light_is_above(facing[i], normal[i], lights[k])
        count[i] = number


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def list_shadow_rays(
    position: FloatArray,
    facing: FloatArray,
    normal: FloatArray,
    lights: FloatArray,
    first: NDArray[np.int64],
    origins: FloatArray,
    directions: FloatArray,
) -> None:
    """List a ray for each light above a place, those of place i from row first[i] on."""
    for i in prange(len(facing)):
        row = first[i]
        for k in range(len(lights)):
            if light_is_above(facing[i], normal[i], lights[k]):
                for c in range(3):
                    origins[row, c] = position[i, c]
                    directions[row, c] = lights[k, c]
                row += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _shade_point(
    points: ShadingPoints,
    i: int,
    share: float,
    lights: FloatArray,
    row: int,
    blocked: NDArray[np.bool_],
    reflected: FloatArray,
    out: FloatArray,
) -> None:
    """Add to out (L, 3) the share of point i; its shadow rays are the rows from ``row`` on."""
    frame, albedo, corner = points.frame[i], points.albedo[i], points.corner[i]
    ox, oy, oz = points.outgoing[i, 0], points.outgoing[i, 1], points.outgoing[i, 2]
    along, across = points.roughness[i, 0], points.roughness[i, 1]
    fifth_o = diffuse_falloff(oz)
    f0, rise, body = np.empty(3), np.empty(3), np.empty(3)
    for c in range(3):
        f0[c] = points.specular[i, c]
        rise[c] = grazing_fresnel(f0[c]) - f0[c]
        body[c] = albedo[c] * transmitted(f0[c], fifth_o) / mean_transmitted(f0[c])
    if len(reflected) > 0:
        soft = share * transmitted((f0[0] + f0[1] + f0[2]) / 3, fifth_o)
        for k in range(3):
            weight = soft * points.weight[i, k]
            around = reflected[corner[k]]
            for light in range(len(lights)):
                for c in range(3):
                    out[light, c] += weight * albedo[c] * around[light, c]
    for light in range(len(lights)):
        to_light = lights[light]
        if not light_is_above(points.facing[i], frame[2], to_light):
            continue
        row += 1
        if blocked[row - 1]:
            continue
        lx, ly, lz = to_light[0], to_light[1], to_light[2]
        ix = frame[0, 0] * lx + frame[0, 1] * ly + frame[0, 2] * lz
        iy = frame[1, 0] * lx + frame[1, 1] * ly + frame[1, 2] * lz
        iz = frame[2, 0] * lx + frame[2, 1] * ly + frame[2, 2] * lz
        fifth_i = diffuse_falloff(iz)
        lobe, schlick = microfacet_lobe(ix, iy, iz, ox, oy, oz, along, across)
        for c in range(3):
            gloss = math.pi * lobe * (f0[c] + rise[c] * schlick)
            value = gloss + body[c] * (1.0 - f0[c] - rise[c] * fifth_i)
            out[light, c] += share * iz * value


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def shade(
    points: ShadingPoints,
    begin: int,
    samples: int,
    lights: FloatArray,
    first: NDArray[np.int64],
    blocked: NDArray[np.bool_],
    reflected: FloatArray,
    out: FloatArray,
) -> None:
    """Fill out (L, texels, 3) with mean radiances; texel j has the points begin + samples j + ….

    first: (texels * samples,) rows of ``blocked``. reflected: (V, L, 3) irradiance / pi from other
    surfaces, or (0, L, 3) for none.
    """
    for texel in prange(out.shape[1]):
        place = out[:, texel]
        place[:] = 0.0
        for s in range(samples):
            local = texel * samples + s
            if points.corner[begin + local, 0] >= 0:
                _shade_point(
                    points, begin + local, 1.0 / samples, lights, first[local], blocked,
                    reflected, place,
                )  # fmt: skip
