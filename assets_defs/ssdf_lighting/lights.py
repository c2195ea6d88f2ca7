"""What lights: `environment_lights`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.ssdf_lighting.declaration import SSDF
from assets_defs.system import Metadata
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.ssdf_lighting.light.spherical_gaussians import Lights

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]

_HEIGHT = 256
"""Rows of the built-in environments."""
_STORED = 64
"""Rows of the environment that is kept beside its lights."""


class LightSettings(Settings):
    """The environment, and how closely its lights follow it."""

    lights: int = Field(16, ge=1, le=24, description="Spherical Gaussians of an environment, N")
    least_sharpness: float = Field(3.0, gt=0.0, le=100.0, description="Least λ of a light")
    most_sharpness: float = Field(300.0, ge=100.0, le=1e4, description="Largest λ of a light")
    sun_azimuth: float = Field(25.0, ge=-360.0, le=360.0, description="Sky: the sun's, degrees")
    sun_elevation: float = Field(35.0, ge=5.0, le=85.0, description="Sky: the sun's, degrees")
    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"lights": 6},
    }


def lights_of(environment_lights: xr.Dataset) -> Lights:
    """The lights of an `environment_lights` dataset."""
    from pipelines.ssdf_lighting.light.spherical_gaussians import Lights

    names = ("axes", "sharpness", "amplitudes")
    return Lights(*(environment_lights[name].values for name in names))


def _flux_error(checked: StoredVersion) -> float:
    from pipelines.ssdf_lighting.light.environment_fit import flux_error

    return flux_error(lights_of(checked.dataset), checked.dataset["radiance"].values)


def _irradiance_error(checked: StoredVersion) -> float:
    from pipelines.ssdf_lighting.light.environment_fit import judged

    dataset = checked.dataset
    return judged(lights_of(dataset), dataset["radiance"].values).irradiance_error


def _tone_error(checked: StoredVersion) -> float:
    return float(checked.dataset["tone_error"])


def _light_pictures(dataset: xr.Dataset) -> Pictures:
    import numpy as np

    from pipelines.drawing.colour import exposure, to_8bit
    from pipelines.light.environment_maps import texel_directions
    from pipelines.ssdf_lighting.light.spherical_gaussians import evaluate

    radiance = dataset["radiance"].values
    again = evaluate(lights_of(dataset), texel_directions(len(radiance)))
    scale = exposure(radiance)
    times = max(1, 512 // radiance.shape[1])
    both = np.vstack([to_8bit(part * scale) for part in (radiance, again)])
    return {"environment-above-lights": both.repeat(times, axis=0).repeat(times, axis=1)}


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
            "irradiance_error",
            "Relative RMS error of the irradiance over all normals.",
            _irradiance_error,
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
    ),
)
def environment_lights(
    settings: LightSettings, source: Source, progress: Callable[[float], None]
) -> Result:
    """Fit spherical Gaussians to the environment."""
    import xarray as xr

    from pipelines.light import built_in_environments
    from pipelines.ssdf_lighting.light.environment_fit import averaged, fit_lights, flux_error
    from storage.readers.environments import read_environment

    if source.path is not None:
        radiance = read_environment(source.path)
    elif source.key == "sky":
        radiance = built_in_environments.sky(
            _HEIGHT, sun_azimuth=settings.sun_azimuth, sun_elevation=settings.sun_elevation
        )
    elif source.key == "lamps":
        radiance = built_in_environments.lamps(_HEIGHT)
    else:
        radiance = built_in_environments.uniform(8)
    small = averaged(radiance, _STORED)
    found = fit_lights(
        small,
        settings.lights,
        least_sharpness=settings.least_sharpness,
        most_sharpness=settings.most_sharpness,
        progress=progress,
    )
    dataset = xr.Dataset(
        {
            "radiance": (("row", "column", "channel"), small.astype("float32")),
            "axes": (("light", "axis"), found.lights.axes),
            "sharpness": (("light",), found.lights.sharpness),
            "amplitudes": (("light", "channel"), found.lights.amplitudes),
            "error": ((), found.error),
            "tone_error": ((), found.tone_error),
            "irradiance_error": ((), found.irradiance_error),
            "flux_error": ((), flux_error(found.lights, small)),
        },
        attrs={"name": source.name},
    )
    return dataset, {
        "sharpest λ": float(found.lights.sharpness.max()),
        "irradiance error": found.irradiance_error,
    }
