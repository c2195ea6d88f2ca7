"""What is driven through: `drive_frames`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.street_billboards.capture_datasets import (
    drive_dataset,
    simulated_drive_dataset,
    stacked_by_frame,
)
from assets_defs.street_billboards.declaration import STREET
from assets_defs.system import NOTES, Pictures, Progress, Result
from pipelines.street_billboards import figures
from storage.readers.drives import Drive, frame_notes, read_drive, read_frame
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

OFFSETS = (1.0, 2.0, 3.0)
"""Metres beside the path, to the left."""


class DriveSettings(Settings):
    """The simulated drive; of a drive of yours, which part."""

    frames: int = Field(12, ge=8, le=10_000, description="Built-in drive: frames")
    spacing: float = Field(3.0, gt=0, le=20, description="Built-in drive: metres between frames")
    width: int = Field(640, ge=160, le=4096, description="Built-in drive: pixels across, 8:5")
    view_angle: float = Field(75.0, ge=30, le=110, description="Built-in drive: degrees across")
    cameras: Literal[1, 3] = Field(3, description="Built-in drive: cameras on the car")
    baseline: float = Field(0.8, gt=0, le=3, description="Built-in drive: metres between cameras")
    noise: float = Field(
        0.004, ge=0, le=0.2, description="Built-in drive: noise of the cameras, of white"
    )
    exposure_spread: float = Field(
        0.12, ge=0, le=0.5, description="Built-in drive: how much exposures differ"
    )
    seed: int = Field(0, ge=0, description="Built-in drive: seed")
    start: int = Field(0, ge=0, description="Your drive: first frame of this tile of it")
    stop: int | None = Field(None, ge=8, description="Your drive: frame after the last")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"frames": 9, "width": 256},
        "paper": {"frames": 100},
    }


def metres_of(source: Source, settings: Settings) -> float:
    """Length of a drive."""
    given = settings.model_dump()
    if source.path is None:
        return float(given["frames"] * given["spacing"])
    return figures.path_length(
        read_drive(source.path).poses[given["start"] : given["stop"], 0, :3, 3]
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


def _frame_spacing(version: StoredVersion) -> float:
    return figures.frame_spacing(version.dataset["poses"].values[:, 0, :3, 3])


@STREET.asset(
    schemas.DRIVE_FRAMES,
    by=("drive",),
    settings=DriveSettings,
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
        Check(
            "frame_spacing",
            "Metres from frame to frame, median.",
            _frame_spacing,
            at_least=0.01,
            at_most=20.0,
            change=0.01,
        ),
    ),
)
def drive_frames(settings: DriveSettings, source: Source, progress: Progress) -> Result:
    """Take the drive in, or drive through the simulated city."""
    if source.path is not None:
        return _taken_in(read_drive(source.path), settings, source.name)
    return _simulated(settings, progress)


def _taken_in(drive: Drive, settings: DriveSettings, name: str) -> Result:
    """A part of a user's drive, its photographs read as the store takes them."""
    from pipelines.street_billboards.capture.centred_photographs import (
        centre_photographs,
        centred_intrinsics,
    )
    from pipelines.street_billboards.capture.held_out import FEWEST_FRAMES, held_out

    count = len(drive.times)
    stop = count if settings.stop is None else settings.stop
    chosen = range(count)[settings.start : stop]
    if stop > count or len(chosen) < FEWEST_FRAMES:
        raise ValueError(
            f"{name}: start is {settings.start} and stop {settings.stop}; expected a part of at "
            f"least {FEWEST_FRAMES} of the {count} frames."
        )

    def taken(frame: int) -> NDArray[np.uint8]:
        return centre_photographs(read_frame(drive, frame), drive.intrinsics)

    shape = (len(drive.cameras), drive.height, drive.width, 3)
    photographs = stacked_by_frame(taken, chosen, (shape, np.uint8))
    intrinsics = [centred_intrinsics(k, drive.width, drive.height) for k in drive.intrinsics]
    # Graphics are drawn in single precision: far from its zero, a map's grid would have no digits.
    poses = drive.poses[list(chosen)]
    origin = np.round(poses[0, 0, :3, 3])
    poses[..., :3, 3] -= origin
    dataset = drive_dataset(photographs, np.stack(intrinsics), poses, origin, held_out(len(chosen)))
    notes = [f"As of all its photographs: {note}" for note in frame_notes(drive, chosen[0])]
    shown = {"cameras": ", ".join(drive.cameras), "frames": len(chosen)}
    return dataset, {**shown, NOTES: notes}


def _simulated(settings: DriveSettings, progress: Progress) -> Result:
    """The built-in drive through the city."""
    from pipelines.street_billboards.capture.held_out import held_out
    from pipelines.virtual.city.city import make_city
    from pipelines.virtual.city.drive import plan_drive
    from pipelines.virtual.city.drive_photographs import photograph_drive
    from pipelines.virtual.city.photographing import CityStage
    from storage.readers.street_photographs import street_photographs

    size = settings.width, settings.width * 5 // 8
    drive = plan_drive(
        settings.frames,
        settings.spacing,
        *size,
        view_angle=settings.view_angle,
        baseline=settings.baseline,
        seed=settings.seed,
        exposure_spread=settings.exposure_spread,
        cameras=settings.cameras,
    )
    metres, kept = settings.frames * settings.spacing, held_out(settings.frames)
    streets = make_city(metres, settings.seed)
    progress(0.1)
    with CityStage(streets, street_photographs(), *size) as stage:
        taken = photograph_drive(
            stage,
            drive,
            kept,
            offsets=OFFSETS,
            noise=settings.noise,
            seed=settings.seed,
            progress=lambda fraction: progress(0.1 + 0.9 * fraction),
        )
    dataset = simulated_drive_dataset(drive, taken, kept, OFFSETS)
    return dataset, {"triangles": len(streets.triangles), "metres": metres}
