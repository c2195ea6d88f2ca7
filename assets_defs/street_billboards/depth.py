"""Depth from neighbouring cameras, and what it agrees on: `depth_maps`, `street_points`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Settings
from assets_defs.street_billboards.capture_datasets import (
    depth_dataset,
    loaded_by_frame,
    points_dataset,
    rig_frame_of,
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
    from pipelines.street_billboards.capture.stereo import depth_maps

    drive, settings = version.input("drive_frames"), version.record["settings"]
    if "truth_depth" not in drive:
        return None
    frame = rig_frame_of(drive, int(drive["held_out"].values.argmax()))
    maps = depth_maps(*frame, nearest=settings["nearest"], farthest=settings["farthest"])
    return figures.depth_error(maps.depth[len(maps.depth) // 2], drive["truth_depth"][0].values)


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
            "known_share",
            "Share of all pixels whose depth is known.",
            _known_share,
            at_least=0.2,
            change=0.05,
        ),
    ),
)
def depth_maps(settings: DepthSettings, progress: Progress, drive_frames: xr.Dataset) -> Result:
    """Match each frame's neighbouring cameras, frame by frame, as the store takes them."""
    from pipelines.street_billboards.capture.drive_depth import (
        RigFrame,
        depth_before_sky,
        drive_sky,
    )

    taken = np.flatnonzero(~drive_frames["held_out"].values)
    reach = {"nearest": settings.nearest, "farthest": settings.farthest}

    def load(frame: int) -> RigFrame:
        return rig_frame_of(drive_frames, frame)

    def maps_of(frame: int) -> NDArray[np.float32]:
        return np.stack(depth_before_sky(load(frame), **reach))

    sky = drive_sky(load, taken, **reach)
    shape = drive_frames["photographs"].shape[1:4]
    maps = stacked_by_frame(maps_of, taken, ((2, *shape), np.float32), progress)
    return depth_dataset(maps, taken, sky), {"photographs": len(taken) * shape[0]}


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
            at_least=500.0,
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
    from pipelines.street_billboards.capture.drive_points import Fusion, drive_gains, drive_points

    drive = loaded_by_frame(drive_frames, depth_maps)
    fusion = Fusion(settings.support, settings.farthest_point, settings.step, settings.cell)
    found = drive_points(drive, fusion, progress=lambda fraction: progress(0.7 * fraction))
    positions = found.points.positions
    gains = drive_gains(
        positions, drive, drive_frames.sizes["camera"], farthest=settings.farthest_point
    )
    return points_dataset(found, gains), {
        "points": len(positions),
        "agreement": float(np.nanmean(found.agreement)),
    }
