"""The draped cloth, the table and the floor, and what a camera's rays meet there."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera
from pipelines.geometry.rays import build_scene, first_hits
from pipelines.neural_btf.draping.draped_cloth import DrapedCloth, draped_cloth
from pipelines.neural_btf.draping.table import table_mesh
from pipelines.neural_btf.surface_lookup import in_frames, surface_frames, unit

if TYPE_CHECKING:
    from open3d.t.geometry import RaycastingScene

FloatArray = NDArray[np.float64]


class Scene(NamedTuple):
    """Cloth, and what else stands on the floor z = 0."""

    cloth: DrapedCloth
    rays: RaycastingScene
    """Of the cloth's triangles, then of others."""
    normals: FloatArray
    """(V, 3) of the cloth's vertices, then of others."""
    triangles: NDArray[np.int64]
    """(F, 3) as in ``rays``."""


class Sights(NamedTuple):
    """What n camera rays meet: cloth or table."""

    position: FloatArray
    """(n, 3), moved off the surface, towards the eye."""
    frame: FloatArray
    """(n, 3, 3): rows are tangent, bitangent, normal, on the eye's side."""
    view: FloatArray
    """(n, 3) unit vectors to the eye, in the frame."""
    places: FloatArray
    """(n, 2) on the cloth, metres; nothing for the table."""
    distance: FloatArray
    """(n,) from the eye."""
    is_cloth: NDArray[np.bool_]


_OFF = 2e-4
"""Metres off the surface: more than single precision loses at some metres, less than a thread."""


@functools.cache
def draped_scene() -> Scene:
    """The cloth over its table: built once a process."""
    cloth, table = draped_cloth(), table_mesh()
    return scene_of(cloth, table.vertices, table.triangles, table.normals)


def scene_of(
    cloth: DrapedCloth,
    vertices: FloatArray | None = None,
    triangles: NDArray[np.integer] | None = None,
    normals: FloatArray | None = None,
) -> Scene:
    """A scene of a cloth, and of another mesh (V, 3), (F, 3) with normals (V, 3), where there is
    one."""
    if vertices is None or triangles is None or normals is None:
        vertices, normals = np.zeros((0, 3)), np.zeros((0, 3))
        triangles = np.zeros((0, 3), np.int64)
    all_vertices = np.concatenate([cloth.vertices, vertices])
    all_triangles = np.concatenate([cloth.triangles, triangles + len(cloth.vertices)])
    return Scene(
        cloth,
        build_scene(all_vertices, all_triangles),
        np.concatenate([cloth.normals, normals]),
        all_triangles.astype(np.int64),
    )


def camera_rays(camera: Camera, size: tuple[int, int], pixels: FloatArray) -> FloatArray:
    """Unit vectors (n, 3) through places (n, 2) of a picture of ``size`` (width, height), pixels
    from its upper left corner."""
    forward = unit(np.subtract(camera.target, camera.position))
    right = unit(np.cross(forward, camera.up))
    up = np.cross(right, forward)
    width, height = size
    scale = 2 * math.tan(math.radians(camera.view_angle) / 2) / height
    across = (pixels[:, 0] - width / 2) * scale
    down = (pixels[:, 1] - height / 2) * scale
    return unit(forward + across[:, None] * right - down[:, None] * up)


def seen(scene: Scene, camera: Camera, directions: FloatArray) -> tuple[NDArray[np.int64], Sights]:
    """Which rays (m,) of a camera's, in ``directions`` (n, 3), meet something, and what."""
    hits = first_hits(scene.rays, np.array(camera.position), directions)
    which = np.flatnonzero(hits.triangle >= 0)
    triangle, weights = hits.triangle[which], hits.barycentric[which].astype(np.float64)
    ways, corners = directions[which], scene.triangles[triangle]
    is_cloth = triangle < len(scene.cloth.triangles)
    count = len(scene.cloth.vertices)
    own = np.where(is_cloth[:, None], corners, 0) % count
    normal = _between(scene.normals, corners, weights)
    tangent = np.where(
        is_cloth[:, None], _between(scene.cloth.tangents, own, weights), _across(normal)
    )
    away = np.sign(-np.sum(normal * ways, axis=1))
    normal *= np.where(away == 0, 1.0, away)[:, None]
    frame = surface_frames(normal, tangent)
    distance = hits.distance[which].astype(np.float64)
    position = np.array(camera.position) + distance[:, None] * ways
    return which, Sights(
        position + _OFF * normal,
        frame,
        in_frames(frame, -ways),
        _between(scene.cloth.places, own, weights),
        distance,
        is_cloth,
    )


def _between(values: FloatArray, corners: NDArray[np.int64], weights: FloatArray) -> FloatArray:
    """Values (n, k) at places of triangles."""
    found: FloatArray = weights[:, :1] * values[corners[:, 0]]
    found += weights[:, 1:2] * values[corners[:, 1]]
    found += weights[:, 2:] * values[corners[:, 2]]
    return found


def _across(normals: FloatArray) -> FloatArray:
    """Some vectors (n, 3) along surfaces."""
    axis = np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    return np.cross(normals, axis)
