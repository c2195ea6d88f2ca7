"""Three scenes that the default scene is not made of, to be lit by probes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry import shapes
from pipelines.geometry.meshes import grid_triangles
from pipelines.ssdf_lighting.light.microfacets import Materials
from pipelines.ssdf_lighting.scene import Scene, make_scene

FloatArray = NDArray[np.float64]
_Mesh = tuple[FloatArray, NDArray[np.integer]]

_AROUND, _ALONG = 20, 220  # of the knot's tube
_TUBE = 0.24


def knot() -> Scene:
    """A glossy torus knot that stands on a matt floor."""
    vertices, triangles = _torus_knot()
    floor = _floor(64, 5.6, float(vertices[:, 2].min()) - 0.02)
    return _scene(
        [(vertices, triangles), floor],
        [[0.62, 0.18, 0.12], [0.55, 0.55, 0.53]],
        [0.04, 0.0],
        0.035,
    )


def boxes() -> Scene:
    """Boxes on one another, turned against each other, on a floor: corners and contact."""
    stack = [
        _box((1.5, 1.1, 0.5), (0.0, 0.0, 0.25), 10.0),
        _box((0.8, 0.8, 0.6), (-0.15, 0.05, 0.80), 38.0),
        _box((0.45, 0.9, 0.2), (-0.1, 0.0, 1.20), -20.0),
        _box((0.5, 0.5, 0.9), (1.05, -0.75, 0.45), 25.0),
        _box((0.35, 0.35, 0.35), (-0.95, -0.95, 0.175), 60.0),
    ]
    colours = [[0.58, 0.48, 0.36], [0.25, 0.42, 0.56], [0.7, 0.68, 0.62], [0.6, 0.22, 0.16]]
    colours += [[0.3, 0.45, 0.22], [0.56, 0.56, 0.55]]
    return _scene([*stack, _floor(1, 4.6, 0.0)], colours, [0.0] * 6, 0.03)


def colonnade() -> Scene:
    """Round columns under a beam before two walls: deep, half closed, slits of light."""
    parts: list[_Mesh] = [
        _column(0.16, 1.2, (x, -0.75 + 0.12 * k, 0.0)) for k, x in enumerate((-1.2, -0.4, 0.4, 1.2))
    ]
    parts.append(_box((3.2, 0.42, 0.22), (0.0, -0.57, 1.31), 8.5))
    parts.append(_box((3.3, 0.1, 1.5), (0.0, 1.05, 0.75), 0.0))
    parts.append(_box((0.1, 1.9, 1.5), (-1.6, 0.1, 0.75), 0.0))
    parts.append(_floor(1, 4.4, 0.0))
    colours = [[0.7, 0.66, 0.58]] * 4 + [[0.66, 0.62, 0.55], [0.62, 0.3, 0.2], [0.28, 0.42, 0.55]]
    return _scene(parts, [*colours, [0.55, 0.54, 0.52]], [0.0] * 8, 0.04)


def _scene(
    parts: Sequence[_Mesh],
    colours: Sequence[Sequence[float]],
    specular: Sequence[float],
    longest: float,
) -> Scene:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    return make_scene(
        np.concatenate([vertices for vertices, _ in parts]),
        np.concatenate(
            [corners + start for (_, corners), start in zip(parts, starts, strict=False)]
        ),
        np.repeat(np.arange(len(parts)), [len(corners) for _, corners in parts]),
        Materials(np.array(colours), np.array(specular), np.full(len(parts), 0.22)),
        longest=longest,
    )


def _torus_knot() -> _Mesh:
    """A tube along the (2, 3) torus knot, closed in both directions."""
    t = np.arange(_ALONG, dtype=np.float64) * (2 * math.pi / _ALONG)

    def middle(at: FloatArray) -> FloatArray:
        radius = 1.0 + 0.42 * np.cos(3 * at)
        ring = [radius * np.cos(2 * at), radius * np.sin(2 * at), 0.42 * np.sin(3 * at)]
        return np.stack(ring, axis=1) @ np.array([[1, 0, 0], [0, 0.5, 0.866], [0, -0.866, 0.5]])

    step = 1e-4
    forward = middle(t + step) - middle(t - step)
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    bend = middle(t + step) + middle(t - step) - 2 * middle(t)
    bend -= np.sum(bend * forward, axis=1, keepdims=True) * forward
    bend /= np.linalg.norm(bend, axis=1, keepdims=True)
    side = np.cross(forward, bend)
    angle = np.arange(_AROUND) * (2 * math.pi / _AROUND)
    ring = np.cos(angle)[:, None] * bend[:, None] + np.sin(angle)[:, None] * side[:, None]
    vertices = (middle(t)[:, None] + _TUBE * ring).reshape(-1, 3)
    corners = grid_triangles(_ALONG + 1, _AROUND + 1)
    row, column = np.divmod(corners, _AROUND + 1)
    return vertices, (row % _ALONG) * _AROUND + column % _AROUND


def _box(size: Sequence[float], middle: Sequence[float], degrees: float) -> _Mesh:
    corner = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    angle = math.radians(degrees)
    turn = np.array([
        [math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1],
    ])  # fmt: skip
    sides = np.array([
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ])  # fmt: skip
    return corner * np.array(size) @ turn.T + np.array(middle), sides


def _column(radius: float, height: float, foot: Sequence[float]) -> _Mesh:
    """A cylinder of 24 sides, closed at both ends."""
    angle = np.arange(24) * (2 * math.pi / 24)
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1)
    vertices = np.concatenate([ring, ring + np.array([0, 0, height]), [[0, 0, 0], [0, 0, height]]])
    one, other = np.arange(24), np.roll(np.arange(24), -1)
    triangles = np.concatenate([
        np.stack([one, other, other + 24], axis=1), np.stack([one, other + 24, one + 24], axis=1),
        np.stack([other, one, 0 * one + 48], axis=1),
        np.stack([one + 24, other + 24, 0 * one + 49], axis=1),
    ])  # fmt: skip
    return vertices + np.array(foot), triangles


def _floor(segments: int, size: float, height: float) -> _Mesh:
    flat = shapes.square(segments)
    return flat.vertices * [size, size, 0.0] + [0.0, 0.0, height], flat.triangles


SCENES = {"knot": knot, "boxes": boxes, "colonnade": colonnade}
"""By name."""
