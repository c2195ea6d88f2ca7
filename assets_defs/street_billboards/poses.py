"""Where the cameras were: `drive_poses`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.street_billboards.capture_datasets import PosePoints, poses_dataset
from assets_defs.street_billboards.declaration import STREET
from assets_defs.street_billboards.given_poses import adjusted, world_of
from assets_defs.system import NOTES, Pictures, Progress, Result
from pipelines.street_billboards import figures
from storage.readers.drives import Drive, frame_notes, read_drive
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray


class PoseSettings(Settings):
    """The simulated drive's way; of a drive of yours, which part."""

    frames: int = Field(12, ge=8, le=10_000, description="Built-in drive: frames")
    spacing: float = Field(3.0, gt=0, le=20, description="Built-in drive: metres between frames")
    width: int = Field(640, ge=160, le=4096, description="Built-in drive: pixels across, 8:5")
    view_angle: float = Field(75.0, ge=30, le=110, description="Built-in drive: degrees across")
    cameras: Literal[1, 3] = Field(3, description="Built-in drive: cameras on the car")
    baseline: float = Field(0.8, gt=0, le=3, description="Built-in drive: metres between cameras")
    bend: float = Field(
        0.0, ge=-45, le=45, description="Built-in drive: degrees by which the road turns left"
    )
    exposure_spread: float = Field(
        0.12, ge=0, le=0.5, description="Built-in drive: how much exposures differ"
    )
    seed: int = Field(0, ge=0, description="Built-in drive: seed")
    start: int = Field(0, ge=0, description="Your drive: first frame of this tile of it")
    stop: int | None = Field(None, ge=8, description="Your drive: frame after the last")
    adjust: bool = Field(
        False, description="Your drive: improve its poses, where they are some centimetres off"
    )
    focal: float | None = Field(
        None, gt=0, description="Your film: focal length, pixels; what it says or shows if not set"
    )
    camera_height: float = Field(
        1.5, gt=0, le=20, description="Your film: metres of the camera above the road; tells scale"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"frames": 9, "width": 256},
        "paper": {"frames": 100},
    }


def metres_of(source: Source, settings: Settings) -> float:
    """Length of a drive; 0 where it is not known before its poses are found."""
    given = settings.model_dump()
    if source.path is None:
        return float(given["frames"] * given["spacing"])
    places = read_drive(source.path).poses[given["start"] : given["stop"], 0, :3, 3]
    return 0.0 if np.isnan(places).any() else figures.path_length(places)


def _pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.street_billboards.drawing.pictures import way_picture

    places = dataset["poses"].values[..., :3, 3]
    return {"way": way_picture(places, dataset["points"].values, dataset["point_colours"].values)}


def _frame_spacing(version: StoredVersion) -> float:
    return figures.frame_spacing(version.dataset["poses"].values[:, 0, :3, 3])


@STREET.asset(
    schemas.DRIVE_POSES,
    by=("drive",),
    settings=PoseSettings,
    from_source=True,
    pictures=_pictures,
    checks=(
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
def drive_poses(settings: PoseSettings, source: Source, progress: Progress) -> Result:
    """Take the drive's poses, adjust or find them, or plan a drive through the simulated city."""
    if source.path is None:
        return _planned(settings)
    drive = read_drive(source.path)
    chosen = _part_of(drive, settings, source.name)
    if np.isnan(drive.poses).all():
        return _found(drive, chosen, settings, progress)
    return _given(drive, chosen, settings, progress)


def _part_of(drive: Drive, settings: PoseSettings, name: str) -> NDArray[np.int64]:
    """Numbers of the frames that are asked for."""
    from pipelines.street_billboards.capture.held_out import FEWEST_FRAMES

    count = len(drive.times)
    stop = count if settings.stop is None else settings.stop
    chosen = np.arange(count)[settings.start : stop]
    if stop > count or len(chosen) < FEWEST_FRAMES:
        raise ValueError(
            f"{name}: start is {settings.start} and stop {settings.stop}; expected a part of at "
            f"least {FEWEST_FRAMES} of the {count} frames."
        )
    return chosen


def _found(
    drive: Drive, chosen: NDArray[np.int64], settings: PoseSettings, progress: Progress
) -> Result:
    """Of a film or photographs of one camera."""
    from assets_defs.street_billboards.unposed import camera_of, pictures_of
    from pipelines.street_billboards.poses.film_poses import pose_film

    film = pose_film(
        pictures_of(drive, chosen),
        camera_of(drive, settings.focal),
        camera_height=settings.camera_height,
        places=drive.places,
        progress=progress,
    )
    size = drive.width, drive.height
    found = PosePoints(film.points, film.colours, np.array([film.focal_deviation]))
    dataset = poses_dataset(
        film.poses[:, None], film.intrinsics[None], size, instant=film.frames, found=found
    )
    focal = float(film.intrinsics[0, 0])
    shown = {"frames": len(film.frames), "points": len(film.points), "focal length": focal}
    notes = [*drive.notes, *film.notes]
    return dataset.assign(used=(("camera", "y", "x"), film.used[None])), {**shown, NOTES: notes}


def _given(
    drive: Drive, chosen: NDArray[np.int64], settings: PoseSettings, progress: Progress
) -> Result:
    """The poses that a drive's files have, adjusted if asked for."""
    notes = [*drive.notes]
    notes += [f"As of all its photographs: {note}" for note in frame_notes(drive, int(chosen[0]))]
    world = world_of(drive, chosen, settings.camera_height)
    poses, instants, more = world.poses.copy(), chosen[world.order], list(world.notes)
    if settings.adjust:
        poses, said = adjusted(drive, world, instants, progress)
        more += said
    # Graphics are drawn in single precision: far from its zero, a map's grid would have no digits.
    origin = np.round(poses[0, 0, :3, 3])
    poses[..., :3, 3] -= origin
    size = drive.width, drive.height
    dataset = poses_dataset(poses, world.intrinsics, size, instant=instants, origin=origin)
    shown = {"cameras": ", ".join(drive.cameras), "frames": len(chosen)}
    return dataset, {**shown, NOTES: [*notes, *more]}


def _planned(settings: PoseSettings) -> Result:
    """The way through the city, and the exposures of its photographs."""
    from pipelines.virtual.city.bend import road_bend
    from pipelines.virtual.city.drive import plan_drive

    metres = settings.frames * settings.spacing
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
        bend=road_bend(metres, settings.bend),
    )
    dataset = poses_dataset(drive.poses, drive.intrinsics, size)
    exposed = dataset.assign(exposure=(("frame", "camera"), drive.gains))
    planned = {"metres": metres, "seed": settings.seed, "bend": settings.bend}
    return exposed.assign_attrs(planned), {"metres": metres}
