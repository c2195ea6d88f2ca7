"""From the store's datasets to what the numerics take."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.geometry.cameras import Cameras
    from pipelines.street_billboards.billboards import Billboards
    from pipelines.street_billboards.capture.point_fusion import FrameViews
    from pipelines.street_billboards.textures.atlases import Page
    from pipelines.street_billboards.textures.forms import CompressedTextures, ViewTextures


def frame_views(drive: xr.Dataset, depths: xr.Dataset, taken: slice) -> FrameViews:
    """The photographs of some frames that are not held out, one row a photograph."""
    import numpy as np

    from pipelines.street_billboards.capture.point_fusion import FrameViews

    frames = depths["frame"].values[taken]
    cameras = drive.sizes["camera"]
    pictures = drive["photographs"].isel(frame=frames).values
    return FrameViews(
        _merged(depths["depth"][taken].values),
        _merged(depths["deviation"][taken].values),
        _merged(pictures),
        np.tile(drive["intrinsics"].values, (len(frames), 1, 1)).reshape(-1, 3, 3),
        drive["poses"].values[frames].reshape(len(frames) * cameras, 4, 4),
    )


def _merged(stacked: NDArray[Any]) -> NDArray[Any]:
    """Frames and cameras as one axis."""
    return stacked.reshape(-1, *stacked.shape[2:])


def taken_cameras(drive: xr.Dataset) -> Cameras:
    """All cameras where they took what is not held out."""
    import numpy as np

    from pipelines.geometry.cameras import Cameras

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


def billboards_of(dataset: xr.Dataset) -> Billboards:
    """The billboards of a `billboards` dataset, or of some of its rows."""
    from pipelines.street_billboards.billboards import Billboards

    return Billboards(*(dataset[name].values for name in Billboards._fields))


def views_of(dataset: xr.Dataset) -> ViewTextures:
    """A `view_textures` dataset's textures."""
    from pipelines.street_billboards.textures.forms import ViewTextures

    return ViewTextures(*(dataset[name].values for name in ViewTextures._fields))


def compressed_of(dataset: xr.Dataset) -> CompressedTextures:
    """An `eigen_textures` dataset's textures."""
    from pipelines.street_billboards.textures.forms import CompressedTextures

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


def compressed_variables(textures: CompressedTextures) -> dict[str, tuple[tuple[str, ...], Any]]:
    """The variables of an `eigen_textures` dataset, without its colour."""
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
    return variables


def page_variables(
    pages: Sequence[Page], billboards: int
) -> dict[str, tuple[tuple[str, ...], NDArray[Any]]]:
    """The variables of a `texture_atlases` dataset: pages end to end, and their shapes."""
    import numpy as np

    def flat(arrays: Iterable[NDArray[Any]]) -> NDArray[Any]:
        return np.concatenate([array.ravel() for array in arrays])

    page_of = np.zeros(billboards, np.int64)
    for number, page in enumerate(pages):
        page_of[page.billboards] = number
    shapes = [
        [array.shape[:2] for array in (*page.detail[:2], *page.tint[:2], page.views, page.masks)]
        for page in pages
    ]
    return {
        "detail": (("detail_byte",), flat(page.detail.texels for page in pages)),
        "detail_scales": (("detail_scale",), flat(page.detail.scales for page in pages)),
        "tint": (("tint_byte",), flat(page.tint.texels for page in pages)),
        "tint_scales": (("tint_scale",), flat(page.tint.scales for page in pages)),
        "views": (("view_byte",), flat(page.views for page in pages)),
        "masks": (("mask_byte",), flat(page.masks for page in pages)),
        "records": (("record",), flat(page.records for page in pages)),
        "shapes": (("page", "texture", "axis_2"), np.array(shapes, np.int64)),
        "reach": (
            ("page", "atlas"),
            np.array([[page.detail.most_tiles, page.tint.most_tiles] for page in pages], np.int64),
        ),
        "page": (("billboard",), page_of),
    }


def pages_of(dataset: xr.Dataset) -> list[Page]:
    """A `texture_atlases` dataset's pages."""
    import numpy as np

    from pipelines.street_billboards.textures.atlases import Atlas, Page

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
