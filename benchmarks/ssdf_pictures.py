"""Pictures of the default scene under the sky: speed, against no compression, against Mitsuba.

They are of the graph's own setting, whose error and bytes go with them (``pictures_*``). Mitsuba is
lit by the same spherical Gaussians, so the comparison does not judge their fit to the environment.
"""

from __future__ import annotations

import functools
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from PIL import Image

from assets_defs.ssdf_lighting.datasets import decoder_of, scene_of
from assets_defs.workspace import CHECKOUT
from benchmarks.ssdf_relit import sky_lights
from pipelines.ssdf_lighting.compression.lookup import matrix_along
from pipelines.ssdf_lighting.drawing import frames, viewpoints
from pipelines.ssdf_lighting.drawing.pictures import error_map
from pipelines.ssdf_lighting.figures import psnr
from pipelines.ssdf_lighting.light.spherical_gaussians import softened
from pipelines.ssdf_lighting.scene import Scene

SIZE = (640, 480)
TURNS = 24
REFERENCE_SIZE, REFERENCE_SAMPLES, REFERENCE_RUNS = (320, 240), 64, 4
PICTURE = CHECKOUT / "docs" / "pictures" / "ssdf-mitsuba.png"


def picture_figures(stored: Callable[[str], xr.Dataset]) -> dict[str, Any]:
    """Frames a second while the light turns, PSNR, and the picture of where Mitsuba differs."""
    scene, basis = scene_of(stored("scene_mesh")), stored("ssdf_basis")
    lights = softened(sky_lights(), float(basis["rmse"]))
    around, above = viewpoints.AZIMUTH, viewpoints.ELEVATION
    camera = viewpoints.scene_camera(scene, around, above, SIZE[0] / SIZE[1])
    matrix = stored("ssdf_matrix")["distances"].values
    decoder = decoder_of(basis)
    compressed = decoder.distances_along
    uncompressed = functools.partial(matrix_along, matrix)

    turns = [360.0 * number / TURNS for number in range(TURNS)]
    turn = frames.draw_turning_light(scene, lights, compressed, camera, SIZE, turns)
    exact = frames.draw_turning_light(scene, lights, uncompressed, camera, SIZE, turns[::4])
    scale = frames.scene_exposure(turn)
    shown = turn.covered > 0.999
    psnrs = [
        psnr(frames.exposed(one, scale), frames.exposed(other, scale), shown)
        for one, other in zip(turn.radiance[::4], exact.radiance, strict=True)
    ]
    drawn = {
        name: frames.draw_turning_light(
            scene, lights, look_up, camera, REFERENCE_SIZE, turns[:1], supersampling=4
        )
        for name, look_up in (("compressed", compressed), ("uncompressed", uncompressed))
    }
    reference = _by_mitsuba(scene, lights, camera)
    inside = drawn["compressed"].covered > 0.999
    by_mitsuba = frames.exposed(reference.mean(axis=0), scale)
    ours = frames.exposed(drawn["compressed"].radiance[0], scale)
    halves = [frames.exposed(half.mean(axis=0), scale) for half in np.split(reference, 2)]
    sheet = np.hstack([by_mitsuba, ours, error_map(ours, by_mitsuba, 4.0)])
    Image.fromarray(sheet).save(PICTURE, optimize=True)
    return {
        "pictures_rmse": float(basis["rmse"]),
        "pictures_file_bytes": int(basis["bytes_file"]),
        "resident_bytes": decoder.resident_bytes,
        "relight_fps": 1.0 / float(np.median(turn.seconds)),
        "relight_ms_slowest": 1000.0 * float(turn.seconds[1:].max()),
        "renderer": turn.renderer,
        "lights": len(lights.sharpness),
        "sharpest_light": float(lights.sharpness.max()),
        "relit_psnr_db": min(psnrs),
        "relit_psnr_db_mean": float(np.mean(psnrs)),
        "reference_psnr_db": psnr(ours, by_mitsuba, inside),
        "reference_psnr_db_uncompressed": psnr(
            frames.exposed(drawn["uncompressed"].radiance[0], scale), by_mitsuba, inside
        ),
        "reference_noise_psnr_db": psnr(halves[0], halves[1], inside) + 10 * np.log10(4),
    }


def _by_mitsuba(scene: Scene, lights: Any, camera: Any) -> Any:
    """Independent pictures (runs, H, W, 3)."""
    from tests.reference.lit_scene import parts_of, pictures

    with tempfile.TemporaryDirectory() as folder:
        render = pictures(
            Path(folder),
            parts_of(scene),
            scene.materials,
            lights,
            camera,
            REFERENCE_SIZE,
            REFERENCE_SAMPLES,
            1,
        )
        runs = []
        for run in range(REFERENCE_RUNS):
            runs.append(render(run))
            print(f"Mitsuba: {run + 1} of {REFERENCE_RUNS}", file=sys.stderr, flush=True)
    return np.stack(runs)
