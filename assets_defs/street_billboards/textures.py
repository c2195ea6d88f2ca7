"""What stands in the street and what it looks like: `billboards`, `view_textures`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.street_billboards.datasets import (
    billboards_of,
    frame_views,
    taken_cameras,
    viewers,
    views_of,
)
from assets_defs.street_billboards.declaration import STREET
from assets_defs.system import Metadata
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.geometry.cameras import Cameras
    from pipelines.street_billboards.textures.view_textures import Photographs

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]

TILE_FRAMES = 16
"""Frames of a tile of the road: photographs are loaded tile by tile."""


# ---- billboards ------------------------------------------------------------------------------


class BillboardSettings(Settings):
    """The octree's leaves, and what stands in them."""

    voxel: float = Field(0.8, gt=0.02, le=20, description="Metres, side of a leaf")
    least_points: int = Field(10, ge=1, description="Points that a leaf must hold")
    planes: Literal["fitted", "turning"] = Field(
        "fitted",
        description="Leaves whose points are flat get a rectangle in their plane; or, as in the "
        "paper, every billboard turns to face the viewer",
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {"test": {"voxel": 1.2}}


def _billboard_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.street_billboards.drawing.pictures import plan_picture

    return {"plan": plan_picture(billboards_of(dataset))}


def _points_in(checked: StoredVersion) -> float:
    """Share of the points that lie in some billboard's voxel, by a tree instead of the octree."""
    import numpy as np
    from scipy.spatial import cKDTree

    dataset = checked.dataset
    positions = checked.input("street_points")["positions"].values[::7]
    half = float(dataset["side"]) / 2 * (1 + 1e-6)
    away, _ = cKDTree(dataset["voxel"].values).query(positions, p=np.inf)
    return float(np.mean(away <= half))


def _off_plane(checked: StoredVersion) -> float:
    """Metres from points to the still rectangle of their voxel, median."""
    import numpy as np
    from scipy.spatial import cKDTree

    dataset = checked.dataset
    still = ~dataset["turns"].values
    if not still.any():
        return 0.0
    positions = checked.input("street_points")["positions"].values[::7]
    away, nearest = cKDTree(dataset["voxel"].values).query(positions, p=np.inf)
    inside = (away <= float(dataset["side"]) / 2) & still[nearest]
    normal = np.cross(dataset["half_s"].values, dataset["half_t"].values)[nearest[inside]]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    offset = positions[inside] - dataset["centre"].values[nearest[inside]]
    return float(np.median(np.abs((offset * normal).sum(axis=1))))


def _still_share(checked: StoredVersion) -> float:
    return 1.0 - float(checked.dataset["turns"].mean())


@STREET.asset(
    schemas.BILLBOARDS,
    by=("drive",),
    settings=BillboardSettings,
    inputs=("drive_frames", "street_points"),
    pictures=_billboard_pictures,
    checks=(
        Check(
            "points_in",
            "Share of the points that some billboard's voxel holds.",
            _points_in,
            at_least=0.8,
            change=0.02,
        ),
        Check(
            "off_plane",
            "Metres from points to the rectangle that stands still in their voxel, median.",
            _off_plane,
            at_most=0.1,
            change=0.005,
        ),
        Check(
            "still_share",
            "Share of the billboards that stand still.",
            _still_share,
            at_least=0.0,
            change=0.05,
        ),
    ),
)
def billboards(
    settings: BillboardSettings, drive_frames: xr.Dataset, street_points: xr.Dataset
) -> Result:
    """Split space into leaves and lay a rectangle through the points of each."""
    import numpy as np
    import xarray as xr
    from scipy.spatial import cKDTree

    from pipelines.street_billboards.billboards import laid_through
    from pipelines.street_billboards.octree import octree_leaves

    positions = street_points["positions"].values
    places = viewers(drive_frames)
    leaves = octree_leaves(positions, settings.voxel, settings.least_points)
    made = laid_through(
        leaves, positions, taken_cameras(drive_frames), all_turn=settings.planes == "turning"
    )
    # In the order of the road, so that the photographs of a tile can be loaded once for all.
    tile = cKDTree(places).query(made.voxel)[1] // TILE_FRAMES
    order = np.argsort(tile, kind="stable")
    variables = {name: values[order] for name, values in made._asdict().items()}
    dims = {1: ("billboard",), 2: ("billboard", "axis")}
    dataset = xr.Dataset(
        {
            **{name: (dims[values.ndim], values) for name, values in variables.items()},
            "tile": (("billboard",), tile[order].astype(np.int32)),
            "side": ((), leaves.side),
            "depth": ((), np.int64(leaves.depth)),
        }
    )
    return dataset, {
        "billboards": len(order),
        "standing still": int((~made.turns).sum()),
        "levels of the octree": leaves.depth,
    }


# ---- view_textures ---------------------------------------------------------------------------


class TextureSettings(Settings):
    """How textures are sampled."""

    sampling: Literal["occlusion", "plain"] = Field(
        "occlusion",
        description="Only from photographs that see the surface; or, as in the paper, from the "
        "best one, whatever hides the surface there",
    )
    farthest_view: float = Field(40.0, gt=0, description="Metres from the camera, at most")


def _view_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.street_billboards.drawing.pictures import views_sheet

    return {"views": views_sheet(views_of(dataset))}


def _seen_share(checked: StoredVersion) -> float:
    """Of all texels of all views."""
    return float((checked.dataset["states"] == 1).mean().compute())


def _sampling_error(checked: StoredVersion) -> float:
    """Sampled anew with plain NumPy from all photographs: some must show what is stored."""
    import numpy as np

    from pipelines.street_billboards.textures.figures import sampling_error
    from pipelines.street_billboards.textures.forms import ViewTextures

    drive, depths = checked.input("drive_frames"), checked.input("depth_maps")
    stored, dataset = checked.input("billboards"), checked.dataset
    tile = int(stored["tile"].values[len(stored["tile"]) // 2])
    # Of one tile only: neither all textures nor all photographs are loaded.
    own = np.flatnonzero(stored["tile"].values == tile)
    ends = dataset["first"].values[own[0] : own[-1] + 2]
    some = dataset.isel(view=slice(int(ends[0]), int(ends[-1])))
    views = ViewTextures(ends - ends[0], *(some[name].values for name in ViewTextures._fields[1:]))
    frames = slice(max((tile - 2) * TILE_FRAMES, 0), (tile + 1) * TILE_FRAMES + 2)
    return sampling_error(
        billboards_of(stored.isel(billboard=own)),
        views,
        frame_views(drive, depths, frames),
        _codes(checked.input("street_points"), frames),
    )


def _views_each(checked: StoredVersion) -> float:
    dataset = checked.dataset
    return dataset.sizes["view"] / max(dataset.sizes["billboard_end"] - 1, 1)


def _codes(points: xr.Dataset, frames: slice) -> NDArray[np.uint8]:
    """Codes (photographs, 256, 3) that even out exposures."""
    from pipelines.street_billboards.capture.exposure import evening_codes

    return evening_codes(points["gains"].values[frames].reshape(-1, 3))


@STREET.asset(
    schemas.VIEW_TEXTURES,
    by=("drive",),
    settings=TextureSettings,
    inputs=("drive_frames", "depth_maps", "street_points", "billboards"),
    pictures=_view_pictures,
    checks=(
        Check(
            "seen_share",
            "Share of the views' texels that show the surface.",
            _seen_share,
            at_least=0.2,
            change=0.02,
        ),
        Check(
            "sampling_error",
            "Codes by which sampled texels differ from what any photograph shows there, median.",
            _sampling_error,
            at_most=2.0,
        ),
        Check(
            "views_each",
            "Directions observed of a billboard, mean.",
            _views_each,
            at_least=1.0,
            at_most=32.0,
            change=0.2,
        ),
    ),
)
def view_textures(
    settings: TextureSettings,
    progress: Callable[[float], None],
    drive_frames: xr.Dataset,
    depth_maps: xr.Dataset,
    street_points: xr.Dataset,
    billboards: xr.Dataset,
) -> Result:
    """Sample the billboards' textures, tile of the road by tile."""
    import numpy as np
    import xarray as xr

    from pipelines.street_billboards.textures import view_textures as sampling
    from pipelines.street_billboards.textures.forms import joined

    tiles = billboards["tile"].values
    places, cameras = viewers(drive_frames), taken_cameras(drive_frames)
    parts = []
    for number in np.unique(tiles):
        progress(0.9 * number / (tiles[-1] + 1))
        own = np.flatnonzero(tiles == number)
        some = billboards_of(billboards.isel(billboard=own))
        near = _frames_that_see(cameras, len(places), some.voxel, settings.farthest_view)
        frames = slice(int(near[0]), int(near[-1]) + 1) if len(near) else slice(0, 1)
        photographs = _photographs(
            drive_frames, depth_maps, street_points, frames, settings.farthest_view
        )
        parts.append(
            sampling.view_textures(
                some,
                float(billboards["side"]),
                photographs,
                plain=settings.sampling == "plain",
                farthest=settings.farthest_view,
            )
        )
        del photographs  # before the next tile's are loaded
    views = joined(parts)
    dataset = xr.Dataset(
        {
            "first": (("billboard_end",), views.first),
            "direction": (("view",), views.direction),
            "colours": (("view", "v", "u", "channel"), views.colours),
            "states": (("view", "v", "u"), views.states),
            "sharpness": (("view",), views.sharpness),
        }
    )
    return dataset, {
        "views": len(views.direction),
        "views of a billboard": len(views.direction) / max(len(tiles), 1),
        "raw bytes": 98_304 * len(tiles),
    }


def _frames_that_see(
    cameras: Cameras, frames: int, voxels: NDArray[np.float64], farthest: float
) -> NDArray[np.int64]:
    """Frames of which some camera has some voxel before it, not too far away."""
    import numpy as np

    from pipelines.geometry.cameras import project_points

    seen = np.zeros(len(cameras.to_world), bool)
    for number, pose in enumerate(cameras.to_world):
        depth = project_points(cameras.intrinsics[number], pose, voxels)[1]
        away = np.linalg.norm(voxels - pose[:3, 3], axis=1)
        seen[number] = bool(((depth > 0) & (away < farthest)).any())
    return np.flatnonzero(seen.reshape(frames, -1).any(axis=1))


def _photographs(
    drive: xr.Dataset, depths: xr.Dataset, points: xr.Dataset, frames: slice, farthest: float
) -> Photographs:
    """The photographs of some frames; where a depth is not known, the one of the points."""
    from concurrent.futures import ThreadPoolExecutor

    import numba
    import numpy as np

    from pipelines.street_billboards.capture.surface_depth import surface_depth
    from pipelines.street_billboards.textures.view_textures import Photographs

    views = frame_views(drive, depths, frames)
    places = views.poses[:, :3, 3]
    positions = points["positions"].values
    reach = farthest + 10.0
    near = (positions > places.min(axis=0) - reach) & (positions < places.max(axis=0) + reach)
    positions = positions[near.all(axis=1)]
    _, height, width = views.depth.shape
    depth, deviation = views.depth, views.deviation

    def fill(number: int) -> None:
        unknown = np.isnan(depth[number])
        surface = surface_depth(
            positions,
            0.08,
            views.intrinsics[number],
            views.poses[number],
            width,
            height,
            farthest=reach,
        )
        depth[number][unknown] = surface[unknown]
        deviation[number][unknown] = 0.1

    with ThreadPoolExecutor(numba.get_num_threads()) as threads:
        list(threads.map(fill, range(len(depth))))
    return Photographs(
        views.photographs, depth, deviation, views.intrinsics, views.poses, _codes(points, frames)
    )
