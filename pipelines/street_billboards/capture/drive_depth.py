"""Depth maps of a whole drive, frame by frame, before the sky that is behind all of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.capture import stereo
from pipelines.street_billboards.capture.sky import SkyView, sky_map, sky_pixels
from pipelines.street_billboards.capture.stereo import DepthMaps

_SKY_FRAMES = 6
"""Frames that the sky is put together from."""


class RigFrame(NamedTuple):
    """What the c cameras on a car photographed at one instant."""

    photographs: NDArray[np.uint8]
    """(c, y, x, 3), sRGB."""
    intrinsics: NDArray[np.float64]
    """(c, 3, 3), pixels."""
    poses: NDArray[np.float64]
    """(c, 4, 4), from the cameras' axes to the world's."""


def drive_sky(
    load: Callable[[int], RigFrame],
    frames: Sequence[int] | NDArray[np.integer],
    *,
    nearest: float,
    farthest: float,
) -> NDArray[np.float32]:
    """The sky (``sky.sky_map``) of half a dozen of these frames, which ``load`` gives by number.

    nearest, farthest: as for ``stereo.depth_maps``.
    """
    views: list[SkyView] = []
    for frame in map(load, frames[:: max(len(frames) // _SKY_FRAMES, 1)]):
        views += sky_views(frame, stereo.depth_maps(*frame, nearest=nearest, farthest=farthest))
    return sky_map(views)


def depth_before_sky(frame: RigFrame, *, nearest: float, farthest: float) -> DepthMaps:
    """Depth maps of a frame by stereo, inf where the pixels show the sky.

    nearest, farthest: metres; raises ValueError as ``stereo.depth_maps`` does.
    """
    maps = stereo.depth_maps(*frame, nearest=nearest, farthest=farthest)
    return DepthMaps(open_to_sky(sky_views(frame, maps)), maps.deviation)


def open_to_sky(views: Sequence[SkyView]) -> NDArray[np.float32]:
    """The views' depths (c, y, x), inf where their pixels show the sky."""
    depth = [np.where(sky_pixels(view), np.float32(np.inf), view.depth) for view in views]
    return np.array(depth, np.float32)


def sky_views(frame: RigFrame, maps: DepthMaps) -> list[SkyView]:
    """A frame's photographs with their depths, in which the sky is looked for."""
    return list(map(SkyView, frame.photographs, maps.depth, frame.intrinsics, frame.poses))
