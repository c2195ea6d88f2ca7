"""Daylight in the room: what reaches each piece by any number of bounces, and the map it makes.

Light of one bounce and more is kept as one irradiance a piece, gathered along the same rays again
and again until nothing changes; pictures gather it once more at each pixel. Windows, sun and lamps
are sampled by themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from docs.room.building import FloatArray, Surfaces
from docs.room.furnishing import Window
from docs.room.patterns import fill_albedo
from pipelines.geometry.rays import build_scene, first_hits, occluded
from pipelines.light.environment_maps import texel_directions

_OFFSET = 1e-4
_BOUNCES = 8
_SUN_AZIMUTH, _SUN_ELEVATION = 203.0, 31.0
_SUN_SPREAD = 0.009
"""Radians of its radius: twice the real one, for haze."""
_SUN = np.array([46.0, 39.5, 31.0])
"""Irradiance where it falls straight."""
_ZENITH, _HORIZON = np.array([1.4, 2.3, 4.2]), np.array([4.0, 4.3, 4.6])
_TREES, _LAWN = np.array([0.24, 0.34, 0.13]), np.array([0.68, 0.86, 0.36])


class _Lamps(NamedTuple):
    """Triangles that shine: corners (K, 3, 3), their share of the area, its sum, radiance."""

    corners: FloatArray
    share: FloatArray
    area: float
    radiance: FloatArray


class LitRoom:
    """Surfaces in daylight, which is ``gathered`` by so many rays from each piece."""

    def __init__(self, surfaces: Surfaces, windows: Sequence[Window], gathered: int) -> None:
        self._surfaces, self._windows = surfaces, windows
        count = len(surfaces.corners)
        self._scene = build_scene(
            surfaces.corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)
        )
        self._lamps = _lamps(surfaces)
        self._sun = _sun_direction()
        self._radiosity = self._solve(gathered)

    # ---- the bounces ----

    def _solve(self, gathered: int) -> FloatArray:
        """Radiance (T, 3) that leaves each piece over its albedo, lamps apart."""
        surfaces, random = self._surfaces, np.random.default_rng(1)
        count = len(surfaces.corners)
        normal = surfaces.normals.mean(axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        albedo = self._albedo(np.arange(count), np.full((count, 3), 1 / 3))
        direct = np.zeros((count, 3))
        met = np.empty((gathered, count), np.int64)
        for number in range(gathered):
            u = random.random((count, 10))
            side = np.where(surfaces.thin & (u[:, 9] < 0.5), -1.0, 1.0)[:, None] * normal
            weight = random.dirichlet((1.0, 1.0, 1.0), count)
            start = np.einsum("ij,ijk->ik", weight, surfaces.corners) + _OFFSET * side
            direct += self._direct(start, side, u[:, :8])
            met[number] = first_hits(
                self._scene, start, _by_cosine(side, u[:, 8], u[:, 9])
            ).triangle
        direct /= gathered * np.pi
        total = direct
        for _ in range(_BOUNCES):
            leaving = np.concatenate([albedo * total, np.zeros((1, 3))])  # row -1: out of a window
            total = direct + leaving[met].mean(axis=0)
        return total

    def _direct(self, start: FloatArray, normal: FloatArray, u: FloatArray) -> FloatArray:
        """Irradiance (N, 3) from one point of each window, one of the sun and one of the lamps."""
        found = np.zeros((len(start), 3))
        for number, window in enumerate(self._windows):
            u1, u2 = (u[:, 0] + 0.37 * number) % 1.0, (u[:, 1] + 0.61 * number) % 1.0
            to = window.corner + u1[:, None] * window.one + u2[:, None] * window.other - start
            far2 = np.einsum("ij,ij->i", to, to)
            way = to / np.sqrt(far2)[:, None]
            outward = np.cross(window.one, window.other)
            area = np.linalg.norm(outward)
            geometry = np.einsum("ij,ij->i", way, normal) * np.abs(way @ (outward / area)) / far2
            seen = geometry > 1e-7
            seen[seen] = ~occluded(self._scene, start[seen], to[seen], farthest=1.0)
            found[seen] += outside(way[seen]) * (geometry[seen] * area)[:, None]
        spread = _SUN_SPREAD * np.sqrt(u[:, 2, None])
        turn = 2 * np.pi * u[:, 3, None]
        across = np.cross(self._sun, [0.0, 0.0, 1.0])
        across /= np.linalg.norm(across)
        other = np.cross(self._sun, across)
        way = self._sun + spread * (np.cos(turn) * across + np.sin(turn) * other)
        cosine = np.einsum("ij,ij->i", way, normal)
        seen = cosine > 0
        seen[seen] = ~occluded(self._scene, start[seen], way[seen])
        found[seen] += cosine[seen, None] * _SUN
        return found + self._from_lamps(start, normal, u[:, 4:7])

    def _from_lamps(self, start: FloatArray, normal: FloatArray, u: FloatArray) -> FloatArray:
        lamps = self._lamps
        chosen = np.searchsorted(np.cumsum(lamps.share)[:-1], u[:, 0])
        root = np.sqrt(u[:, 1])
        weight = np.stack([1 - root, root * (1 - u[:, 2]), root * u[:, 2]], axis=-1)
        corners = lamps.corners[chosen]
        to = np.einsum("ij,ijk->ik", weight, corners) - start
        far2 = np.maximum(np.einsum("ij,ij->i", to, to), 1e-3)
        way = to / np.sqrt(far2)[:, None]
        facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing /= np.linalg.norm(facing, axis=1, keepdims=True)
        slant = np.abs(np.einsum("ij,ij->i", way, facing))
        geometry = np.einsum("ij,ij->i", way, normal) * slant / far2
        seen = geometry > 1e-7
        seen[seen] = ~occluded(self._scene, start[seen], to[seen], farthest=0.995)
        return np.where(seen, geometry * lamps.area, 0.0)[:, None] * lamps.radiance[chosen]

    def _albedo(self, triangle: NDArray[np.int64], weight: FloatArray) -> FloatArray:
        surfaces = self._surfaces
        uv = np.einsum("ij,ijk->ik", weight, surfaces.uv[triangle])
        found = np.empty((len(triangle), 3))
        fill_albedo(
            surfaces.colour[triangle],
            surfaces.pattern[triangle],
            surfaces.seed[triangle],
            uv,
            found,
        )
        return found

    # ---- the map ----

    def picture(
        self, eye: FloatArray, way: FloatArray, u: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Radiance, albedo and normals (N, 3) that one ray each finds; ``u`` (N, 12)."""
        hits = first_hits(self._scene, eye, way)
        radiance = outside(way)
        albedo = radiance / (1.0 + radiance)
        normals = np.zeros_like(radiance)
        rows = np.flatnonzero(hits.triangle >= 0)
        triangle, weight = hits.triangle[rows], hits.barycentric[rows].astype(np.float64)
        came = way[rows]
        point = eye + hits.distance[rows, None] * came
        surfaces = self._surfaces
        normal = np.einsum("ij,ijk->ik", weight, surfaces.normals[triangle])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        normal *= np.where(np.einsum("ij,ij->i", normal, came) > 0, -1.0, 1.0)[:, None]
        shown = self._albedo(triangle, weight)
        through = surfaces.thin[triangle] & (u[rows, 9] < 0.5)
        side = np.where(through[:, None], -normal, normal)
        start = point + _OFFSET * side
        light = self._direct(start, side, u[rows, :8]) / np.pi
        light += self._onward(start, _by_cosine(side, u[rows, 10], u[rows, 11]))
        radiance[rows] = shown * light + surfaces.emission[triangle]
        self._add_gloss(radiance, rows, triangle, point + _OFFSET * normal, normal, came)
        albedo[rows], normals[rows] = shown, normal
        return radiance, albedo, normals

    def _onward(self, start: FloatArray, way: FloatArray, lit: bool = False) -> FloatArray:
        """Radiance (N, 3) along rays, from surfaces; ``lit``: from lamps and outside, too."""
        hits = first_hits(self._scene, start, way)
        hit = hits.triangle >= 0
        found = outside(way) if lit else np.zeros((len(start), 3))
        triangle = hits.triangle[hit]
        found[hit] = self._radiosity[triangle] * self._albedo(
            triangle, hits.barycentric[hit].astype(np.float64)
        )
        if lit:
            found[hit] += self._surfaces.emission[triangle]
        return found

    def _add_gloss(
        self,
        radiance: FloatArray,
        rows: NDArray[np.int64],
        triangle: NDArray[np.int64],
        start: FloatArray,
        normal: FloatArray,
        came: FloatArray,
    ) -> None:
        """What polished surfaces mirror, by Schlick's factor, a little blurred."""
        gloss = self._surfaces.gloss[triangle]
        shiny = gloss > 0
        cosine = -np.einsum("ij,ij->i", normal, came)[shiny, None]
        factor = gloss[shiny, None] + (1 - gloss[shiny, None]) * (1 - np.clip(cosine, 0, 1)) ** 5
        rough = np.random.default_rng(len(rows)).normal(size=(int(shiny.sum()), 3)) * 0.05
        mirrored = came[shiny] + 2 * cosine * normal[shiny] + rough
        mirrored /= np.linalg.norm(mirrored, axis=1, keepdims=True)
        seen = np.minimum(self._onward(start[shiny], mirrored, lit=True), 8.0)
        at = rows[shiny]
        radiance[at] = (1 - factor) * radiance[at] + 0.8 * factor * seen


def draw_map(
    room: LitRoom,
    eye: Sequence[float],
    height: int,
    samples: int,
    progress: Callable[[float], None] = lambda fraction: None,
) -> NDArray[np.float32]:
    """The room from a point as an equirectangular map (H, 2 H, 3), denoised."""
    import pyoidn

    ways = texel_directions(height).reshape(-1, 3)
    sums: list[FloatArray] = []
    block = 1 << 16
    for first in range(0, len(ways), block):
        progress(first / len(ways))
        texels = np.arange(first, min(first + block, len(ways)))
        parts: Any = [0.0, 0.0, 0.0]
        offsets = np.random.default_rng(first).random((len(texels), 14))
        for sample in range(samples):
            u = (offsets + (sample + 1) * _STEPS) % 1.0
            found = room.picture(
                np.array(eye, np.float64), _jittered(texels, height, u[:, 12:]), u[:, :12]
            )
            parts = [part + one for part, one in zip(parts, found, strict=True)]
        sums.append(np.concatenate(parts, axis=1) / samples)
    shape = (height, 2 * height, 3)
    radiance, albedo, normals = (
        np.ascontiguousarray(np.concatenate(sums)[:, 3 * n : 3 * n + 3].reshape(shape), np.float32)
        for n in range(3)
    )
    # Wrapped, so that the first and the last columns fit each other.
    edge = ((0, 0), (height // 8, height // 8), (0, 0))
    wrapped = [np.pad(part, edge, mode="wrap") for part in (radiance, albedo, normals)]
    clean = pyoidn.denoise(*wrapped, hdr=True)
    return np.ascontiguousarray(clean[:, height // 8 : -(height // 8)])


def outside(way: FloatArray) -> FloatArray:
    """Radiance (N, 3) from outside: a bright sky over trees and a lawn."""
    up, azimuth = way[:, 2], np.arctan2(way[:, 1], way[:, 0])
    high = np.clip(up, 0.0, 1.0)[:, None] ** 0.6
    sky = (1 - high) * _HORIZON + high * _ZENITH
    ridge = 0.10 + 0.05 * np.sin(5 * azimuth + 1) + 0.03 * np.sin(17 * azimuth)
    ridge = ridge + 0.012 * np.sin(61 * azimuth) + 0.008 * np.sin(143 * azimuth + 2)
    leaves = 0.75 + 0.25 * np.sin(90 * azimuth + 40 * up) * np.sin(120 * up + 7 * azimuth)
    trees = _TREES * leaves[:, None] * (1.0 + 2.5 * np.clip(up / ridge, 0, 1)[:, None])
    part = np.clip((ridge - up) / 0.012, 0.0, 1.0)[:, None]
    below = np.clip(-up / 0.02, 0.0, 1.0)[:, None]
    return (1 - below) * ((1 - part) * sky + part * trees) + below * _LAWN


def _sun_direction() -> FloatArray:
    around, above = np.radians(_SUN_AZIMUTH), np.radians(_SUN_ELEVATION)
    return np.array([np.cos(above) * np.cos(around), np.cos(above) * np.sin(around), np.sin(above)])


def _lamps(surfaces: Surfaces) -> _Lamps:
    shining = surfaces.emission.any(axis=1)
    corners = surfaces.corners[shining]
    areas = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return _Lamps(corners, areas / areas.sum(), float(areas.sum()), surfaces.emission[shining])


def _by_cosine(normal: FloatArray, u1: FloatArray, u2: FloatArray) -> FloatArray:
    """Directions (N, 3) over surfaces by the cosine: the normal with a point of the unit sphere."""
    z, turn = (1 - 2 * u1)[:, None], (2 * np.pi * u2)[:, None]
    radius = np.sqrt(np.maximum(1 - z * z, 0.0))
    way = (
        0.9999 * np.concatenate([radius * np.cos(turn), radius * np.sin(turn), z], axis=1) + normal
    )
    return np.asarray(way / np.linalg.norm(way, axis=1, keepdims=True))


def _jittered(texels: NDArray[np.int64], height: int, u: FloatArray) -> FloatArray:
    theta = (texels // (2 * height) + u[:, 0]) * np.pi / height
    azimuth = np.pi - (texels % (2 * height) + u[:, 1]) * np.pi / height
    flat = np.sin(theta)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.cos(theta)], axis=-1)


def _steps(count: int) -> FloatArray:
    """Those of the R sequence in ``count`` dimensions (Roberts 2018)."""
    root = 2.0
    for _ in range(64):
        root = (1 + root) ** (1 / (count + 1))
    return np.asarray((1 / root) ** np.arange(1, count + 1) % 1.0)


_STEPS = _steps(14)
