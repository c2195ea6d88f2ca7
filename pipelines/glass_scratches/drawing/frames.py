"""Pictures of scratched glass: which views, by path tracing, and the same on the stage."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance, to_8bit
from pipelines.drawing.stage import Camera, fitting_distance, orbit
from pipelines.geometry.rays import build_scene, first_hits
from pipelines.geometry.solids import Solid
from pipelines.glass_scratches.drawing.denoising import denoised
from pipelines.glass_scratches.drawing.path_tracing import TracedPicture, trace_picture
from pipelines.glass_scratches.drawing.stage_view import draw_scratched
from pipelines.glass_scratches.scratched_glass import ScratchedGlass
from pipelines.light.built_in_environments import uniform
from pipelines.light.environment_maps import rotate_environment
from pipelines.light.environment_sampling import EnvironmentSampler, make_environment_sampler

_VIEW_ANGLE, _CLOSE_VIEW_ANGLE = 46.0, 34.0
"""Degrees: wide enough for some of the room to be seen around the object and through it."""
_AZIMUTH, _ELEVATION = -80.0, 6.0
_CLOSE_UP = 0.42
"""Distance of the close view from the surface: a hand's breadth, where the radius is 1."""
_CLOSE_AZIMUTH, _CLOSE_ELEVATION = -76.0, 2.0
FURNACE_SIZE, FURNACE_SAMPLES = 48, 64
_KEY = 0.22
"""What the picture's middle brightness is shown as: a little over a photographer's grey card."""
_DARKEST = 1e-3
_MOVING_ROWS = 512
"""Of the environment of the small pictures with the moving light, texels at most."""


class GlassFrames(NamedTuple):
    """What scratched glass looks like.

    far, close: as traced. clean: (2, H, W, 3) float32 radiance, the same without noise.
    stage: (2, H, W, 3) float32 radiance, the same views on the stage.
    moving: (lights, S, S, 3) uint8, the close view while the light turns once around.
    furnace: the far view in an environment of radiance 1. exposure: factor for display.
    """

    far: TracedPicture
    close: TracedPicture
    clean: NDArray[np.float32]
    stage: NDArray[np.float32]
    moving: NDArray[np.uint8]
    furnace: TracedPicture
    exposure: float


def draw_frames(
    glass: ScratchedGlass,
    light: EnvironmentSampler,
    *,
    size: int,
    samples: int,
    lights: int,
    moving_size: int,
    seed: int,
    progress: Callable[[float], None] = lambda fraction: None,
) -> GlassFrames:
    """Trace both views (size x size pixels, ``samples`` paths each) and take their noise away, draw
    the same on the stage, let the light go around in ``lights`` pictures, and trace the furnace.
    """
    (far, close), stage = trace_views(
        glass,
        light,
        size=size,
        samples=samples,
        seed=seed,
        progress=lambda fraction: progress(0.8 * fraction),
    )
    clean = np.stack([denoised(far), denoised(close)])
    exposure = picture_exposure(clean)
    moving = draw_moving_light(
        glass,
        light,
        exposure,
        count=lights,
        size=moving_size,
        progress=lambda fraction: progress(0.8 + 0.15 * fraction),
    )
    white = trace_furnace(glass, seed)
    return GlassFrames(far, close, clean, stage, moving, white, exposure)


def object_cameras(solid: Solid) -> tuple[Camera, Camera]:
    """The whole object, and its surface from a hand's breadth."""
    middle = (0.0, 0.0, 0.0)
    distance = 1.12 * fitting_distance(
        solid.vertices, middle, _AZIMUTH, _ELEVATION, view_angle=_VIEW_ANGLE, aspect=1.0
    )
    far = orbit(middle, distance, _AZIMUTH, _ELEVATION, view_angle=_VIEW_ANGLE)
    start = orbit(middle, distance, _CLOSE_AZIMUTH, _CLOSE_ELEVATION).position
    scene = build_scene(solid.vertices, solid.triangles)
    way = -np.array(start) / np.linalg.norm(start)
    hit = first_hits(scene, np.array([start]), way).distance[0]
    if not np.isfinite(hit):  # a ring: its hole lies in the middle
        hit = np.float32(np.linalg.norm(start))
    x, y, z = (np.array(start) + float(hit) * way).tolist()
    close = orbit(
        (x, y, z), _CLOSE_UP, _CLOSE_AZIMUTH, _CLOSE_ELEVATION, view_angle=_CLOSE_VIEW_ANGLE
    )
    return far, close


def picture_exposure(radiance: NDArray[np.floating]) -> float:
    """Factor that shows the geometric mean of pictures' luminance, (..., 3), as 0.22.

    What is small and bright, lamps or the sun, hardly moves it; the mean of an environment with a
    sun is mostly the sun's. What is darker than a thousandth of the mean counts as that.

    >>> picture = np.full((8, 8, 3), 0.11, np.float32)
    >>> round(picture_exposure(picture), 6)
    2.0
    >>> picture[0, 0] = 1e4
    >>> 1.0 < picture_exposure(picture) < 2.0
    True
    """
    bright = luminance(radiance.astype(np.float64))
    return _KEY / float(np.exp(np.log(np.maximum(bright, _DARKEST * bright.mean() + 1e-30)).mean()))


def trace_view(
    glass: ScratchedGlass,
    light: EnvironmentSampler,
    camera: Camera,
    *,
    size: int,
    samples: int,
    seed: int = 0,
    progress: Callable[[float], None] = lambda fraction: None,
) -> TracedPicture:
    """A picture of size x size pixels, by ``samples`` paths a pixel."""
    return trace_picture(
        glass.solid,
        glass.surface,
        light,
        camera,
        width=size,
        height=size,
        samples=samples,
        seed=seed,
        progress=progress,
    )


def trace_views(
    glass: ScratchedGlass,
    light: EnvironmentSampler,
    *,
    size: int,
    samples: int,
    seed: int,
    progress: Callable[[float], None],
) -> tuple[tuple[TracedPicture, TracedPicture], NDArray[np.float32]]:
    """Far and close view of size x size pixels: ``samples`` paths a pixel, and by the shader."""
    views = object_cameras(glass.solid)
    far, close = (
        trace_view(
            glass,
            light,
            camera,
            size=size,
            samples=samples,
            seed=seed,
            progress=lambda fraction, number=number: progress((number + fraction) / 2),  # type: ignore[misc]
        )
        for number, camera in enumerate(views)
    )
    stage = [
        draw_scratched(glass.actor, light, camera, width=size, height=size, supersampling=2)
        for camera in views
    ]
    return (far, close), np.stack([picture[..., :3] for picture in stage])


def trace_furnace(glass: ScratchedGlass, seed: int) -> TracedPicture:
    """The far view in an environment of radiance 1: nowhere brighter than that."""
    light, camera = make_environment_sampler(uniform(8)), object_cameras(glass.solid)[0]
    return trace_view(glass, light, camera, size=FURNACE_SIZE, samples=FURNACE_SAMPLES, seed=seed)


def draw_moving_light(
    glass: ScratchedGlass,
    light: EnvironmentSampler,
    exposure: float,
    *,
    count: int,
    size: int,
    progress: Callable[[float], None],
) -> NDArray[np.uint8]:
    """The close view on the stage while the light turns once around: (count, size, size, 3)."""
    import cv2

    radiance: NDArray[Any] = light.radiance
    rows = min(len(light.radiance), _MOVING_ROWS)
    if rows < len(radiance):
        radiance = cv2.resize(radiance, (2 * rows, rows), interpolation=cv2.INTER_AREA)
    camera = object_cameras(glass.solid)[1]
    pictures = []
    for number in range(count):
        progress(number / count)
        turned = make_environment_sampler(rotate_environment(radiance, 360.0 * number / count))
        drawn = draw_scratched(
            glass.actor, turned, camera, width=size, height=size, supersampling=2
        )
        pictures.append(drawn[..., :3])
    return to_8bit(np.stack(pictures) * exposure)
