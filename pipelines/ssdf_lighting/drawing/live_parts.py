"""What a viewer elsewhere needs to draw a lit scene as the stage does, and pictures to compare."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.stage import Camera
from pipelines.ssdf_lighting.drawing.frames import (
    BACKGROUND,
    DistancesAlong,
    cluster_picture,
    draw_turning_light,
    exposed,
)
from pipelines.ssdf_lighting.drawing.stage_view import all_gloss_lobes, rows_of_lobes
from pipelines.ssdf_lighting.light.gloss_lobes import gloss_lobes
from pipelines.ssdf_lighting.light.interreflection import BounceFactors
from pipelines.ssdf_lighting.light.sphere_maps import downsampled
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights
from pipelines.ssdf_lighting.scene import Scene, split_by_part

Floats = NDArray[np.float32]

TURNS = (0.0, 120.0)
"""Degrees, of the reference views."""
SUPERSAMPLING = 2
"""Of the reference views."""
SHOWN_ROWS = 64
"""Of the environment that a package holds, at most."""
_LARGEST_HALF = 65504.0


class LiveMesh(NamedTuple):
    """The mesh as it is drawn; all (V, …) float32 but ``triangles`` (F, 3).

    source: row of the SSDFs. material: row of the materials. lobes: row of ``gloss_lobes``. uvs:
    (V, 2, 2), two texture coordinates. paint: (V, 3).
    """

    vertices: Floats
    triangles: NDArray[np.uint32]
    normals: Floats
    source: Floats
    material: Floats
    lobes: Floats
    uvs: Floats
    paint: Floats


class ReferenceView(NamedTuple):
    """A frame (h, w, 3) uint8 of the stage, with what a live view is set to for it."""

    name: str
    frame: NDArray[np.uint8]
    turn: float
    shadows: bool
    clusters: bool


def live_mesh(scene: Scene) -> LiveMesh:
    """The scene split as for the stage."""
    mesh, source = split_by_part(scene)
    count = len(mesh.vertices)
    textures = mesh.textures
    return LiveMesh(
        mesh.vertices.astype(np.float32),
        mesh.triangles.astype(np.uint32),
        mesh.normals.astype(np.float32),
        source.astype(np.float32),
        np.asarray(mesh.object_of_vertex, np.float32),
        rows_of_lobes(mesh).astype(np.float32),
        np.zeros((count, 2, 2), np.float32) if textures is None else textures.uvs,
        np.ones((count, 3), np.float32) if textures is None else textures.colours,
    )


def gloss_table(scene: Scene) -> Floats:
    """(rows, columns, 4): λ, along, up, ln amplitude; rows as `live_mesh` names them."""
    gloss = gloss_lobes(scene.materials)
    rows = gloss if scene.textures is None else all_gloss_lobes(gloss)
    return np.stack(rows, axis=-1).astype(np.float32)


def shown_environment(radiance: NDArray[np.floating]) -> NDArray[np.float16]:
    """An environment (H, 2 H, 3) with few rows, as halfs: what is seen behind the scene."""
    return halfs(downsampled(radiance, min(len(radiance), SHOWN_ROWS)).astype(np.float32))


def halfs(radiance: NDArray[np.floating]) -> NDArray[np.float16]:
    """Radiance as halfs; what these cannot hold becomes their largest."""
    return np.minimum(radiance, _LARGEST_HALF).astype(np.float16)


def environment_picture(radiance: NDArray[np.floating]) -> NDArray[np.uint8]:
    """An environment (H, 2 H, 3) as a picture of 512 columns or more, 8-bit sRGB."""
    import cv2

    shown = to_8bit(radiance * auto_exposure(radiance))
    times = max(1, math.ceil(512 / shown.shape[1]))
    size = (shown.shape[1] * times, shown.shape[0] * times)
    return np.asarray(cv2.resize(shown, size, interpolation=cv2.INTER_CUBIC), np.uint8)


def reference_views(
    scene: Scene,
    lights: Lights,
    distances_along: DistancesAlong,
    cluster: NDArray[np.integer],
    camera: Camera,
    size: tuple[int, int],
    exposure: float,
    bounce: BounceFactors,
) -> list[ReferenceView]:
    """The scene at two turns of its lights, without shadows, and its clusters; ``size`` is (width,
    height), ``cluster`` (F,). All are with reflected light."""

    def drawn(distances: DistancesAlong, turns: tuple[float, ...]) -> NDArray[np.uint8]:
        turning = draw_turning_light(
            scene,
            lights,
            distances,
            camera,
            size,
            turns,
            supersampling=SUPERSAMPLING,
            bounce=bounce,
        )
        return exposed(turning.radiance, exposure)

    lit = drawn(distances_along, TURNS)
    plain = drawn(_nothing_hidden, TURNS[:1])[0]
    clusters = cluster_picture(scene, cluster, camera, size)
    return [
        *(
            ReferenceView(f"turn_{turn:.0f}", frame, turn, True, False)
            for turn, frame in zip(TURNS, lit, strict=True)
        ),
        ReferenceView("without_shadows", plain, TURNS[0], False, False),
        ReferenceView("clusters", clusters, TURNS[0], True, True),
    ]


def poster(
    scene: Scene,
    lights: Lights,
    distances_along: DistancesAlong,
    camera_of: Callable[[float], Camera],
    width: int,
    exposure: float,
    bounce: BounceFactors,
) -> NDArray[np.uint8]:
    """The scene at 4 : 3, smooth; ``camera_of`` makes the camera of an aspect."""
    size = (width, width * 3 // 4)
    turning = draw_turning_light(
        scene,
        lights,
        distances_along,
        camera_of(4 / 3),
        size,
        TURNS[:1],
        supersampling=2,
        bounce=bounce,
    )
    return exposed(turning.radiance[0], exposure)


def background() -> list[float]:
    """Linear radiance where no surface is."""
    return list(BACKGROUND)


def _nothing_hidden(vertices: NDArray[np.int64], axes: Floats) -> Floats:
    return np.full(axes.shape[:2], math.pi, np.float32)
