"""Points of a whole drive, and how its photographs are exposed: frames are loaded as they come."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.capture import exposure, point_fusion
from pipelines.street_billboards.capture.observations import observe_points
from pipelines.street_billboards.capture.point_fusion import Points, RgbdViews

_AROUND = 3
"""Frames before and after one that are asked to confirm it."""
_ASKED_FRAMES = 8
"""Frames of which it is measured how much their neighbours confirm."""


class LoadedByFrame(NamedTuple):
    """The frames of a drive, loaded when they are asked for."""

    frames: int
    load: Callable[[slice], RgbdViews]
    """Photographs of some frames with their depths, one row a photograph."""


class Fusion(NamedTuple):
    """What becomes a point."""

    support: int = 2
    """Depth maps that must confirm it."""
    farthest: float = 25.0
    """Metres from the camera."""
    step: int = 2
    """Pixels from one to the next."""
    cell: float = 0.05
    """Metres; points of one cell become one."""
    company: int = 10
    """Points around one without which it is an outlier."""


def company_of(cameras: int) -> int:
    """Points that a point has around it: fewer cameras leave fewer of them on every surface.

    >>> company_of(3), company_of(1)
    (10, 4)
    """
    return math.ceil(10 * min(cameras, 3) / 3)


class DrivePoints(NamedTuple):
    """What the frames of a drive agree on."""

    points: Points
    agreement: NDArray[np.float64]
    """(f,), share of some frames' points that their neighbours confirm; nan: not asked."""


def drive_points(
    drive: LoadedByFrame,
    fusion: Fusion = Fusion(),  # noqa: B008
    *,
    progress: Callable[[float], None] = lambda fraction: None,
) -> DrivePoints:
    """Keep what neighbouring frames confirm, of each frame, and fuse it.

    progress is told the fraction done. Raises ValueError where nothing is confirmed.
    """
    agreement = np.full(drive.frames, np.nan)
    asked = set(np.linspace(0, drive.frames - 1, min(_ASKED_FRAMES, drive.frames)).astype(int))

    def parts() -> Iterator[Points]:
        for number in range(drive.frames):
            progress(number / drive.frames)
            frame = drive.load(slice(number, number + 1))
            neighbours = drive.load(slice(max(number - _AROUND, 0), number + _AROUND + 1))
            if number in asked:
                agreement[number] = point_fusion.photometric_agreement(frame, neighbours)
            yield point_fusion.consistent_points(
                frame,
                neighbours,
                least_support=fusion.support,
                farthest=fusion.farthest,
                step=fusion.step,
            )

    points = point_fusion.fuse_points(parts(), fusion.cell, fusion.company)
    if len(points.positions) == 0:
        raise ValueError(
            "street_points: no point is confirmed by other frames; expected consistent intrinsics "
            "and poses."
        )
    return DrivePoints(points, agreement)


def drive_gains(
    positions: NDArray[np.float64], drive: LoadedByFrame, cameras: int, *, farthest: float
) -> NDArray[np.float64]:
    """Exposures (f, cameras, 3) of a drive's photographs, by the points (n, 3) that they share.

    Factors of linear light, about 1; farthest: metres from a camera that a point may be.
    """
    seen = [
        observe_points(positions, drive.load(slice(number, number + 1)), farthest=farthest).shifted(
            number * cameras
        )
        for number in range(drive.frames)
    ]
    gains = exposure.exposure_gains(
        np.concatenate([row.point for row in seen]),
        np.concatenate([row.photograph for row in seen]),
        np.concatenate([row.radiance for row in seen]),
        drive.frames * cameras,
    )
    return gains.reshape(drive.frames, cameras, 3)
