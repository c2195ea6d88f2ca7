"""Pictures of the draped cloth in several materials at once, from the same random numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from pipelines.drawing.stage import Camera
from pipelines.neural_btf.draping.gathering import (
    Lighting,
    floor_radiance,
    gather,
    plane_filling,
)
from pipelines.neural_btf.draping.scene import Scene, Sights, camera_rays, seen
from pipelines.neural_btf.importance import ImportanceTable
from pipelines.neural_btf.material import FlatColour, Material, surface_radiance

FloatArray = NDArray[np.float64]

TABLE = FlatColour((0.16, 0.12, 0.09))
"""The table under the cloth: matt dark wood."""
_RAYS = 1 << 17


class Rendered(NamedTuple):
    """Pictures, linear radiance."""

    pictures: NDArray[np.float32]
    """(material, y, x, 3)."""
    cloth: NDArray[np.float32]
    """(y, x) share of a pixel with cloth."""


class View(NamedTuple):
    """How a picture is taken."""

    camera: Camera
    size: tuple[int, int]
    """Width and height."""
    samples: int
    """A pixel, even: half drawn from the environment, half from the material."""
    tile: tuple[float, float]
    """Width and height of a tile of the material, metres."""
    seed: int = 0


def render(
    scene: Scene,
    lighting: Lighting,
    shading: NDArray[np.float32],
    materials: Sequence[Material],
    table: ImportanceTable,
    view: View,
) -> Rendered:
    """Draws the cloth of each material, with the same rays and the same directions of light.

    ``shading`` of the floor, as `gathering.floor_shading` gives it; ``table``: from which
    directions of light are drawn. Light is seen once reflected: cloth does not light cloth.
    Raises ValueError where samples are odd.
    """
    if view.samples < 2 or view.samples % 2:
        raise ValueError(f"samples is {view.samples}; expected an even number, 2 or more.")
    (width, height), count = view.size, view.samples
    y, x = np.divmod(np.arange(width * height), width)
    middles = np.stack([x, y], axis=-1) + 0.5
    rays = camera_rays(view.camera, view.size, middles)
    pictures = np.empty((len(materials), width * height, 3), np.float32)
    pictures[:] = _floor(view.camera, rays, lighting, shading)
    hit = np.zeros(width * height, bool)
    hit[seen(scene, view.camera, rays)[0]] = True
    near = np.flatnonzero(binary_dilation(hit.reshape(height, width), np.ones((3, 3))))
    cloth = np.zeros(width * height, np.float32)
    shift = np.random.default_rng(view.seed).random((width * height, 4))
    sequence = plane_filling(count, 4)
    block = max(1, _RAYS // count)
    for start in range(0, len(near), block):
        pixels = near[start : start + block]
        uniforms = (shift[pixels, None] + sequence).reshape(-1, 4) % 1.0
        places = np.repeat(middles[pixels] - 0.5, count, axis=0) + uniforms[:, :2]
        ways = camera_rays(view.camera, view.size, places)
        colours, is_cloth = _samples(
            scene, lighting, shading, materials, table, view=view, ways=ways, uniforms=uniforms
        )
        pictures[:, pixels] = colours.reshape(len(materials), len(pixels), count, 3).mean(axis=2)
        cloth[pixels] = is_cloth.reshape(len(pixels), count).mean(axis=1)
    return Rendered(
        pictures.reshape(len(materials), height, width, 3), cloth.reshape(height, width)
    )


def _samples(
    scene: Scene,
    lighting: Lighting,
    shading: NDArray[np.float32],
    materials: Sequence[Material],
    table: ImportanceTable,
    *,
    view: View,
    ways: FloatArray,
    uniforms: FloatArray,
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Radiance (material, n, 3) along rays (n, 3) from the eye, and which of them meet cloth."""
    which, sights = seen(scene, view.camera, ways)
    colours = np.empty((len(materials), len(ways), 3), np.float32)
    missed = np.ones(len(ways), bool)
    missed[which] = False
    colours[:, missed] = _floor(view.camera, ways[missed], lighting, shading)
    gathered = gather(scene, sights, lighting, table, uniforms[which, 2:], which % 2 == 1)
    lit = gathered.weight.any(axis=1)
    places = sights.places / view.tile
    footprint = _footprint(view, sights)
    for number, material in enumerate(materials):
        found = np.zeros((len(which), 3), np.float32)
        for kind, part in ((material, lit & sights.is_cloth), (TABLE, lit & ~sights.is_cloth)):
            value = surface_radiance(
                kind, places[part], gathered.light[part], sights.view[part], footprint[part]
            )
            found[part] = value * gathered.weight[part]
        colours[number, which] = found
    is_cloth = np.zeros(len(ways), bool)
    is_cloth[which] = sights.is_cloth
    return colours, is_cloth


def _footprint(view: View, sights: Sights) -> FloatArray:
    """Width (n,) in tiles of what a sample stands for: a pixel's area over the samples in it.

    The pixel lies slanted on the cloth, longer by 1 / cosine one way: the mean of both ways.
    """
    pixel = 2 * np.tan(np.radians(view.camera.view_angle) / 2) / view.size[1]
    cosine = np.maximum(sights.view[:, 2], 0.1)
    width: FloatArray = sights.distance * pixel / np.sqrt(cosine * view.samples)
    return width / np.sqrt(view.tile[0] * view.tile[1])


def _floor(
    camera: Camera, ways: FloatArray, lighting: Lighting, shading: NDArray[np.float32]
) -> FloatArray:
    """Radiance (n, 3) of the floor along rays that meet nothing else; at the horizon, its end."""
    reach = camera.position[2] / np.maximum(-ways[:, 2], 1e-6)
    points = np.array(camera.position[:2]) + reach[:, None] * ways[:, :2]
    return floor_radiance(shading, lighting, points)
