"""What the scratched glass looks like: `glass_object`, `glass_frames`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field, field_validator

from assets_defs.checks import Check
from assets_defs.glass_scratches.declaration import ENVIRONMENTS, SCRATCHES
from assets_defs.settings import Preset, Settings, UserFile
from assets_defs.sources import Source
from assets_defs.system import Metadata
from storage.schemas import glass_scratches as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]

_ENVIRONMENT_HEIGHT = 512


# ---- glass_object ----------------------------------------------------------------------------


class ObjectSettings(Settings):
    """The glass."""

    segments: int = Field(14, ge=4, le=64, description="Teapot: segments of a patch's edge")
    thickness: float = Field(
        0.05, ge=0.005, le=0.08, description="Thickness of the plate and of the teapot's wall"
    )
    up: Literal["auto", "y", "z"] = Field(
        "auto", description="Your mesh's upward axis; auto: y for GLB, as glTF has it, else z"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"segments": 6},
        "paper": {"segments": 24},
    }


def _edge_error(checked: StoredVersion) -> float:
    """Share of the edges without exactly two triangles of opposite senses."""
    import numpy as np

    triangles = checked.dataset["triangles"].values.astype(np.int64)
    count = int(triangles.max()) + 1
    one, other = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    return float(1 - np.isin(one * count + other, other * count + one).mean())


def _volume(checked: StoredVersion) -> float:
    return float(checked.dataset["volume"])


@SCRATCHES.asset(
    schemas.GLASS_OBJECT,
    by=("object",),
    settings=ObjectSettings,
    from_source=True,
    checks=(
        Check(
            "edge_error",
            "Share of the triangles' sides without a partner: light would get lost.",
            _edge_error,
            at_most=0.0,
        ),
        Check("volume", "Volume of the glass.", _volume, at_least=1e-6, change=0.02),
    ),
)
def glass_object(settings: ObjectSettings, source: Source) -> Result:
    """Make the plate or the teapot, or close-check, orient and scale a mesh."""
    import numpy as np
    import xarray as xr

    from pipelines.geometry.meshes import y_up_to_z_up
    from pipelines.geometry.solid_shapes import glass_teapot, plate
    from pipelines.geometry.solids import make_solid
    from storage.readers.meshes import read_mesh

    if source.path is not None:
        vertices, triangles, _ = read_mesh(source.path)
        if settings.up == "y" or (settings.up == "auto" and source.path.suffix.lower() == ".glb"):
            vertices = y_up_to_z_up(vertices)
        vertices = vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        vertices /= np.linalg.norm(vertices, axis=1).max()
        solid = make_solid(vertices, triangles)
    elif source.key == "teapot":
        solid = glass_teapot(settings.segments, settings.thickness)
    else:
        solid = plate(1.5, 1.1, settings.thickness)
    a, b, c = np.moveaxis(solid.vertices[solid.triangles], 1, 0)
    dataset = xr.Dataset(
        {
            "vertices": (("vertex", "axis"), solid.vertices),
            "triangles": (("triangle", "corner"), solid.triangles),
            "corner_normals": (("triangle", "corner", "axis"), solid.corner_normals),
            "volume": ((), float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)),
        },
        attrs={"name": source.name},
    )
    return dataset, {"vertices": len(solid.vertices), "triangles": len(solid.triangles)}


# ---- glass_frames ----------------------------------------------------------------------------


class FrameSettings(Settings):
    """The pictures and their light."""

    size: int = Field(180, ge=32, le=4096, description="Height and width of the pictures, pixels")
    samples: int = Field(16, ge=2, le=65_536, description="Light paths a pixel")
    environment: Annotated[str, UserFile] = Field(
        "lamps", description="lamps, sky, uniform, or an equirectangular .hdr or .exr file"
    )
    turn: float = Field(
        0.0,
        ge=-360.0,
        le=360.0,
        description="Turn of the environment about up, degrees",
    )
    tile: float = Field(
        1.0, gt=0.0, le=1000.0, description="Side of a tile of scratches; the object's radius is 1"
    )
    lights: int = Field(6, ge=1, le=720, description="Pictures of the moving light")
    moving_size: int = Field(160, ge=32, le=2048, description="Their height and width, pixels")
    frame_seed: int = Field(0, ge=0, description="Seed of the paths")

    @field_validator("environment")
    @classmethod
    def _found_again(cls, value: str) -> str:
        """A file's whole path: a nightly run starts from elsewhere."""
        return str(Path(value).resolve()) if Path(value).is_file() else value

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"size": 48, "samples": 8, "lights": 2, "moving_size": 48},
        "paper": {"size": 512, "samples": 64, "lights": 24, "moving_size": 320},
    }


@SCRATCHES.before_work
def _environment_exists(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    shown = settings.get("glass_frames")
    if isinstance(shown, FrameSettings):
        check_environment_setting(shown)


def check_environment_setting(settings: FrameSettings) -> None:
    """Raises ValueError, BadInput for what names no environment."""
    if settings.environment not in ENVIRONMENTS:
        _read_environment(settings.environment)


def _read_environment(name: str) -> NDArray[np.float32]:
    from storage.readers.environments import read_environment

    if not Path(name).suffix:
        raise ValueError(
            f"environment is {name!r}; expected {', '.join(ENVIRONMENTS)}, or an .hdr or .exr file."
        )
    return read_environment(name)


def environment(settings: FrameSettings) -> NDArray[np.float32]:
    """The environment's radiance (H, 2 H, 3), turned. Raises as `check_environment_setting`."""
    from pipelines.light import built_in_environments
    from pipelines.light.environment_maps import rotate_environment

    height = _ENVIRONMENT_HEIGHT
    if settings.environment == "lamps":
        radiance = built_in_environments.lamps(height)
    elif settings.environment == "sky":
        radiance = built_in_environments.sky(height, sun_azimuth=-115.0, sun_elevation=38.0)
    elif settings.environment == "uniform":
        radiance = built_in_environments.uniform(8)
    else:
        radiance = _read_environment(settings.environment)
    return rotate_environment(radiance, settings.turn)


def _frame_pictures(dataset: xr.Dataset) -> Pictures:
    import numpy as np

    from pipelines.glass_scratches.drawing.pictures import furnace_picture

    pairs = zip(dataset["frames"].values, dataset["stage"].values, strict=True)
    return {
        "frames": np.hstack(list(dataset["frames"].values)),
        "traced-beside-stage": np.vstack([np.hstack(pair) for pair in pairs]),
        "furnace": furnace_picture(dataset["furnace"].values),
    }


def _not_finite(checked: StoredVersion) -> float:
    import numpy as np

    radiance = checked.dataset["radiance"].values
    return float(np.mean(~np.isfinite(radiance) | (radiance < 0)))


def _furnace_excess(checked: StoredVersion) -> float:
    from pipelines.glass_scratches.figures import brightest_excess

    dataset = checked.dataset
    return brightest_excess(dataset["furnace"].values, dataset["furnace_error"].values)


def _furnace_loss(checked: StoredVersion) -> float:
    return float(1 - checked.dataset["furnace"].values.mean())


def _mean_brightness(checked: StoredVersion) -> float:
    return float(checked.dataset["frames"].values.mean() / 255.0)


def _stage_brightness(checked: StoredVersion) -> float:
    """Mean of the stage's pictures over that of the traced ones."""
    dataset = checked.dataset
    return float(dataset["stage"].values.mean() / dataset["frames"].values.mean())


def _scratched_share(checked: StoredVersion) -> float:
    return float(checked.dataset["scratched"].values[1].mean())


@SCRATCHES.asset(
    schemas.GLASS_FRAMES,
    by=("setting", "object"),
    settings=FrameSettings,
    inputs=("scratch_table_2d", "scratch_table", "scratch_layers", "glass_object"),
    kinds=frozenset({"zarr", "pyvista"}),
    pictures=_frame_pictures,
    checks=(
        Check(
            "not_finite",
            "Share of the radiance that is not finite, or negative.",
            _not_finite,
            at_most=0.0,
        ),
        Check(
            "furnace_excess",
            "In an environment of radiance 1: the brightest 8 x 8 pixels above 1, standard errors.",
            _furnace_excess,
            at_most=5.0,
        ),
        Check(
            "furnace_loss",
            "In an environment of radiance 1: what is missing to 1, mean of the picture.",
            _furnace_loss,
            at_most=0.05,
            change=0.005,
        ),
        Check(
            "scratched_share",
            "Share of the close view's paths that met a scratch.",
            _scratched_share,
            at_least=0.002,
            change=0.02,
        ),
        Check(
            "mean_brightness",
            "Mean of all traced pictures' 8-bit codes, in [0, 1].",
            _mean_brightness,
            at_least=0.02,
            at_most=0.95,
            change=0.02,
        ),
        Check(
            "stage_brightness",
            "Mean of the stage's pictures over that of the traced ones.",
            _stage_brightness,
            at_least=0.3,
            at_most=2.0,
            change=0.05,
        ),
    ),
)
def glass_frames(
    settings: FrameSettings,
    progress: Callable[[float], None],
    scratch_table_2d: xr.Dataset,
    scratch_table: xr.Dataset,
    scratch_layers: xr.Dataset,
    glass_object: xr.Dataset,
) -> Result:
    """Trace the far and the close view, draw the same on the stage, and let the light go around."""
    import numpy as np
    import xarray as xr

    from assets_defs.glass_scratches.layers import layers_of
    from pipelines.drawing.colour import to_8bit
    from pipelines.geometry.solids import Solid
    from pipelines.glass_scratches.drawing.frames import (
        exposure,
        furnace,
        moving_light,
        trace_frames,
    )
    from pipelines.glass_scratches.drawing.path_tracing import make_surface
    from pipelines.glass_scratches.drawing.stage_view import ScratchedActor
    from pipelines.glass_scratches.layers.scratch_layers import layer_arrays
    from pipelines.glass_scratches.tables.sampling import lobe_of
    from pipelines.glass_scratches.tables.scratch_table import Lean
    from pipelines.light.environment_sampling import make_environment_sampler

    solid = Solid(
        glass_object["vertices"].values,
        glass_object["triangles"].values,
        glass_object["corner_normals"].values,
    )
    index = float(scratch_table["index"])
    coverage = scratch_layers["coverage"].values
    lean = Lean(scratch_table["factor"].values, scratch_table["gamma"].values)
    surface = make_surface(
        layer_arrays(layers_of(scratch_layers)),
        coverage,
        lobe_of(
            scratch_table_2d["across"].values,
            scratch_table["cdf"].values,
            scratch_table["share"].values,
            scratch_table_2d.attrs["roughness"],
        ),
        lean,
        roughness=scratch_table_2d.attrs["roughness"],
        tile=settings.tile,
        index=index,
    )
    actor = ScratchedActor(
        solid,
        coverage,
        scratch_layers["angle"].values,
        scratch_table_2d["rho"].values,
        lean,
        index=index,
        tile=settings.tile,
    )
    light = make_environment_sampler(environment(settings))
    views = trace_frames(
        solid,
        surface,
        actor,
        light,
        size=settings.size,
        samples=settings.samples,
        seed=settings.frame_seed,
        progress=lambda fraction: progress(0.8 * fraction),
    )
    moving = moving_light(
        solid,
        actor,
        light,
        count=settings.lights,
        size=settings.moving_size,
        progress=lambda fraction: progress(0.8 + 0.15 * fraction),
    )
    white = furnace(solid, surface, settings.frame_seed)
    traced = (views.far, views.close)
    radiance = np.stack([picture.radiance for picture in traced])
    scale = exposure(light)
    pixels = ("view", "y", "x")
    furnace_pixels = ("furnace_row", "furnace_column")
    dataset = xr.Dataset(
        {
            "radiance": ((*pixels, "channel"), radiance),
            "error": (pixels, np.sqrt(np.stack([picture.variance for picture in traced]))),
            "scratched": (pixels, np.stack([picture.scratched for picture in traced])),
            "frames": ((*pixels, "channel"), to_8bit(radiance * scale)),
            "stage": ((*pixels, "channel"), to_8bit(views.stage * scale)),
            "moving": (("light", "row", "column", "channel"), moving),
            "exposure": ((), scale),
            "furnace": (furnace_pixels, white.radiance.mean(axis=2)),
            "furnace_error": (furnace_pixels, np.sqrt(white.variance)),
        }
    )
    rays = sum(picture.rays for picture in traced)
    return dataset, {"rays": rays, "noise, close": float(dataset["error"].values[1].mean())}
