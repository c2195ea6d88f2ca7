"""What a photograph of scratched glass tells: `scratch_photo`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.glass_scratches.declaration import SCRATCHES
from assets_defs.glass_scratches.photograph_files import LARGEST_SIDE, is_photograph, load_scratches
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.system import NOTES, Pictures, Result
from storage.schemas import glass_scratches as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr

    from pipelines.glass_scratches.photograph.photograph_layers import PhotographScratches

_BLUR = 2.5
"""Pixels: what looks narrower is as wide as the photograph's blur."""


class ScratchPhotoSettings(Settings):
    """Your photograph of scratched glass."""

    crop: tuple[int, int, int, int] | None = Field(
        None, description="Your photograph: left, top, width, height in pixels; all by default"
    )
    photo_side: int = Field(
        LARGEST_SIDE, ge=128, le=4096, description="Longer side; larger photographs are averaged"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"photo_side": 384},
        "paper": {"photo_side": 2048},
    }


def _found_pictures(dataset: xr.Dataset) -> Pictures:
    from assets_defs.glass_scratches.datasets import photograph_scratches_of
    from pipelines.glass_scratches.photograph.pictures import found_picture

    scratches = photograph_scratches_of(dataset)
    if scratches is None:
        return {}
    return {"scratches": found_picture(dataset["luminance"].values, scratches)}


def _slender(version: StoredVersion) -> float | None:
    """None where there is no photograph."""
    import numpy as np

    dataset = version.dataset
    if dataset.sizes["segment"] == 0:
        return None
    return float(np.median(dataset["length"].values / dataset["width"].values))


@SCRATCHES.asset(
    schemas.SCRATCH_PHOTO,
    by=("setting",),
    settings=ScratchPhotoSettings,
    from_source=True,
    pictures=_found_pictures,
    checks=(
        Check(
            "slenderness",
            "Median of the scratches' length over width: spots and grain are round.",
            _slender,
            at_least=4.0,
        ),
    ),
)
def scratch_photo(settings: ScratchPhotoSettings, source: Source) -> Result:
    """Find the scratches of a photograph, and put them into layers."""
    import numpy as np

    from assets_defs.glass_scratches.datasets import photograph_dataset

    if not is_photograph(source):
        return photograph_dataset(np.zeros((0, 0), np.float32), None), {}
    photograph = load_scratches(source, settings.model_dump())
    scratches = photograph.scratches
    dataset = photograph_dataset(photograph.luminance, scratches)
    return dataset, {
        "scratches": len(scratches.layer),
        "layers": len(scratches.angle),
        "coverage": float(scratches.coverage.sum()),
        "pixels of a tile's side": scratches.tile,
        NOTES: (*photograph.notes, *_told(scratches)),
    }


def _told(scratches: PhotographScratches) -> tuple[str, ...]:
    """Notes on what the photograph does not tell."""
    notes = ["A photograph does not tell the cross-section: shape and roughness are as set."]
    thin = float((scratches.segments.width < _BLUR).mean())
    if thin > 0.5:
        notes.append(
            f"{thin:.0%} of the scratches look less than {_BLUR:g} pixels wide: the photograph's "
            "blur is in it, and they may be narrower and stronger."
        )
    return tuple(notes)
