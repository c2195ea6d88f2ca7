"""Where the scratches lie: `scratch_layers`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.glass_scratches.declaration import SCRATCHES
from assets_defs.glass_scratches.photograph_files import is_photograph
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.system import Pictures, Result
from storage.schemas import glass_scratches as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr

    from pipelines.glass_scratches.layers.settings import LayerSpec
    from pipelines.glass_scratches.photograph.figures import Likeness

_STAGE_SIZE = 256
MAP_SAMPLES = 16
"""Points of a texel that tell its coverage."""


class LayerSettings(Settings):
    """The scratches of a tile, the square that repeats over the object."""

    length: float = Field(0.3, gt=0.0, le=1.0, description="Length of a cell, tiles (table 1)")
    width: float = Field(0.001, gt=0.0, le=1.0, description="Width of a cell, tiles (table 1)")
    threshold: float = Field(
        0.1, gt=0.0, le=0.5, description="Cell noise below this is scratch; more is more scratches"
    )
    coverage: float | None = Field(
        None, gt=0.0, le=0.6, description="Share of the area that each layer covers; overrides it"
    )
    layers: int = Field(4, ge=1, le=8, description="Layers, each with its own direction")
    curvature: float = Field(0.0, ge=0.0, le=1.5, description="Turn from end to end, radians")
    digs: float = Field(0.0, ge=0.0, le=1.0, description="Share of the scratches that are pits")
    fading: float = Field(0.0, ge=0.0, le=1.0, description="How far scratches fade along them")
    breaks: float = Field(0.0, ge=0.0, lt=1.0, description="Share of their length that is missing")
    spread: float = Field(0.0, ge=0.0, le=1.5, description="Spread of length, width, depth (log)")
    resolution: int = Field(512, ge=16, le=8192, description="Texels of the maps, a power of two")
    layer_seed: int = Field(3, ge=0, description="Seed of the scratches")

    @classmethod
    def preset(cls, name: Preset, keys: Mapping[str, str]) -> Self:
        """Table 1's settings, and one that the paper leaves open."""
        looks: dict[str, Any] = {
            "setting-2": {"length": 0.6, "width": 0.01},
            "ground": {"length": 0.6, "width": 0.01},
            "clear": {"length": 0.6, "width": 0.01},
            "worn": {
                "length": 0.5,
                "width": 0.005,
                "coverage": 0.012,
                "layers": 6,
                "curvature": 0.5,
                "digs": 0.08,
                "fading": 0.7,
                "breaks": 0.3,
                "spread": 0.8,
            },
        }
        sizes = {"test": {"resolution": 128}, "paper": {"resolution": 2048}}
        return cls(**looks.get(keys["setting"], {}), **sizes.get(name, {}))


@SCRATCHES.before_work
def _layers_can_be(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    scattered = settings.get("scratch_layers")
    if isinstance(scattered, LayerSettings):
        layer_spec(scattered).validate()
        source = sources.get("setting")
        if source is not None and is_photograph(source):
            _check_unset(source, scattered)


def _check_unset(source: Source, settings: LayerSettings) -> None:
    """Raise ValueError for a look that is set where the photograph tells it."""
    usual = LayerSettings()
    for name in LayerSettings.model_fields.keys() - {"resolution", "layer_seed"}:
        if getattr(settings, name) != getattr(usual, name):
            raise ValueError(
                f"{source.name}: {name} is set to {getattr(settings, name)}; expected no such "
                "setting, for the photograph tells it. Leave it out."
            )


def layer_spec(settings: LayerSettings) -> LayerSpec:
    """The settings as the type of `pipelines`. Raises ValueError for a resolution that is no power
    of two."""
    from pipelines.glass_scratches.layers.settings import LayerSpec

    if settings.resolution & (settings.resolution - 1):
        raise ValueError(f"resolution is {settings.resolution}; expected a power of two.")
    chosen = settings.model_dump(exclude={"resolution", "layer_seed"})
    return LayerSpec(**chosen)


def _layer_pictures(dataset: xr.Dataset) -> Pictures:
    import numpy as np

    from pipelines.glass_scratches.layers.pictures import layers_picture

    stages = np.hstack(list(dataset["stages"].values))
    return {
        "stages": np.repeat(stages[..., None], 3, axis=2),
        "layers": layers_picture(dataset["coverage"].values, dataset["angle"].values),
    }


def _coverage_error(version: StoredVersion) -> float | None:
    """None of a photograph's: its layers have no setting."""
    from pipelines.glass_scratches.figures import coverage_error

    if version.input("scratch_photo").sizes["layer"]:
        return None
    settings = LayerSettings(**version.record["settings"])
    return coverage_error(version.dataset["coverage"].values, layer_spec(settings))


def _likeness(version: StoredVersion) -> Likeness | None:
    """None where there is no photograph."""
    from assets_defs.glass_scratches.datasets import photograph_scratches_of
    from pipelines.glass_scratches.photograph.figures import photograph_likeness

    scratches = photograph_scratches_of(version.input("scratch_photo"))
    if scratches is None:
        return None
    return photograph_likeness(scratches, version.dataset["coverage"].values)


def _photo_direction_error(version: StoredVersion) -> float | None:
    likeness = _likeness(version)
    return None if likeness is None else likeness.direction_error


def _photo_coverage_ratio(version: StoredVersion) -> float | None:
    likeness = _likeness(version)
    return None if likeness is None else likeness.coverage_ratio


def _map_z(version: StoredVersion) -> float:
    from assets_defs.glass_scratches.datasets import layers_of
    from pipelines.glass_scratches.figures import coverage_map_z

    dataset = version.dataset
    return coverage_map_z(dataset["coverage"].values, layers_of(dataset), MAP_SAMPLES)


@SCRATCHES.asset(
    schemas.SCRATCH_LAYERS,
    by=("setting",),
    settings=LayerSettings,
    inputs=("scratch_photo",),
    pictures=_layer_pictures,
    checks=(
        Check(
            "coverage_error",
            "Relative difference of the layers' coverage from what was asked for, mean of layers.",
            _coverage_error,
            at_most=0.35,
            change=0.01,
        ),
        Check(
            "map_z",
            "RMS z-score of the maps' means over blocks against the scratches sampled anew.",
            _map_z,
            at_most=2.0,
        ),
        Check(
            "photo_direction_error",
            "Degrees that scratches found in a picture of the layers are turned against the "
            "photograph's, on average (earth mover's distance).",
            _photo_direction_error,
            at_most=10.0,
        ),
        Check(
            "photo_coverage_ratio",
            "Area times contrast of scratches found in a picture of the layers, over the "
            "photograph's.",
            _photo_coverage_ratio,
            at_least=0.6,
            at_most=1.6,
        ),
    ),
)
def scratch_layers(settings: LayerSettings, scratch_photo: xr.Dataset) -> Result:
    """Scatter the scratches, of the settings or like a photograph's, and map their coverage."""
    from assets_defs.glass_scratches.datasets import layers_dataset, photograph_scratches_of
    from pipelines.glass_scratches.layers.coverage import coverage_maps
    from pipelines.glass_scratches.layers.pictures import layer_stages
    from pipelines.glass_scratches.layers.scratch_layers import make_layers
    from pipelines.glass_scratches.photograph.photograph_layers import layers_like

    spec, seed = layer_spec(settings), settings.layer_seed
    scratches = photograph_scratches_of(scratch_photo)
    layers = make_layers(spec, seed) if scratches is None else layers_like(scratches, seed)
    maps = coverage_maps(layers, settings.resolution, MAP_SAMPLES)
    dataset = layers_dataset(layers, maps, layer_stages(spec, seed, _STAGE_SIZE))
    return dataset, {
        "scratches": len(layers.features.layer),
        "bytes of the scratches": layers.angle.nbytes + sum(f.nbytes for f in layers.features),
        "coverage of a layer, mean": float(maps.mean()),
    }
