"""What lights: `environment_lights`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.ssdf_lighting.datasets import lights_dataset, lights_of
from assets_defs.ssdf_lighting.declaration import SSDF
from assets_defs.system import NOTES, Pictures, Progress, Result
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr

    from storage.readers.environments import EnvironmentFile

_HEIGHT = 256
"""Rows of the built-in environments."""
_STORED = 1024
"""Rows of the environment that is kept beside its lights, at most: frames are compared with it."""


_SHOWN = 128
"""Rows of the picture of it."""


class LightSettings(Settings):
    """The environment, and how closely its lights follow it."""

    lights: int = Field(24, ge=1, le=24, description="Spherical Gaussians of an environment, N")
    least_sharpness: float = Field(8.0, gt=0.0, le=100.0, description="Least λ of a light")
    most_sharpness: float = Field(
        1000.0, ge=100.0, le=1e4, description="Largest λ of a light that is no sun"
    )
    sun_azimuth: float = Field(25.0, ge=-360.0, le=360.0, description="Sky: the sun's, degrees")
    sun_elevation: float = Field(35.0, ge=5.0, le=85.0, description="Sky: the sun's, degrees")
    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        # So few have to be wider, or they leave dark between them.
        "test": {"lights": 6, "least_sharpness": 3.0},
    }


def _flux_error(version: StoredVersion) -> float:
    from pipelines.ssdf_lighting.light.fit_quality import flux_error

    return flux_error(lights_of(version.dataset), version.dataset["radiance"].values)


def _shadowed_error(version: StoredVersion) -> float:
    from pipelines.ssdf_lighting.light.fit_quality import fit_errors

    radiance = version.dataset["radiance"].values
    return fit_errors(lights_of(version.dataset), radiance).shadowed_error


def _tone_error(version: StoredVersion) -> float:
    return float(version.dataset["tone_error"])


def _share_from_above(version: StoredVersion) -> float:
    from pipelines.light.environment_maps import solid_angles

    radiance = version.dataset["radiance"].values
    flux = radiance.sum(axis=(1, 2)) * solid_angles(len(radiance))
    return float(flux[: len(flux) // 2].sum() / flux.sum())


def _light_pictures(dataset: xr.Dataset) -> Pictures:
    import numpy as np

    from pipelines.drawing.colour import auto_exposure, to_8bit
    from pipelines.light.environment_maps import texel_directions
    from pipelines.ssdf_lighting.light.sphere_maps import downsampled
    from pipelines.ssdf_lighting.light.spherical_gaussians import evaluate

    radiance = downsampled(dataset["radiance"].values, _SHOWN)
    again = evaluate(lights_of(dataset), texel_directions(_SHOWN))
    scale = auto_exposure(radiance)
    both = np.vstack([to_8bit(part * scale) for part in (radiance, again)])
    return {"environment-above-lights": both.repeat(2, axis=0).repeat(2, axis=1)}


@SSDF.asset(
    schemas.ENVIRONMENT_LIGHTS,
    by=("environment",),
    settings=LightSettings,
    from_source=True,
    pictures=_light_pictures,
    checks=(
        Check(
            "flux_error",
            "Largest relative error, over the channels, of the radiance's integral.",
            _flux_error,
            at_most=1e-3,
        ),
        Check(
            "shadowed_error",
            "Relative RMS error of the irradiance behind random occluders.",
            _shadowed_error,
            at_most=0.08,
            change=0.005,
        ),
        Check(
            "tone_error",
            "Relative RMS error of log(1 + L / mean).",
            _tone_error,
            at_most=1.0,
            change=0.02,
        ),
        Check(
            "share_from_above",
            "Share of the flux from above the horizon: little where the sky lies below.",
            _share_from_above,
            at_least=0.02,  # a room may be lit from its floor
            change=0.02,
        ),
    ),
)
def environment_lights(settings: LightSettings, source: Source, progress: Progress) -> Result:
    """Fit spherical Gaussians to the environment."""
    from pipelines.ssdf_lighting.light.environment_fit import fit_lights
    from pipelines.ssdf_lighting.light.fit_quality import flux_error
    from pipelines.ssdf_lighting.light.sphere_maps import downsampled

    light = _light(settings, source)
    kept = downsampled(light.radiance, min(len(light.radiance), _STORED))
    fit = fit_lights(
        light.radiance,
        settings.lights,
        least_sharpness=settings.least_sharpness,
        most_sharpness=settings.most_sharpness,
        progress=progress,
    )
    dataset = lights_dataset(kept, fit, flux_error(fit.lights, kept), source.name)
    return dataset, {
        "sharpest λ": float(fit.lights.sharpness.max()),
        "shadowed error": fit.errors.shadowed_error,
        NOTES: light.notes,
    }


def _light(settings: LightSettings, source: Source) -> EnvironmentFile:
    """The environment. Raises BadInput for a file that holds none."""
    from pipelines.light.built_in_environments import lamps, sky, uniform
    from pipelines.light.room import room
    from storage.readers.environments import EnvironmentFile, read_environment

    if source.path is not None:
        return read_environment(source.path)
    if source.key == "room":
        made = room(_STORED)  # it is looked at
    elif source.key == "sky":
        made = sky(_HEIGHT, sun_azimuth=settings.sun_azimuth, sun_elevation=settings.sun_elevation)
    else:
        made = lamps(_HEIGHT) if source.key == "lamps" else uniform(8)
    return EnvironmentFile(made, ())
