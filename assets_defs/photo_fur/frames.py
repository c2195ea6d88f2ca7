"""Pictures of the fur on the mesh: `fur_frames`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.photo_fur.datasets import (
    frames_dataset,
    laid_fur_of,
    photograph_of,
    shell_mesh_of,
)
from assets_defs.photo_fur.declaration import FUR, SQUARE
from assets_defs.settings import Preset, Settings
from assets_defs.system import Pictures, Progress, Result
from pipelines.photo_fur import figures
from pipelines.photo_fur.attenuation import Tails
from pipelines.photo_fur.stage_view import Fill, Look
from storage.schemas import photo_fur as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr

    from pipelines.photo_fur.frames import Frames, View
    from pipelines.photo_fur.laid_fur import LaidFur
    from pipelines.photo_fur.photograph import FurPhotograph
    from pipelines.photo_fur.shells import ShellMesh


class FrameSettings(Settings):
    """How the pictures are taken."""

    width: int = Field(
        640,
        ge=32,
        le=4096,
        description="Pixels across, 4:3; the square's pictures go by the photograph's size",
    )
    supersampling: int = Field(2, ge=1, le=8, description="Samples along each side of a pixel")
    look: Look = Field(
        "full",
        description="Full: patches along the lie, light on hairs; plain: shells by texture "
        "coordinates, as in the paper. The square is always plain",
    )
    tails: Tails = "end layers"
    fill: Fill = Field(
        "columns", description="Plain: layers show whole hairs (columns) or, as in the paper, bands"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"width": 96, "supersampling": 1},
        "paper": {"width": 1280, "supersampling": 3},
    }


def _pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.drawing.contact_sheet import contact_sheet

    return {"frames": contact_sheet(dataset["frames"].values)}


def _aslant_rmse(version: StoredVersion) -> float | None:
    """None of anything but the square."""
    from pipelines.photo_fur.ray_cast import Square, aslant_rmse, cast_square

    mesh_key, _ = version.slot.partition.split(".")
    if mesh_key != SQUARE:
        return None
    from pipelines.photo_fur.frames import SQUARE_VIEWS, stretched, view_cameras

    photograph = photograph_of(version.input("fur_photo"), version.input("attenuation"))
    settings, picture = version.record["settings"], version.dataset["frames"].values[-1]
    (rows, columns), (height, width) = photograph.luminance.shape, picture.shape[:2]
    mesh = stretched(shell_mesh_of(version.input("shell_mesh")), columns / rows)
    camera = view_cameras(SQUARE_VIEWS, mesh.vertices.reshape(-1, 3), width / height)[-1]
    square = Square(photograph, mesh, settings["fill"], settings["tails"])
    cast = cast_square(square, camera, (height, width), settings["supersampling"])
    return aslant_rmse(picture, cast)


def _least_coverage(version: StoredVersion) -> float:
    return float(version.dataset["coverage"].min())


def _mean_brightness(version: StoredVersion) -> float:
    import numpy as np

    from pipelines.drawing.colour import to_8bit
    from pipelines.photo_fur.frames import BACKGROUND

    background = to_8bit(np.array(BACKGROUND))
    return figures.mean_brightness(version.dataset["frames"].values, background)


@FUR.asset(
    schemas.FUR_FRAMES,
    by=("photo", "mesh"),
    settings=FrameSettings,
    inputs=("fur_photo", "attenuation", "shell_mesh", "lie_field", "fur_patches"),
    kinds=frozenset({"zarr", "pyvista"}),
    pictures=_pictures,
    checks=(
        Check(
            "aslant_rmse",
            "RMSE in [0, 1] between the square from aside and the same by a ray caster of its own; "
            "with shuffled depths 0.02 to 0.1.",
            _aslant_rmse,
            at_most=0.005,
            change=0.001,
        ),
        Check(
            "least_coverage",
            "Share of the picture with fur, in the view that has least: nothing drawn is 0.",
            _least_coverage,
            at_least=0.02,
            change=0.01,
        ),
        Check(
            "mean_brightness",
            "Mean of the fur's 8-bit codes in all pictures, without the background, in [0, 1].",
            _mean_brightness,
            at_least=0.02,
            at_most=0.98,
            change=0.01,
        ),
    ),
)
def fur_frames(
    settings: FrameSettings,
    keys: Mapping[str, str],
    progress: Progress,
    fur_photo: xr.Dataset,
    attenuation: xr.Dataset,
    shell_mesh: xr.Dataset,
    lie_field: xr.Dataset,
    fur_patches: xr.Dataset,
) -> Result:
    """Draw the fur on the mesh from every view."""
    photograph = photograph_of(fur_photo, attenuation)
    if settings.look == "full" and keys["mesh"] != SQUARE:
        laid = laid_fur_of(shell_mesh, lie_field, fur_patches)
        drawn, views = _laid(settings, photograph, laid, progress)
    else:
        mesh = shell_mesh_of(shell_mesh)
        drawn, views = _plain(settings, photograph, mesh, keys["mesh"] == SQUARE, progress)
    return frames_dataset(drawn, views), {"views": len(views)}


def _laid(
    settings: FrameSettings, photograph: FurPhotograph, fur: LaidFur, progress: Progress
) -> tuple[Frames, Sequence[View]]:
    from pipelines.photo_fur.frames import ROUND_VIEWS, draw_laid_frames

    size = settings.width * 3 // 4, settings.width
    drawn = draw_laid_frames(
        photograph, fur, ROUND_VIEWS, size, settings.supersampling, settings.tails, progress
    )
    return drawn, ROUND_VIEWS


def _plain(
    settings: FrameSettings,
    photograph: FurPhotograph,
    mesh: ShellMesh,
    is_square: bool,
    progress: Progress,
) -> tuple[Frames, Sequence[View]]:
    from pipelines.photo_fur import frames

    views, size = frames.ROUND_VIEWS, (settings.width * 3 // 4, settings.width)
    if is_square:
        height, width = photograph.luminance.shape
        mesh = frames.stretched(mesh, width / height)
        views, size = frames.SQUARE_VIEWS, frames.top_view_size(photograph.luminance.shape)
    drawn = frames.draw_frames(
        photograph,
        mesh,
        views,
        size=size,
        supersampling=settings.supersampling,
        tails=settings.tails,
        fill=settings.fill,
        progress=progress,
    )
    return drawn, views
