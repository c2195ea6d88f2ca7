"""Ground truth of the shading: the same materials, visibility by rays, the probe itself for light.

Direct light only. Directions are drawn from the light, from the cosine and
from Beckmann's half vectors at once, and weighted by the sum of these densities (Veach's balance
heuristic, one sample at a time): no sample is much brighter than the pixel.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera
from pipelines.geometry.rays import build_scene, first_hits, occluded
from pipelines.ssdf_lighting.drawing.camera_rays import camera_rays, pixel_centres
from pipelines.ssdf_lighting.drawing.hit_looks import HitLooks
from pipelines.ssdf_lighting.drawing.light_sources import LightSource, about
from pipelines.ssdf_lighting.light.microfacets import beckmann, check_materials, gloss
from pipelines.ssdf_lighting.scene import LitMesh
from pipelines.ssdf_lighting.surface_textures import Looks

if TYPE_CHECKING:
    from open3d.t.geometry import RaycastingScene

FloatArray = NDArray[np.float64]

_OFF_SURFACE = 1e-4  # of the triangle's size
_LIGHTS_PART = 0.5  # of the samples
_AT_ONCE = 1 << 17  # samples in memory together


class Traced(NamedTuple):
    """radiance: (H, W, 4) float64, linear, and coverage; standard_error: (H, W, 3) of radiance, as
    if samples were independent; they are spread evenly, and it is less."""

    radiance: FloatArray
    standard_error: FloatArray


class _Surface(NamedTuple):
    mesh: LitMesh
    looks: HitLooks
    facing: FloatArray
    """(F, 3) geometric unit normals, on the side of the shading normals."""
    off: FloatArray
    """(F,) how far rays start above the triangle."""


class _Spots(NamedTuple):
    """Where S samples hit the surface. ``facing`` is the geometric normal; all (S, 3) but the
    looks, which have a row each."""

    at: FloatArray
    normal: FloatArray
    facing: FloatArray
    view: FloatArray
    looks: Looks


def ray_traced(
    mesh: LitMesh,
    source: LightSource,
    camera: Camera,
    size: tuple[int, int],
    samples: int,
    *,
    seed: int = 0,
    progress: Callable[[float], None] = lambda fraction: None,
    jittered: bool = True,
) -> Traced:
    """Trace a picture of ``size`` = (width, height) with ``samples`` >= 2 a pixel.

    progress: is told the share of the work that is done.
    jittered: samples are spread evenly over the pixel; else all go through its middle, as the
        stage's do; textures are averaged over the pixel, as there.

    Light from below the triangle or its shading normal does not arrive. Raises ValueError as
    ``build_scene`` and for materials that are none.
    """
    check_materials(mesh.materials)
    scene = build_scene(mesh.vertices, mesh.triangles)
    surface = _surface(mesh, HitLooks(mesh, camera, size, 1 / math.sqrt(samples)))
    middles = pixel_centres(size)
    picture, error = np.zeros((len(middles), 4)), np.zeros((len(middles), 3))
    rows = max(1, _AT_ONCE // samples)
    for first in range(0, len(middles), rows):
        progress(first / len(middles))
        block = slice(first, first + rows)
        places = np.repeat(middles[block], samples, axis=0)
        # Each block has numbers of its own: the picture does not depend on the blocks' order.
        rng = np.random.default_rng([seed, first])
        u = _spread(len(middles[block]), samples, rng)
        spread = places + u[:, 4:] - 0.5
        rays = camera_rays(camera, size, spread if jittered else places)
        light, hit = _sampled(scene, surface, source, rays, spread, u[:, :4])
        light = light.reshape(-1, samples, 3)
        picture[block, :3] = light.mean(axis=1)
        picture[block, 3] = hit.reshape(-1, samples).mean(axis=1)
        error[block] = light.std(axis=1, ddof=1) / math.sqrt(samples)
    width, height = size
    return Traced(picture.reshape(height, width, 4), error.reshape(height, width, 3))


def _spread(pixels: int, samples: int, rng: np.random.Generator) -> FloatArray:
    """Numbers (pixels * samples, 6) in [0, 1): in each pixel Sobol's points, moved around."""
    from scipy.stats import qmc

    points = qmc.Sobol(6, scramble=True, rng=rng).random(1 << (samples - 1).bit_length())[:samples]
    return ((points + rng.random((pixels, 1, 6))) % 1.0).reshape(-1, 6)


def _surface(mesh: LitMesh, looks: HitLooks) -> _Surface:
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    facing = np.cross(b - a, c - a)
    doubled = np.linalg.norm(facing, axis=1, keepdims=True)
    facing = facing / np.maximum(doubled, 1e-300)
    outer = mesh.normals[mesh.triangles].sum(axis=1)
    facing = np.where(np.sum(facing * outer, axis=1, keepdims=True) < 0, -facing, facing)
    return _Surface(mesh, looks, facing, _OFF_SURFACE * np.sqrt(doubled[:, 0]))


def _sampled(
    scene: RaycastingScene,
    surface: _Surface,
    source: LightSource,
    rays: tuple[FloatArray, FloatArray],
    places: FloatArray,
    u: FloatArray,
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """One sample's light (S, 3) for each ray, origins and ways (S, 3), and whether it hit; textures
    are looked up at places (S, 2) of the picture; ``u`` (S, 4) are its numbers in [0, 1)."""
    origins, ways = rays
    hits = first_hits(scene, origins, ways)
    hit = hits.triangle >= 0
    light = np.zeros((len(places), 3))
    if not hit.any():
        return light, hit
    triangle, weight = hits.triangle[hit], hits.barycentric[hit].astype(np.float64)
    mesh = surface.mesh
    corner = mesh.triangles[triangle]
    facing = surface.facing[triangle]
    at = np.einsum("sk,skc->sc", weight, mesh.vertices[corner])
    normals, looks = surface.looks.at(triangle, weight, places[hit])
    spots = _Spots(
        at + facing * surface.off[triangle][:, None],
        normals,
        facing,
        -ways[hit],
        looks,
    )
    way, density, glow = _drawn(spots, source, u[hit])
    reflected = _reflected(spots, way)
    above = (np.sum(way * spots.facing, axis=1) > 0) & (reflected > 0).any(axis=1)
    above[above] = ~occluded(scene, spots.at[above], way[above])
    light[hit] = np.where(above[:, None], glow * reflected / density[:, None], 0.0)
    return light, hit


def _drawn(
    spots: _Spots, source: LightSource, u: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Directions (S, 3), their density (S,) per steradian, and the radiance (S, 3) from there."""
    roughness = spots.looks.roughness
    gloss_part = np.where(spots.looks.specular > 0, (1 - _LIGHTS_PART) / 2, 0.0)
    matt_part = 1 - _LIGHTS_PART - gloss_part
    by_light = u[:, 2] < _LIGHTS_PART
    by_gloss = u[:, 2] >= 1 - gloss_part
    slope = roughness * np.sqrt(-np.log1p(-u[:, 0]))
    cosine = np.where(by_gloss, 1 / np.hypot(1, slope), np.sqrt(u[:, 0]))
    way = about(spots.normal, cosine, 2 * math.pi * u[:, 1])
    o_h = np.sum(way * spots.view, axis=1, keepdims=True)
    way = np.where(by_gloss[:, None], 2 * o_h * way - spots.view, way)
    way[by_light] = source.drawn(spots.normal[by_light], u[by_light][:, [0, 1, 3]])

    half = _unit(way + spots.view)
    n_h, o_h = (np.sum(half * other, axis=1) for other in (spots.normal, spots.view))
    n_i = np.sum(way * spots.normal, axis=1)
    mirrored = np.where(n_h > 0, beckmann(n_h, roughness) * n_h / (4 * np.maximum(o_h, 1e-6)), 0.0)
    density = (
        _LIGHTS_PART * source.density(spots.normal, way)
        + matt_part * np.maximum(n_i, 0) / math.pi
        + gloss_part * mirrored
    )
    return way, density, source.radiance(way)


def _reflected(spots: _Spots, way: FloatArray) -> FloatArray:
    """BRDF times cosine (S, 3)."""
    half = _unit(way + spots.view)
    n_i = np.sum(way * spots.normal, axis=1)
    shine = gloss(
        n_i,
        np.sum(spots.view * spots.normal, axis=1),
        np.sum(half * spots.normal, axis=1),
        np.sum(half * spots.view, axis=1),
        spots.looks.specular,
        spots.looks.roughness,
    )
    matt = spots.looks.albedo / math.pi * np.maximum(n_i, 0.0)[:, None]
    return matt + shine[:, None] * spots.looks.tint


def _unit(vectors: FloatArray) -> FloatArray:
    length: FloatArray = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.maximum(length, 1e-30)
