"""Scenes under probes beside a path tracer that knows the probes themselves, by Mitsuba.

Three scenes that the default one is not made of, two probes: a clear sky with a sun of half a
degree, and a room with lamps. ``probe_*``: direct light; ``bounce_*``: paths of six edges. Nulls:
one even light of the same flux, the lights upside down, no reflected light.

``python -m benchmarks.ssdf_probe [FILE.hdr ...]`` measures this part alone; probes that are given
are taken instead.
"""

from __future__ import annotations

import functools
import json
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from assets_defs.ssdf_lighting.clusters import ClusterSettings
from assets_defs.ssdf_lighting.lights import LightSettings
from benchmarks.ssdf_probe_scenes import SCENES
from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.picture_metrics import flip_map, psnr
from pipelines.drawing.stage import Camera
from pipelines.light import built_in_environments
from pipelines.ssdf_lighting.compression.compact_file import compress
from pipelines.ssdf_lighting.compression.decoder import Decoder
from pipelines.ssdf_lighting.compression.lookup import matrix_along
from pipelines.ssdf_lighting.distances.refined import occluders, refined_distances
from pipelines.ssdf_lighting.distances.visibility import (
    RayOrigins,
    SceneVisibility,
    scene_visibility,
    unpacked,
)
from pipelines.ssdf_lighting.drawing import frames, viewpoints
from pipelines.ssdf_lighting.light.environment_fit import fit_lights
from pipelines.ssdf_lighting.light.interreflection import BounceFactors, bounce_factors
from pipelines.ssdf_lighting.light.sphere_maps import fluxes
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, integral, softened
from pipelines.ssdf_lighting.scene import Scene

Array = NDArray[np.float64]

SIZE = (240, 180)
SAMPLES, RUNS = 64, 2  # a pixel, of each of the pictures that the truth is the mean of
DEPTHS = {"probe": 2, "bounce": 6}  # edges of a path; 2: direct light
SIDE = 64  # of the directions
RMSE = 0.006  # the graph's own
SUN_RADIUS = 0.2665  # degrees


class Prepared(NamedTuple):
    """A scene with its distances, as they are after compression and were before."""

    scene: Scene
    camera: Camera
    decoder: Decoder
    matrix: NDArray[np.float32]
    bounce: BounceFactors
    file_bytes: int


def built_in_probes() -> dict[str, NDArray[np.float32]]:
    """Maps of radiance by name."""
    settings = LightSettings()
    sun = built_in_environments.sky(
        1024,
        sun_azimuth=settings.sun_azimuth,
        sun_elevation=settings.sun_elevation,
        sun_radius=SUN_RADIUS,
    )
    return {"sun": sun, "lamps": built_in_environments.lamps(512)}


def probe_figures(probes: Mapping[str, NDArray[np.floating]] | None = None) -> dict[str, Any]:
    """All figures, worst and mean of the pairs of scene and probe, and of each pair."""
    given = built_in_probes() if probes is None else probes
    lights = {name: _fitted(radiance) for name, radiance in given.items()}
    pairs: dict[str, dict[str, float]] = {}
    rows: dict[str, Any] = {}
    for name, make in SCENES.items():
        prepared = _prepared(make())
        _tell(f"{name}: {len(prepared.scene.vertices)} vertices")
        rows[name] = {
            "vertices": len(prepared.scene.vertices),
            "file_bytes": prepared.file_bytes,
            "bounce_bytes": prepared.bounce.nbytes,
        }
        for probe, radiance in given.items():
            pairs[f"{name} under {probe}"] = _compared(prepared, radiance, lights[probe])
            _tell(f"{name} under {probe}: {pairs[f'{name} under {probe}']}")
    found: dict[str, Any] = {"probe_pairs": pairs, "probe_scenes": rows}
    keys = next(iter(pairs.values()))
    for key in keys:
        values = [pair[key] for pair in pairs.values()]
        found[key] = max(values) if "flip" in key else min(values)
        found[f"{key}_mean"] = float(np.mean(values))
    found["probe_lights"] = LightSettings().lights
    return found


def _fitted(radiance: NDArray[np.floating]) -> Lights:
    settings = LightSettings()
    return fit_lights(
        radiance,
        settings.lights,
        least_sharpness=settings.least_sharpness,
        most_sharpness=settings.most_sharpness,
    ).lights


def _prepared(scene: Scene) -> Prepared:
    """What the graph makes of a scene, by its own settings."""
    seen = scene_visibility(scene.vertices, scene.triangles, scene.normals, SIDE)
    matrix = _distances(scene, seen)
    file = compress(matrix, scene.triangles, clusters=ClusterSettings().clusters, rmse=RMSE)
    camera = viewpoints.scene_camera(
        scene, viewpoints.AZIMUTH, viewpoints.ELEVATION, SIZE[0] / SIZE[1]
    )
    bounce = bounce_factors(scene, seen.origins, 256)
    return Prepared(scene, camera, Decoder.of_file(file), matrix, bounce, len(file))


def _distances(scene: Scene, seen: SceneVisibility) -> NDArray[np.float32]:
    around = occluders(scene.vertices, scene.triangles)
    blocks = []
    for first in range(0, len(scene.vertices), 512):
        block = slice(first, first + 512)
        origins = RayOrigins(seen.origins.points[block], seen.origins.sealed[block])
        visible = unpacked(seen.visible[block], SIDE**2)
        blocks.append(refined_distances(around, origins, scene.normals[block], visible))
    return np.concatenate(blocks)


def _compared(
    prepared: Prepared, radiance: NDArray[np.floating], lights: Lights
) -> dict[str, float]:
    truth = _by_mitsuba(prepared, radiance)
    along = prepared.decoder.distances_along
    plain = functools.partial(matrix_along, prepared.matrix)
    upside_down = lights._replace(axes=lights.axes * [1.0, 1.0, -1.0])
    direct = _drawn(prepared, lights, along)
    shown = direct.covered > 0.999
    # As a frame is exposed: by the brighter part of what is shown.
    scale = auto_exposure(truth["bounce"].mean(axis=0)[shown])

    def codes(picture: NDArray[np.floating]) -> NDArray[np.uint8]:
        return to_8bit(picture * scale)

    def against(name: str, picture: NDArray[np.floating]) -> float:
        return psnr(codes(picture), codes(truth[name].mean(axis=0)), shown)

    found: dict[str, float] = {}
    pictures = {
        "probe": direct.radiance[0],
        "bounce": _drawn(prepared, lights, along, prepared.bounce).radiance[0],
    }
    everywhere, edges = np.ones_like(shown), direct.covered[..., None]

    def on_background(name: str, picture: NDArray[np.floating]) -> NDArray[np.floating]:
        filled = np.where(edges > 0, truth[name].mean(axis=0), picture)
        return filled + (1.0 - edges) * np.array(frames.BACKGROUND) * (edges > 0)

    for name, picture in pictures.items():
        filled = on_background(name, picture)
        found[f"{name}_psnr_db"] = against(name, picture)
        found[f"{name}_flip"] = float(flip_map(codes(picture), codes(filled))[shown].mean())
        found[f"{name}_psnr_db_frame"] = psnr(codes(picture), codes(filled), everywhere)
        found[f"{name}_flip_frame"] = float(flip_map(codes(picture), codes(filled)).mean())
        # Of the mean of all runs: each half has twice its variance, their difference four times.
        halves = [codes(half) for half in truth[name]]
        noise = psnr(halves[0], halves[1], shown)
        found[f"{name}_noise_psnr_db"] = noise + 10 * float(np.log10(4))
    exact, even = (
        _drawn(prepared, own, distances).radiance[0]
        for own, distances in ((lights, plain), (_even(radiance), along))
    )
    filled = on_background("probe", even)
    found |= {
        "probe_psnr_db_uncompressed": against("probe", exact),
        "probe_psnr_db_even": against("probe", even),
        "probe_flip_even": float(flip_map(codes(even), codes(filled))[shown].mean()),
        "probe_psnr_db_upside_down": against(
            "probe", _drawn(prepared, upside_down, along).radiance[0]
        ),
        "bounce_psnr_db_none": against("bounce", direct.radiance[0]),
    }
    return found


def _even(radiance: NDArray[np.floating]) -> Lights:
    """One light from everywhere, of the same flux."""
    sharpness = np.array([1e-3])
    flux = fluxes(radiance.astype(np.float64))
    return Lights(np.array([[0.0, 0.0, 1.0]]), sharpness, flux[None] / integral(sharpness)[:, None])


def _drawn(
    prepared: Prepared, lights: Lights, along: Any, bounce: BounceFactors | None = None
) -> frames.TurningLight:
    return frames.draw_turning_light(
        prepared.scene,
        softened(lights, RMSE),
        along,
        prepared.camera,
        SIZE,
        [0.0],
        supersampling=4,
        bounce=bounce,
    )


def _by_mitsuba(prepared: Prepared, radiance: NDArray[np.floating]) -> dict[str, Array]:
    """Independent pictures (runs, H, W, 3) of direct light and of paths."""
    from tests.reference.lit_scene import parts_of, pictures_under_probe

    with tempfile.TemporaryDirectory() as folder:
        render = pictures_under_probe(
            Path(folder),
            parts_of(prepared.scene),
            prepared.scene.materials,
            radiance,
            prepared.camera,
            SIZE,
            SAMPLES,
        )
        return {
            name: np.stack([render(depth, RUNS * depth + run) for run in range(RUNS)])
            for name, depth in DEPTHS.items()
        }


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    from storage.readers.environments import read_environment

    files = {Path(name).stem: read_environment(Path(name)).radiance for name in sys.argv[1:]}
    print(json.dumps(probe_figures(files or None)))
