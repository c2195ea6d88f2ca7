"""Photographs of the material, measured or virtual: `btf_images`."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.neural_btf.datasets import (
    LazyPhotographs,
    btf_images_dataset,
    pairs_of,
    photograph_blocks,
)
from assets_defs.neural_btf.declaration import BTF
from assets_defs.neural_btf.measured import measured_photographs
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.system import NOTES, Pictures, Progress, Result
from pipelines.neural_btf import figures
from storage.readers.btf import open_btf
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray


class ImageSettings(Settings):
    """How the BTF is taken in, or measured on the virtual gonioreflectometer."""

    crop: tuple[int, int, int, int] | None = Field(
        None, description="Left, top, width, height in pixels; whole photographs by default"
    )
    orientation: Literal[
        "auto",
        "upright",
        "turned 90",
        "turned 180",
        "turned 270",
        "mirrored",
        "mirrored, turned 90",
        "mirrored, turned 180",
        "mirrored, turned 270",
    ] = Field(
        "auto",
        description="How your photographs lie in their files: mirrored or not, then turned "
        "counter-clockwise; auto: as their relief says",
    )
    exr_colours: Literal["auto", "rgb", "xyz"] = Field(
        "auto",
        description="What R, G, B of your EXR files hold; auto: what their chromaticities say, "
        "else by their names and values",
    )
    texels: int = Field(48, ge=4, le=1024, description="Virtual cloth: texels a side")
    directions: Literal[15, 41, 81, 151] = Field(
        41, description="Virtual cloth: directions of lights, and of views (15, 41, 81 or 151)"
    )
    samples: int = Field(2, ge=1, le=256, description="Virtual cloth: rays a texel")
    cloth_seed: int = Field(0, ge=0, description="Virtual cloth: seed")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"texels": 12, "directions": 15, "samples": 1},
        "paper": {"texels": 100, "directions": 81, "samples": 16},
    }


def texels_and_photographs(material: Source, settings: Settings) -> tuple[int, int]:
    """How many there will be of a material, by its `btf_images` settings."""
    assert isinstance(settings, ImageSettings)
    if material.path is None:
        return settings.texels**2, settings.directions**2
    measured = open_btf(material.path, settings.crop, settings.exr_colours)
    return measured.height * measured.width, measured.images


def _image_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.neural_btf.pictures import photograph_sheet, shown_images

    shown = dataset["images"][shown_images(pairs_of(dataset))]
    return {"photographs": photograph_sheet(shown.values)}


def _missing_pairs(version: StoredVersion) -> float:
    return figures.missing_pairs(pairs_of(version.dataset))


def _dark_share(version: StoredVersion) -> float:
    return figures.dark_share(photograph_blocks(version.dataset["images"]))


def _mean_radiance(version: StoredVersion) -> float:
    return figures.mean_radiance(photograph_blocks(version.dataset["images"]))


def _orientation_margin(version: StoredVersion) -> float | None:
    """None where photographs show no relief, and where their user has said how they lie."""
    from pipelines.neural_btf.orientation import central_patch, orientation_scores

    if version.record["settings"]["orientation"] != "auto":
        return None
    images = version.dataset["images"]
    left, top, width, height = central_patch(images.sizes["y"], images.sizes["x"])
    middle = images[:, top : top + height, left : left + width]
    scores = orientation_scores(pairs_of(version.dataset), lambda chosen: middle[chosen].values)
    return scores.margin("upright") if scores is not None and scores.are_clear else None


def _virtual(material: str, settings: ImageSettings) -> LazyPhotographs:
    """Photographs of a virtual cloth, of any view at a time."""
    from pipelines.light.directions import all_pairs, hemisphere_table
    from pipelines.virtual.cloth.gonioreflectometer import Gonioreflectometer
    from pipelines.virtual.cloth.weaves import make_cloth

    directions = hemisphere_table(settings.directions)
    size = (settings.texels, settings.texels)
    cloth = make_cloth(material, settings.cloth_seed)
    gonio = Gonioreflectometer(cloth, directions, size, settings.samples, settings.cloth_seed)

    def read(first: int, last: int) -> NDArray[np.float32]:
        view, light = divmod(first, len(directions))
        if light or last - first != len(directions):
            raise IndexError(f"photographs {first} to {last} are not one view's")
        return gonio.photographs(directions[view])

    return LazyPhotographs(
        all_pairs(directions, directions),
        *size,
        len(directions),
        _one_at_a_time(read),  # the gonioreflectometer uses all cores by itself
        {"layout": "virtual gonioreflectometer", "colour": "linear RGB"},
    )


def _one_at_a_time(
    read: Callable[[int, int], NDArray[np.float32]],
) -> Callable[[int, int], NDArray[np.float32]]:
    """The same reader, asked by one thread at a time."""
    lock = threading.Lock()

    def reading(first: int, last: int) -> NDArray[np.float32]:
        with lock:
            return read(first, last)

    return reading


def _telling(photographs: LazyPhotographs, progress: Progress) -> LazyPhotographs:
    """The same photographs, which tell how many have been read."""
    done: set[int] = set()

    def read(first: int, last: int) -> NDArray[np.float32]:
        images = photographs.read(first, last)
        done.update(range(first, last))
        progress(len(done) / len(photographs.pairs.light))
        return images

    return photographs._replace(read=read)


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
        Check(
            "orientation_margin",
            "How much better the relief explains the photographs as they lie than turned or "
            "mirrored.",
            _orientation_margin,
            at_least=0.0,
        ),
    ),
)
def btf_images(settings: ImageSettings, source: Source, progress: Progress) -> Result:
    """Open the photographs, or photograph the virtual cloth; both lazily, view by view."""
    photographs = (
        _virtual(source.key, settings)
        if source.path is None
        else measured_photographs(
            source.path, settings.crop, settings.exr_colours, settings.orientation
        )
    )
    shown = {
        "photographs": len(photographs.pairs.light),
        "texels": photographs.height * photographs.width,
        **photographs.about,
        NOTES: photographs.notes,
    }
    return btf_images_dataset(_telling(photographs, progress), source.name), shown
