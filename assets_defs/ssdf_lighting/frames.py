"""What the lit scenes look like: `relit_frames`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.ssdf_lighting.datasets import (
    bounce_of,
    decoder_of,
    frames_dataset,
    lights_of,
    matrix_distances_along,
    scene_of,
)
from assets_defs.ssdf_lighting.declaration import SSDF
from assets_defs.system import NOTES, Pictures, Progress, Result
from pipelines.ssdf_lighting import figures
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.ssdf_lighting.drawing.frames import Illumination, RelitFrames
    from pipelines.ssdf_lighting.drawing.viewpoints import Viewpoint

_GAIN = 8.0
"""Of the pictures of differences."""


class FrameSettings(Settings):
    """The pictures."""

    width: int = Field(480, ge=32, le=4096, description="Pixels across, 4:3")
    frames: int = Field(12, ge=1, le=720, description="Pictures of the turning light")
    reference_samples: int = Field(
        16, ge=2, le=65_536, description="Rays a pixel of the traced picture"
    )
    azimuth: float | None = Field(
        None,
        ge=-360.0,
        le=360.0,
        description="The camera's, degrees; default: -62, or so that open boxes are looked into",
    )
    elevation: float | None = Field(
        None, ge=-89.0, le=89.0, description="The same: default: 24, or as boxes need it"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"width": 96, "frames": 2, "reference_samples": 8},
        "paper": {"width": 640, "frames": 36, "reference_samples": 128},
    }


def _frame_pictures(dataset: xr.Dataset) -> Pictures:
    import numpy as np

    from pipelines.drawing.contact_sheet import contact_sheet
    from pipelines.ssdf_lighting.drawing.pictures import error_map

    first, reference = dataset["frames"].values[0], dataset["reference"].values
    direct = dataset["direct"].values
    uncompressed = dataset["uncompressed"].values
    return {
        "lit": first,
        "turning-light": contact_sheet(dataset["frames"].values[:6]),
        "traced-beside-lit": np.hstack([reference, direct]),
        "without-reflected-light": direct,
        "errors": np.hstack(
            [error_map(first, uncompressed, _GAIN), error_map(direct, reference, _GAIN / 2)]
        ),
        "clusters": dataset["clusters"].values,
    }


def _shows_scene(relit_frames: xr.Dataset) -> NDArray[np.bool_]:
    """Pixels that the scene covers."""
    return relit_frames["covered"].values > 0.999


def _relit_psnr(version: StoredVersion) -> float:
    pictures = version.dataset
    first, other = pictures["frames"].values[0], pictures["uncompressed"].values
    return figures.psnr(first, other, _shows_scene(pictures))


def _probe_psnr(version: StoredVersion) -> float:
    pictures = version.dataset
    direct, traced = pictures["direct"].values, pictures["reference"].values
    return figures.psnr(direct, traced, _shows_scene(pictures))


def _colour_error(version: StoredVersion) -> float:
    pictures = version.dataset
    direct, traced = pictures["direct"].values, pictures["reference"].values
    return figures.colour_error(direct, traced, _shows_scene(pictures))


def _reflected_share(version: StoredVersion) -> float:
    pictures = version.dataset
    shown = _shows_scene(pictures)
    return figures.mean_brightness(pictures["frames"].values[:1], shown) - figures.mean_brightness(
        pictures["direct"].values[None], shown
    )


def _mean_brightness(version: StoredVersion) -> float:
    pictures = version.dataset
    return figures.mean_brightness(pictures["frames"].values, _shows_scene(pictures))


def _coverage(version: StoredVersion) -> float:
    return float(version.dataset["covered"].values.mean())


@SSDF.asset(
    schemas.RELIT_FRAMES,
    by=("scene", "environment"),
    settings=FrameSettings,
    inputs=(
        "scene_mesh",
        "ssdf_matrix",
        "triangle_clusters",
        "ssdf_basis",
        "bounce_factors",
        "environment_lights",
    ),
    kinds=frozenset({"zarr", "pyvista"}),
    pictures=_frame_pictures,
    checks=(
        Check(
            "relit_psnr",
            "PSNR of the first frame, 8 bit, scene pixels, against SSDFs not compressed, dB.",
            _relit_psnr,
            at_least=36.0,
            change=1.0,
        ),
        Check(
            "probe_psnr",
            "PSNR of direct light against rays under the environment itself, denoised, scene "
            "pixels, dB; even light has 11 to 19.",
            _probe_psnr,
            at_least=20.0,
            change=0.5,
        ),
        Check(
            "colour_error",
            "How far the mean colours of the drawn and of the traced picture's scene are apart.",
            _colour_error,
            at_most=0.06,
            change=0.01,
        ),
        Check(
            "reflected_light",
            "What reflected light adds to the mean of the scene's 8-bit codes, in [0, 1].",
            _reflected_share,
            at_least=0.0005,
            at_most=0.5,
            change=0.005,
        ),
        Check(
            "coverage",
            "Share of the picture with the scene.",
            _coverage,
            at_least=0.05,
            change=0.01,
        ),
        Check(
            "mean_brightness",
            "Mean of the scene's 8-bit codes, in [0, 1].",
            _mean_brightness,
            at_least=0.02,
            at_most=0.98,
            change=0.01,
        ),
    ),
)
def relit_frames(
    settings: FrameSettings,
    progress: Progress,
    scene_mesh: xr.Dataset,
    ssdf_matrix: xr.Dataset,
    triangle_clusters: xr.Dataset,
    ssdf_basis: xr.Dataset,
    bounce_factors: xr.Dataset,
    environment_lights: xr.Dataset,
) -> Result:
    """Draw the scene under the turning light; the first frame also not compressed, and traced."""
    from pipelines.ssdf_lighting.drawing import frames
    from pipelines.ssdf_lighting.drawing.viewpoints import viewpoint

    scene = scene_of(scene_mesh)
    light = _illumination(environment_lights, bounce_factors, float(ssdf_basis["rmse"]))
    size = (settings.width, settings.width * 3 // 4)
    view = viewpoint(scene, settings.azimuth, settings.elevation, size[0] / size[1])
    turns = [360.0 * number / settings.frames for number in range(settings.frames)]
    distances = frames.ComparedDistances(
        decoder_of(ssdf_basis).distances_along, partial(matrix_distances_along, ssdf_matrix)
    )
    found = frames.relit_frames(
        scene, light, distances, view.camera, size, turns, settings.reference_samples, progress
    )
    clusters = frames.cluster_picture(scene, triangle_clusters["cluster"].values, view.camera, size)
    return frames_dataset(found, turns, clusters), {
        "sharpest λ": float(light.lights.sharpness.max()),
        **_told(found, view),
    }


def _illumination(
    environment_lights: xr.Dataset, bounce_factors: xr.Dataset, rmse: float
) -> Illumination:
    from pipelines.ssdf_lighting.drawing.frames import Illumination
    from pipelines.ssdf_lighting.light.spherical_gaussians import softened

    lights, environment = lights_of(environment_lights), environment_lights["radiance"].values
    return Illumination(softened(lights, rmse), environment, bounce_of(bounce_factors))


def _told(found: RelitFrames, view: Viewpoint) -> dict[str, Any]:
    import numpy as np

    share = f"{view.behind:.0%} of what is seen are back sides"
    notes = [f"{share}, which are lit as their front sides are."] if view.behind > 0.01 else []
    return {
        "frames a second": 1.0 / float(np.median(found.turning.seconds)),
        "renderer": found.turning.renderer,
        "azimuth": view.azimuth,
        "elevation": view.elevation,
        NOTES: notes,
    }
