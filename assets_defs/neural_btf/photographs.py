"""Photographs of the material, measured or virtual: `btf_images`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from assets_defs.checks import Check
from assets_defs.neural_btf.datasets import (
    pairs_of,
)
from assets_defs.neural_btf.declaration import BTF, ImageSettings
from assets_defs.sources import Source
from assets_defs.system import Metadata
from storage.readers.btf import open_btf
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]

_BAND_BYTES = 1 << 20


def _image_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.neural_btf.pictures import photograph_sheet, shown_images

    shown = dataset["images"][shown_images(pairs_of(dataset))]
    return {"photographs": photograph_sheet(shown.values)}


def _missing_pairs(checked: StoredVersion) -> float:
    from pipelines.neural_btf.figures import missing_pairs

    return missing_pairs(pairs_of(checked.dataset))


def _dark_share(checked: StoredVersion) -> float:
    images = checked.dataset["images"]
    return float((images.max(dim=("y", "x", "channel")) <= 0).mean().compute())


def _mean_radiance(checked: StoredVersion) -> float:
    return float(checked.dataset["images"].mean(dtype="float64").compute())


@BTF.asset(
    schemas.BTF_IMAGES,
    by=("material",),
    settings=ImageSettings,
    from_source=True,
    pictures=_image_pictures,
    checks=(
        Check(
            "missing_pairs",
            "Pairs of light and view that are missing or there twice.",
            _missing_pairs,
            at_most=0.0,
        ),
        Check(
            "dark_share",
            "Share of the photographs that are black: their light or their file failed.",
            _dark_share,
            at_most=0.0,
        ),
        Check(
            "mean_radiance",
            "Mean of all values.",
            _mean_radiance,
            at_least=0.001,
            at_most=10.0,
            change=0.005,
        ),
    ),
)
def btf_images(
    settings: ImageSettings, source: Source, progress: Callable[[float], None]
) -> Result:
    """Open the photographs, or photograph the virtual cloth; both lazily, view by view."""
    import xarray as xr

    from pipelines.light.directions import Pairs, all_pairs, hemisphere_table

    if source.path is None:
        directions = hemisphere_table(settings.directions)
        pairs = all_pairs(directions, directions)
        height = width = settings.texels
        read = _virtual_photographs(source.key, settings, directions, progress)
        about = {"layout": "virtual gonioreflectometer", "colour": "linear RGB"}
        lights = len(directions)
    else:
        measured = open_btf(source.path, settings.crop)
        pairs = Pairs(measured.light, measured.view)
        height, width = measured.height, measured.width
        read = _told(measured.read, measured.images, progress)
        about = {"layout": measured.layout, "colour": measured.colour}
        if measured.shifted_lights:
            about["shifted lights"] = f"{measured.shifted_lights} photographs, nominal angles kept"
        lights = measured.lights_per_view
    dataset = xr.Dataset(
        {
            "images": (
                ("image", "y", "x", "channel"),
                _lazy_images(read, len(pairs.light), lights, height, width),
            ),
            "light": (("image", "angle"), pairs.light),
            "view": (("image", "angle"), pairs.view),
        },
        attrs={"name": source.name, **about},
    )
    return dataset, {"photographs": len(pairs.light), "texels": height * width, **about}


def _virtual_photographs(
    material: str,
    settings: ImageSettings,
    directions: NDArray[np.float64],
    progress: Callable[[float], None],
) -> Callable[[int, int], NDArray[np.float32]]:
    """Photographs first … last - 1, all of one view."""
    import threading

    from pipelines.virtual.cloth.gonioreflectometer import Gonioreflectometer
    from pipelines.virtual.cloth.weaves import make_cloth

    lock = threading.Lock()  # the gonioreflectometer uses all cores by itself
    size = (settings.texels, settings.texels)
    cloth = make_cloth(material, settings.cloth_seed)
    gonio = Gonioreflectometer(cloth, directions, size, settings.samples, settings.cloth_seed)
    done: set[int] = set()

    def read(first: int, last: int) -> NDArray[np.float32]:
        view, light = divmod(first, len(directions))
        if light or last - first != len(directions):
            raise IndexError(f"photographs {first} to {last} are not one view's")
        with lock:
            photographs = gonio.photographs(directions[view])
            done.add(view)
            progress(len(done) / len(directions))
        return photographs

    return read


def _told(
    read: Callable[[int, int], NDArray[np.float32]],
    images: int,
    progress: Callable[[float], None],
) -> Callable[[int, int], NDArray[np.float32]]:
    """The same reader, which tells how far it has come."""
    done: set[int] = set()

    def telling(first: int, last: int) -> NDArray[np.float32]:
        photographs = read(first, last)
        done.update(range(first, last))
        progress(len(done) / images)
        return photographs

    return telling


def _lazy_images(
    read: Callable[[int, int], NDArray[np.float32]],
    images: int,
    block: int,
    height: int,
    width: int,
) -> Any:
    """A lazy array (image, y, x, channel) float16, read a view at a time.

    Its chunks are bands of rows of a view's photographs: the transposition to texels reads one
    band of all views at a time, and no more.
    """
    import dask
    import dask.array as da
    import numpy as np

    from pipelines.neural_btf.abrdf import check_values

    def half(first: int, last: int) -> NDArray[np.float16]:
        values = read(first, last)
        check_values(values)
        return values.astype(np.float16)

    parts = []
    for first in range(0, images, block):
        last = min(first + block, images)
        shape = (last - first, height, width, 3)
        parts.append(da.from_delayed(dask.delayed(half)(first, last), shape, np.float16))
    rows = -(-_BAND_BYTES // (block * width * 3 * 2))
    return da.concatenate(parts).rechunk({1: min(rows, height)})
