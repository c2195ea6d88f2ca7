"""Scratched glass as a live picture needs it: halfs, 8-bit coverage, environments small enough, and
frames of the stage to compare it with."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.stage import Camera, orbit
from pipelines.geometry.solids import Solid
from pipelines.glass_scratches.drawing.frames import object_cameras
from pipelines.glass_scratches.drawing.stage_view import Lamp, ScratchedActor, draw_scratched
from pipelines.light.environment_maps import Radiance, check_environment
from pipelines.light.environment_sampling import EnvironmentSampler

LARGEST_HALF = float(np.finfo(np.float16).max)
_LAST = np.uint16(1 << 3)
"""What the last bit of a half that is kept stands for: 7 bits of its mantissa's 10."""
_LARGEST_ROUND = np.uint16(0x7BF8)
POSTER_SIZE = 480, 640
"""Height and width."""
_POSTER_DISTANCE = 3.2
_LAMP = Lamp((-0.8, 0.48, 0.36), 3.0)
"""Behind the plate and beside the picture, in which a lamp would show only on and in the glass."""


def half_radiance(radiance: Radiance, rows: int) -> NDArray[np.float16]:
    """An environment (H, 2 H, 3) in halfs, with at most ``rows`` rows, each a mean over its own.

    Numbers are rounded to 8 significant bits, 0.4 % of themselves at most: of a room, the last bits
    that nobody sees make nearly half of a PNG. Where halfs cannot hold it, which end at 65 504, all
    of it is scaled down. Raises ValueError for a map that ``check_environment`` refuses.

    >>> half_radiance(np.full((6, 12, 3), 2.0, np.float32), 4).shape
    (4, 8, 3)
    """
    import cv2

    check_environment(radiance)
    kept: NDArray[Any] = radiance
    if len(kept) > rows:
        kept = cv2.resize(kept, (2 * rows, rows), interpolation=cv2.INTER_AREA)
    brightest = float(kept.max())
    if brightest > LARGEST_HALF:
        kept = kept * np.float32(LARGEST_HALF / brightest)
    bits = kept.astype(np.float16).view(np.uint16)
    rounded = (bits + np.uint16(_LAST // 2)) // _LAST * _LAST
    return np.minimum(rounded, _LARGEST_ROUND).view(np.float16)


def coverage_codes(coverage: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Coverage in [0, 1] as 8-bit codes, rounded to the nearest.

    >>> coverage_codes(np.array([0.0, 0.5, 1.0], np.float32)).tolist()
    [0, 128, 255]
    """
    return np.rint(coverage * 255.0).astype(np.uint8)


class ReferenceView(NamedTuple):
    """A frame of the stage that a live picture must show, too: (size, size, 3) of 8 bits, sRGB."""

    name: str
    camera: Camera
    lamp: Lamp | None
    frame: NDArray[np.uint8]


def reference_views(
    solid: Solid,
    actor: ScratchedActor,
    light: EnvironmentSampler,
    exposure: float,
    size: int,
) -> tuple[ReferenceView, ...]:
    """The object from far and from close, and close with a lamp beside the environment;
    ``exposure`` multiplies radiance."""
    far, close = object_cameras(solid)
    wanted = (("far", far, None), ("close", close, None), ("lamp", close, _LAMP))
    return tuple(
        ReferenceView(
            name,
            camera,
            lamp,
            to_8bit(
                exposure
                * draw_scratched(
                    actor, light, camera, width=size, height=size, supersampling=2, lamp=lamp
                )[..., :3]
            ),
        )
        for name, camera, lamp in wanted
    )


def poster(actor: ScratchedActor, light: EnvironmentSampler, exposure: float) -> NDArray[np.uint8]:
    """The object from a little above with a lamp that shines on its scratches, 4:3; ``exposure``
    multiplies radiance."""
    height, width = POSTER_SIZE
    camera = orbit((0.0, 0.0, 0.0), _POSTER_DISTANCE, -68.0, 20.0)
    drawn = draw_scratched(
        actor, light, camera, width=width, height=height, supersampling=2, lamp=_LAMP
    )
    return to_8bit(drawn[..., :3] * exposure)
