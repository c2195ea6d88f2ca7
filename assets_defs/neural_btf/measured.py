"""Photographs of the user's, turned upright."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from assets_defs.neural_btf.datasets import LazyPhotographs
from storage.readers.btf import ExrColours, MeasuredBTF, open_btf

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pipelines.neural_btf.orientation import Scores

_TURNED = (
    "The photographs lie {best} in their files, by what their relief shows, and were turned "
    "upright; set orientation to upright to keep them as they lie."
)
_UNCLEAR = (
    "The photographs show too little relief to say which way up they are: they were taken as "
    "they lie; set orientation if the light comes from a wrong side."
)


def measured_photographs(
    path: Path, crop: tuple[int, int, int, int] | None, exr_colours: ExrColours, orientation: str
) -> LazyPhotographs:
    """A user's photographs, upright and in linear RGB, read when they are wanted.

    ``crop``: of the photographs as they lie in their files. ``orientation``: how they lie, or
    "auto". Raises BadInput as `open_btf`.
    """
    from pipelines.light.directions import Pairs
    from pipelines.neural_btf.orientation import ORIENTATIONS, central_patch, turned_upright

    measured = open_btf(path, crop, exr_colours)
    notes = measured.notes
    if orientation == "auto":
        # Of whole photographs, whatever a crop leaves of them.
        whole = measured if crop is None else open_btf(path, None, exr_colours)
        patch = central_patch(whole.height, whole.width)
        orientation, said = _orientation(open_btf(path, patch, exr_colours))
        notes = (*notes, *said)
    about = {"layout": measured.layout, "colour": measured.colour, "orientation": orientation}
    if measured.shifted_lights:
        about["shifted lights"] = f"{measured.shifted_lights} photographs, nominal angles kept"
    height, width = measured.height, measured.width
    if ORIENTATIONS.index(orientation) % 2:
        height, width = width, height

    def read(first: int, last: int) -> NDArray[np.float32]:
        return turned_upright(measured.read(first, last), orientation)

    pairs = Pairs(measured.light, measured.view)
    return LazyPhotographs(
        pairs, height, width, measured.lights_per_view, read, about, tuple(notes)
    )


def _orientation(measured: MeasuredBTF) -> tuple[str, tuple[str, ...]]:
    """How photographs lie, and what is to be said of it."""
    scores = _scores(measured)
    if scores is None:
        return "upright", ()
    if not scores.are_clear:
        return "upright", (_UNCLEAR,)
    if scores.best == "upright":
        return "upright", ()
    return scores.best, (_TURNED.format(best=scores.best),)


def _scores(measured: MeasuredBTF) -> Scores | None:
    from pipelines.light.directions import Pairs
    from pipelines.neural_btf.orientation import orientation_scores

    def read(images: NDArray[np.intp]) -> NDArray[np.float32]:
        first = int(images.min())  # factors are multiplied out by blocks, not one by one
        return measured.read(first, int(images.max()) + 1)[images - first]

    return orientation_scores(Pairs(measured.light, measured.view), read)
