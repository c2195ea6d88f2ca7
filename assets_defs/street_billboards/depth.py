"""Depth from neighbouring cameras, and what it agrees on: `depth_maps`, `street_points`."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Settings
from assets_defs.street_billboards.datasets import frame_views
from assets_defs.street_billboards.declaration import STREET
from assets_defs.system import Metadata
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.street_billboards.capture.point_fusion import Points

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]

_SKY_FRAMES = 6
"""Frames that the sky is put together from."""
_ASKED_FRAMES = 8
"""Frames of which it is measured how much their neighbours confirm."""

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


def _stereo_bad(checked: StoredVersion) -> float:
    """Of the real pair, whatever drive is asked for: the matching is one."""
    from pipelines.street_billboards.capture.depth_refinement import filled
    from pipelines.street_billboards.capture.stereo import match
    from pipelines.street_billboards.figures import bad_pixel_share
    from storage.readers.street_photographs import motorcycle

    pair = motorcycle()
    found, _ = match(pair.left, pair.right, pair.most)
    return bad_pixel_share(filled(found.disparity, pair.left), pair.disparity)


def _depth_error(checked: StoredVersion) -> float | None:
    """Against the true depth of held-out frames, which are matched for this alone."""
    from pipelines.street_billboards.capture.stereo import depth_maps
    from pipelines.street_billboards.figures import depth_error

    drive = checked.input("drive_frames")
    if "truth_depth" not in drive:
        return None
    settings = checked.record["settings"]
    frame = int(drive["held_out"].values.argmax())
    maps = depth_maps(
        drive["photographs"][frame].values,
        drive["intrinsics"].values,
        drive["poses"][frame].values,
        nearest=settings["nearest"],
        farthest=settings["farthest"],
    )
    return depth_error(maps.depth[len(maps.depth) // 2], drive["truth_depth"][0].values)


def _known_share(checked: StoredVersion) -> float:
    import numpy as np

    return float(np.isfinite(checked.dataset["depth"]).mean().compute())


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
def depth_maps(
    settings: DepthSettings, progress: Callable[[float], None], drive_frames: xr.Dataset
) -> Result:
    """Match each frame's neighbouring cameras, frame by frame, as the store takes them."""
    import dask
    import dask.array as da
    import numpy as np
    import xarray as xr

    from pipelines.street_billboards.capture import stereo
    from pipelines.street_billboards.capture.sky import SkyView, sky_map, sky_pixels

    taken = np.flatnonzero(~drive_frames["held_out"].values)
    intrinsics, poses = drive_frames["intrinsics"].values, drive_frames["poses"].values
    shape = drive_frames["photographs"].shape[1:4]
    done, lock = [0], threading.Lock()

    def matched(frame: int) -> tuple[list[SkyView], NDArray[np.float32]]:
        pictures = drive_frames["photographs"][frame].values
        maps = stereo.depth_maps(
            pictures,
            intrinsics,
            poses[frame],
            nearest=settings.nearest,
            farthest=settings.farthest,
        )
        views = map(SkyView, pictures, maps.depth, intrinsics, poses[frame])
        return list(views), maps.deviation

    some = taken[:: max(len(taken) // _SKY_FRAMES, 1)]
    sky = sky_map([view for frame in some for view in matched(frame)[0]])

    def maps_of(frame: int) -> NDArray[np.float32]:
        views, deviation = matched(frame)
        depth = [np.where(sky_pixels(view), np.inf, view.depth) for view in views]
        with lock:
            done[0] += 1
            progress(done[0] / len(taken))
        return np.stack([np.array(depth, np.float32), deviation])

    maps = da.stack(
        [
            da.from_delayed(dask.delayed(maps_of, pure=False)(frame), (2, *shape), np.float32)
            for frame in taken
        ]
    )
    dims = ("taken", "camera", "y", "x")
    dataset = xr.Dataset(
        {
            "depth": (dims, maps[:, 0]),
            "deviation": (dims, maps[:, 1]),
            "frame": (("taken",), taken.astype(np.int64)),
            "sky": (("row", "column", "channel"), sky),
        }
    )
    return dataset, {"photographs": len(taken) * shape[0]}


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


def _agreement(checked: StoredVersion) -> float:
    return float(checked.dataset["agreement"].mean(skipna=True))


def _points_a_metre(checked: StoredVersion) -> float:
    import numpy as np

    places = checked.input("drive_frames")["poses"].values[:, 0, :3, 3]
    way = float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
    return checked.dataset.sizes["point"] / way


def _stray_share(checked: StoredVersion) -> float | None:
    """Against the true depth of held-out frames: a point before it hangs in the air."""
    from pipelines.street_billboards.figures import stray_share

    drive = checked.input("drive_frames")
    if "truth_depth" not in drive:
        return None
    middle = drive.sizes["camera"] // 2
    return stray_share(
        checked.dataset["positions"].values,
        drive["intrinsics"].values[middle],
        drive["poses"].values[drive["held_out"].values, middle],
        drive["truth_depth"].values,
    )


def _gain_step(checked: StoredVersion) -> float:
    """Evened out, neighbouring photographs should agree: what is left, as a factor less one."""
    import numpy as np

    gains = checked.dataset["gains"].values
    return float(np.abs(np.log(gains)).max())


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
            _gain_step,
            at_most=1.5,
            change=0.05,
        ),
    ),
)
def street_points(
    settings: PointSettings,
    progress: Callable[[float], None],
    drive_frames: xr.Dataset,
    depth_maps: xr.Dataset,
) -> Result:
    """Keep what neighbouring frames confirm; even out exposures by what photographs share."""
    import numpy as np
    import xarray as xr

    from pipelines.street_billboards.capture.exposure import exposure_gains
    from pipelines.street_billboards.capture.point_fusion import agreement, consistent_points, fused
    from pipelines.street_billboards.textures.observations import observed

    count, cameras = depth_maps.sizes["taken"], drive_frames.sizes["camera"]
    confirmed = np.full(count, np.nan)
    asked = set(np.linspace(0, count - 1, min(_ASKED_FRAMES, count)).astype(int))

    def parts() -> Iterator[Points]:
        for number in range(count):
            progress(0.7 * number / count)
            frame = frame_views(drive_frames, depth_maps, slice(number, number + 1))
            around = slice(max(number - 3, 0), number + 4)
            neighbours = frame_views(drive_frames, depth_maps, around)
            if number in asked:
                confirmed[number] = agreement(frame, neighbours)
            yield consistent_points(
                frame,
                neighbours,
                least_support=settings.support,
                farthest=settings.farthest_point,
                step=settings.step,
            )

    points = fused(parts(), settings.cell)
    if len(points.positions) == 0:
        raise ValueError(
            "street_points: no point is confirmed by other frames; expected consistent intrinsics "
            "and poses."
        )
    rows = [
        observed(
            points.positions,
            frame_views(drive_frames, depth_maps, slice(number, number + 1)),
            farthest=settings.farthest_point,
        ).shifted(number * cameras)
        for number in range(count)
    ]
    progress(0.9)
    gains = exposure_gains(
        np.concatenate([row.point for row in rows]),
        np.concatenate([row.photograph for row in rows]),
        np.concatenate([row.radiance for row in rows]),
        count * cameras,
    )
    dataset = xr.Dataset(
        {
            "positions": (("point", "axis"), points.positions),
            "colours": (("point", "channel"), points.colours),
            "gains": (("taken", "camera", "channel"), gains.reshape(count, cameras, 3)),
            "agreement": (("taken",), confirmed),
        }
    )
    return dataset, {"points": len(points.positions), "agreement": float(np.nanmean(confirmed))}
