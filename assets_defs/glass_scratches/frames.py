"""What the scratched glass looks like: `glass_object`, `glass_frames`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field, field_validator

from assets_defs.checks import Check
from assets_defs.glass_scratches.declaration import ENVIRONMENTS, SCRATCHES
from assets_defs.settings import Preset, Settings, UserFile
from assets_defs.sources import Source
from assets_defs.system import NOTES, Pictures, Progress, Result
from storage.schemas import glass_scratches as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.geometry.solids import Solid
    from pipelines.glass_scratches.drawing.frames import GlassFrames
    from storage.readers.environments import EnvironmentFile


# ---- glass_object ----------------------------------------------------------------------------


class ObjectSettings(Settings):
    """The glass."""

    segments: int = Field(14, ge=4, le=64, description="Teapot: segments of a patch's edge")
    thickness: float = Field(
        0.05, ge=0.005, le=0.08, description="Thickness of the plate and of the teapot's wall"
    )
    up: Literal["auto", "y", "z"] = Field(
        "auto", description="Your mesh's upward axis; auto: y for glTF, which says so, else z"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"segments": 6},
        "paper": {"segments": 24},
    }


def _edge_error(version: StoredVersion) -> float:
    from pipelines.glass_scratches.figures import edge_error

    return edge_error(version.dataset["triangles"].values)


def _volume(version: StoredVersion) -> float:
    return float(version.dataset["volume"])


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
    from assets_defs.glass_scratches.datasets import solid_dataset
    from pipelines.geometry.solid_shapes import glass_teapot, plate

    notes: tuple[str, ...] = ()
    if source.path is not None:
        solid, notes = _solid_of_file(source.path, settings.up)
    elif source.key == "teapot":
        solid = glass_teapot(settings.segments, settings.thickness)
    else:
        solid = plate(1.5, 1.1, settings.thickness)
    dataset = solid_dataset(solid, source.name)
    shown = {"vertices": len(solid.vertices), "triangles": len(solid.triangles), NOTES: notes}
    return dataset, shown


def _solid_of_file(path: Path, up: str) -> tuple[Solid, tuple[str, ...]]:
    """A closed mesh around the origin, of radius 1, and what was mended, a sentence each."""
    import numpy as np

    from pipelines.geometry.meshes import y_up_to_z_up
    from pipelines.geometry.solids import make_closed_mesh, smooth_solid
    from storage.readers.gltf import SUFFIXES
    from storage.readers.meshes import read_mesh

    vertices, triangles, _, notes = read_mesh(path)
    if up == "y" or (up == "auto" and path.suffix.lower() in SUFFIXES):
        vertices = y_up_to_z_up(vertices)
    vertices = vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    vertices /= np.linalg.norm(vertices, axis=1).max()
    closed = make_closed_mesh(vertices, triangles)
    return smooth_solid(closed), (*notes, *closed.notes)


# ---- glass_frames ----------------------------------------------------------------------------


class FrameSettings(Settings):
    """The pictures and their light."""

    size: int = Field(180, ge=32, le=4096, description="Height and width of the pictures, pixels")
    samples: int = Field(16, ge=2, le=65_536, description="Light paths a pixel")
    environment: Annotated[str, UserFile] = Field(
        "room", description="room, lamps, sky, uniform, or an equirectangular .hdr or .exr file"
    )
    light_rows: int = Field(
        1024, ge=16, le=1024, multiple_of=2, description="Rows of a built-in environment, texels"
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
        "test": {"size": 48, "samples": 8, "lights": 2, "moving_size": 48, "light_rows": 128},
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


def _read_environment(name: str) -> EnvironmentFile:
    from storage.readers.environments import read_environment

    if not Path(name).suffix:
        raise ValueError(
            f"environment is {name!r}; expected {', '.join(ENVIRONMENTS)}, or an .hdr or .exr file."
        )
    return read_environment(name)


def environment(settings: FrameSettings) -> EnvironmentFile:
    """The environment's radiance (H, 2 H, 3), turned, and what was done to a user's file.

    Raises as `check_environment_setting`.
    """
    from pipelines.light import built_in_environments
    from pipelines.light.environment_maps import rotate_environment
    from pipelines.light.room import room
    from storage.readers.environments import EnvironmentFile

    height = settings.light_rows
    notes: tuple[str, ...] = ()
    if settings.environment == "room":
        radiance = room(height)
    elif settings.environment == "lamps":
        radiance = built_in_environments.lamps(height)
    elif settings.environment == "sky":
        radiance = built_in_environments.sky(height, sun_azimuth=-115.0, sun_elevation=38.0)
    elif settings.environment == "uniform":
        radiance = built_in_environments.uniform(8)
    else:
        radiance, notes = _read_environment(settings.environment)
    return EnvironmentFile(rotate_environment(radiance, settings.turn), notes)


def _frame_pictures(dataset: xr.Dataset) -> Pictures:
    import numpy as np

    from pipelines.glass_scratches.drawing.pictures import furnace_picture

    pairs = zip(dataset["frames"].values, dataset["stage"].values, strict=True)
    return {
        "frames": np.hstack(list(dataset["frames"].values)),
        "noise-beside-clean": np.hstack(
            [np.vstack(list(part)) for part in (_noisy(dataset), dataset["frames"].values)]
        ),
        "traced-beside-stage": np.vstack([np.hstack(pair) for pair in pairs]),
        "furnace": furnace_picture(dataset["furnace"].values),
    }


def _noisy(dataset: xr.Dataset) -> NDArray[np.uint8]:
    """Both views as they were traced."""
    from pipelines.drawing.colour import to_8bit

    return to_8bit(dataset["radiance"].values * float(dataset["exposure"]))


def _figures(frames: GlassFrames, dataset: xr.Dataset) -> dict[str, float]:
    noise = float(dataset["error"].values[1].mean())
    return {"rays": frames.far.rays + frames.close.rays, "noise, close": noise}


def _not_finite(version: StoredVersion) -> float:
    from pipelines.glass_scratches.figures import impossible_share

    return impossible_share(version.dataset["radiance"].values)


def _furnace_excess(version: StoredVersion) -> float:
    from pipelines.glass_scratches.figures import brightest_excess

    dataset = version.dataset
    return brightest_excess(dataset["furnace"].values, dataset["furnace_error"].values)


def _furnace_loss(version: StoredVersion) -> float:
    return float(1 - version.dataset["furnace"].values.mean())


def _mean_brightness(version: StoredVersion) -> float:
    return float(version.dataset["frames"].values.mean() / 255.0)


def _darker_view(version: StoredVersion) -> float:
    return float(version.dataset["frames"].values.mean(axis=(1, 2, 3)).min() / 255.0)


def _denoised_change(version: StoredVersion) -> float:
    from pipelines.glass_scratches.figures import denoised_change

    return denoised_change(version.dataset["clean"].values, version.dataset["radiance"].values)


def _stage_flip(version: StoredVersion) -> float:
    from pipelines.glass_scratches.figures import stage_flip

    return stage_flip(version.dataset["frames"].values, version.dataset["stage"].values)


def _scratched_share(version: StoredVersion) -> float:
    return float(version.dataset["scratched"].values[1].mean())


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
            "Mean of all pictures' 8-bit codes, in [0, 1].",
            _mean_brightness,
            at_least=0.25,
            at_most=0.85,
            change=0.02,
        ),
        Check(
            "darker_view",
            "Mean of the darker view's 8-bit codes, in [0, 1]: no picture is black.",
            _darker_view,
            at_least=0.15,
            change=0.02,
        ),
        Check(
            "denoised_change",
            "Relative change of a view's mean radiance by the denoiser, the larger.",
            _denoised_change,
            at_most=0.2,  # two paths a pixel find some of the light only by chance
        ),
        Check(
            "stage_flip",
            "FLIP of the stage's pictures against traced and denoised ones, mean of whole frames.",
            _stage_flip,
            at_most=0.25,
            change=0.03,
        ),
    ),
)
def glass_frames(
    settings: FrameSettings,
    progress: Progress,
    scratch_table_2d: xr.Dataset,
    scratch_table: xr.Dataset,
    scratch_layers: xr.Dataset,
    glass_object: xr.Dataset,
) -> Result:
    """Trace the far and the close view, denoise them, draw the same on the stage, and let the light
    go around."""
    from assets_defs.glass_scratches.datasets import frames_dataset, material_of, solid_of
    from pipelines.glass_scratches.drawing.frames import draw_frames
    from pipelines.glass_scratches.scratched_glass import scratched_glass
    from pipelines.light.environment_sampling import make_environment_sampler

    material = material_of(scratch_table_2d, scratch_table, scratch_layers)
    glass = scratched_glass(solid_of(glass_object), material, tile=settings.tile)
    light = environment(settings)
    frames = draw_frames(
        glass,
        make_environment_sampler(light.radiance),
        size=settings.size,
        samples=settings.samples,
        lights=settings.lights,
        moving_size=settings.moving_size,
        seed=settings.frame_seed,
        progress=progress,
    )
    dataset = frames_dataset(frames, light.radiance)
    return dataset, {**_figures(frames, dataset), NOTES: light.notes}
