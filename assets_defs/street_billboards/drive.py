"""What is driven through: `drive_frames`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Settings
from assets_defs.sources import Source
from assets_defs.street_billboards.capture_datasets import (
    drive_dataset,
    simulated_drive_dataset,
    simulated_drive_of,
    stacked_by_frame,
)
from assets_defs.street_billboards.declaration import STREET
from assets_defs.street_billboards.used_pixels import used_pixels
from assets_defs.system import Pictures, Progress, Result
from pipelines.street_billboards import figures
from storage.readers.drives import Drive, read_drive, read_frame
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

OFFSETS = (1.0, 2.0, 3.0)
"""Metres beside the path, to the left."""


class DriveSettings(Settings):
    """What the simulated drive's cameras are like."""

    noise: float = Field(
        0.004, ge=0, le=0.2, description="Built-in drive: noise of the cameras, of white"
    )


def _pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.drawing.contact_sheet import contact_sheet

    count = dataset.sizes["frame"]
    shown = dataset["photographs"].isel(frame=sorted({0, count // 2}))
    row = shown.values.reshape(-1, *shown.shape[2:])
    pictures = {"photographs": contact_sheet(row)}
    if "beside" in dataset:
        beside = dataset["beside"].values[0]
        pictures["beside-the-path"] = np.hstack(list(beside))
    return pictures


def _exposure_spread(version: StoredVersion) -> float:
    photographs = version.dataset["photographs"]
    means = photographs.mean(dim=("y", "x", "channel"), dtype="float64")
    return figures.exposure_spread(means.values)


def _detail(version: StoredVersion) -> float:
    """Of every fourth frame's first photograph."""
    some = version.dataset["photographs"].isel(camera=0, frame=slice(None, None, 4))
    return figures.neighbour_difference(some.mean(dim="channel", dtype="float32").values)


@STREET.asset(
    schemas.DRIVE_FRAMES,
    by=("drive",),
    settings=DriveSettings,
    inputs=("drive_poses",),
    from_source=True,
    kinds=frozenset({"zarr", "pyvista"}),
    pictures=_pictures,
    checks=(
        Check(
            "exposure_spread",
            "Standard deviation of the photographs' mean codes over their mean.",
            _exposure_spread,
            at_most=0.5,
            change=0.02,
        ),
        Check(
            "detail",
            "Mean difference of the codes of neighbouring pixels.",
            _detail,
            at_least=1.0,
            change=0.5,
        ),
    ),
)
def drive_frames(
    settings: DriveSettings, source: Source, progress: Progress, drive_poses: xr.Dataset
) -> Result:
    """Take the drive's photographs in, or take them in the simulated city."""
    if source.path is not None:
        return _taken_in(read_drive(source.path), drive_poses)
    return _simulated(settings, progress, drive_poses)


def _taken_in(drive: Drive, poses: xr.Dataset) -> Result:
    """The photographs of a user's drive, read as the store takes them."""
    from pipelines.street_billboards.capture.centred_photographs import (
        centre_photographs,
        centred_intrinsics,
    )
    from pipelines.street_billboards.capture.held_out import held_out

    lenses, size = poses["intrinsics"].values, (drive.width, drive.height)
    instants = poses["instant"].values

    def taken(frame: int) -> NDArray[np.uint8]:
        return centre_photographs(read_frame(drive, frame), lenses)

    shape = (len(drive.cameras), drive.height, drive.width)
    photographs = stacked_by_frame(taken, instants, ((*shape, 3), np.uint8))
    intrinsics = np.stack([centred_intrinsics(lens, *size) for lens in lenses])
    kept = held_out(poses.sizes["frame"])
    dataset = drive_dataset(photographs, intrinsics, poses, kept)
    if (used := used_pixels(drive, poses)) is not None:
        masks = stacked_by_frame(used, instants, (shape, np.bool_))
        dataset = dataset.assign(used=(("frame", "camera", "y", "x"), masks))
    return dataset, {"photographs": kept.size * len(lenses)}


def _simulated(settings: DriveSettings, progress: Progress, poses: xr.Dataset) -> Result:
    """The photographs of the built-in drive, and what is true in frames held out."""
    from pipelines.street_billboards.capture.held_out import held_out
    from pipelines.virtual.city.bend import road_bend
    from pipelines.virtual.city.city import make_city
    from pipelines.virtual.city.drive_photographs import photograph_drive
    from pipelines.virtual.city.photographing import CityStage
    from storage.readers.street_photographs import street_photographs

    kept, seed = held_out(poses.sizes["frame"]), int(poses.attrs["seed"])
    metres = float(poses.attrs["metres"])
    streets = make_city(metres, seed, road_bend(metres, float(poses.attrs["bend"])))
    progress(0.1)
    with CityStage(streets, street_photographs(), *map(int, poses["size"].values)) as stage:
        taken = photograph_drive(
            stage,
            simulated_drive_of(poses),
            kept,
            offsets=OFFSETS,
            noise=settings.noise,
            seed=seed,
            progress=lambda fraction: progress(0.1 + 0.9 * fraction),
        )
    dataset = simulated_drive_dataset(poses, taken, kept, OFFSETS)
    return dataset, {"triangles": len(streets.triangles)}
