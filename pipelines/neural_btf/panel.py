"""A panel of cloth under a moving light: the stage draws where, the network says how bright.

The stage draws texture coordinates and directions of a gently folded panel into float pictures;
the compressed BTF is asked for every pixel's texel, light and view.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.stage import PAINTED, Camera, Stage, orbit, surface
from pipelines.light.directions import unit_vectors
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.surface_lookup import (
    dimming,
    held_directions,
    in_frames,
    surface_frames,
    texels_at,
    unit,
)

BACKGROUND = (0.02, 0.022, 0.026)
LIGHT_THETA = math.radians(50.0)
_GRID = 160
_HALF_HEIGHT = 0.75
_FOLD = 0.05


class Panel(NamedTuple):
    """The panel, z towards the viewer. V vertices; all vectors in world space."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    uvs: NDArray[np.float64]
    """(V, 2) in tiles of the material."""
    normals: NDArray[np.float64]
    tangents: NDArray[np.float64]
    """(V, 3) unit vectors along u on the surface."""


class Frames(NamedTuple):
    """Pictures of the panel."""

    pictures: NDArray[np.uint8]
    """(light, y, x, 3) 8-bit sRGB."""
    coverage: float
    """Share of the picture with cloth."""


def folded_panel(tiles: float, aspect: float) -> Panel:
    """A panel 2 wide and 1.5 high with soft folds along y; ``tiles`` repeats over its width.

    ``aspect`` is a tile's height over its width.
    """
    u, v = np.meshgrid(np.linspace(-1, 1, _GRID), np.linspace(-1, 1, _GRID))
    x, y = u, _HALF_HEIGHT * v
    phase = 2.3 * math.pi * (x + 0.12 * np.sin(2.0 * y))
    slope = _FOLD * 2.3 * math.pi * np.cos(phase)
    along_x = np.stack([np.ones_like(x), np.zeros_like(x), slope], axis=-1)
    along_y = np.stack([np.zeros_like(x), np.ones_like(x), slope * 0.24 * np.cos(2.0 * y)], axis=-1)
    normals = np.cross(along_x, along_y)
    corner = np.arange(_GRID * _GRID).reshape(_GRID, _GRID)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    return Panel(
        np.stack([x, y, _FOLD * np.sin(phase)], axis=-1).reshape(-1, 3),
        triangles,
        np.stack([x, y / aspect], axis=-1).reshape(-1, 2) * tiles / 2,
        unit(normals).reshape(-1, 3),
        unit(along_x).reshape(-1, 3),
    )


def moving_lights(count: int) -> NDArray[np.float64]:
    """Directions (count, 2) once around the panel, 50° from its normal, from the upper left."""
    around = math.radians(135.0) - 2 * math.pi * np.arange(count) / count
    return np.stack([np.full(count, LIGHT_THETA), around % (2 * math.pi)], axis=-1)


def draw_frames(
    compressed: CompressedBtf,
    lights: NDArray[np.float64],
    *,
    width: int = 320,
    tiles: float = 4.0,
    supersampling: int = 2,
    progress: Callable[[float], None] = lambda fraction: None,
) -> Frames:
    """Pictures of the panel, ``width`` pixels wide and three quarters as high, one a light.

    One exposure for all: the 99 % quantile of the cloth's radiance is shown as 0.8.
    """
    panel = folded_panel(tiles, compressed.height / compressed.width)
    height, s = width * 3 // 4, supersampling
    camera = orbit((0.0, 0.0, 0.0), 3.6, -90.0, 62.0, view_angle=24.0)
    size = (width * s, height * s)
    drawn = {
        name: _draw(panel, values, camera, size)
        for name, values in (
            ("uv", np.pad(panel.uvs, ((0, 0), (0, 1)))),
            ("position", panel.vertices),
            ("normal", panel.normals),
            ("tangent", panel.tangents),
        )
    }
    seen = drawn["uv"][..., 3] > 0
    texels = texels_at(drawn["uv"][seen][:, :2], compressed)
    frame = surface_frames(drawn["normal"][seen][:, :3], drawn["tangent"][seen][:, :3])
    position = drawn["position"][seen][:, :3].astype(np.float64)
    view = held_directions(in_frames(frame, unit(np.asarray(camera.position) - position)))
    pictures = np.zeros((len(lights), height, width, 3), np.float32)
    fine = np.zeros((size[1], size[0], 3), np.float32)
    for number, light in enumerate(unit_vectors(lights)):
        progress(number / len(lights))
        towards = np.einsum("nij,j->ni", frame, light)
        radiance = compressed.radiance(texels, held_directions(towards), view)
        fine[seen] = np.maximum(radiance * dimming(towards[:, 2])[:, None], 0.0)
        pictures[number] = fine.reshape(height, s, width, s, 3).mean(axis=(1, 3))
    cloth = seen.reshape(height, s, width, s).mean(axis=(1, 3))
    scale = auto_exposure(pictures[:, cloth == 1.0])
    behind = (1.0 - cloth)[..., None] * np.array(BACKGROUND)
    return Frames(to_8bit(pictures * scale + behind), float(cloth.mean()))


def _draw(
    panel: Panel, values: NDArray[np.float64], camera: Camera, size: tuple[int, int]
) -> NDArray[np.float32]:
    """Values (V, 3) as a float picture (y, x, 4), coverage last."""
    with Stage(*size) as stage:
        stage.add(
            surface(
                panel.vertices,
                panel.triangles,
                attributes={"shown": values},
                shader=PAINTED,
                lit=False,
            )
        )
        stage.look(camera)
        return stage.radiance()
