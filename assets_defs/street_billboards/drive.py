"""What is driven through: `drive_frames`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.street_billboards.declaration import STREET
from assets_defs.system import Metadata
from storage.readers.drives import Drive, read_drive, read_frame
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]

OFFSETS = (1.0, 2.0, 3.0)
"""Metres beside the path, to the left."""
EXPOSURE = 0.95
"""From the simulated city's radiance to pictures."""
HELD_OUT_EVERY, HELD_OUT_FIRST = 10, 5


class DriveSettings(Settings):
    """The simulated drive; of a drive of yours, which part."""

    frames: int = Field(18, ge=8, le=10_000, description="Built-in drive: frames")
    spacing: float = Field(3.0, gt=0, le=20, description="Built-in drive: metres between frames")
    width: int = Field(640, ge=160, le=4096, description="Built-in drive: pixels across, 8:5")
    view_angle: float = Field(75.0, ge=30, le=110, description="Built-in drive: degrees across")
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
    import numpy as np

    given = settings.model_dump()
    if source.path is None:
        return float(given["frames"] * given["spacing"])
    places = read_drive(source.path).poses[given["start"] : given["stop"], 0, :3, 3]
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def _drive_pictures(dataset: xr.Dataset) -> Pictures:
    import numpy as np

    from pipelines.drawing.contact_sheet import contact_sheet

    count = dataset.sizes["frame"]
    shown = dataset["photographs"].isel(frame=sorted({0, count // 2}))
    row = shown.values.reshape(-1, *shown.shape[2:])
    pictures = {"photographs": contact_sheet(row)}
    if "beside" in dataset:
        beside = dataset["beside"].values[0]
        pictures["beside-the-path"] = np.hstack(list(beside))
    return pictures


def _spread(checked: StoredVersion) -> float:
    """How much the photographs' mean codes differ, relative."""
    means = checked.dataset["photographs"].mean(dim=("y", "x", "channel"), dtype="float64").values
    return float(means.std() / means.mean())


def _detail(checked: StoredVersion) -> float:
    """Mean difference of neighbouring pixels' codes: what stereo lives on."""
    import numpy as np

    some = checked.dataset["photographs"].isel(camera=0)
    greys = some.isel(frame=slice(None, None, 4)).mean(dim="channel", dtype="float32").values
    return float(np.abs(np.diff(greys, axis=-1)).mean())


def _way(checked: StoredVersion) -> float:
    """Median metres from frame to frame."""
    import numpy as np

    places = checked.dataset["poses"].values[:, 0, :3, 3]
    return float(np.median(np.linalg.norm(np.diff(places, axis=0), axis=1)))


@STREET.asset(
    schemas.DRIVE_FRAMES,
    by=("drive",),
    settings=DriveSettings,
    from_source=True,
    kinds=frozenset({"zarr", "pyvista"}),
    pictures=_drive_pictures,
    checks=(
        Check(
            "exposure_spread",
            "Standard deviation of the photographs' mean codes over their mean.",
            _spread,
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
            _way,
            at_least=0.01,
            at_most=20.0,
            change=0.01,
        ),
    ),
)
def drive_frames(
    settings: DriveSettings, source: Source, progress: Callable[[float], None]
) -> Result:
    """Take the drive in, or drive through the simulated city."""
    if source.path is not None:
        return _taken_in(read_drive(source.path), settings, source.name)
    return _simulated(settings, progress)


def _taken_in(drive: Drive, settings: DriveSettings, name: str) -> Result:
    import dask
    import dask.array as da
    import numpy as np
    import xarray as xr

    from pipelines.street_billboards.capture.centred_pictures import centred, centred_intrinsics

    count = len(drive.times)
    stop = count if settings.stop is None else settings.stop
    chosen = range(count)[settings.start : stop]
    if stop > count or len(chosen) <= HELD_OUT_FIRST + 1:
        raise ValueError(
            f"{name}: start is {settings.start} and stop {settings.stop}; expected a part of at "
            f"least {HELD_OUT_FIRST + 2} of the {count} frames."
        )
    shape = (len(drive.cameras), drive.height, drive.width, 3)
    intrinsics = [centred_intrinsics(k, drive.width, drive.height) for k in drive.intrinsics]

    def taken(frame: int) -> NDArray[np.uint8]:
        return centred(read_frame(drive, frame), drive.intrinsics)

    photographs = da.stack(
        [
            da.from_delayed(dask.delayed(taken, pure=False)(frame), shape, np.uint8)
            for frame in chosen
        ]
    )
    # Graphics are drawn in single precision: far from its zero, a map's grid would have no digits.
    poses = drive.poses[list(chosen)]
    origin = np.round(poses[0, 0, :3, 3])
    poses[..., :3, 3] -= origin
    dataset = xr.Dataset(
        {
            "photographs": (("frame", "camera", "y", "x", "channel"), photographs),
            "intrinsics": (("camera", "row", "column"), np.stack(intrinsics)),
            "poses": (("frame", "camera", "row_4", "column_4"), poses),
            "origin": (("axis",), origin),
            "held_out": (("frame",), held_out(len(chosen))),
        }
    )
    return dataset, {"cameras": ", ".join(drive.cameras), "frames": len(chosen)}


def held_out(frames: int) -> NDArray[np.bool_]:
    """Which of the frames are kept for the test: every tenth."""
    import numpy as np

    return np.arange(frames) % HELD_OUT_EVERY == HELD_OUT_FIRST


def _simulated(settings: DriveSettings, progress: Callable[[float], None]) -> Result:
    import numpy as np
    import xarray as xr

    from pipelines.drawing.colour import to_8bit
    from pipelines.geometry.cameras import moved_left
    from pipelines.virtual.city.city import city
    from pipelines.virtual.city.photographing import CityStage
    from pipelines.virtual.city.simulated_drive import photograph, plan_drive
    from storage.readers.street_photographs import street_photographs

    width, height = settings.width, settings.width * 5 // 8
    plan = plan_drive(
        settings.frames,
        settings.spacing,
        width,
        height,
        view_angle=settings.view_angle,
        baseline=settings.baseline,
        seed=settings.seed,
        exposure_spread=settings.exposure_spread,
    )
    kept = held_out(settings.frames)
    frames, cameras = plan.poses.shape[:2]
    middle = cameras // 2
    photographs = np.empty((frames, cameras, height, width, 3), np.uint8)
    truth_depth, truth_pole, beside = [], [], []
    random = np.random.default_rng(settings.seed)
    streets = city(settings.frames * settings.spacing, settings.seed)
    progress(0.1)
    with CityStage(streets, street_photographs(), width, height) as stage:
        for frame in range(frames):
            for camera in range(cameras):
                labels = bool(kept[frame]) and camera == middle
                pose, lens = plan.poses[frame, camera], plan.intrinsics[camera]
                shot = stage.shoot(lens, pose, labels=labels)
                photographs[frame, camera] = photograph(
                    shot.radiance, plan.gains[frame, camera], EXPOSURE, settings.noise, random
                )
                if labels:
                    truth_depth.append(shot.depth)
                    truth_pole.append(shot.pole)
                    moved = [stage.shoot(lens, moved_left(pose, offset)) for offset in OFFSETS]
                    beside.append([to_8bit(EXPOSURE * one.radiance) for one in moved])
            progress(0.1 + 0.9 * (frame + 1) / frames)
    dataset = xr.Dataset(
        {
            "photographs": (("frame", "camera", "y", "x", "channel"), photographs),
            "intrinsics": (("camera", "row", "column"), plan.intrinsics),
            "poses": (("frame", "camera", "row_4", "column_4"), plan.poses),
            "origin": (("axis",), np.zeros(3)),
            "held_out": (("frame",), kept),
            "truth_depth": (("held", "y", "x"), np.array(truth_depth, np.float32)),
            "truth_pole": (("held", "y", "x"), np.array(truth_pole, bool)),
            "beside": (("held", "offset", "y", "x", "channel"), np.array(beside, np.uint8)),
            "offset": (("offset",), np.array(OFFSETS)),
        }
    )
    return dataset, {"triangles": len(streets.triangles), "metres": frames * settings.spacing}
