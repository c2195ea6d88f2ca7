"""Thin things around a floor, made by code: poles, wires and leaves of a known angular width."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry import shapes
from pipelines.ssdf_lighting.light.microfacets import Materials
from pipelines.ssdf_lighting.scene import Scene, make_scene

FloatArray = NDArray[np.float64]
Ints = NDArray[np.int64]
Mesh = tuple[FloatArray, Ints]

SEGMENTS = 32
"""Squares along the floor, which is 2 wide."""
AWAY = 4.0
"""How far from the floor's middle things stand."""
COUNT = 12
_SIDES = 10


class ThinScene(NamedTuple):
    """``scene``; ``floor`` (P,) int64, its vertices; ``axes`` (A, 2, 3) float64, the ends of the
    things' middle lines; ``width`` (A,), their diameters; all in the scene's units."""

    scene: Scene
    floor: NDArray[np.int64]
    axes: FloatArray
    width: FloatArray


def cylinder(begin: FloatArray, end: FloatArray, radius: float) -> Mesh:
    """A closed cylinder, seen from outside counter-clockwise."""
    way = (end - begin) / np.linalg.norm(end - begin)
    one = np.cross(way, [1.0, 0.0, 0.0] if abs(way[0]) < 0.9 else [0.0, 1.0, 0.0])
    one /= np.linalg.norm(one)
    turn = np.arange(_SIDES)[:, None] * (2.0 * math.pi / _SIDES)
    ring = radius * (np.cos(turn) * one + np.sin(turn) * np.cross(way, one))
    k, after = np.arange(_SIDES), (np.arange(_SIDES) + 1) % _SIDES
    low, high = 2 * _SIDES + 0 * k, 2 * _SIDES + 1 + 0 * k
    faces = [
        np.stack(corners, axis=-1)
        for corners in (
            (k, after, _SIDES + after),
            (k, _SIDES + after, _SIDES + k),
            (low, after, k),
            (high, _SIDES + k, _SIDES + after),
        )
    ]
    return np.concatenate([begin + ring, end + ring, [begin, end]]), np.concatenate(faces)


def leaf(begin: FloatArray, end: FloatArray, width: float) -> Mesh:
    """A lozenge of two triangles, open and without thickness, facing the origin."""
    across = np.cross(end - begin, begin)
    across *= 0.5 * width / np.linalg.norm(across)
    middle = (begin + end) / 2.0
    corners = np.array([begin, middle + across, end, middle - across])
    return corners, np.array([[0, 1, 2], [0, 2, 3]])


def poles(degrees: float) -> ThinScene:
    """Poles of this width seen from the floor's middle, standing, not quite upright."""
    random = np.random.default_rng(1)
    turn = (np.arange(COUNT) + random.random(COUNT)) * 2.0 * math.pi / COUNT
    feet = AWAY * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)
    rise = np.array([0.0, 0.0, 4.0]) + random.normal(size=(COUNT, 3)) * [0.4, 0.4, 0.2]
    return _around(feet, feet + rise, degrees, cylinder, 0.5)


def wires(degrees: float) -> ThinScene:
    """Wires of this width, hung high from one side of the floor to the other."""
    random = np.random.default_rng(2)
    turn = random.random(COUNT) * 2.0 * math.pi
    way = np.stack([np.cos(turn), np.sin(turn), 0.1 * random.normal(size=COUNT)], axis=-1)
    over = np.stack([*(2.0 * random.normal(size=(2, COUNT))), np.full(COUNT, 3.0)], axis=-1)
    return _around(over - 3.0 * way, over + 3.0 * way, degrees, cylinder, 0.5)


def leaves(degrees: float) -> ThinScene:
    """Lozenges of this width, four times as long, all over the sky."""
    random = np.random.default_rng(3)
    count = 6 * COUNT
    way = random.normal(size=(count, 3))
    way[:, 2] = np.abs(way[:, 2]) + 0.3
    at = AWAY * way / np.linalg.norm(way, axis=1, keepdims=True)
    along = np.cross(at, random.normal(size=(count, 3)))
    along *= 2.0 * math.radians(degrees) * AWAY / np.linalg.norm(along, axis=1, keepdims=True)
    return _around(at - along, at + along, degrees, leaf, 1.0)


def _around(
    begin: FloatArray,
    end: FloatArray,
    degrees: float,
    make: Callable[[FloatArray, FloatArray, float], Mesh],
    scale: float,
) -> ThinScene:
    """The floor and a thing for each pair of ends, as wide as asked for at its own middle."""
    floor = shapes.square(SEGMENTS)
    middles = np.linalg.norm((begin + end) / 2.0, axis=1)
    width = 2.0 * middles * math.tan(math.radians(degrees) / 2.0)
    meshes: list[Mesh] = [(2.0 * floor.vertices, floor.triangles.astype(np.int64))]
    for ends in zip(begin, end, scale * width, strict=True):
        meshes.append(make(*ends))
    starts = np.cumsum([0, *(len(points) for points, _ in meshes)])
    corners = [faces + start for (_, faces), start in zip(meshes, starts[:-1], strict=True)]
    part = np.repeat([0, *np.ones(len(begin), int)], [len(faces) for _, faces in meshes])
    materials = Materials(np.array([[0.5] * 3, [0.2] * 3]), np.zeros(2), np.full(2, 0.3))
    scene = make_scene(
        np.concatenate([points for points, _ in meshes]), np.concatenate(corners), part, materials
    )
    axes = (np.stack([begin, end], axis=1) - scene.middle) / scene.scale
    own = np.unique(scene.triangles[scene.part == 0]).astype(np.int64)
    return ThinScene(scene, own, axes, width / scene.scale)


KINDS = {"poles": poles, "wires": wires, "leaves": leaves}
