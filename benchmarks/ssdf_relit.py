"""The default scene under its turning sky, drawn from any distances: against no compression."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

from assets_defs.ssdf_lighting.datasets import scene_of
from assets_defs.ssdf_lighting.lights import LightSettings
from pipelines.light import built_in_environments
from pipelines.ssdf_lighting.compression.lookup import matrix_along
from pipelines.ssdf_lighting.drawing import frames, viewpoints
from pipelines.ssdf_lighting.figures import psnr
from pipelines.ssdf_lighting.light.environment_fit import fit_lights
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, softened

SIZE = (640, 480)
TURNS = tuple(60.0 * number for number in range(6))


@functools.lru_cache(maxsize=1)
def sky_lights() -> Lights:
    """The built-in sky's, by the graph's own settings."""
    settings = LightSettings()
    sky = built_in_environments.sky(
        256, sun_azimuth=settings.sun_azimuth, sun_elevation=settings.sun_elevation
    )
    return fit_lights(
        sky,
        settings.lights,
        least_sharpness=settings.least_sharpness,
        most_sharpness=settings.most_sharpness,
    ).lights


def relit_judge(
    stored: Callable[[str], xr.Dataset],
) -> Callable[[frames.DistancesAlong], dict[str, Any]]:
    """Of distances along axes: `relit_psnr_db`, 8-bit codes of the stage's pictures, the worst of
    six turns, its mean, and `relight_fps`."""
    scene = scene_of(stored("scene_mesh"))
    lights = softened(sky_lights(), float(stored("ssdf_basis")["rmse"]))
    camera = viewpoints.scene_camera(
        scene, viewpoints.AZIMUTH, viewpoints.ELEVATION, SIZE[0] / SIZE[1]
    )
    matrix = stored("ssdf_matrix")["distances"].values
    draw = functools.partial(frames.draw_turning_light, scene, lights)
    exact = draw(functools.partial(matrix_along, matrix), camera, SIZE, TURNS)
    scale, shown = frames.scene_exposure(exact), exact.covered > 0.999

    def judged(distances_along: frames.DistancesAlong) -> dict[str, Any]:
        drawn = draw(distances_along, camera, SIZE, TURNS)
        found = [
            psnr(frames.exposed(one, scale), frames.exposed(other, scale), shown)
            for one, other in zip(drawn.radiance, exact.radiance, strict=True)
        ]
        return {
            "relit_psnr_db": min(found),
            "relit_psnr_db_mean": float(np.mean(found)),
            "relight_fps": 1.0 / float(np.median(drawn.seconds)),
        }

    return judged
