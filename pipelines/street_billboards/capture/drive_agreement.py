"""Whether the frames of a drive show one world: asked of a user's drive before any work."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipelines.street_billboards.capture.drive_depth import DriveDepth, DriveFrames, RigFrame
from pipelines.street_billboards.capture.point_fusion import RgbdViews, photometric_agreement
from pipelines.street_billboards.capture.stereo import DepthMaps

_NEAREST, _FARTHEST = 2.0, 40.0
"""Metres between which depth is looked for."""

LEAST_AGREEMENT = 0.3
"""Share of points that neighbouring frames confirm; wrong calibrations leave a tenth."""


def frames_compared(cameras: int) -> int:
    """How many consecutive frames of so many cameras ``neighbours_agreement`` asks for.

    A frame of a rig has its depth alone; one of a single camera has it from those around it.
    """
    return 3 if cameras > 1 else 5


def neighbours_agreement(frames: Sequence[RigFrame]) -> float:
    """Share of the middle frame's textured pixels that the frame before and the one after confirm.

    frames: consecutive, an odd number, 3 at least. See ``point_fusion.photometric_agreement``;
    depth is found for this alone. Raises ValueError as ``DriveDepth.maps`` does.
    """
    middle = len(frames) // 2
    poses = np.stack([frame.poses for frame in frames])
    drive = DriveFrames(frames.__getitem__, poses, np.arange(len(frames)))
    depth = DriveDepth(drive, nearest=_NEAREST, farthest=_FARTHEST)
    before, here, after = (
        _views(depth.maps(number), frames[number]) for number in range(middle - 1, middle + 2)
    )
    beside = RgbdViews._make(
        np.concatenate([getattr(before, name), getattr(after, name)]) for name in RgbdViews._fields
    )
    return photometric_agreement(here, beside)


def _views(maps: DepthMaps, frame: RigFrame) -> RgbdViews:
    return RgbdViews(maps.depth, maps.deviation, *frame)
