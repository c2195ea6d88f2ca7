"""Whether the frames of a drive show one world: asked of a user's drive before any work."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipelines.street_billboards.capture import stereo
from pipelines.street_billboards.capture.drive_depth import RigFrame
from pipelines.street_billboards.capture.point_fusion import RgbdViews, photometric_agreement

LEAST_AGREEMENT = 0.3
"""Share of points that neighbouring frames confirm; wrong calibrations leave a tenth."""


def neighbours_agreement(frames: Sequence[RigFrame]) -> float:
    """Share of the second frame's textured pixels that the first and the third confirm.

    See ``point_fusion.photometric_agreement``; depth is found for this alone. Raises ValueError as
    ``stereo.depth_maps`` does.
    """
    before, here, after = (_views(frame) for frame in frames)
    beside = RgbdViews._make(
        np.concatenate([getattr(before, name), getattr(after, name)]) for name in RgbdViews._fields
    )
    return photometric_agreement(here, beside)


def _views(frame: RigFrame) -> RgbdViews:
    maps = stereo.depth_maps(*frame)
    return RgbdViews(maps.depth, maps.deviation, *frame)
