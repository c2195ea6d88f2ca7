"""What stands in the street and what it looks like: `billboards`, `view_textures`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.street_billboards.capture_datasets import (
    exposure_lut_of,
    frame_views,
    photographs_of,
    taken_cameras,
    viewers,
)
from assets_defs.street_billboards.datasets import (
    billboards_dataset,
    billboards_of,
    road_of,
    views_dataset,
    views_of,
    views_of_rows,
)
from assets_defs.street_billboards.declaration import STREET
from assets_defs.system import Pictures, Progress, Result
from pipelines.street_billboards import figures
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.street_billboards.textures.photographs import Photographs

_ASKED_POINTS = 7
"""Every so many points are looked for in billboards."""


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


def _points_in(version: StoredVersion) -> float:
    dataset = version.dataset
    return figures.share_in_voxels(
        _some_points(version), dataset["voxel"].values, float(dataset["side"])
    )


def _off_plane(version: StoredVersion) -> float:
    made = billboards_of(version.dataset)
    return figures.off_plane(
        _some_points(version),
        made.voxel,
        float(version.dataset["side"]),
        centre=made.centre,
        normal=np.cross(made.half_s, made.half_t),
        turns=made.turns,
    )


def _some_points(version: StoredVersion) -> NDArray[np.float64]:
    positions: NDArray[np.float64] = version.input("street_points")["positions"].values
    return positions[::_ASKED_POINTS]


def _still_share(version: StoredVersion) -> float:
    return 1.0 - float(version.dataset["turns"].mean())


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
    from pipelines.street_billboards.billboards import fit_billboards
    from pipelines.street_billboards.octree import octree_leaves
    from pipelines.street_billboards.road_tiles import TiledBillboards, by_tile

    positions = street_points["positions"].values
    leaves = octree_leaves(positions, settings.voxel, settings.least_points)
    made = fit_billboards(
        leaves, positions, taken_cameras(drive_frames), all_turn=settings.planes == "turning"
    )
    road = TiledBillboards(*by_tile(made, viewers(drive_frames)), leaves.side, leaves.depth)
    return billboards_dataset(road), {
        "billboards": len(made.turns),
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


def _seen_share(version: StoredVersion) -> float:
    """Of all texels of all views."""
    return float((version.dataset["states"] == 1).mean().compute())


def _sampling_error(version: StoredVersion) -> float:
    """Of one tile only: neither all textures nor all photographs are loaded."""
    from pipelines.street_billboards.road_tiles import frames_near_tile
    from pipelines.street_billboards.textures.figures import sampling_error

    stored = version.input("billboards")
    tiles = stored["tile"].values
    tile = int(tiles[len(tiles) // 2])
    own = slice(*np.searchsorted(tiles, [tile, tile + 1]).tolist())
    frames = frames_near_tile(tile)
    return sampling_error(
        billboards_of(stored.isel(billboard=own)),
        views_of_rows(version.dataset, own),
        frame_views(version.input("drive_frames"), version.input("depth_maps"), frames),
        exposure_lut_of(version.input("street_points"), frames),
    )


def _views_each(version: StoredVersion) -> float:
    sizes = version.dataset.sizes
    return sizes["view"] / max(sizes["billboard_end"] - 1, 1)


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
    progress: Progress,
    drive_frames: xr.Dataset,
    depth_maps: xr.Dataset,
    street_points: xr.Dataset,
    billboards: xr.Dataset,
) -> Result:
    """Sample the billboards' textures, tile of the road by tile."""
    from pipelines.street_billboards.textures.tile_textures import view_textures_by_tile

    def load(frames: slice) -> Photographs:
        return photographs_of(
            drive_frames, depth_maps, street_points, frames, settings.farthest_view
        )

    road = road_of(billboards)
    views = view_textures_by_tile(
        road,
        taken_cameras(drive_frames),
        depth_maps.sizes["taken"],
        load,
        plain=settings.sampling == "plain",
        farthest=settings.farthest_view,
        progress=lambda fraction: progress(0.9 * fraction),
    )
    return views_dataset(views), {
        "views": len(views.direction),
        "views of a billboard": len(views.direction) / max(len(road.tile), 1),
        "raw bytes": figures.RAW_BYTES * len(road.tile),
    }
