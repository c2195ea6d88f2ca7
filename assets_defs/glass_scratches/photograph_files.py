"""Users' photographs of scratched glass."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from assets_defs.sources import Source
from storage.readers.photographs import SUFFIXES

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pipelines.glass_scratches.photograph.photograph_layers import PhotographScratches

LARGEST_SIDE = 1024
_EXPECTED = (
    "8 or more, over less than a third of it; photograph the glass nearer and in focus, lit from "
    "the side before a smooth dark ground, or set crop to its part with scratches"
)


class ScratchPhotograph(NamedTuple):
    """A photograph (y, x), linear, its scratches, and sentences on what was converted."""

    luminance: NDArray[np.float32]
    scratches: PhotographScratches
    notes: tuple[str, ...]


def is_photograph(source: Source) -> bool:
    """Whether a setting is a photograph of scratched glass, not a cross-section."""
    return source.path is not None and source.path.suffix.lower() in SUFFIXES


def load_scratches(source: Source, settings: Mapping[str, Any]) -> ScratchPhotograph:
    """A photograph with the settings of ``scratch_photo``. Raises BadInput for a file that is no
    photograph, or in which no scratches are seen."""
    import numpy as np
    from skimage.transform import rescale

    from pipelines.drawing.colour import luminance
    from pipelines.glass_scratches.photograph.photograph_layers import photograph_scratches
    from storage.readers.bad_input import BadInput
    from storage.readers.photographs import read_photograph

    assert source.path is not None
    read = read_photograph(source.path, settings.get("crop"))
    if read.opaque is not None:
        raise BadInput(
            source.path, "picture", "transparent in part", "glass everywhere; set crop to its part"
        )
    grey = luminance(read.radiance)
    larger = max(grey.shape) / settings.get("photo_side", LARGEST_SIDE)
    if larger > 1.0:
        grey = rescale(grey, 1.0 / larger, anti_aliasing=True)
    try:
        scratches = photograph_scratches(grey)
    except ValueError as error:
        raise BadInput(source.path, "number of scratches", str(error), _EXPECTED) from error
    return ScratchPhotograph(grey.astype(np.float32), scratches, read.notes)
