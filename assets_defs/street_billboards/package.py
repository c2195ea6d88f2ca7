"""The street for programs that know nothing of the store: `street_package`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field

from assets_defs.checks import Check
from assets_defs.packages import PackageSettings, package_dataset, package_of, read_back_check
from assets_defs.settings import Preset
from assets_defs.street_billboards.capture_datasets import viewers
from assets_defs.street_billboards.datasets import billboards_of, compressed_of, model_of
from assets_defs.street_billboards.declaration import CITY, STREET
from assets_defs.street_billboards.package_tiles import tiles_of
from assets_defs.system import Result
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.street_billboards.live_tiles import LiveTile
    from pipelines.street_billboards.reference_views import Lens
    from pipelines.street_billboards.street_model import StreetModel
    from storage.packages import Figure, Source, View

_LARGEST_HALF = 65504.0
_BUILT_IN = "Apache-2.0 (made by Tsuya)"


class StreetPackageSettings(PackageSettings):
    """The tiles, and the pictures that the package holds."""

    tile_metres: float = Field(24.0, ge=4.0, le=200.0, description="Metres of road in a tile")
    view_width: int = Field(320, ge=32, le=1024, description="Of its reference pictures")
    poster_width: int = Field(960, ge=32, le=2048, description="Of its poster")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"tile_metres": 8.0, "view_width": 160, "poster_width": 160},
    }


def _expected(version: StoredVersion) -> dict[str, Any]:
    """Parts as the datasets have them, by NumPy alone."""
    drive, depth = version.input("drive_frames"), version.input("depth_maps")
    middle, count = drive.sizes["camera"] // 2, drive.sizes["frame"]
    return {
        "path": drive["poses"].values[:, middle].astype(np.float32),
        "path_held_out": drive["held_out"].values.astype(np.uint8),
        "sky": np.minimum(depth["sky"].values, _LARGEST_HALF).astype(np.float16),
        "input": drive["photographs"].values[count // 2, middle],
    }


def _tile_error(version: StoredVersion) -> float:
    """Largest difference of tiles, as they are read back, from billboards and eigen-textures.

    In codes; whatever does not stand where it should, or is missing or twice, counts as 255.
    """
    from pipelines.street_billboards.live_tiles import some_textures
    from pipelines.street_billboards.textures.figures import unpacked_error

    textures = compressed_of(version.input("eigen_textures"))
    billboards = billboards_of(version.input("billboards"))
    tiles = tiles_of(package_of(version))
    rows = np.concatenate([tile.rows for tile in tiles])
    if not np.array_equal(np.sort(rows), np.flatnonzero(np.diff(textures.first) > 0)):
        return 255.0
    for tile in tiles:
        headers = tile.headers.reshape(-1, 5, 4)[: len(tile.rows)]
        stored: tuple[NDArray[np.floating[Any]], ...] = (
            billboards.centre,
            billboards.half_s,
            billboards.half_t,
        )
        for texel, values in enumerate(stored):
            if not np.array_equal(headers[:, texel, :3], values[tile.rows].astype(np.float32)):
                return 255.0
    return max(unpacked_error([t.page], some_textures(textures, t.rows)) for t in tiles)


@STREET.asset(
    schemas.STREET_PACKAGE,
    by=("drive",),
    settings=StreetPackageSettings,
    inputs=(
        "drive_frames",
        "depth_maps",
        "billboards",
        "eigen_textures",
        "texture_atlases",
        "street_frames",
    ),
    kinds=frozenset({"zarr", "pyvista"}),
    checks=(
        read_back_check(_expected),
        Check(
            "tile_error",
            "Largest difference, in codes, of billboards decoded from the tiles as read back.",
            _tile_error,
            at_most=0.01,
        ),
    ),
)
def street_package(
    settings: StreetPackageSettings,
    keys: Mapping[str, str],
    lineage: Sequence[Mapping[str, Any]],
    *,
    drive_frames: xr.Dataset,
    depth_maps: xr.Dataset,
    billboards: xr.Dataset,
    eigen_textures: xr.Dataset,
    texture_atlases: xr.Dataset,
    street_frames: xr.Dataset,
) -> Result:
    """Pack the street in tiles of road, and draw the reference views."""
    from pipelines.street_billboards.live_tiles import live_tiles
    from storage.packages import Contents, write_package
    from storage.packages.street_billboards import PACKAGE

    street = model_of(billboards, texture_atlases, eigen_textures, depth_maps)
    tiles = live_tiles(
        street.billboards, street.textures, viewers(drive_frames), settings.tile_metres
    )
    views = _views(settings, street, drive_frames)
    values = _values(drive_frames, depth_maps, tiles) | {v.picture: frame for v, frame in views}
    contents = Contents(
        _title(keys),
        _sources(settings, keys),
        values | {"poster": _poster(settings, street, drive_frames)},
        _parameters(drive_frames, billboards, street.textures.colour, tiles),
        [view for view, _ in views],
        _figures(drive_frames, texture_atlases, eigen_textures, street_frames),
        lineage,
    )
    content = write_package(PACKAGE, contents)
    return package_dataset(content), {"bytes": len(content), "tiles": len(tiles)}


def _title(keys: Mapping[str, str]) -> str:
    return f"{keys['drive']} street"


def _sources(settings: StreetPackageSettings, keys: Mapping[str, str]) -> list[Source]:
    from storage.packages import Source

    built_in = keys["drive"] == CITY
    return [Source(keys["drive"], _BUILT_IN if built_in else settings.licence or "not stated")]


def _middle(drive_frames: xr.Dataset) -> NDArray[np.float64]:
    poses: NDArray[np.float64] = drive_frames["poses"].values[:, drive_frames.sizes["camera"] // 2]
    return poses


def _lens(drive_frames: xr.Dataset, width: int) -> Lens:
    from pipelines.street_billboards.reference_views import lens_of

    lens = drive_frames["intrinsics"].values[drive_frames.sizes["camera"] // 2]
    return lens_of(lens, (drive_frames.sizes["x"], drive_frames.sizes["y"]), width)


def _values(
    drive_frames: xr.Dataset, depth_maps: xr.Dataset, tiles: Sequence[LiveTile]
) -> dict[str, Any]:
    from pipelines.street_billboards.live_tiles import tile_textures

    middle, frame = drive_frames.sizes["camera"] // 2, drive_frames.sizes["frame"] // 2
    shown = drive_frames["photographs"].isel(frame=frame, camera=middle)
    values: dict[str, Any] = {
        "input": shown.values,
        "tile_billboards": np.array([len(tile.rows) for tile in tiles], np.uint32),
        "tile_stretch": np.array([tile.stretch for tile in tiles], np.float32),
        "tile_box": np.stack([tile.box for tile in tiles]),
        "path": _middle(drive_frames).astype(np.float32),
        "path_held_out": drive_frames["held_out"].values.astype(np.uint8),
        "sky": np.minimum(depth_maps["sky"].values, _LARGEST_HALF).astype(np.float16),
    }
    for number, tile in enumerate(tiles):
        parts = {"billboard": tile.rows.astype(np.uint32), **tile_textures(tile)}
        values |= {f"tile_{number:03d}/{name}": part for name, part in parts.items()}
    return values


def _views(
    settings: StreetPackageSettings, street: StreetModel, drive_frames: xr.Dataset
) -> list[tuple[View, NDArray[np.uint8]]]:
    """The stage's frames, and what tells another program to draw them again."""
    from dataclasses import asdict

    from pipelines.street_billboards.reference_views import SUPERSAMPLING, reference_views
    from storage.packages import View

    lens = _lens(drive_frames, settings.view_width)
    return [
        (
            View(
                view.name,
                f"reference_{number}",
                *lens.size,
                SUPERSAMPLING,
                asdict(view.camera),
                {"show": "street", "path": False},
            ),
            view.frame,
        )
        for number, view in enumerate(reference_views(street, _middle(drive_frames), lens))
    ]


def _poster(
    settings: StreetPackageSettings, street: StreetModel, drive_frames: xr.Dataset
) -> NDArray[np.uint8]:
    from pipelines.street_billboards.reference_views import poster

    return poster(street, _middle(drive_frames), _lens(drive_frames, settings.poster_width))


def _parameters(
    drive_frames: xr.Dataset, billboards: xr.Dataset, colour: str, tiles: Sequence[LiveTile]
) -> dict[str, Any]:
    lens = _lens(drive_frames, drive_frames.sizes["x"])
    half = lens.size[1] / 2 / float(lens.intrinsics[1, 1])
    pages = [tile.page for tile in tiles]
    return {
        "colour": colour,
        "detail_side": pages[0].detail.side,
        "tint_side": pages[0].tint.side,
        "detail_tiles": max(page.detail.most_tiles for page in pages),
        "tint_tiles": max(page.tint.most_tiles for page in pages),
        "view_angle": float(np.degrees(2 * np.arctan(half))),
        "leaf": float(billboards["side"]),
    }


def _figures(
    drive_frames: xr.Dataset,
    texture_atlases: xr.Dataset,
    eigen_textures: xr.Dataset,
    street_frames: xr.Dataset,
) -> list[Figure]:
    from pipelines.street_billboards import figures
    from pipelines.street_billboards.billboards import HEADER_BYTES
    from storage.packages import Figure

    way = figures.path_length(viewers(drive_frames))
    count = texture_atlases.sizes["billboard"]
    size = float(texture_atlases["bytes"]) + HEADER_BYTES * count
    return [
        Figure("PSNR of held-out frames, where covered", float(street_frames["psnr"].mean()), "dB"),
        Figure("SSIM of held-out frames, where covered", float(street_frames["ssim"].mean())),
        Figure("FLIP of held-out frames, where covered", float(street_frames["flip"].mean())),
        Figure("share of held-out frames covered", float(street_frames["covered"].mean())),
        Figure("error of textures (RMSE)", float(eigen_textures["rmse"]), "code"),
        Figure("road", way, "m"),
        Figure("billboards", float(count)),
        Figure("bytes a metre of road", size / way, "byte"),
        Figure("bytes a billboard", size / max(count, 1), "byte"),
    ]
