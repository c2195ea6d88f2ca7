"""Light from all around, as it reaches a point: directions, and what they count for.

Half of a pixel's samples are drawn from the environment, half from the material's table; each
counts by the balance heuristic (Veach, Guibas, "Optimally combining sampling techniques", 1995),
so that neither a small sun nor a shine is left to chance.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from pipelines.geometry.rays import occluded
from pipelines.light.environment_lookup import radiance_from_directions
from pipelines.light.environment_maps import Radiance, solid_angles, texel_directions
from pipelines.light.environment_sampling import (
    EnvironmentSampler,
    direction_pdfs,
    make_environment_sampler,
    sample_directions,
)
from pipelines.neural_btf.draping.scene import Scene, Sights
from pipelines.neural_btf.importance import ImportanceTable

FloatArray = NDArray[np.float64]

FLOOR = (0.20, 0.195, 0.19)
"""Albedo of the floor: matt, a little warm."""
_FLOOR_HALF = 2.6
"""Of the square around the table in which the floor has shadows, metres."""
_POOL = 2.4
_FAR = 0.3
"""The floor fades to this part of its brightness, half of the way ``_POOL`` metres away."""


class Lighting(NamedTuple):
    """An environment above a floor."""

    sampler: EnvironmentSampler
    """Below the horizon it shines as the floor does where nothing shades it."""
    floor: FloatArray
    """(3,) radiance of that floor."""


def lighting_of(environment: Radiance) -> Lighting:
    """Light of a map (H, 2 H, 3), H even, of which the upper half counts."""
    half = len(environment) // 2
    cosine = texel_directions(len(environment))[:half, :, 2:]
    weights = cosine * solid_angles(len(environment))[:half, None, None]
    irradiance = (weights * environment[:half]).sum(axis=(0, 1), dtype=np.float64)
    floor = np.array(FLOOR) * irradiance / math.pi
    lit = environment.copy()
    lit[half:] = floor
    return Lighting(make_environment_sampler(lit), floor)


class Gathered(NamedTuple):
    """A direction of light for each of n sights, in their frames, and its weight."""

    light: FloatArray
    """(n, 3)."""
    weight: FloatArray
    """(n, 3): radiance / (pi * density), 0 where something is in the way. The mean over a pixel's
    samples of weight times a material's value is what the eye sees."""


def gather(
    scene: Scene,
    sights: Sights,
    lighting: Lighting,
    table: ImportanceTable,
    uniforms: FloatArray,
    by_table: NDArray[np.bool_],
) -> Gathered:
    """Draws a direction for each sight, from numbers (n, 2) in [0, 1).

    ``by_table`` (n,): from the material's table, and not from the environment; of a pixel's
    samples it must be true for half.
    """
    outward = np.empty_like(sights.position)
    outward[~by_table] = sample_directions(lighting.sampler, uniforms[~by_table])[0]
    drawn = table.sample(sights.view[by_table], uniforms[by_table])
    outward[by_table] = np.einsum("nij,ni->nj", sights.frame[by_table], drawn)
    light = np.einsum("nij,nj->ni", sights.frame, outward)
    up = np.flatnonzero(light[:, 2] > 0)
    up = up[~occluded(scene.rays, sights.position[up], outward[up])]
    density = table.pdf(light[up], sights.view[up])
    density += direction_pdfs(lighting.sampler, outward[up])
    weight = np.zeros_like(light)
    weight[up] = radiance_from_directions(lighting.sampler.radiance, outward[up])
    weight[up] /= (0.5 * math.pi * density)[:, None]
    return Gathered(light, weight)


# ---- the floor -------------------------------------------------------------------------------


def floor_shading(
    scene: Scene, lighting: Lighting, cells: int, samples: int, seed: int = 0
) -> NDArray[np.float32]:
    """Parts (cells, cells, 3) of the floor's brightness that reach it around the table.

    Row 0 is at -y, column 0 at -x. Smoothed by a cell: what is left of the noise is in grain.
    """
    along = ((np.arange(cells) + 0.5) / cells * 2 - 1) * _FLOOR_HALF
    x, y = np.meshgrid(along, along)
    points = np.stack([x.ravel(), y.ravel(), np.full(x.size, 1e-4)], axis=-1)
    shift = np.random.default_rng(seed).random((len(points), 2))
    found = np.zeros((len(points), 3))
    for uniforms in plane_filling(samples, 2):
        light, density = sample_directions(lighting.sampler, (uniforms + shift) % 1.0)
        up = np.flatnonzero(light[:, 2] > 0)
        up = up[~occluded(scene.rays, points[up], light[up])]
        radiance = radiance_from_directions(lighting.sampler.radiance, light[up])
        found[up] += radiance * (light[up, 2] / (density[up] * math.pi * samples))[:, None]
    parts = found.reshape(cells, cells, 3) * (np.array(FLOOR) / lighting.floor)
    smooth: NDArray[np.float32] = gaussian_filter(parts, (1.0, 1.0, 0.0)).astype(np.float32)
    return smooth


def floor_radiance(
    shading: NDArray[np.float32], lighting: Lighting, points: FloatArray
) -> FloatArray:
    """Radiance (n, 3) of the floor at points (n, 2): shaded, and fading far away, so that the
    picture has no horizon."""
    places = (points[:, ::-1] / _FLOOR_HALF + 1) / 2 * len(shading) - 0.5
    outside = (np.abs(points) >= _FLOOR_HALF).any(axis=1)
    parts = np.stack(
        [map_coordinates(shading[..., k], places.T, order=1, mode="nearest") for k in range(3)],
        axis=-1,
    )
    parts[outside] = 1.0
    away = (points**2).sum(axis=1) / _POOL**2
    fade: FloatArray = _FAR + (1 - _FAR) / (1 + away)
    return parts * lighting.floor * fade[:, None]


def plane_filling(count: int, dimensions: int) -> FloatArray:
    """Numbers (count, dimensions) in [0, 1) that fill the cube evenly: Kronecker's sequence of the
    generalised golden ratio, the root of x^(d + 1) = x + 1."""
    ratio = 2.0
    for _ in range(64):
        ratio = (1 + ratio) ** (1 / (dimensions + 1))
    steps = ratio ** -np.arange(1.0, dimensions + 1)
    filled: FloatArray = (0.5 + np.arange(count)[:, None] * steps) % 1.0
    return filled
