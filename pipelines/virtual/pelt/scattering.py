"""Scattering by hairs and skin, one path vertex at a time: compiled.

The model is in the docstring of ``pelt``: Kajiya and Kay's fibre with Goldman's directionality,
a Lambertian skin, a source about a direction.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from pipelines.geometry.rays import FirstHits
from pipelines.virtual.pelt.hairs import FloatArray
from pipelines.virtual.pelt.prisms import Fibres

BACKSCATTER = 0.3
NUMBERS_PER_VERTEX = 5  # random: direction to the light (2), next direction (3)
SKIN_CLEARANCE = 1e-5  # rays start at least this far above the skin

_Vector = tuple[float, float, float]


class Source(NamedTuple):
    """Light from afar: radiance (n + 2) / 2 cos^n about a direction, so that an open white
    Lambertian surface that faces it has radiance 1."""

    towards: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Unit vector to its middle."""
    exponent: float = 2.0
    """n: 0 is an even half of the sky, large a point."""


class Scattered(NamedTuple):
    """What N path vertices send on, each (N, 3) float32."""

    light_origin: FloatArray
    light_direction: FloatArray
    light_weight: FloatArray  # times visibility: the radiance towards the previous vertex
    next_origin: FloatArray
    next_direction: FloatArray
    next_weight: FloatArray  # times the radiance from there: likewise


class _DiscPoint(NamedTuple):
    """A point of the unit disc, evenly drawn.

    Lifted to the hemisphere it is cosine-distributed; its x alone is the cosine to the fibre of
    directions with density sin t (the semicircle law), and its y, in units of the chord there, is
    uniform.
    """

    x: float
    y: float
    chord: float


class _FibrePoint(NamedTuple):
    """Where a ray has met a hair, moved to its axis; the tangent has length 1."""

    place: _Vector
    tangent: _Vector
    radius: float
    hair: int


class _Vertex(NamedTuple):
    """One path vertex: where rays leave, and what they carry but for the albedo.

    onward: the direction in which the path goes on. light_start, next_start: how far from the place
    the rays to the light and onward begin. light: of the source, goes_on: of the path; 0 where it
    ends. albedo: row of ``Fibres.albedo``.
    """

    place: _Vector
    onward: _Vector
    light_start: float
    next_start: float
    light: float
    goes_on: float
    albedo: int


@njit(cache=True, nogil=True, error_model="numpy")
def scatter(
    hits: FirstHits,
    origins: FloatArray,
    directions: FloatArray,
    random: FloatArray,
    source: Source,
    fibres: Fibres,
    out: Scattered,
) -> None:
    """Fill ``out`` for each ray's first hit; random numbers (NUMBERS_PER_VERTEX, N) in [0, 1).

    origins, directions: (N, 3) of the rays.
    """
    hair_triangles = len(fibres.segment) * len(fibres.hair)
    exponent = source.exponent
    source_weight = math.pi * (exponent + 2) / (exponent + 1)  # radiance over density
    for i in range(len(hits.triangle)):
        light = _source_direction(random[0, i], random[1, i], source)
        disc = _disc_point(random[2, i], random[3, i])
        if hits.triangle[i] < 0:
            vertex = _at_the_source()
        elif hits.triangle[i] >= hair_triangles:
            normal = fibres.skin_normals[hits.triangle[i] - hair_triangles]
            vertex = _on_the_skin(
                _point_of(hits, origins, directions, i),
                (np.float64(normal[0]), np.float64(normal[1]), np.float64(normal[2])),
                len(fibres.albedo) - 1,
                source_weight,
                light,
                disc,
            )
        else:
            view = (-directions[i, 0], -directions[i, 1], -directions[i, 2])
            point = _fibre_point(fibres, hits, i)
            vertex = _on_a_fibre(point, view, light, source_weight, disc, random[4, i])
        _send_on(vertex, light, fibres, out, i)


@njit(cache=True, nogil=True, error_model="numpy")
def _source_direction(u: float, v: float, source: Source) -> _Vector:
    """Draw a direction to the source with density (n + 1) / (2 pi) cos^n."""
    z = u ** (1 / (source.exponent + 1))
    r = math.sqrt(max(0.0, 1 - z * z))
    return _beside(source.towards, r * math.cos(2 * math.pi * v), r * math.sin(2 * math.pi * v), z)


@njit(cache=True, nogil=True, error_model="numpy")
def _beside(axis: _Vector, a: float, b: float, c: float) -> _Vector:
    """a and b along two unit vectors across a unit axis, and c along it.

    Duff et al., "Building an Orthonormal Basis, Revisited" (2017); of z these are x and y.
    """
    x, y, z = axis
    sign = math.copysign(1.0, z)
    turn = -1.0 / (sign + z)
    cross = x * y * turn
    return (
        a * (1.0 + sign * x * x * turn) + b * cross + c * x,
        a * sign * cross + b * (sign + y * y * turn) + c * y,
        -a * sign * x - b * y + c * z,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _point_of(hits: FirstHits, origins: FloatArray, directions: FloatArray, i: int) -> _Vector:
    """Where ray i hits; in double precision afterwards: all kinds of vertices are of one type."""
    distance = hits.distance[i]
    return (
        np.float64(origins[i, 0] + distance * directions[i, 0]),
        np.float64(origins[i, 1] + distance * directions[i, 1]),
        np.float64(origins[i, 2] + distance * directions[i, 2]),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _disc_point(u: float, v: float) -> _DiscPoint:
    r = math.sqrt(u)
    a, b = r * math.cos(2 * math.pi * v), r * math.sin(2 * math.pi * v)
    return _DiscPoint(a, b, math.sqrt(max(1e-6, 1 - a * a)))


@njit(cache=True, nogil=True, error_model="numpy")
def _at_the_source() -> _Vertex:
    """Nothing was hit but the source, whose light has been sampled before: the path ends."""
    return _Vertex((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0, 0.0, 0.0, 0.0, 0)


@njit(cache=True, nogil=True, error_model="numpy")
def _on_the_skin(
    place: _Vector,
    normal: _Vector,
    row: int,
    source_weight: float,
    light: _Vector,
    disc: _DiscPoint,
) -> _Vertex:
    """Lambertian. Rays leave from just above: no skin shadows itself."""
    a, b = disc.x, disc.y
    up = math.sqrt(max(0.0, 1 - a * a - b * b))
    cosine = max(0.0, light[0] * normal[0] + light[1] * normal[1] + light[2] * normal[2])
    onward = _beside(normal, a, b, up)
    px, py, pz = place
    above = (
        px + SKIN_CLEARANCE * normal[0],
        py + SKIN_CLEARANCE * normal[1],
        pz + SKIN_CLEARANCE * normal[2],
    )
    return _Vertex(above, onward, 0.0, 0.0, source_weight * cosine / math.pi, 1.0, row)


@njit(cache=True, nogil=True, error_model="numpy")
def _fibre_point(fibres: Fibres, hits: FirstHits, i: int) -> _FibrePoint:
    """The point of a hair's axis beside hit ``i``."""
    faces = len(fibres.segment)
    copy = hits.triangle[i] // faces
    face = hits.triangle[i] - copy * faces
    hair, s = fibres.hair[copy], fibres.segment[face]
    f = 0.0
    for corner in range(3):
        f += hits.barycentric[i, corner] * fibres.towards_tip[face, corner]
    px, py, pz = _along(fibres.points, hair, s, f)
    px, py = px + fibres.copy_shift[copy, 0], py + fibres.copy_shift[copy, 1]
    tx, ty, tz = _along(fibres.tangents, hair, s, f)
    scale = 1 / math.sqrt(tx * tx + ty * ty + tz * tz)
    radius = (1 - f) * fibres.radii[hair, s] + f * fibres.radii[hair, s + 1]
    return _FibrePoint((px, py, pz), (scale * tx, scale * ty, scale * tz), radius, hair)


@njit(cache=True, nogil=True, error_model="numpy")
def _on_a_fibre(
    point: _FibrePoint,
    view: _Vector,
    light: _Vector,
    source_weight: float,
    disc: _DiscPoint,
    turn: float,
) -> _Vertex:
    """view, light: unit vectors away from the fibre; ``turn``: random, in [0, 1)."""
    tx, ty, tz = point.tangent
    lx, ly, lz = light
    # Across the fibre: u towards the viewer, v = t x u.
    vx, vy, vz = view
    cosine = tx * vx + ty * vy + tz * vz
    ux, uy, uz = vx - cosine * tx, vy - cosine * ty, vz - cosine * tz
    scale = 1 / math.sqrt(max(1e-12, ux * ux + uy * uy + uz * uz))
    ux, uy, uz = scale * ux, scale * uy, scale * uz
    vx, vy, vz = ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux
    # Light from the source: the cosine of its azimuth p is (u . l) / sin t.
    cosine = tx * lx + ty * ly + tz * lz
    sine = math.sqrt(max(1e-6, 1 - cosine * cosine))
    lobe = sine + BACKSCATTER * (ux * lx + uy * ly + uz * lz)
    # Light from other hairs: p is uniform so far. Turning cos p round with probability
    # (1 - BACKSCATTER cos p) / 2 leaves the density 1 + BACKSCATTER cos p, and weight 1.
    a, chord = disc.x, disc.chord
    azimuth = math.pi * disc.y / chord
    cu, cv = chord * math.cos(azimuth), chord * math.sin(azimuth)
    if 2 * turn > 1 + BACKSCATTER * math.cos(azimuth):
        cu = -cu
    nx = a * tx + cu * ux + cv * vx
    ny = a * ty + cu * uy + cv * vy
    nz = a * tz + cu * uz + cv * vz
    return _Vertex(
        point.place,
        (nx, ny, nz),
        _exit_distance(point.radius, sine),
        _exit_distance(point.radius, chord),
        source_weight * lobe / math.pi**2,
        1.0,
        point.hair,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _send_on(vertex: _Vertex, light: _Vector, fibres: Fibres, out: Scattered, i: int) -> None:
    """Write row i."""
    albedo = fibres.albedo
    _start(out.light_origin[i], vertex.place, vertex.light_start, light, fibres.wraps)
    _start(out.next_origin[i], vertex.place, vertex.next_start, vertex.onward, fibres.wraps)
    for axis in range(3):
        out.light_direction[i, axis] = light[axis]
        out.next_direction[i, axis] = vertex.onward[axis]
    for channel in range(3):
        out.light_weight[i, channel] = vertex.light * albedo[vertex.albedo, channel]
        out.next_weight[i, channel] = vertex.goes_on * albedo[vertex.albedo, channel]


@njit(cache=True, nogil=True, error_model="numpy")
def _start(row: FloatArray, place: _Vector, distance: float, way: _Vector, wraps: bool) -> None:
    """Where a ray begins: inside the tile, around which there are copies, where fur ``wraps``."""
    x, y = place[0] + distance * way[0], place[1] + distance * way[1]
    z = place[2] + distance * way[2]
    if wraps:
        row[0], row[1], row[2] = x - math.floor(x), y - math.floor(y), max(z, SKIN_CLEARANCE)
    else:
        row[0], row[1], row[2] = x, y, z


@njit(cache=True, nogil=True, error_model="numpy")
def _along(curves: FloatArray, hair: int, s: int, f: float) -> _Vector:
    """Interpolate (H, P, 3) figures of a hair at the fraction f of its segment s."""
    return (
        (1 - f) * curves[hair, s, 0] + f * curves[hair, s + 1, 0],
        (1 - f) * curves[hair, s, 1] + f * curves[hair, s + 1, 1],
        (1 - f) * curves[hair, s, 2] + f * curves[hair, s + 1, 2],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _exit_distance(radius: float, sine: float) -> float:
    """How far a ray from a tube's axis has to go to be outside; bounded along the tube."""
    return 1.02 * radius / max(sine, 0.15)
