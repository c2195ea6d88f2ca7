"""The virtual gonioreflectometer: photographs of a cloth under every light from every view.

What a value is
    The value of texel p for the light (theta_i, phi_i) and the view (theta_o, phi_o) is the mean
    radiance that leaves towards the view through the texel's square in the reference plane, when
    a directional light gives the irradiance pi on a surface square to it: a flat white Lambertian
    sample reads cos theta_i. Light and view are taken at infinity.

Place
    The cloth is one tile [0, 1] x [0, 1], continued without end in x and y. Photographs are
    rectified to the reference plane: z = the mean height that is seen from straight above, as a
    camera calibrated on the sample's surface would have it. What stands above or below moves
    with the view (parallax), hides (masking), and shades. Row 0 of a photograph is at y = 1,
    column 0 at x = 0.

Light
    Rays through jittered points of each texel meet the cloth first; a second ray to each light
    looks for shadow; the fibre BRDF (``fibre_brdf.py``) answers. Interreflection is diffuse: each
    vertex of the mesh gathers over GATHER_RAYS directions what its surroundings reflect of each
    light, once for all views; it is interpolated in between. Where a ray meets nothing it is dark.

Jitter is drawn once, from the seed, and is the same for all views and lights: a photograph
depends on nothing that was asked before. Equal arguments give equal bits on one machine.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.geometry.rays import build_scene, first_hits, occluded
from pipelines.light.directions import unit_vectors
from pipelines.virtual.cloth.interreflection import gather_interreflection, vertex_irradiance
from pipelines.virtual.cloth.mesh import Cloth
from pipelines.virtual.cloth.shading import (
    LIFT,
    FloatArray,
    ShadingPoints,
    count_lights_above,
    find_shading_points,
    list_shadow_rays,
    shade,
)

MAX_THETA = math.radians(80.0)
GATHER_RAYS = 24
PAIRS_PER_BLOCK = 1 << 20  # places times lights at once: 24 MB of rays
_HEIGHT_PROBES = 64  # rays a side that find the reference plane
_PLASTIC = 1.32471795724474602596  # the root of x^3 = x + 1, of Roberts' R2 sequence


class Gonioreflectometer:
    """Photographs one cloth under a fixed set of lights.

    cloth: one tile. lights: (L, 2) theta, phi in radians, theta at most 80 degrees.
    size: (rows, columns) of a photograph. samples: rays a texel. bounces: how often light goes on
        from yarn to yarn, 0 for direct light alone. seed: of the jitter.

    Builds the scene and gathers the interreflections at once: seconds, and 12 * V * L bytes.
    rays: rays traced so far. reference: height of the reference plane.
    Raises ValueError for arguments out of range.
    """

    def __init__(
        self,
        cloth: Cloth,
        lights: ArrayLike,
        size: tuple[int, int],
        samples: int = 4,
        seed: int = 0,
        *,
        bounces: int = 1,
    ) -> None:
        for name, value, least in (
            ("size", min(size), 1),
            ("samples", samples, 1),
            ("bounces", bounces, 0),
        ):
            if value < least:
                raise ValueError(f"{name}: expected at least {least}, found {value}")
        self.size = (int(size[0]), int(size[1]))
        self.samples = samples
        self.rays = 0
        rng = np.random.default_rng(seed)
        self._lights = np.ascontiguousarray(_vectors(lights, "lights"), np.float32)
        self._surface = _checked(cloth)
        self._low, self._high = (float(f(cloth.vertices[:, 2])) for f in (np.min, np.max))
        triangles, shifts = _copies_in_reach(cloth, (self._high - self._low) * math.tan(MAX_THETA))
        self._source = triangles
        corners = cloth.vertices[cloth.triangles[triangles]] + shifts[:, None]
        self._scene = build_scene(
            corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)
        )
        self.reference = self._mean_height()
        self._places = _jittered(self.size, samples, rng)
        self._reflected = self._interreflection(bounces, rng)

    def photographs(self, view: ArrayLike) -> NDArray[np.float32]:
        """Photograph the cloth from one view under all lights: (L, rows, columns, 3), linear RGB.

        view: (2,) theta, phi in radians. Raises ValueError for theta beyond 80 degrees.
        """
        towards = _vectors(np.asarray(view, np.float64).reshape(1, 2), "view")[0]
        points = self._seen(self._places, towards)
        texels = self.size[0] * self.size[1]
        lights = len(self._lights)
        out = np.empty((lights, texels, 3), np.float32)
        block = max(1, PAIRS_PER_BLOCK // (self.samples * lights))
        for begin in range(0, texels, block):
            end = min(begin + block, texels)
            part = slice(begin * self.samples, end * self.samples)
            first, blocked = self._shadows(
                points.position[part], points.facing[part], points.frame[part, 2]
            )
            shade(
                points, part.start, self.samples, self._lights, first, blocked, self._reflected,
                out[:, begin:end],
            )  # fmt: skip
        return out.reshape(lights, *self.size, 3)

    def _seen(self, places: NDArray[np.float64], towards: NDArray[np.float64]) -> ShadingPoints:
        """What is met along ``towards`` behind places (N, 2) of the reference plane."""
        above = self._high + 1e-3
        start = places + towards[:2] * ((above - self.reference) / towards[2])
        origins = np.empty((len(places), 3), np.float32)
        origins[:, :2] = start - np.floor(start)
        origins[:, 2] = above
        direction = (-towards).astype(np.float32)
        hits = first_hits(self._scene, origins, direction)
        self.rays += len(origins)
        source = np.where(hits.triangle >= 0, self._source[hits.triangle], -1)
        points = ShadingPoints.empty(len(origins))
        find_shading_points(
            origins, direction, hits.distance, source, hits.barycentric, self._surface, points
        )
        return points

    def _mean_height(self) -> float:
        axis = (np.arange(_HEIGHT_PROBES) + 0.5) / _HEIGHT_PROBES
        x, y = np.meshgrid(axis, axis)
        above = np.full(x.size, self._high + 1.0)
        origins = np.stack([x.ravel(), y.ravel(), above], axis=-1)
        distance = first_hits(self._scene, origins, (0.0, 0.0, -1.0)).distance
        met = distance[np.isfinite(distance)].astype(np.float64)
        return self._high + 1.0 - float(met.mean()) if len(met) else 0.0

    def _shadows(
        self, position: FloatArray, facing: FloatArray, normal: FloatArray
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Rays to the lights above each place: each place's first row, and whether blocked."""
        count = np.empty(len(position), np.int64)
        count_lights_above(facing, normal, self._lights, count)
        ends = np.cumsum(count)
        origins = np.empty((int(ends[-1]), 3), np.float32)
        directions = np.empty_like(origins)
        first = ends - count
        list_shadow_rays(position, facing, normal, self._lights, first, origins, directions)
        self.rays += len(origins)
        return first, occluded(self._scene, origins, directions)

    # ----------------------------------------------------------------------------------------
    # Interreflection, once for all views

    def _interreflection(self, bounces: int, rng: np.random.Generator) -> FloatArray:
        """Diffuse irradiance / pi of each vertex from other surfaces: (V, L, 3), or (0, L, 3)."""
        none = np.empty((0, len(self._lights), 3), np.float32)
        if not bounces:
            return none
        surface = self._surface
        count = len(surface.vertices)
        position = (surface.vertices + LIFT * surface.normals).astype(np.float32)
        position[:, :2] -= np.floor(position[:, :2])
        direct = np.empty((count, len(self._lights)), np.float32)
        block = max(1, PAIRS_PER_BLOCK // len(self._lights))
        for begin in range(0, count, block):
            rows = slice(begin, begin + block)
            normals = surface.normals[rows]
            first, blocked = self._shadows(position[rows], normals, normals)
            vertex_irradiance(
                normals, surface.specular[rows], self._lights, first, blocked, direct[rows]
            )
        triangle = np.empty((count, GATHER_RAYS), np.int32)
        barycentric = np.empty((count, GATHER_RAYS, 2), np.float32)
        pattern = _r2(GATHER_RAYS)
        block = PAIRS_PER_BLOCK // GATHER_RAYS
        for begin in range(0, count, block):
            rows = slice(begin, begin + block)
            normals = surface.normals[rows]
            shift = rng.random((len(normals), 1, 2))
            ways = _cosine_directions(normals, (pattern + shift) % 1.0)
            origins = np.repeat(position[rows], GATHER_RAYS, axis=0)
            hits = first_hits(self._scene, origins, ways.reshape(-1, 3))
            self.rays += len(origins)
            source = np.where(hits.triangle >= 0, self._source[hits.triangle], -1)
            triangle[rows] = source.reshape(-1, GATHER_RAYS)
            barycentric[rows] = hits.barycentric[:, 1:].reshape(-1, GATHER_RAYS, 2)
        reflected = none
        for _ in range(bounces):
            new = np.empty((count, len(self._lights), 3), np.float32)
            gather_interreflection(
                triangle, barycentric, surface.triangles, surface.albedo, direct, reflected, new
            )
            reflected = new
        return reflected


def _checked(cloth: Cloth) -> Cloth:
    """Bring a cloth into the form that the compiled loops read without looking."""
    vertices, triangles = len(cloth.vertices), np.asarray(cloth.triangles)
    if triangles.size == 0 or triangles.min() < 0 or triangles.max() >= vertices:
        raise ValueError(f"cloth: expected triangles of {vertices} vertices, found others or none")
    fields = []
    for name, values in cloth._asdict().items():
        if name != "triangles" and len(values) != vertices:
            raise ValueError(f"cloth: {name}: expected {vertices} rows, found {len(values)}")
        kind = np.int32 if name == "triangles" else np.float32
        fields.append(np.ascontiguousarray(values, kind))
    return Cloth._make(fields)


def _vectors(directions: ArrayLike, name: str) -> NDArray[np.float64]:
    angles = np.asarray(directions, np.float64)
    if angles.ndim != 2 or angles.shape[1] != 2:
        raise ValueError(f"{name}: expected theta and phi, shape (…, 2), found {angles.shape}")
    if angles.size and not (abs(angles[:, 0]) <= MAX_THETA + 1e-9).all():
        raise ValueError(
            f"{name}: expected theta up to {math.degrees(MAX_THETA):.0f} degrees, found "
            f"{math.degrees(abs(angles[:, 0]).max()):.1f}"
        )
    return unit_vectors(angles)


def _copies_in_reach(cloth: Cloth, margin: float) -> tuple[NDArray[np.int64], FloatArray]:
    """Find the periodic copies of triangles within ``margin`` of the tile.

    Rays start in the tile and cross the cloth's height, so that they go no farther than that.
    Returns the triangles (C,) and their shifts (C, 3).
    """
    corners = cloth.vertices[cloth.triangles][..., :2]
    low, high = corners.min(axis=1), corners.max(axis=1)
    first = np.floor(-margin - high.max(axis=0)).astype(int)
    last = np.ceil(1 + margin - low.min(axis=0)).astype(int)
    triangles, shifts = [], []
    for i in range(first[0], last[0] + 1):
        for j in range(first[1], last[1] + 1):
            tile = np.array([i, j, 0], np.float32)
            near = (high + tile[:2] >= -margin) & (low + tile[:2] <= 1 + margin)
            found = np.flatnonzero(near.all(axis=1))
            triangles.append(found)
            shifts.append(np.broadcast_to(tile, (len(found), 3)))
    return np.concatenate(triangles), np.concatenate(shifts)


def _r2(count: int) -> NDArray[np.float64]:
    """Spread points (count, 2) evenly in the unit square (M. Roberts' R2 sequence)."""
    steps = np.array([1 / _PLASTIC, 1 / _PLASTIC**2])
    return np.mod(0.5 + steps * np.arange(count)[:, None], 1.0)


def _jittered(size: tuple[int, int], samples: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Places (rows * columns * samples, 2) in the tile, texel by texel, from the top row down."""
    rows, columns = size
    inside: NDArray[np.float64] = (_r2(samples) + rng.random((rows, columns, 1, 2))) % 1.0
    x = (np.arange(columns)[None, :, None] + inside[..., 0]) / columns
    y = 1 - (np.arange(rows)[:, None, None] + inside[..., 1]) / rows
    return np.stack([x, y], axis=-1).reshape(-1, 2)


def _cosine_directions(normals: FloatArray, square: NDArray[np.float64]) -> FloatArray:
    """Map points (N, K, 2) of the square to directions (N, K, 3), dense as the cosine."""
    radius, angle = np.sqrt(square[..., 0]), 2 * np.pi * square[..., 1]
    upright = normals.astype(np.float64)
    helper = np.where(np.abs(upright[:, :1]) > 0.6, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
    side = np.cross(helper, upright)
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    other = np.cross(upright, side)
    ways = (
        (radius * np.cos(angle))[..., None] * side[:, None]
        + (radius * np.sin(angle))[..., None] * other[:, None]
        + np.sqrt(1 - radius**2)[..., None] * upright[:, None]
    )
    return ways.astype(np.float32)
