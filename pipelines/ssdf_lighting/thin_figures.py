"""Figures of merit of what distances say about thin parts: what they miss, what they make up.

Neither knows how the distances were found: one takes points of the mesh, the other casts rays.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.rays import build_scene, occluded
from pipelines.ssdf_lighting.distances.octahedral import resolution_of, texel_directions

FloatArray = NDArray[np.float64]
Floats = NDArray[np.float32]

_POINTS = 256
_DEEP = 1.0 / 8.0
"""In sides of a texel: of so much the refined edge may fall short."""
_OPEN = 12
_BEYOND = (1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0)
"""In sides of a texel: how far behind the distance something is looked for."""
_BETWEEN = 1.0 / 16.0
"""In sides of a texel: from ray to ray there."""


def said_open(distances: Floats, ways: FloatArray, deep: float = 0.0) -> NDArray[np.bool_]:
    """Whether directions are open by what distances to others say: all that is nearer to ω than
    d(ω) is, here by more than ``deep``, radians.

    distances (D,) of one vertex; ways (K, 3) unit vectors; found (K,).

    >>> d = np.full(64, -0.1, np.float32)
    >>> d[0] = 0.5
    >>> said_open(d, texel_directions(8)[[0, 1, 27]]).tolist()
    [True, True, False]
    """
    texels = texel_directions(resolution_of(len(distances)))
    some = distances > deep
    found: NDArray[np.bool_] = ((ways @ texels[some].T) > np.cos(distances[some] - deep)).any(
        axis=1
    )
    return found


def missed_share(
    distances: Floats,
    origins: Floats,
    vertices: FloatArray,
    triangles: NDArray[np.integer],
) -> float:
    """Share of random points of the mesh that lie deep in what d says is open: 0 is right, for
    where the mesh is there is no sky.

    distances (P, D) seen from origins (P, 3); points are drawn evenly from the triangles (F, 3).
    """
    random = np.random.default_rng(0)
    side = math.sqrt(4.0 * math.pi / distances.shape[1])
    missed = 0
    for own, origin in zip(distances, origins, strict=True):
        corners = vertices[triangles[random.integers(len(triangles), size=_POINTS)]]
        shares = random.dirichlet((1.0, 1.0, 1.0), size=_POINTS)
        ways = np.einsum("kc,kcx->kx", shares, corners) - origin
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        missed += int(said_open(own, ways, _DEEP * side).sum())
    return missed / (_POINTS * len(distances))


def made_up_share(
    distances: Floats,
    origins: Floats,
    vertices: FloatArray,
    triangles: NDArray[np.integer],
) -> float:
    """Share of random open directions behind whose distance there is nothing: of rings of rays
    around the direction, a little farther than d, none meets the mesh. 0 is right.

    distances (P, D) seen from origins (P, 3). Directions without an edge do not count; 0 where no
    direction counts.
    """
    random = np.random.default_rng(0)
    ways = texel_directions(resolution_of(distances.shape[1]))
    side = math.sqrt(4.0 * math.pi / len(ways))
    scene = build_scene(vertices, triangles)
    counted, lonely = 0, 0
    for own, origin in zip(distances, origins, strict=True):
        some = np.flatnonzero((own > 0.0) & (own < math.pi))
        for direction in random.permutation(some)[:_OPEN]:
            rings = [
                _ring(ways[direction], float(own[direction]) + beyond * side, _BETWEEN * side)
                for beyond in _BEYOND
            ]
            counted += 1
            lonely += not occluded(scene, origin, np.concatenate(rings)).any()
    return lonely / max(counted, 1)


def _ring(way: FloatArray, radius: float, between: float) -> FloatArray:
    """Unit vectors (ring, 3) at an angle to one, an angle from each other."""
    one = np.cross(way, [0.0, 0.0, 1.0] if abs(way[2]) < 0.9 else [1.0, 0.0, 0.0])
    one /= np.linalg.norm(one)
    count = max(16, math.ceil(2.0 * math.pi * math.sin(radius) / between))
    turn = np.arange(count)[:, None] * (2.0 * math.pi / count)
    across = np.cos(turn) * one + np.sin(turn) * np.cross(way, one)
    return math.cos(radius) * way + math.sin(radius) * across
