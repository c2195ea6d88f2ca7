"""Frames of the stage that another program draws again, and a street's poster."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.stage import Camera
from pipelines.geometry.cameras import moved_left
from pipelines.street_billboards.drawing.stage_camera import stage_camera
from pipelines.street_billboards.drawing.street_stage import StreetStage, flight_poses
from pipelines.street_billboards.street_model import StreetModel

FloatArray = NDArray[np.float64]
SUPERSAMPLING = 3
_FIRST = 5
"""Frame of the first view: enough photographs before it saw what it looks at."""


class Lens(NamedTuple):
    """A camera without its place."""

    intrinsics: FloatArray
    """(3, 3), pixels; the principal point is in the middle."""
    size: tuple[int, int]
    """Width and height, pixels."""


class ReferenceView(NamedTuple):
    """A frame and where from."""

    name: str
    camera: Camera
    frame: NDArray[np.uint8]
    """(y, x, 3), sRGB."""
    billboards: bool
    """Whether they are shown in colours of their own."""


def lens_of(intrinsics: FloatArray, size: tuple[int, int], width: int) -> Lens:
    """The lens of a drive's photographs (K (3, 3), width and height), for pictures of a width.

    >>> lens = lens_of(np.array([[100.0, 0, 99.5], [0, 100, 49.5], [0, 0, 1]]), (200, 100), 50)
    >>> lens.size, lens.intrinsics[0].tolist()
    ((50, 25), [25.0, 0.0, 24.5])
    """
    height = max(round(width * size[1] / size[0]), 1)
    focal = float(intrinsics[0, 0]) * width / size[0]
    middle = (width - 1) / 2, (height - 1) / 2
    scaled = np.array([[focal, 0.0, middle[0]], [0.0, focal, middle[1]], [0.0, 0.0, 1.0]])
    return Lens(scaled, (width, height))


def reference_views(street: StreetModel, poses: FloatArray, lens: Lens) -> list[ReferenceView]:
    """On the path of a drive (f, 4, 4), between its frames, and beside it.

    Raises ``drawing.stage.NoGraphicsError`` where nothing can be drawn.
    """
    first, middle = min(_FIRST, len(poses) // 2), len(poses) // 2
    between = flight_poses(poses, 2 * len(poses) - 1, 0.0)[2 * middle - 1]
    named = [
        ("on the path", poses[first]),
        ("between two frames", between),
        ("1 m beside", moved_left(poses[middle], 1.0)),
        ("2 m beside", moved_left(poses[first], 2.0)),
    ]
    return drawn_views(street, named, lens)


def poster(street: StreetModel, poses: FloatArray, lens: Lens) -> NDArray[np.uint8]:
    """The street from a metre beside its path, (y, x, 3) in sRGB."""
    pose = moved_left(poses[min(_FIRST, len(poses) // 2)], 1.0)
    return drawn_views(street, [("poster", pose)], lens)[0].frame


def drawn_views(
    street: StreetModel,
    named: Sequence[tuple[str, FloatArray]],
    lens: Lens,
    *,
    billboards: bool = False,
) -> list[ReferenceView]:
    """Frames from poses (4, 4) with names; billboards: shown in colours of their own.

    Of two billboards in nearly one plane rounding decides which is in front: what they show is the
    same, their own colours are not.
    """
    with StreetStage(
        street.billboards,
        street.pages,
        street.sky,
        lens.size,
        supersampling=SUPERSAMPLING,
        show_billboards=billboards,
    ) as stage:
        return [
            ReferenceView(
                name,
                stage_camera(lens.intrinsics, pose, lens.size[1]),
                to_8bit(stage.view(lens.intrinsics, pose).with_sky),
                billboards,
            )
            for name, pose in named
        ]
