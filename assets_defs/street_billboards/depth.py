"""Depth from neighbouring cameras, and what it agrees on: `depth_maps`, `street_points`."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Settings
from assets_defs.street_billboards.capture_datasets import (
    depth_dataset,
    frames_of,
    loaded_by_frame,
    points_dataset,
    stacked_by_frame,
)
from assets_defs.street_billboards.declaration import STREET
from assets_defs.system import Pictures, Progress, Result
from pipelines.street_billboards import figures
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray


# ---- depth_maps ------------------------------------------------------------------------------


class DepthSettings(Settings):
    """What is matched."""

    nearest: float = Field(2.0, gt=0, description="Metres; nothing nearer is matched")
    farthest: float = Field(40.0, gt=0, description="Metres; nothing farther is matched")


class _HeldOut(NamedTuple):
    """The middle camera's depths (y, x) of a frame that is held out."""

    depth: NDArray[np.float32]
    deviation: NDArray[np.float32]
    truth: NDArray[np.float32]


def _depth_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.drawing.colour import to_8bit
    from pipelines.street_billboards.drawing.pictures import depth_picture

    middle = dataset.sizes["taken"] // 2
    sky = dataset["sky"].values
    return {
        "depth": depth_picture(dataset["depth"][middle].values),
        "sky": to_8bit(sky[: len(sky) // 2]),
    }


def _stereo_bad(version: StoredVersion) -> float:
    """Of the real pair, whatever drive is asked for: the matching is one."""
    from pipelines.street_billboards.capture.stereo import match_rectified_pair
    from pipelines.street_billboards.capture.weighted_median import fill_disparity_holes
    from storage.readers.street_photographs import motorcycle

    pair = motorcycle()
    found, _ = match_rectified_pair(pair.left, pair.right, pair.most)
    return figures.bad_pixel_share(fill_disparity_holes(found.disparity, pair.left), pair.disparity)


def _depth_error(version: StoredVersion) -> float | None:
    """Against the true depth of held-out frames, which are matched for this alone."""
    found = _held_out_depth(version)
    return None if found is None else figures.depth_error(found.depth, found.truth)


def _deviation_honest(version: StoredVersion) -> float | None:
    """Likewise."""
    found = _held_out_depth(version)
    return None if found is None else figures.deviation_honest(*found)


def _held_out_depth(version: StoredVersion) -> _HeldOut | None:
    """Of the first frame held out, found from the others; None where the truth is not known."""
    from pipelines.street_billboards.capture.drive_depth import DriveDepth

    drive, settings = version.input("drive_frames"), version.record["settings"]
    if "truth_depth" not in drive:
        return None
    reach = {name: settings[name] for name in ("nearest", "farthest")}
    maps = DriveDepth(frames_of(drive), **reach).maps(int(drive["held_out"].values.argmax()))
    middle = len(maps.depth) // 2
    return _HeldOut(maps.depth[middle], maps.deviation[middle], drive["truth_depth"][0].values)


def _known_share(version: StoredVersion) -> float:
    return float(np.isfinite(version.dataset["depth"]).mean().compute())


@STREET.asset(
    schemas.DEPTH_MAPS,
    by=("drive",),
    settings=DepthSettings,
    inputs=("drive_frames",),
    pictures=_depth_pictures,
    checks=(
        Check(
            "stereo_bad05",
            "Share of the pixels of a real calibrated pair whose disparity, filled, is off by more "
            "than half a pixel.",
            _stereo_bad,
            at_most=0.16,
            change=0.005,
        ),
        Check(
            "depth_error",
            "Simulated drive: share of the pixels up to 20 m whose depth is missing or off by more "
            "than 5 %.",
            _depth_error,
            at_most=0.5,
            change=0.02,
        ),
        Check(
            "deviation_honest",
            "Simulated drive: share of the depths up to 25 m that are off by less than two of "
            "their deviations.",
            _deviation_honest,
            at_least=0.75,
            at_most=0.995,
            change=0.02,
        ),
        Check(
            "known_share",
            "Share of all pixels whose depth is known.",
            _known_share,
            at_least=0.2,
            change=0.05,
        ),
    ),
)
def depth_maps(settings: DepthSettings, progress: Progress, drive_frames: xr.Dataset) -> Result:
    """Match a rig's cameras, or one camera's frames, frame by frame, as the store takes them."""
    from pipelines.street_billboards.capture.drive_depth import DriveDepth

    frames = frames_of(drive_frames)
    found = DriveDepth(frames, nearest=settings.nearest, farthest=settings.farthest)

    def maps_of(frame: int) -> NDArray[np.float32]:
        maps = np.stack(found.before_sky(frame))
        if "used" in drive_frames:
            maps[:, ~drive_frames["used"][frame].values] = np.nan
        return maps

    shape = drive_frames["photographs"].shape[1:4]
    maps = stacked_by_frame(maps_of, frames.taken, ((2, *shape), np.float32), progress)
    shown = {"photographs": len(frames.taken) * shape[0]}
    return depth_dataset(maps, frames.taken, found.sky()), shown


# ---- street_points ---------------------------------------------------------------------------


class PointSettings(Settings):
    """What is a point."""

    farthest_point: float = Field(25.0, gt=0, description="Metres from the camera, at most")
    support: int = Field(2, ge=1, le=50, description="Depth maps that must confirm a point")
    step: int = Field(2, ge=1, le=8, description="Pixels from one that becomes a point to the next")
    cell: float = Field(0.05, gt=0, le=1, description="Metres; points of one cell become one")


def _point_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.street_billboards.drawing.pictures import points_picture

    return {"points": points_picture(dataset["positions"].values, dataset["colours"].values)}


def _agreement(version: StoredVersion) -> float:
    return float(version.dataset["agreement"].mean(skipna=True))


def _points_a_metre(version: StoredVersion) -> float:
    places = version.input("drive_frames")["poses"].values[:, 0, :3, 3]
    return version.dataset.sizes["point"] / figures.path_length(places)


def _stray_share(version: StoredVersion) -> float | None:
    """Against the true depth of held-out frames: a point before it hangs in the air."""
    drive = version.input("drive_frames")
    if "truth_depth" not in drive:
        return None
    middle = drive.sizes["camera"] // 2
    return figures.stray_share(
        version.dataset["positions"].values,
        drive["intrinsics"].values[middle],
        drive["poses"].values[drive["held_out"].values, middle],
        drive["truth_depth"].values,
    )


def _largest_gain(version: StoredVersion) -> float:
    return figures.largest_log_gain(version.dataset["gains"].values)


@STREET.asset(
    schemas.STREET_POINTS,
    by=("drive",),
    settings=PointSettings,
    inputs=("drive_frames", "depth_maps"),
    pictures=_point_pictures,
    checks=(
        Check(
            "agreement",
            "Share of the frames' points that their neighbours confirm.",
            _agreement,
            at_least=0.3,
            change=0.05,
        ),
        Check(
            "points_a_metre",
            "Points for a metre of road.",
            _points_a_metre,
            at_least=100.0,
            change=500.0,
        ),
        Check(
            "stray_share",
            "Simulated drive: share of the points that hang before the true surface by more than "
            "5 % of their distance.",
            _stray_share,
            at_most=0.08,
            change=0.01,
        ),
        Check(
            "largest_gain",
            "Largest logarithm of a photograph's exposure.",
            _largest_gain,
            at_most=1.5,
            change=0.05,
        ),
    ),
)
def street_points(
    settings: PointSettings, progress: Progress, drive_frames: xr.Dataset, depth_maps: xr.Dataset
) -> Result:
    """Keep what neighbouring frames confirm; even out exposures by what photographs share."""
    from pipelines.street_billboards.capture import drive_points as points

    drive, cameras = loaded_by_frame(drive_frames, depth_maps), drive_frames.sizes["camera"]
    reach, company = settings.farthest_point, points.company_of(cameras)
    fusion = points.Fusion(settings.support, reach, settings.step, settings.cell, company)
    found = points.drive_points(drive, fusion, progress=lambda fraction: progress(0.7 * fraction))
    positions = found.points.positions
    gains = points.drive_gains(positions, drive, cameras, farthest=reach)
    return points_dataset(found, gains), {
        "points": len(positions),
        "agreement": float(np.nanmean(found.agreement)),
    }
