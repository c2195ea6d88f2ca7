"""Thin things: what distances say is open, looking up from a floor, and shadows of poles on it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from benchmarks.ssdf_thin import drawn_directions
from benchmarks.ssdf_thin_scenes import Mesh, cylinder, leaf
from pipelines.drawing.colour import to_8bit
from pipelines.geometry import shapes
from pipelines.geometry.rays import occluded
from pipelines.ssdf_lighting.compression.lookup import matrix_along
from pipelines.ssdf_lighting.distances.octahedral import texel_directions
from pipelines.ssdf_lighting.distances.refined import (
    crossing_distances,
    occluders,
    refined_distances,
)
from pipelines.ssdf_lighting.distances.visibility import RayOrigins, visible_directions
from pipelines.ssdf_lighting.light.spherical_gaussians import integral, visible_integral
from pipelines.ssdf_lighting.thin_figures import said_open

_PIXELS, _FINER = 380, 2
_AT_ONCE = 8192
_SQUARES = 40
_SKY, _DARK, _MARGIN = np.array([201, 219, 238]), np.array([38, 42, 48]), np.array([255, 255, 255])
_HORIZON = 1.48
"""Radians from straight up at the picture's rim: a little above the floor."""


def thin_picture(n: int = 64) -> NDArray[np.uint8]:
    """Side by side, as a fisheye lens sees the sky: by rays; what n x n directions and the edge
    between them say is open; the same with the outlines (H, 3 W, 3)."""
    vertices, triangles = _things()
    around = occluders(vertices, triangles)
    origins = RayOrigins(np.array([[0.0, 0.0, 1e-3]], np.float32), np.zeros(1, bool))
    visible = visible_directions(around.rays, origins, texel_directions(n))
    up = np.array([[0.0, 0.0, 1.0]])
    ways, inside = _fisheye()
    panels = [
        ~occluded(around.rays, origins.points[0], ways),
        _by(crossing_distances(around.rays, origins, up, visible)[0], ways),
        _by(refined_distances(around, origins, up, visible)[0], ways),
    ]
    return np.hstack([_panel(is_open, inside) for is_open in panels])


def shadow_picture(sharpness: float = 300.0) -> NDArray[np.uint8]:
    """Side by side, a floor from above in the light of one spherical Gaussian behind two poles: the
    visible share by rays; by d without the outlines; with them (H, 3 W, 3)."""
    floor, axis = shapes.square(_SQUARES), np.array([-0.85, 0.1, 0.5]) / math.hypot(0.85, 0.1, 0.5)
    meshes = [
        (2.0 * floor.vertices, floor.triangles),
        cylinder(np.array([-1.3, 0.2, 0.0]), np.array([-1.3, 0.2, 1.6]), 0.012),
        cylinder(np.array([-1.5, -0.5, 0.0]), np.array([-1.5, -0.5, 1.8]), 0.03),
    ]
    around = occluders(*_joined(meshes))
    place = np.linspace(-1.0, 1.0, _SQUARES + 1)
    x, y = np.meshgrid(place, -place)
    points = np.stack([x.ravel(), y.ravel(), np.full(x.size, 1e-3)], axis=-1).astype(np.float32)
    origins = RayOrigins(points, np.zeros(len(points), bool))
    visible = visible_directions(around.rays, origins, texel_directions(64))
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    ways = drawn_directions(np.random.default_rng(0), axis, sharpness)
    panels = [np.array([1.0 - occluded(around.rays, point, ways).mean() for point in points])]
    axes = np.broadcast_to(axis.astype(np.float32), (len(points), 1, 3))
    for distances in (
        crossing_distances(around.rays, origins, up, visible),
        refined_distances(around, origins, up, visible),
    ):
        d = matrix_along(distances, np.arange(len(points)), axes)[:, 0]
        panels.append(visible_integral(d, sharpness) / integral(sharpness))
    grey = [np.pad(0.45 * panel.reshape(x.shape), 1, constant_values=1.0) for panel in panels]
    wide = to_8bit(np.hstack(grey)[..., None].repeat(3, axis=-1))
    return wide.repeat(_PIXELS // len(x), axis=0).repeat(_PIXELS // len(x), axis=1)


def _by(distances: NDArray[np.float32], ways: NDArray[np.float64]) -> NDArray[np.bool_]:
    parts = np.array_split(ways, 1 + len(ways) // _AT_ONCE)
    return np.concatenate([said_open(distances, some) for some in parts])


def _fisheye() -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Directions (inside, 3) of the pixels' samples, and which of all samples are inside."""
    size = _PIXELS * _FINER
    place = (np.arange(size) + 0.5) * (2.0 / size) - 1.0
    x, y = np.meshgrid(place, -place)
    radius = np.hypot(x, y)
    inside = radius < 0.98
    polar, turn = radius[inside] / 0.98 * _HORIZON, np.arctan2(y[inside], x[inside])
    around = np.sin(polar)
    return np.stack([around * np.cos(turn), around * np.sin(turn), np.cos(polar)], -1), inside


def _panel(is_open: NDArray[np.bool_], inside: NDArray[np.bool_]) -> NDArray[np.uint8]:
    samples = np.broadcast_to(_MARGIN, (*inside.shape, 3)).astype(float)
    samples[inside] = np.where(is_open[:, None], _SKY, _DARK)
    pixels = samples.reshape(_PIXELS, _FINER, _PIXELS, _FINER, 3).mean(axis=(1, 3))
    return np.rint(pixels).astype(np.uint8)


def _things() -> Mesh:
    """A floor, a lamp post with its arm and lamp, three wires, a branch with leaves."""
    random = np.random.default_rng(5)
    floor = shapes.square(4)
    lamp = shapes.sphere(12)
    foot, top = np.array([-2.2, 0.9, 0.0]), np.array([-2.2, 0.9, 3.2])
    end = top + np.array([0.9, -0.5, 0.15])
    meshes = [
        (8.0 * floor.vertices, floor.triangles),
        cylinder(foot, top, 0.035),
        cylinder(top, end, 0.02),
        (0.11 * lamp.vertices * [1.3, 1.0, 0.5] + end, lamp.triangles),
    ]
    for shift in (0.0, 0.7, 1.6):
        meshes.append(
            cylinder(np.array([-5.0, -1.9 - shift, 3.4]), np.array([5.0, -0.7 - shift, 3.1]), 0.012)
        )
    branch = np.array([[4.2, 3.4, 1.6], [2.6, 2.4, 2.2], [1.1, 1.7, 2.4], [-0.4, 1.4, 2.6]])
    for k in range(3):
        meshes.append(cylinder(branch[k], branch[k + 1], 0.05 - 0.013 * k))
    for share in np.linspace(0.1, 1.0, 22):
        k = min(2, math.floor(3 * share))
        at = branch[k] + (branch[k + 1] - branch[k]) * (3 * share - k)
        way = random.normal(size=3) * [1.0, 1.0, 0.5]
        way /= np.linalg.norm(way)
        stalk = at + 0.16 * way
        meshes.append(cylinder(at, stalk, 0.006))
        meshes.append(leaf(stalk, stalk + 0.42 * way, 0.17))
    return _joined(meshes)


def _joined(meshes: Sequence[Mesh]) -> Mesh:
    starts = np.cumsum([0, *(len(points) for points, _ in meshes)])
    corners = [faces + start for (_, faces), start in zip(meshes, starts[:-1], strict=True)]
    return np.concatenate([points for points, _ in meshes]), np.concatenate(corners)
