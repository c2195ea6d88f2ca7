"""Stored billboards, textures and pictures and the objects of `pipelines`, in both directions.

Those of drives, depths and points are in `capture_datasets`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipelines.street_billboards.billboards import Billboards
from pipelines.street_billboards.road_tiles import TiledBillboards
from pipelines.street_billboards.street_model import StreetModel
from pipelines.street_billboards.textures.atlases import Atlas, Page
from pipelines.street_billboards.textures.texture_tables import CompressedTextures, ViewTextures
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.street_billboards.frames import StreetFrames, Viewpoints


# ---- billboards ------------------------------------------------------------------------------


def billboards_dataset(road: TiledBillboards) -> xr.Dataset:
    """`billboards` of a road's."""
    import xarray as xr

    dims = {1: ("billboard",), 2: ("billboard", "axis")}
    return xr.Dataset(
        {
            **{name: (dims[a.ndim], a) for name, a in road.billboards._asdict().items()},
            "tile": (("billboard",), road.tile),
            "side": ((), road.side),
            "depth": ((), np.int64(road.depth)),
        }
    )


def billboards_of(dataset: xr.Dataset) -> Billboards:
    """The billboards of a `billboards` dataset, or of some of its rows."""
    return Billboards(*(dataset[name].values for name in Billboards._fields))


def road_of(dataset: xr.Dataset) -> TiledBillboards:
    """A `billboards` dataset's billboards with the tiles that they lie in."""
    return TiledBillboards(
        billboards_of(dataset),
        dataset["tile"].values,
        float(dataset["side"]),
        int(dataset["depth"]),
    )


# ---- textures --------------------------------------------------------------------------------


def views_dataset(views: ViewTextures) -> xr.Dataset:
    """`view_textures` of sampled textures."""
    import xarray as xr

    return xr.Dataset(
        {
            "first": (("billboard_end",), views.first),
            "direction": (("view",), views.direction),
            "colours": (("view", "v", "u", "channel"), views.colours),
            "states": (("view", "v", "u"), views.states),
            "sharpness": (("view",), views.sharpness),
        }
    )


def views_of(dataset: xr.Dataset) -> ViewTextures:
    """A `view_textures` dataset's textures."""
    return ViewTextures(*(dataset[name].values for name in ViewTextures._fields))


def views_of_rows(dataset: xr.Dataset, billboards: slice) -> ViewTextures:
    """The textures of some consecutive billboards; no others are loaded."""
    ends = dataset["first"].values[billboards.start : billboards.stop + 1]
    some = dataset.isel(view=slice(int(ends[0]), int(ends[-1])))
    return ViewTextures(ends - ends[0], *(some[name].values for name in ViewTextures._fields[1:]))


def compressed_dataset(textures: CompressedTextures, size: int, rmse: float) -> xr.Dataset:
    """`eigen_textures` of compressed textures, of so many bytes and with this error in codes."""
    import xarray as xr

    variables: dict[str, tuple[tuple[str, ...], Any]] = {
        "first": (("billboard_end",), textures.first),
        "direction": (("view",), textures.direction),
        "means": (("view", "channel"), textures.means),
        "ranks": (("billboard", "channel"), textures.ranks),
        "first_mask": (("billboard_end",), textures.first_mask),
        "masks": (("mask", "v", "byte"), textures.masks),
    }
    for number in range(3):
        plane = f"plane_{number}"
        variables |= {
            f"planes_{number}": ((plane, f"v_{number}", f"u_{number}"), textures.planes[number]),
            f"scales_{number}": ((plane,), textures.scales[number]),
            f"weights_{number}": ((f"weight_{number}",), textures.weights[number]),
        }
    return xr.Dataset(
        {**variables, "bytes": ((), np.int64(size)), "rmse": ((), rmse)},
        attrs={"colour": textures.colour},
    )


def compressed_of(dataset: xr.Dataset) -> CompressedTextures:
    """An `eigen_textures` dataset's textures."""

    def channels(name: str) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        first, second, third = (dataset[f"{name}_{number}"].values for number in range(3))
        return first, second, third

    return CompressedTextures(
        colour=str(dataset.attrs["colour"]),
        first=dataset["first"].values,
        direction=dataset["direction"].values,
        means=dataset["means"].values,
        ranks=dataset["ranks"].values,
        planes=channels("planes"),
        scales=channels("scales"),
        weights=channels("weights"),
        first_mask=dataset["first_mask"].values,
        masks=dataset["masks"].values,
    )


def atlases_dataset(pages: Sequence[Page], textures: CompressedTextures) -> xr.Dataset:
    """`texture_atlases` of pages: one after the other, and their shapes."""
    import xarray as xr

    def flat(arrays: Iterable[NDArray[Any]]) -> NDArray[Any]:
        return np.concatenate([array.ravel() for array in arrays])

    page_of = np.zeros(len(textures.first) - 1, np.int64)
    for number, page in enumerate(pages):
        page_of[page.billboards] = number
    shapes = [
        [array.shape[:2] for array in (*page.detail[:2], *page.tint[:2], page.views, page.masks)]
        for page in pages
    ]
    reach = [[page.detail.most_tiles, page.tint.most_tiles] for page in pages]
    return xr.Dataset(
        {
            "detail": (("detail_byte",), flat(page.detail.texels for page in pages)),
            "detail_scales": (("detail_scale",), flat(page.detail.scales for page in pages)),
            "tint": (("tint_byte",), flat(page.tint.texels for page in pages)),
            "tint_scales": (("tint_scale",), flat(page.tint.scales for page in pages)),
            "views": (("view_byte",), flat(page.views for page in pages)),
            "masks": (("mask_byte",), flat(page.masks for page in pages)),
            "records": (("record",), flat(page.records for page in pages)),
            "shapes": (("page", "texture", "axis_2"), np.array(shapes, np.int64)),
            "reach": (("page", "atlas"), np.array(reach, np.int64)),
            "page": (("billboard",), page_of),
            "bytes": ((), np.int64(sum(page.bytes for page in pages))),
            "padding": ((), np.int64(sum(page.padding for page in pages))),
        },
        attrs={"colour": textures.colour},
    )


def pages_of(dataset: xr.Dataset) -> list[Page]:
    """A `texture_atlases` dataset's pages."""
    names = ("detail", "detail_scales", "tint", "tint_scales", "views", "masks")
    flat = {name: dataset[name].values for name in (*names, "records")}
    taken = dict.fromkeys(flat, 0)

    def cut(name: str, shape: tuple[int, ...]) -> NDArray[Any]:
        start, count = taken[name], int(np.prod(shape))
        taken[name] += count
        return flat[name][start : start + count].reshape(shape)

    pages = []
    for number, shapes in enumerate(dataset["shapes"].values):
        arrays = {name: cut(name, (*shape, 4)) for name, shape in zip(names, shapes, strict=True)}
        rows = np.flatnonzero(dataset["page"].values == number)
        sides = [
            arrays[name].shape[0] // max(arrays[f"{name}_scales"].shape[0], 1)
            for name in ("detail", "tint")
        ]
        reach = dataset["reach"].values[number]
        pages.append(
            Page(
                rows,
                Atlas(arrays["detail"], arrays["detail_scales"], sides[0], int(reach[0])),
                Atlas(arrays["tint"], arrays["tint_scales"], sides[1], int(reach[1])),
                arrays["views"],
                arrays["masks"],
                cut("records", (len(rows), 2, 4)),
                int(dataset["bytes"]),
                int(dataset["padding"]),
            )
        )
    return pages


# ---- pictures --------------------------------------------------------------------------------


def model_of(
    billboards: xr.Dataset,
    texture_atlases: xr.Dataset,
    eigen_textures: xr.Dataset,
    depth_maps: xr.Dataset,
) -> StreetModel:
    """All that a street is drawn from."""
    return StreetModel(
        billboards_of(billboards),
        pages_of(texture_atlases),
        compressed_of(eigen_textures),
        depth_maps["sky"].values,
    )


def viewpoints_of(
    drive: xr.Dataset, offsets: Sequence[float], flight_frames: int, swerve: float
) -> Viewpoints:
    """Where a drive's middle camera looks from."""
    from pipelines.street_billboards.frames import viewpoints

    middle = drive.sizes["camera"] // 2
    return viewpoints(
        drive["intrinsics"].values[middle],
        drive["poses"].values[:, middle],
        drive["held_out"].values,
        (drive.sizes["x"], drive.sizes["y"]),
        offsets=offsets,
        flight_frames=flight_frames,
        swerve=swerve,
    )


def true_pictures(drive: xr.Dataset) -> NDArray[np.uint8]:
    """Photographs (held, y, x, 3) of the middle camera that were held out."""
    held_out, middle = drive["held_out"].values, drive.sizes["camera"] // 2
    pictures: NDArray[np.uint8] = drive["photographs"].isel(frame=held_out, camera=middle).values
    return pictures


def frames_dataset(
    frames: StreetFrames,
    truth: NDArray[np.uint8],
    offsets: Sequence[float],
    beside_truth: NDArray[np.uint8] | None,
) -> xr.Dataset:
    """`street_frames` of the pictures drawn and the true ones; beside the path if known."""
    import xarray as xr

    pixels = ("y", "x", "channel")
    dataset = xr.Dataset(
        {
            "flight": (("frame", *pixels), frames.flight),
            "rendered": (("held", *pixels), frames.rendered),
            "truth": (("held", *pixels), truth),
            "alone": (("held", *pixels), frames.alone),
            "covered": (("held", "y", "x"), frames.covered),
            "beside": (("held", "offset", *pixels), frames.beside),
            "beside_covered": (("held", "offset", "y", "x"), frames.beside_covered),
            "offset": (("offset",), np.array(offsets)),
            "shaded": (pixels, frames.shaded),
            "decoded": (pixels, frames.decoded),
            **{
                name: (("held",), np.array([getattr(one, name) for one in frames.metrics]))
                for name in ("psnr", "ssim", "flip")
            },
        }
    )
    if beside_truth is not None:
        dataset["beside_truth"] = (("held", "offset", *pixels), beside_truth)
    return dataset


LOADERS: dict[str, Callable[[StoredVersion], object]] = {
    "billboards": lambda version: billboards_of(version.dataset),
    "view_textures": lambda version: views_of(version.dataset),
    "eigen_textures": lambda version: compressed_of(version.dataset),
    "texture_atlases": lambda version: pages_of(version.dataset),
}
"""What ``tsuya.load`` gives, by asset: the billboards, their textures, the pages they are on."""
