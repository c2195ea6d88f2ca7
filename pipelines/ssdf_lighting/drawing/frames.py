"""A lit scene under turning light, beside it what was not compressed and what rays find."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.stage import PAINTED, Camera, Stage, surface
from pipelines.light.environment_lookup import radiance_from_directions
from pipelines.light.environment_maps import rotate_environment
from pipelines.ssdf_lighting.drawing.bounced_light import BouncedLight
from pipelines.ssdf_lighting.drawing.camera_rays import camera_rays, pixel_centres
from pipelines.ssdf_lighting.drawing.denoising import denoised
from pipelines.ssdf_lighting.drawing.light_sources import LightSource, ProbeSource
from pipelines.ssdf_lighting.drawing.pictures import cluster_colours
from pipelines.ssdf_lighting.drawing.ray_tracing import Traced, ray_traced
from pipelines.ssdf_lighting.drawing.stage_view import LitActor
from pipelines.ssdf_lighting.light.interreflection import BounceFactors
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, rotated
from pipelines.ssdf_lighting.scene import Scene, split_by_part

Progress = Callable[[float], None]
DistancesAlong = Callable[[NDArray[np.int64], NDArray[np.float32]], NDArray[np.float32]]
"""Vertices (P,) and axes (P, L, 3) -> d (P, L), radians."""

BACKGROUND = (0.02, 0.02, 0.025)
"""Linear radiance where no surface is."""


class TurningLight(NamedTuple):
    """The scene under turning light.

    radiance: (frames, H, W, 3) float32; covered: (H, W) float32.
    seconds: (frames,) of each, the first with building the shaders; renderer: its name.
    """

    radiance: NDArray[np.float32]
    covered: NDArray[np.float32]
    seconds: NDArray[np.float64]
    renderer: str


def draw_turning_light(
    scene: Scene,
    lights: Lights,
    distances_along: DistancesAlong,
    camera: Camera,
    size: tuple[int, int],
    turns: Sequence[float],
    progress: Progress = lambda fraction: None,
    *,
    supersampling: int = 1,
    bounce: BounceFactors | None = None,
) -> TurningLight:
    """Draw the scene for each turn (degrees about up) of its lights.

    ``distances_along`` tells d (P, L) of vertices (P,) along axes (P, L, 3). With ``bounce`` the
    scene's surfaces light each other, too.
    """
    split = split_by_part(scene)
    actor = LitActor(split.mesh, lights)
    reflected = None if bounce is None else BouncedLight(scene, bounce, lights)
    pictures, seconds = [], []
    with Stage(*size, background=BACKGROUND, supersampling=supersampling) as stage:
        stage.add(*actor.actors)
        stage.look(camera)
        for number, turn in enumerate(turns):
            begin = time.perf_counter()
            turned = rotated(lights, turn)
            actor.relight(camera, turned, lambda axes: distances_along(split.source, axes))
            if reflected is not None:
                actor.show_bounced(reflected.at_vertices(turned, distances_along)[split.source])
            stage.draw()
            seconds.append(time.perf_counter() - begin)
            pictures.append(stage.radiance())
            progress((number + 1) / len(turns))
        renderer = stage.renderer_name
    frames = np.stack(pictures)
    return TurningLight(frames[..., :3], frames[0, ..., 3], np.array(seconds), renderer)


def traced_reference(
    scene: Scene,
    source: LightSource,
    camera: Camera,
    size: tuple[int, int],
    samples: int,
    *,
    seed: int = 0,
    progress: Progress = lambda fraction: None,
) -> Traced:
    """The same picture of direct light by rays, none of the method's shortcuts."""
    return ray_traced(
        split_by_part(scene).mesh,
        source,
        camera,
        size,
        samples,
        seed=seed,
        progress=progress,
        jittered=False,
    )


class RelitFrames(NamedTuple):
    """A scene under turning light with what it is compared with, 8-bit sRGB (…, H, W, 3) at one
    exposure, before the environment that lights it.

    frames: (frames, H, W, 3), with light that surfaces reflect.
    uncompressed, direct, reference: the first of them of the SSDFs before compression; without
    reflected light; and that by rays under the environment itself, denoised.
    exposure: what radiance was multiplied by. turning: the frames' radiance, times and renderer.
    """

    frames: NDArray[np.uint8]
    uncompressed: NDArray[np.uint8]
    direct: NDArray[np.uint8]
    reference: NDArray[np.uint8]
    exposure: float
    turning: TurningLight


class ComparedDistances(NamedTuple):
    """d along axes, decoded and as it was before compression."""

    compressed: DistancesAlong
    uncompressed: DistancesAlong


class Illumination(NamedTuple):
    """Lights, the environment (H, 2 H, 3) that they stand for, and the scene's form factors."""

    lights: Lights
    environment: NDArray[np.floating]
    bounce: BounceFactors


def relit_frames(
    scene: Scene,
    light: Illumination,
    distances: ComparedDistances,
    camera: Camera,
    size: tuple[int, int],
    turns: Sequence[float],
    samples: int,
    progress: Progress = lambda fraction: None,
) -> RelitFrames:
    """Draw every turn (degrees) of the lights; of the first also what it is compared with.

    ``samples`` >= 2, rays a pixel of the traced picture; ``turns`` begin with 0, as the environment
    is given. Raises ValueError as ``LitActor`` and ``ProbeSource``.
    """

    def drawn(along: DistancesAlong, count: int, bounce: BounceFactors | None) -> TurningLight:
        return draw_turning_light(
            scene, light.lights, along, camera, size, turns[:count], bounce=bounce
        )

    turning = drawn(distances.compressed, len(turns), light.bounce)
    progress(0.3)
    exact = drawn(distances.uncompressed, 1, light.bounce)
    direct = drawn(distances.compressed, 1, None)
    progress(0.4)
    reference = traced_reference(
        scene,
        ProbeSource(light.environment),
        camera,
        size,
        samples,
        progress=lambda fraction: progress(0.4 + 0.6 * fraction),
    ).radiance
    traced = denoised(reference[..., :3], split_by_part(scene).mesh, camera, size)
    behind = np.stack([seen_behind(light.environment, camera, size, turn) for turn in turns])
    plain = np.array(BACKGROUND, np.float32)
    scale = scene_exposure(turning)

    def shown(found: TurningLight, backdrops: NDArray[np.float32]) -> NDArray[np.uint8]:
        free = 1.0 - found.covered[..., None]
        return exposed(found.radiance + free * (backdrops - plain), scale)

    return RelitFrames(
        shown(turning, behind),
        shown(exact, behind[:1])[0],
        shown(direct, behind[:1])[0],
        exposed(np.where(reference[..., 3:] > 0, traced, behind[0]), scale),
        scale,
        turning,
    )


def seen_behind(
    environment: NDArray[np.float32], camera: Camera, size: tuple[int, int], turn: float
) -> NDArray[np.float32]:
    """Radiance (height, width, 3) of what stands behind a scene: an environment (H, 2 H, 3) turned
    by degrees about up, as its lights are."""
    _, ways = camera_rays(camera, size, pixel_centres(size))
    found = radiance_from_directions(rotate_environment(environment, turn), ways, smooth=True)
    return found.reshape(size[1], size[0], 3)


def cluster_picture(
    scene: Scene, cluster: NDArray[np.integer], camera: Camera, size: tuple[int, int]
) -> NDArray[np.uint8]:
    """Triangles in the colours of their clusters (figure 2)."""
    colours = cluster_colours(int(cluster.max()) + 1)
    corners = scene.vertices[scene.triangles].reshape(-1, 3)
    normals = scene.normals[scene.triangles].reshape(-1, 3)
    light = np.maximum(normals @ (np.array([0.3, -0.4, 0.85]) / 0.986), 0.0) * 0.6 + 0.4
    painted = surface(
        corners,
        np.arange(len(corners)).reshape(-1, 3),
        attributes={"shown": np.repeat(colours[cluster], 3, axis=0) * light[:, None]},
        shader=PAINTED,
        lit=False,
    )
    with Stage(*size, background=BACKGROUND, supersampling=2) as stage:
        stage.add(painted)
        stage.look(camera)
        return stage.frame()


def exposed(radiance: NDArray[np.floating], scale: float) -> NDArray[np.uint8]:
    """Radiance as an 8-bit sRGB picture."""
    return to_8bit(radiance * scale)


def scene_exposure(turn: TurningLight) -> float:
    """Factor that brings the brighter part of the scene's pixels, of all frames, to 0.8."""
    return auto_exposure(turn.radiance[:, turn.covered > 0.5])
