"""Stored drives, depths and points and the objects of `pipelines`, in both directions."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pipelines.geometry.cameras import Cameras

if TYPE_CHECKING:
    import dask.array as da
    import xarray as xr
    from numpy.typing import NDArray

    from assets_defs.system import Progress
    from pipelines.street_billboards.capture.drive_depth import DriveFrames, RigFrame
    from pipelines.street_billboards.capture.drive_points import DrivePoints, LoadedByFrame
    from pipelines.street_billboards.capture.point_fusion import RgbdViews
    from pipelines.street_billboards.textures.photographs import Photographs
    from pipelines.virtual.city.drive import SimulatedDrive
    from pipelines.virtual.city.drive_photographs import DrivePhotographs

_PIXELS = ("y", "x", "channel")
_HIDDEN = 0.01
"""Metres: the depth of pixels that are not used, in front of all that textures are taken of."""


# ---- drives ----------------------------------------------------------------------------------


class PosePoints(NamedTuple):
    """What poses were found or adjusted by."""

    points: NDArray[np.float64]
    """(p, 3), metres."""
    colours: NDArray[np.uint8]
    """(p, 3), sRGB."""
    focal_deviation: NDArray[np.float64]
    """(c,), pixels; 0 where the focal length was given."""


def _nothing_found(cameras: int) -> PosePoints:
    """Of a drive whose poses are given."""
    return PosePoints(np.empty((0, 3)), np.empty((0, 3), np.uint8), np.zeros(cameras))


def stacked_by_frame(
    work: Callable[[int], NDArray[Any]],
    frames: Sequence[int] | NDArray[np.integer],
    like: tuple[tuple[int, ...], type[np.generic]],
    progress: Progress | None = None,
) -> da.Array:
    """(frame, …) lazy: ``work`` makes one frame's array, of this shape and dtype, when asked."""
    import dask
    import dask.array as da

    done, lock = [0], threading.Lock()

    def told(frame: int) -> NDArray[Any]:
        made = work(frame)
        if progress is not None:
            with lock:
                done[0] += 1
                progress(done[0] / len(frames))
        return made

    return da.stack(
        [da.from_delayed(dask.delayed(told, pure=False)(frame), *like) for frame in frames]
    )


def poses_dataset(
    poses: NDArray[np.float64],
    intrinsics: NDArray[np.float64],
    size: tuple[int, int],
    *,
    instant: NDArray[np.integer] | None = None,
    origin: NDArray[np.float64] | None = None,
    found: PosePoints | None = None,
) -> xr.Dataset:
    """`drive_poses` of poses (f, c, 4, 4) and lenses, with what they were found by, if anything.

    instant: which of the drive's own, all if not given; origin: the world's zero.
    """
    import xarray as xr

    frames, cameras = poses.shape[:2]
    found = found or _nothing_found(cameras)
    return xr.Dataset(
        {
            "poses": (("frame", "camera", "row_4", "column_4"), poses),
            "intrinsics": (("camera", "row", "column"), intrinsics),
            "size": (("side",), np.array(size, np.int64)),
            "instant": (("frame",), np.arange(frames) if instant is None else instant),
            "origin": (("axis",), np.zeros(3) if origin is None else origin),
            "points": (("point", "axis"), found.points),
            "point_colours": (("point", "channel"), found.colours),
            "focal_deviation": (("camera",), found.focal_deviation),
        }
    )


def simulated_drive_of(poses: xr.Dataset) -> SimulatedDrive:
    """The built-in drive that a `drive_poses` dataset is of."""
    from pipelines.virtual.city.drive import SimulatedDrive

    names = ("intrinsics", "poses", "exposure")
    return SimulatedDrive(*(poses[name].values for name in names))


def drive_dataset(
    photographs: NDArray[np.uint8] | da.Array,
    intrinsics: NDArray[np.float64],
    poses: xr.Dataset,
    held_out: NDArray[np.bool_],
) -> xr.Dataset:
    """`drive_frames` of photographs (f, c, y, x, 3), their K and their `drive_poses`."""
    import xarray as xr

    return xr.Dataset(
        {
            "photographs": (("frame", "camera", *_PIXELS), photographs),
            "intrinsics": (("camera", "row", "column"), intrinsics),
            "poses": poses["poses"],
            "origin": poses["origin"],
            "held_out": (("frame",), held_out),
        }
    )


def simulated_drive_dataset(
    poses: xr.Dataset,
    taken: DrivePhotographs,
    held_out: NDArray[np.bool_],
    offsets: Sequence[float],
) -> xr.Dataset:
    """`drive_frames` of the built-in drive, with what is true in frames held out."""
    dataset = drive_dataset(taken.photographs, poses["intrinsics"].values, poses, held_out)
    return dataset.assign(
        truth_depth=(("held", "y", "x"), taken.truth_depth),
        truth_pole=(("held", "y", "x"), taken.truth_pole),
        beside=(("held", "offset", *_PIXELS), taken.beside),
        offset=(("offset",), np.array(offsets)),
    )


def rig_frame_of(drive: xr.Dataset, frame: int) -> RigFrame:
    """One frame of a `drive_frames` dataset."""
    from pipelines.street_billboards.capture.drive_depth import RigFrame

    return RigFrame(
        drive["photographs"][frame].values, drive["intrinsics"].values, drive["poses"][frame].values
    )


def frames_of(drive: xr.Dataset) -> DriveFrames:
    """A `drive_frames` dataset's frames, loaded when they are asked for."""
    from pipelines.street_billboards.capture.drive_depth import DriveFrames

    taken = np.flatnonzero(~drive["held_out"].values)
    return DriveFrames(lambda frame: rig_frame_of(drive, frame), drive["poses"].values, taken)


def taken_cameras(drive: xr.Dataset) -> Cameras:
    """All cameras where they took what is not held out."""
    poses = drive["poses"].values[~drive["held_out"].values]
    lenses = np.broadcast_to(drive["intrinsics"].values, (*poses.shape[:2], 3, 3))
    return Cameras(
        lenses.reshape(-1, 3, 3), poses.reshape(-1, 4, 4), drive.sizes["x"], drive.sizes["y"]
    )


def viewers(drive: xr.Dataset) -> NDArray[np.float64]:
    """Places (frame, 3) of the middle camera where it took what is not held out."""
    middle = drive.sizes["camera"] // 2
    places: NDArray[np.float64] = drive["poses"].values[:, middle, :3, 3]
    return places[~drive["held_out"].values]


# ---- depth and points ------------------------------------------------------------------------


def depth_dataset(
    maps: da.Array, frames: NDArray[np.integer], sky: NDArray[np.float32]
) -> xr.Dataset:
    """`depth_maps` of depths and deviations (taken, 2, c, y, x), lazy, of these frames."""
    import xarray as xr

    dims = ("taken", "camera", "y", "x")
    return xr.Dataset(
        {
            "depth": (dims, maps[:, 0]),
            "deviation": (dims, maps[:, 1]),
            "frame": (("taken",), frames.astype(np.int64)),
            "sky": (("row", "column", "channel"), sky),
        }
    )


def frame_views(drive: xr.Dataset, depths: xr.Dataset, taken: slice) -> RgbdViews:
    """The photographs of some frames that are not held out, one row a photograph."""
    from pipelines.street_billboards.capture.point_fusion import RgbdViews

    frames = depths["frame"].values[taken]
    cameras = drive.sizes["camera"]
    pictures = drive["photographs"].isel(frame=frames).values
    return RgbdViews(
        _merged(depths["depth"][taken].values),
        _merged(depths["deviation"][taken].values),
        _merged(pictures),
        np.tile(drive["intrinsics"].values, (len(frames), 1, 1)).reshape(-1, 3, 3),
        drive["poses"].values[frames].reshape(len(frames) * cameras, 4, 4),
    )


def _merged(stacked: NDArray[Any]) -> NDArray[Any]:
    """Frames and cameras as one axis."""
    return stacked.reshape(-1, *stacked.shape[2:])


def loaded_by_frame(drive: xr.Dataset, depths: xr.Dataset) -> LoadedByFrame:
    """The frames that are not held out, loaded when they are asked for."""
    from pipelines.street_billboards.capture.drive_points import LoadedByFrame

    return LoadedByFrame(depths.sizes["taken"], lambda taken: frame_views(drive, depths, taken))


def points_dataset(found: DrivePoints, gains: NDArray[np.float64]) -> xr.Dataset:
    """`street_points` of what frames agree on and of exposures (f, c, 3)."""
    import xarray as xr

    return xr.Dataset(
        {
            "positions": (("point", "axis"), found.points.positions),
            "colours": (("point", "channel"), found.points.colours),
            "gains": (("taken", "camera", "channel"), gains),
            "agreement": (("taken",), found.agreement),
        }
    )


def exposure_lut_of(points: xr.Dataset, taken: slice) -> NDArray[np.uint8]:
    """Codes (photographs, 256, 3) that even out the exposures of some frames."""
    from pipelines.street_billboards.capture.exposure import exposure_lut

    return exposure_lut(points["gains"].values[taken].reshape(-1, 3))


def photographs_of(
    drive: xr.Dataset, depths: xr.Dataset, points: xr.Dataset, taken: slice, farthest: float
) -> Photographs:
    """The photographs of some frames; where a depth is not known, the one of the points."""
    from pipelines.street_billboards.capture.surface_depth import fill_unknown_depth
    from pipelines.street_billboards.textures.photographs import Photographs

    views = frame_views(drive, depths, taken)
    fill_unknown_depth(views, points["positions"].values, farthest=farthest)
    if "used" in drive:
        views.depth[~_merged(drive["used"].isel(frame=depths["frame"].values[taken]).values)] = (
            _HIDDEN
        )
    return Photographs(
        views.photographs,
        views.depth,
        views.deviation,
        views.intrinsics,
        views.poses,
        exposure_lut_of(points, taken),
    )
