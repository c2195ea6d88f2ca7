"""The photograph of the fur: `fur_photo`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.photo_fur.datasets import opaque_of, photograph_dataset, seen_of
from assets_defs.photo_fur.declaration import FUR, PELT
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.system import NOTES, Pictures, Progress, Result
from pipelines.photo_fur import figures
from storage.schemas import photo_fur as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray


class PhotoSettings(Settings):
    """How the photograph is taken in."""

    crop: tuple[int, int, int, int] | None = Field(
        None, description="Left, top, width, height in pixels; the whole photograph by default"
    )
    segment: bool = Field(
        True,
        description="Find the fur, where neither a crop nor transparent pixels say where it is",
    )
    even: bool = Field(True, description="Take the light's slope out of the photograph")
    largest_side: int = Field(
        1024, ge=64, le=8192, description="Longer side in pixels; larger photographs are averaged"
    )
    pelt_size: int = Field(512, ge=64, le=2048, description="Virtual pelt: pixels a side")
    pelt_hairs: int = Field(16_000, ge=100, le=100_000, description="Virtual pelt: hairs")
    pelt_samples: int = Field(24, ge=1, le=4096, description="Virtual pelt: light paths a pixel")
    pelt_seed: int = Field(0, ge=0, description="Virtual pelt: seed")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"largest_side": 128, "pelt_size": 64, "pelt_hairs": 280, "pelt_samples": 16},
        "paper": {"largest_side": 4096, "pelt_samples": 64},
    }


def _pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.photo_fur.suitability import report_picture

    return {"photograph": report_picture(dataset["radiance"].values, opaque_of(dataset))}


def _contrast(version: StoredVersion) -> float:
    return figures.contrast(seen_of(version.dataset, "luminance"))


def _clipped_share(version: StoredVersion) -> float:
    return figures.clipped_share(seen_of(version.dataset, "radiance"))


def _fur_share(version: StoredVersion) -> float:
    opaque = opaque_of(version.dataset)
    return 1.0 if opaque is None else float(opaque.mean())


def _unevenness(version: StoredVersion) -> float | None:
    """None of what is left as it is: the virtual pelt, and where a setting says so."""
    dataset = version.dataset
    if "unevenness_before" not in dataset:
        return None
    return figures.unevenness(dataset["luminance"].values, opaque_of(dataset))


def _read(source: Source, settings: PhotoSettings) -> tuple[xr.Dataset, tuple[str, ...]]:
    """A photograph of the user's or a built-in one, exposed, brought to size and evenly lit, with
    where its fur is, and with notes."""
    from pipelines.photo_fur.photograph import expose, fit_cutout, fit_size
    from pipelines.photo_fur.segmentation import fur_mask
    from pipelines.photo_fur.suitability import evenly_lit
    from storage.readers.photographs import builtin_photograph, read_photograph

    raw = (
        builtin_photograph(source.key)
        if source.path is None
        else read_photograph(source.path, settings.crop)
    )
    radiance, opaque = expose(raw.radiance, raw.opaque), raw.opaque
    notes = raw.notes
    if opaque is not None:
        radiance, opaque = fit_cutout(radiance, opaque, settings.largest_side)
    else:
        radiance = fit_size(radiance, settings.largest_side)
        if settings.segment and settings.crop is None:
            opaque = fur_mask(radiance)
            notes = (*notes, *_said_of(opaque, raw.radiance.shape[1]))
    unevenness = None
    if settings.even:
        radiance, unevenness = evenly_lit(radiance, opaque)
    return photograph_dataset(radiance, source.name, opaque=opaque, unevenness=unevenness), notes


def _said_of(fur: NDArray[np.bool_] | None, width: int) -> tuple[str, ...]:
    """What a note says of fur found in a photograph that was as wide before it was averaged."""
    from pipelines.photo_fur.segmentation import largest_square

    if fur is None:
        return ()
    scale = width / fur.shape[1]
    left, top, side = (int(scale * value) for value in largest_square(fur))
    return (
        f"{fur.mean():.0%} of the photograph was found to be fur, the rest is left out; "
        f"a crop of {left},{top},{side},{side} is all fur, segment=false takes the whole.",
    )


@FUR.asset(
    schemas.FUR_PHOTO,
    by=("photo",),
    settings=PhotoSettings,
    from_source=True,
    pictures=_pictures,
    checks=(
        Check(
            "contrast",
            "Michelson contrast of the 1 % and 99 % luminances: a flat photograph has no depth.",
            _contrast,
            at_least=0.1,
            change=0.02,
        ),
        Check(
            "clipped_share",
            "Share of the pixels that are pure white: their brightness tells no depth.",
            _clipped_share,
            at_most=0.05,
            change=0.005,
        ),
        Check(
            "fur_share",
            "Share of the photograph that is fur.",
            _fur_share,
            at_least=0.15,
            change=0.05,
        ),
        Check(
            "unevenness",
            "Deviation of the light's slope over the fur, in logarithms; 0.7 halves and doubles.",
            _unevenness,
            at_most=0.15,
        ),
    ),
)
def fur_photo(settings: PhotoSettings, source: Source, progress: Progress) -> Result:
    """Read the photograph, or photograph the virtual pelt."""
    from pipelines.virtual.pelt.pelt import make_pelt

    if source.path is None and source.key == PELT:
        radiance, depth = make_pelt(
            settings.pelt_size,
            settings.pelt_hairs,
            settings.pelt_samples,
            settings.pelt_seed,
            progress=progress,
        )
        dataset = photograph_dataset(radiance, source.name, depth=depth)
        return dataset, {"pixels": dataset["luminance"].size}
    dataset, notes = _read(source, settings)
    return dataset, {"pixels": dataset["luminance"].size, NOTES: notes}
