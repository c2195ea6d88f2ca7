"""The virtual pelt on a body, seen from anywhere under any lamp: what drawn fur is held against.

Hairs stand on a skin that is bent from the tiles' plane; a photograph of one tile from above, laid
over the same skin by its texture coordinates, has the same hair at every place.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.meshes import Mesh
from pipelines.geometry.rays import first_hits
from pipelines.virtual.pelt.hairs import FloatArray, Hairs
from pipelines.virtual.pelt.pelt import SKIN_ALBEDO, traced
from pipelines.virtual.pelt.prisms import PrismScene, build_coat_scene
from pipelines.virtual.pelt.scattering import Source

Body = Literal["plane", "cylinder", "sphere"]
CYLINDER_TILES = 3
"""Around a cylinder."""
RADII = {"plane": math.inf, "cylinder": CYLINDER_TILES / (2 * math.pi), "sphere": 0.5}
"""In tile sides."""
_HALF_WIDTHS = {"plane": 1.5, "cylinder": CYLINDER_TILES / 2, "sphere": 1.42}
"""How far the skin reaches from its middle in x, as far as it is bent; of a sphere all around."""
_HALF_HEIGHTS = {"plane": 1.5, "cylinder": 1.2, "sphere": 1.42}
_VIEW_HEIGHTS = {"plane": 0.6, "cylinder": 1.2, "sphere": 1.5}
_GRID = 96
"""Edges of the skin's mesh along a side."""
_COVERAGE_SAMPLES = 16
_FAR = 20.0


class Coat(NamedTuple):
    """Hairs on a body. Lengths are in tile sides, the middle of the tiles' plane is at the origin,
    and z points away from the skin there."""

    scene: PrismScene
    skin: Mesh
    """With texture coordinates in tiles."""
    thickness: float
    """Height of the highest hair above the skin."""


class View(NamedTuple):
    """An orthographic picture: a direction, and how much it shows."""

    towards: tuple[float, float, float]
    """Unit vector from the body to the camera."""
    up: tuple[float, float, float]
    """Unit vector upwards in the picture, across ``towards``."""
    middle: tuple[float, float, float]
    """What the picture's middle shows."""
    height: float
    """Of the picture, in tile sides."""


def oblique_view(body: Body, polar: float, azimuth: float) -> View:
    """All of a sphere, or a part of a plane or cylinder, seen ``polar`` degrees from above and
    ``azimuth`` degrees from +x."""
    lean, around = math.radians(polar), math.radians(azimuth)
    x, y = math.cos(around), math.sin(around)
    towards = (math.sin(lean) * x, math.sin(lean) * y, math.cos(lean))
    up = (-math.cos(lean) * x, -math.cos(lean) * y, math.sin(lean))
    middle = (0.0, 0.0, -RADII["sphere"] if body == "sphere" else 0.0)
    return View(towards, up, middle, _VIEW_HEIGHTS[body])


def make_coat(hairs: Hairs, body: Body) -> Coat:
    """Hairs of a tile, repeated, on a body.

    >>> from pipelines.virtual.pelt.hairs import grow_hairs
    >>> coat = make_coat(grow_hairs(20, np.random.default_rng(0)), "cylinder")
    >>> x, _, z = coat.skin.vertices.T
    >>> bool(np.allclose(np.hypot(x, z + RADII["cylinder"]), RADII["cylinder"]))
    True
    """
    standing = _repeated(hairs, body)
    points = bent(standing.points.astype(np.float64), body).astype(np.float32)
    skin = _skin(body)
    scene = build_coat_scene(standing._replace(points=points), skin, SKIN_ALBEDO)
    thickness = float((hairs.points[..., 2] + hairs.radii).max(initial=0.0))
    return Coat(scene, skin, thickness)


def bent(points: NDArray[np.float64], body: Body) -> NDArray[np.float64]:
    """Points (…, 3) over the tiles' plane, bent with it: x and y keep their lengths on a cylinder,
    on a sphere the distance from the middle does."""
    x, y, z = np.moveaxis(points, -1, 0)
    radius = RADII[body]
    if body == "plane":
        return points
    if body == "cylinder":
        angle = x / radius
        around = (radius + z) * np.sin(angle), y, (radius + z) * np.cos(angle) - radius
        return np.stack(around, axis=-1)
    distance = np.hypot(x, y)
    angle = distance / radius
    share = np.sinc(angle / np.pi) / radius  # sin(angle) / distance, whatever the distance
    lifted = radius + z
    return np.stack([lifted * share * x, lifted * share * y, lifted * np.cos(angle) - radius], -1)


def photograph_coat(
    coat: Coat,
    view: View,
    size: tuple[int, int],
    samples: int,
    source: Source,
    rng: np.random.Generator,
    *,
    bounces: int = 2,
    progress: Callable[[float], None] | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Trace a picture of size = (height, width) pixels: radiance (y, x, 3), 0 beside the body, and
    the body's share (y, x) of each pixel."""
    height, width = size
    middle, up, back = (np.asarray(part) for part in (view.middle, view.up, view.towards))
    right = np.cross(up, back)

    def rays(pixels: np.ndarray, place: FloatArray) -> tuple[FloatArray, FloatArray]:
        across = ((pixels % width + place[0]) / width - 0.5) * view.height * width / height
        above = (0.5 - (pixels // width + place[1]) / height) * view.height
        starts = middle + across[:, None] * right + above[:, None] * up + _FAR * back
        ways = np.broadcast_to(-back, starts.shape)
        return starts.astype(np.float32), np.ascontiguousarray(ways, np.float32)

    count = height * width
    radiance = traced(
        coat.scene, rays, count, samples, source, rng, bounces=bounces, progress=progress
    )
    covered = np.zeros(count, np.float32)
    for place in rng.random((_COVERAGE_SAMPLES, 2, 1), dtype=np.float32):
        hits = first_hits(coat.scene.scene, *rays(np.arange(count), place))
        covered += (hits.triangle >= 0) / np.float32(_COVERAGE_SAMPLES)
    return radiance.reshape(height, width, 3), covered.reshape(height, width)


def _repeated(hairs: Hairs, body: Body) -> Hairs:
    """The copies of a tile's hairs whose roots are on the body's skin, in the tiles' plane."""
    wide, high = _HALF_WIDTHS[body], _HALF_HEIGHTS[body]
    roots = hairs.points[:, 0, :2].astype(np.float64)
    kept: list[tuple[np.ndarray, np.ndarray]] = []
    for i in range(math.floor(-wide) - 1, math.ceil(wide) + 1):
        for j in range(math.floor(-high) - 1, math.ceil(high) + 1):
            x, y = (roots + np.array([i, j])).T
            inside = (-wide <= x) & (x < wide) & (-high <= y) & (y < high)
            if body == "sphere":
                inside &= np.hypot(x, y) < wide
            found = np.flatnonzero(inside)
            kept.append((found, np.broadcast_to((i, j, 0.0), (len(found), 3))))
    which = np.concatenate([found for found, _ in kept])
    shift = np.concatenate([shift for _, shift in kept])
    points = hairs.points[which] + shift[:, None].astype(np.float32)
    return Hairs(points, hairs.radii[which], hairs.albedo[which])


def _skin(body: Body) -> Mesh:
    wide, high = _HALF_WIDTHS[body], _HALF_HEIGHTS[body]
    columns, rows = np.meshgrid(np.linspace(-1, 1, _GRID + 1), np.linspace(-1, 1, _GRID + 1))
    flat = np.stack([wide * columns, high * rows, np.zeros_like(rows)], axis=-1).reshape(-1, 3)
    if body == "sphere":  # squares become circles
        longest = np.abs(flat).max(axis=1, keepdims=True)
        flat *= longest / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
    corner = np.arange(_GRID)[:, None] * (_GRID + 1) + np.arange(_GRID)
    a, b, c, d = corner, corner + 1, corner + _GRID + 2, corner + _GRID + 1
    triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.int32)
    vertices = bent(flat, body)
    normals = bent(flat + np.array([0.0, 0.0, 1.0]), body) - vertices
    return Mesh(vertices, triangles, flat[:, :2].copy(), normals)
