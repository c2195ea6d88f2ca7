"""How much of an overcast sky the city's vertices see."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.rays import build_scene, occluded

_RAYS = 64
_VERTICES_AT_ONCE = 4096
_FARTHEST = 60.0
_OFF = 0.02
"""Metres from the surface that rays start at, and that they start inside of a triangle's corner."""


def sky_visibility(
    vertices: NDArray[np.floating], normals: NDArray[np.floating], triangles: NDArray[np.integer]
) -> NDArray[np.float32]:
    """Irradiance (v,) of an overcast sky, with what hides it, as a part of that on open ground.

    vertices (v, 3) in metres, normals (v, 3) of length 1, triangles (t, 3). The sky's radiance is
    proportional to 1 + 2 sin(elevation) (CIE's overcast sky). In [0, 1].
    """
    scene = build_scene(vertices, triangles)
    inward = _towards_triangles(vertices, triangles)
    starts = (vertices + _OFF * normals + _OFF * inward).astype(np.float32)
    local = _cosine_directions(_RAYS)
    visible = np.empty(len(vertices), np.float32)
    for first in range(0, len(vertices), _VERTICES_AT_ONCE):
        block = slice(first, first + _VERTICES_AT_ONCE)
        ways = np.einsum("kc,vcd->vkd", local, _frames(normals[block])).astype(np.float32)
        sine = ways[..., 2]
        light = np.where(sine > 0.0, 1.0 + 2.0 * sine, 0.0)
        origins = np.repeat(starts[block], _RAYS, axis=0)
        hidden = occluded(scene, origins, ways.reshape(-1, 3), farthest=_FARTHEST)
        visible[block] = (light * ~hidden.reshape(light.shape)).mean(axis=1)
    # On open ground the mean of 1 + 2 sin(elevation), weighted by the cosine, is 7 / 3.
    return np.minimum(visible * np.float32(3.0 / 7.0), 1.0)


def _cosine_directions(count: int) -> NDArray[np.float64]:
    """Directions (count, 3) about +z with a density of cosine / pi, evenly spread."""
    number = np.arange(count)
    radius = np.sqrt((number + 0.5) / count)
    angle = number * (np.pi * (3.0 - np.sqrt(5.0)))
    return np.stack(
        [radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1.0 - radius**2)], axis=-1
    )


def _frames(normals: NDArray[np.floating]) -> NDArray[np.float64]:
    """Right-handed frames (v, 3, 3); rows are tangent, bitangent, normal."""
    n = normals.astype(np.float64)
    helper = np.where(np.abs(n[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    tangent = np.cross(helper, n)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-12)
    return np.stack([tangent, np.cross(n, tangent), n], axis=1)


def _towards_triangles(
    vertices: NDArray[np.floating], triangles: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Vectors (v, 3), at most 1 long, from vertices to the middle of the triangles around them.

    A wall's lowest vertices lie in the pavement: rays must start above it.
    """
    centres = vertices[triangles].mean(axis=1, dtype=np.float64)
    corners = triangles.reshape(-1)
    counts = np.bincount(corners, minlength=len(vertices))
    spread = np.repeat(centres, 3, axis=0)
    sums = [np.bincount(corners, spread[:, axis], len(vertices)) for axis in range(3)]
    middle = np.stack(sums, axis=1) / np.maximum(counts, 1)[:, None]
    away = middle - vertices
    length = np.linalg.norm(away, axis=1, keepdims=True)
    return np.where(length > 1e-3, away / np.maximum(length, 1e-9), 0.0)
