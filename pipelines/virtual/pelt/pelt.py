"""The virtual pelt: a synthetic photograph of fur whose depth is known in every pixel.

The fur model of this system (Eq. 1-4 of the fur paper) reads depth out of brightness: light that
enters fur from above decays as I(h) = Imax exp(-a h). To test that honestly one needs a picture
of fur with its true depth. Here hairs are grown as curves, photographed from straight above by
tracing light among them, and the depth at which each pixel's ray meets the fur is kept beside the
picture. The brightness never sees the depth: it is what a Monte Carlo light transport gives.

Place and units
    The patch is the tile [0, 1] x [0, 1] of the plane z = 0 (the skin), continued periodically in
    x and y; z points to the camera. One unit is the side of the tile (see ``hairs.py``). Row 0 of
    a picture is at y = 1, column 0 at x = 0.

Light
    A large soft source overhead: radiance from the direction with zenith angle t is
    (n + 2) / 2 cos^n t for t < 90 degrees, scaled so that an open horizontal white Lambertian
    surface has radiance 1. Light exactly along the view would reach every visible point alike, so
    "lit along the view" has to mean a source of some extent; n = 0 is an even sky.

Scattering
    A hair is a thin fibre after Kajiya and Kay ("Rendering fur with three dimensional textures",
    SIGGRAPH 1989) with the forward and backward directionality of Goldman ("Fake fur rendering",
    SIGGRAPH 1997), normalised so that an albedo of 1 scatters all light: with the angle t between
    light and fibre and the angle p between light and view about the fibre,
        L = albedo / pi^2  *  integral of  L_in (1 + BACKSCATTER cos p) sin t  over the sphere.
    Light may pass through the fibre; therefore rays leave from its axis and start outside it. The
    skin is Lambertian. A path has its light from the source sampled at each vertex and is
    scattered onwards ``bounces`` times by importance sampling.

Camera
    Orthographic, box-filtered pixels, then a lens blur of LENS_BLUR pixels. Samples are Sobol
    points shifted at random for each pixel. Indirect light is the smaller and smoother part (a
    fifth of the light, a tenth of the variance): one in INDIRECT_STRIDE samples follows it, which
    gives about the least noise for a number of rays.

Limits
    Hairs have no gloss and no medulla, and their roots no darker colour. A ray sees the tile's
    copies as far away as the fur is high; beyond, it meets bare skin or the sky.

What comes out (512 pixels, 16 000 hairs, 24 samples, three seeds)
    Brightness falls with depth with a rank correlation of 0.73 to 0.75. Its mean at a depth is
    level over the top third, where only the highest tufts reach and nothing shades them; from
    there it falls by two thirds on a curve nearer to a bent S than to one exponential (log-linear
    fit: a = 2 a thickness, R^2 0.96 of the means), and ends on the floor of multiply scattered
    light.

All random numbers come from one Generator; sums are in a fixed order and no ray's answer
depends on threads. Equal arguments give equal bits on one machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.stats import qmc

from pipelines.geometry.rays import build_scene, first_hits, occluded
from pipelines.virtual.pelt.hairs import FloatArray, Hairs, grow_hairs

if TYPE_CHECKING:
    from open3d.t.geometry import RaycastingScene

SKIN_ALBEDO = (0.26, 0.16, 0.085)
SOURCE_EXPONENT = 2.0
BACKSCATTER = 0.3
BOUNCES = 2
LENS_BLUR = 0.5  # standard deviation in pixels
INDIRECT_STRIDE = 4
WHITE_QUANTILE = 0.999
SIDES = 3  # of a hair's prism
PIXELS_PER_BLOCK = 1 << 17
NUMBERS_PER_VERTEX = 5  # random: direction to the light (2), next direction (3)
SKIN_CLEARANCE = 1e-5  # rays start at least this far above the skin: no skin shadows itself


class Pelt(NamedTuple):
    """A photograph of fur and its true depth; row 0 at the top, both periodic.

    radiance: (size, size, 3) float32, linear RGB.
    depth: (size, size) float32 in [0, 1]: where the ray through the pixel's centre first meets
        hair or skin, from 0 at the height of the highest hair to 1 at the skin.
    """

    radiance: FloatArray
    depth: FloatArray


def virtual_pelt(
    size: int,
    hairs: int,
    samples: int,
    seed: int,
    *,
    progress: Callable[[float], None] | None = None,
) -> Pelt:
    """Grow a patch of fur and photograph it from above.

    size: side of the picture in pixels.
    hairs: how many grow in the patch; their size goes with 1 / sqrt(hairs). 512 pixels want some
        16 000: hairs two pixels thick and a hundred long.
    samples: light paths a pixel.
    seed: of all random numbers; equal arguments give equal bits.
    progress: called with the fraction done in (0, 1], rising.

    The radiance is exposed: 1 is the WHITE_QUANTILE of the brightest channel, more is clipped.
    Raises ValueError for sizes, hairs or samples below 1.
    The model is in the module's docstring; it is ours.
    """
    rng = np.random.default_rng(seed)
    fur = grow_hairs(hairs, rng)
    picture = photograph_pelt(fur, size, samples, rng, progress=progress)
    white = max(float(np.quantile(picture.radiance.max(axis=-1), WHITE_QUANTILE)), 1e-6)
    return picture._replace(radiance=np.minimum(picture.radiance / np.float32(white), 1))


# --------------------------------------------------------------------------------------------
# Photographing


def photograph_pelt(
    hairs: Hairs,
    size: int,
    samples: int,
    rng: np.random.Generator,
    *,
    source_exponent: float = SOURCE_EXPONENT,
    bounces: int = BOUNCES,
    skin_albedo: tuple[float, float, float] = SKIN_ALBEDO,
    progress: Callable[[float], None] | None = None,
) -> Pelt:
    """Trace light among hairs to an orthographic camera straight above.

    hairs: of one tile; there may be none, then all is skin.
    size: side of the picture in pixels. samples: paths a pixel.
    source_exponent: n of the overhead source, 0 an even sky, large a point at the zenith.
    bounces: how often light goes on from one hair to the next, 0 for direct light alone.
    progress: called with the fraction done in (0, 1], rising.

    The radiance is not exposed: an open white Lambertian skin has 1.
    Raises ValueError for a size or samples below 1, and negative bounces or exponents.
    """
    for name, value, least in (
        ("size", size, 1),
        ("samples", samples, 1),
        ("bounces", bounces, 0),
        ("source_exponent", source_exponent, 0),
    ):
        if value < least:
            raise ValueError(f"{name}: expected at least {least}, found {value}")
    fur = _Fur.of(hairs, skin_albedo)
    numbers = 2 + NUMBERS_PER_VERTEX * (bounces + 1)  # the first two: a place in the pixel
    sobol = qmc.Sobol(numbers, seed=rng).random_base2(math.ceil(math.log2(samples)))
    indirect_samples = math.ceil(samples / INDIRECT_STRIDE)
    indirect_weight = samples / indirect_samples
    vertices = [bounces + 1 if k < indirect_samples else 1 for k in range(samples)]

    radiance = np.zeros((size * size, 3), np.float32)
    depth = np.empty(size * size, np.float32)
    for first in range(0, size * size, PIXELS_PER_BLOCK):
        pixels = np.arange(first, min(first + PIXELS_PER_BLOCK, size * size))
        depth[pixels] = _depth(fur, pixels, size)
        shift = rng.random((numbers, len(pixels)), dtype=np.float32)
        for k in range(samples):
            random = (shift + sobol[k, :, None].astype(np.float32)) % np.float32(1)
            origins = _camera_origins(pixels, size, random[:2], fur.top)
            radiance[pixels] += _path_radiance(
                fur, origins, random[2:], vertices[k], indirect_weight, float(source_exponent)
            )
            if progress is not None:
                done = first * sum(vertices) + len(pixels) * sum(vertices[: k + 1])
                progress(done / (size * size * sum(vertices)))
    picture = (radiance / np.float32(samples)).reshape(size, size, 3)
    blurred = gaussian_filter(picture, (LENS_BLUR, LENS_BLUR, 0), mode="wrap")
    return Pelt(blurred, depth.reshape(size, size))


class _Fur(NamedTuple):
    """Hairs of one tile with the copies around it that its rays can meet, ready for casting."""

    scene: RaycastingScene
    top: float  # height of the highest hair
    fibres: _Fibres

    @staticmethod
    def of(hairs: Hairs, skin_albedo: tuple[float, float, float]) -> _Fur:
        points = hairs.points.astype(np.float64)
        count = points.shape[1]
        tangents = np.gradient(points, axis=1) if len(points) else points
        tangents /= np.maximum(np.linalg.norm(tangents, axis=-1, keepdims=True), 1e-12)
        rings = _rings(points, hairs.radii, tangents)
        top = float(rings[..., 2].max(initial=0.0))
        # Every ray starts inside the tile, so the copies need to reach as far as a single ray flies
        # through the fur. Margins of 2 and 4 times the height change the mean by 0.02 % (seen).
        hair, copy_shift = _copies_in_reach(points, margin=top)
        template = _prism_triangles(count)
        prisms = np.arange(len(hair))[:, None, None] * (count * SIDES) + template
        skin = 1e3 * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
        vertices = (rings[hair] + copy_shift[:, None, None]).reshape(-1, 3)
        triangles = prisms.reshape(-1, 3)
        scene = build_scene(
            np.concatenate([vertices, skin]),
            np.concatenate([triangles, len(vertices) + np.array([(0, 1, 2), (0, 2, 3)])]),
        )
        segment = template.min(axis=1) // SIDES
        fibres = _Fibres(
            np.ascontiguousarray(hairs.points, np.float32),
            tangents.astype(np.float32),
            np.ascontiguousarray(hairs.radii, np.float32),
            np.concatenate([hairs.albedo, [skin_albedo]]).astype(np.float32),
            hair,
            np.ascontiguousarray(copy_shift, np.float32),
            segment,
            (template // SIDES - segment[:, None]).astype(np.float32),
        )
        return _Fur(scene, top, fibres)


class _Fibres(NamedTuple):
    """What shading needs to know of a triangle: arrays only, for numba.

    Triangle t < C * S belongs to copy t // S and there to row t % S of the prism's S triangles;
    higher numbers are the skin.
    """

    points: FloatArray  # (H, P, 3)
    tangents: FloatArray  # (H, P, 3)
    radii: FloatArray  # (H, P)
    albedo: FloatArray  # (H + 1, 3): hairs, skin
    hair: np.ndarray  # (C,) hair of each copy
    copy_shift: FloatArray  # (C, 3)
    segment: np.ndarray  # (S,) the segment between points i and i + 1
    towards_tip: FloatArray  # (S, 3) 1 for the triangle's corners at point i + 1, else 0


def _rings(points: np.ndarray, radii: np.ndarray, tangents: np.ndarray) -> np.ndarray:
    """Corners of the prisms about hairs: (H, P, SIDES, 3)."""
    side = np.cross(tangents, (0.0, 0.0, 1.0))
    length = np.linalg.norm(side, axis=-1, keepdims=True)
    side = np.where(length > 1e-6, side / np.maximum(length, 1e-6), (1.0, 0.0, 0.0))
    ridge = np.cross(side, tangents)
    angle = math.pi / 2 + 2 * math.pi * np.arange(SIDES)[:, None] / SIDES
    spokes = side[:, :, None] * np.cos(angle) + ridge[:, :, None] * np.sin(angle)
    rings: np.ndarray = points[:, :, None] + radii[:, :, None, None] * spokes
    return rings


def _prism_triangles(points: int) -> np.ndarray:
    """Triangles of one open prism of ``points`` rings: (S, 3)."""
    corner = np.arange(SIDES)
    a = SIDES * np.arange(points - 1)[:, None] + corner
    b = SIDES * np.arange(points - 1)[:, None] + (corner + 1) % SIDES
    faces = np.stack([a, b, a + SIDES, b, b + SIDES, a + SIDES], axis=-1)
    return faces.reshape(-1, 3)


def _copies_in_reach(points: np.ndarray, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Find the periodic copies that come within ``margin`` of the tile: hair (C,), shift (C, 3)."""
    low, high = points[..., :2].min(axis=1), points[..., :2].max(axis=1)
    first = np.floor(-margin - high.max(axis=0, initial=0.0)).astype(int)
    last = np.ceil(1 + margin - low.min(axis=0, initial=0.0)).astype(int)
    hair, shift = [], []
    for i in range(first[0], last[0] + 1):
        for j in range(first[1], last[1] + 1):
            tile = np.array([i, j, 0.0])
            near = (high + tile[:2] >= -margin) & (low + tile[:2] <= 1 + margin)
            found = np.flatnonzero(near.all(axis=1))
            hair.append(found)
            shift.append(np.broadcast_to(tile, (len(found), 3)))
    return np.concatenate(hair), np.concatenate(shift)


def _camera_origins(
    pixels: np.ndarray, size: int, place: np.ndarray | tuple[float, float], top: float
) -> FloatArray:
    """Start rays above the fur, at ``place`` in [0, 1)^2 of each pixel, from its upper left."""
    origins = np.empty((len(pixels), 3), np.float32)
    origins[:, 0] = (pixels % size + place[0]) / size
    origins[:, 1] = 1 - (pixels // size + place[1]) / size
    origins[:, 2] = _camera_height(top)
    return origins


def _camera_height(top: float) -> float:
    return 1.01 * top + 1e-3


def _depth(fur: _Fur, pixels: np.ndarray, size: int) -> np.ndarray:
    origins = _camera_origins(pixels, size, (0.5, 0.5), fur.top)
    distance = first_hits(fur.scene, origins, (0.0, 0.0, -1.0)).distance
    height: np.ndarray = _camera_height(fur.top) - distance.astype(np.float64)
    height[distance >= origins[:, 2]] = 0  # the skin exactly, whatever the rounding
    return (1 - height / max(fur.top, 1e-12)).clip(0, 1)


def _path_radiance(
    fur: _Fur,
    origins: FloatArray,
    random: FloatArray,
    vertices: int,
    indirect_weight: float,
    source_exponent: float,
) -> FloatArray:
    """Estimate what comes up to the camera along paths of ``vertices`` scatterings: (N, 3).

    random: (NUMBERS_PER_VERTEX * vertices or more, N), in [0, 1).
    indirect_weight: of all light after the first scattering.
    """
    count = len(origins)
    directions = np.repeat(np.array([[0, 0, -1]], np.float32), count, axis=0)
    radiance = np.zeros((count, 3), np.float32)
    throughput = np.ones((count, 3), np.float32)
    for vertex in range(vertices):
        hits = first_hits(fur.scene, origins, directions)
        out = _Scattered(*(np.empty((count, 3), np.float32) for _ in _Scattered._fields))
        numbers = random[NUMBERS_PER_VERTEX * vertex :][:NUMBERS_PER_VERTEX]
        _scatter(*hits, origins, directions, numbers, source_exponent, fur.fibres, out)
        lit = ~occluded(fur.scene, out.light_origin, out.light_direction)
        radiance += throughput * out.light_weight * lit[:, None]
        throughput *= out.next_weight
        if vertex == 0:
            throughput *= np.float32(indirect_weight)
        origins, directions = out.next_origin, out.next_direction
    return radiance


# --------------------------------------------------------------------------------------------
# Scattering, one path vertex at a time


class _Scattered(NamedTuple):
    """What N path vertices send on, each (N, 3) float32."""

    light_origin: FloatArray
    light_direction: FloatArray
    light_weight: FloatArray  # times visibility: the radiance towards the previous vertex
    next_origin: FloatArray
    next_direction: FloatArray
    next_weight: FloatArray  # times the radiance from there: likewise


@njit(cache=True, error_model="numpy")
def _source_direction(u: float, v: float, exponent: float) -> tuple[float, float, float]:
    """Draw a direction to the source with density (n + 1) / (2 pi) cos^n."""
    z = u ** (1 / (exponent + 1))
    r = math.sqrt(max(0.0, 1 - z * z))
    return r * math.cos(2 * math.pi * v), r * math.sin(2 * math.pi * v), z


@njit(cache=True, error_model="numpy")
def _along(curves: FloatArray, hair: int, s: int, f: float) -> tuple[float, float, float]:
    """Interpolate (H, P, 3) figures of a hair at the fraction f of its segment s."""
    return (
        (1 - f) * curves[hair, s, 0] + f * curves[hair, s + 1, 0],
        (1 - f) * curves[hair, s, 1] + f * curves[hair, s + 1, 1],
        (1 - f) * curves[hair, s, 2] + f * curves[hair, s + 1, 2],
    )


@njit(cache=True, error_model="numpy")
def _exit_distance(radius: float, sine: float) -> float:
    """How far a ray from a tube's axis has to go to be outside; bounded along the tube."""
    return 1.02 * radius / max(sine, 0.15)


@njit(cache=True, error_model="numpy")
def _scatter(
    distance: FloatArray,
    triangle: NDArray[np.int64],
    barycentric: FloatArray,
    origins: FloatArray,
    directions: FloatArray,
    random: FloatArray,
    exponent: float,
    fibres: _Fibres,
    out: _Scattered,
) -> None:
    """Fill ``out`` for each ray's first hit; random numbers (NUMBERS_PER_VERTEX, N)."""
    faces = len(fibres.segment)
    hair_triangles = faces * len(fibres.hair)
    source_weight = math.pi * (exponent + 2) / (exponent + 1)  # radiance over density
    for i in range(len(triangle)):
        lx, ly, lz = _source_direction(random[0, i], random[1, i], exponent)
        # A point of the unit disc: lifted to the hemisphere it is cosine-distributed; its x alone
        # is the cosine to the fibre of directions with density sin t (the semicircle law), and
        # its y, in units of the chord there, is uniform.
        r = math.sqrt(random[2, i])
        a, b = r * math.cos(2 * math.pi * random[3, i]), r * math.sin(2 * math.pi * random[3, i])
        chord = math.sqrt(max(1e-6, 1 - a * a))
        if triangle[i] < 0:  # the source, whose light has been sampled before: the path ends
            px, py, pz = 0.0, 0.0, 0.0
            nx, ny, nz = 0.0, 0.0, 1.0
            light, goes_on = 0.0, 0.0
            light_start = next_start = 0.0
            row = 0
        elif triangle[i] >= hair_triangles:
            px = origins[i, 0] + distance[i] * directions[i, 0]
            py = origins[i, 1] + distance[i] * directions[i, 1]
            pz = 0.0
            nx, ny, nz = a, b, math.sqrt(max(0.0, 1 - a * a - b * b))
            light, goes_on = source_weight * lz / math.pi, 1.0
            light_start = next_start = 0.0
            row = len(fibres.albedo) - 1
        else:
            copy = triangle[i] // faces
            face = triangle[i] - copy * faces
            hair, s = fibres.hair[copy], fibres.segment[face]
            f = 0.0
            for corner in range(3):
                f += barycentric[i, corner] * fibres.towards_tip[face, corner]
            px, py, pz = _along(fibres.points, hair, s, f)
            px, py = px + fibres.copy_shift[copy, 0], py + fibres.copy_shift[copy, 1]
            tx, ty, tz = _along(fibres.tangents, hair, s, f)
            scale = 1 / math.sqrt(tx * tx + ty * ty + tz * tz)
            tx, ty, tz = scale * tx, scale * ty, scale * tz
            radius = (1 - f) * fibres.radii[hair, s] + f * fibres.radii[hair, s + 1]
            row = hair
            # Across the fibre: u towards the viewer, v = t x u.
            vx, vy, vz = -directions[i, 0], -directions[i, 1], -directions[i, 2]
            cosine = tx * vx + ty * vy + tz * vz
            ux, uy, uz = vx - cosine * tx, vy - cosine * ty, vz - cosine * tz
            scale = 1 / math.sqrt(max(1e-12, ux * ux + uy * uy + uz * uz))
            ux, uy, uz = scale * ux, scale * uy, scale * uz
            vx, vy, vz = ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux
            # Light from the source: the cosine of its azimuth p is (u . l) / sin t.
            cosine = tx * lx + ty * ly + tz * lz
            sine = math.sqrt(max(1e-6, 1 - cosine * cosine))
            lobe = sine + BACKSCATTER * (ux * lx + uy * ly + uz * lz)
            light, goes_on = source_weight * lobe / math.pi**2, 1.0
            light_start = _exit_distance(radius, sine)
            # Light from other hairs: p is uniform so far. Turning cos p round with probability
            # (1 - BACKSCATTER cos p) / 2 leaves the density 1 + BACKSCATTER cos p, and weight 1.
            azimuth = math.pi * b / chord
            cu, cv = chord * math.cos(azimuth), chord * math.sin(azimuth)
            if 2 * random[4, i] > 1 + BACKSCATTER * math.cos(azimuth):
                cu = -cu
            nx = a * tx + cu * ux + cv * vx
            ny = a * ty + cu * uy + cv * vy
            nz = a * tz + cu * uz + cv * vz
            next_start = _exit_distance(radius, chord)
        # Both go on from inside the tile, around which there are copies on all sides.
        x, y = px + light_start * lx, py + light_start * ly
        out.light_origin[i, 0] = x - math.floor(x)
        out.light_origin[i, 1] = y - math.floor(y)
        out.light_origin[i, 2] = max(pz + light_start * lz, SKIN_CLEARANCE)
        out.light_direction[i, 0] = lx
        out.light_direction[i, 1] = ly
        out.light_direction[i, 2] = lz
        x, y = px + next_start * nx, py + next_start * ny
        out.next_origin[i, 0] = x - math.floor(x)
        out.next_origin[i, 1] = y - math.floor(y)
        out.next_origin[i, 2] = max(pz + next_start * nz, SKIN_CLEARANCE)
        out.next_direction[i, 0] = nx
        out.next_direction[i, 1] = ny
        out.next_direction[i, 2] = nz
        for channel in range(3):
            out.light_weight[i, channel] = light * fibres.albedo[row, channel]
            out.next_weight[i, channel] = goes_on * fibres.albedo[row, channel]
