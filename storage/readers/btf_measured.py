"""What every reader of a BTF database gives: directions, a size, and photographs in blocks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput

LARGEST_MEGAPIXELS = 64
"""Of one photograph; the databases' own have 0.64 at most."""


class Photographs(Protocol):
    """Where the blocks come from. Picklable; ``read`` is called by several threads at once."""

    def read(self, first: int, last: int) -> NDArray[np.float32]:
        """Photographs first ... last - 1 as (image, y, x, 3) linear RGB."""
        ...


@dataclass(frozen=True, eq=False)
class MeasuredBTF:
    """A BTF database's files, checked; no pixel is decoded before ``read``.

    ``name``: the file's or the folder's. ``layout``: which database's. ``colour``: one line that
    says how its values become linear RGB. ``light``, ``view``: (image, 2) float64, theta and phi
    in radians of every photograph, as its name or the header gives them (nominal).
    ``height``, ``width``: pixels, after the crop. Photographs stand view by view and inside a
    view light by light: image = view * lights_per_view + light. ``shifted_lights``: photographs
    whose light really stood beside the nominal one, because the camera was in its way (UTIA).
    ``notes``: sentences on what was converted, mended or left out.

    Picklable, and any number of threads may read at once.
    """

    name: str
    layout: str
    colour: str
    light: NDArray[np.float64]
    view: NDArray[np.float64]
    height: int
    width: int
    views: int
    lights_per_view: int
    shifted_lights: int
    photographs: Photographs
    notes: tuple[str, ...] = ()

    @property
    def images(self) -> int:
        """How many photographs there are."""
        return self.views * self.lights_per_view

    def read(self, first: int, last: int) -> NDArray[np.float32]:
        """Photographs first ... last - 1, decoded now: (last - first, height, width, 3) float32.

        Linear RGB with the primaries of sRGB, the top row first; radiance as a camera sees it,
        the light's cosine included; not clamped (above 1 in HDR databases, below 0 outside the
        gamut). Raises BadInput for a file that turns out to be damaged, IndexError for photographs
        that do not exist.
        """
        if not 0 <= first <= last <= self.images:
            raise IndexError(f"photographs {first} to {last} of {self.images} in {self.name}")
        return self.photographs.read(first, last)


class Crop(NamedTuple):
    """A box of an upright photograph, in pixels."""

    left: int
    top: int
    width: int
    height: int

    @property
    def box(self) -> tuple[slice, slice]:
        """Rows and columns."""
        return (
            slice(self.top, self.top + self.height),
            slice(self.left, self.left + self.width),
        )


def checked_crop(
    file: Path, crop: tuple[int, int, int, int] | None, width: int, height: int
) -> Crop:
    """The crop, or all of a photograph of width x height. Raises BadInput where it sticks out."""
    if crop is None:
        return Crop(0, 0, width, height)
    wanted = Crop(*crop)
    inside = (
        min(wanted.left, wanted.top) >= 0
        and min(wanted.width, wanted.height) >= 1
        and wanted.left + wanted.width <= width
        and wanted.top + wanted.height <= height
    )
    if not inside:
        raise BadInput(
            file,
            "crop",
            f"left {wanted.left}, top {wanted.top}, {wanted.width} x {wanted.height} pixels",
            f"a box of 1 x 1 pixel or more inside the photographs' {width} x {height} pixels",
        )
    return wanted


def check_area(file: Path, width: int, height: int) -> None:
    """Raises BadInput for a photograph without pixels or with far too many."""
    if not 1 <= width * height <= LARGEST_MEGAPIXELS * 1_000_000:
        raise BadInput(
            file,
            "size",
            f"{width} x {height} pixels",
            f"1 pixel to {LARGEST_MEGAPIXELS} megapixels",
        )
