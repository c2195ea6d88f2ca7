"""What a drive without poses is good for, told from a handful of its frames."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.features import match_features, sift_features
from pipelines.street_billboards.poses.found_poses import (
    TOLD,
    FoundPoses,
    find_poses,
    focal_sentence,
)
from pipelines.street_billboards.poses.frame_choice import median_parallax
from pipelines.street_billboards.poses.mapping import Pinhole

FRAMES = 12
"""Frames that are looked at: a good half minute's work."""
ENOUGH_POINTS = 60
"""Sparse points a frame, below which depth will be poor."""
ENOUGH_FRAMES = 20
ENOUGH_PARALLAX = 0.004
"""Of the picture's width, median, from frame to frame."""


class DriveQuality(NamedTuple):
    """What some frames in a row told.

    asked, registered: frames that were looked at, and those that got a pose.
    parallax: median from frame to frame, of the picture's width.
    focal, focal_deviation: pixels; deviation 0: given; nan: no pose was found.
    points: sparse points a frame with a pose.
    residual: median of their root mean square residuals, pixels; nan: no pose was found.
    lacking: sentences on what is missing, each with the way out; none: good.
    """

    asked: int
    registered: int
    parallax: float
    focal: float
    focal_deviation: float
    points: float
    residual: float
    lacking: tuple[str, ...]

    @property
    def is_good(self) -> bool:
        """Whether nothing is lacking."""
        return not self.lacking


def drive_quality(
    pictures: Sequence[NDArray[np.uint8]],
    camera: Pinhole,
    mask: NDArray[np.bool_] | None = None,
    *,
    frames: int,
) -> DriveQuality:
    """Look at some frames in a row of a drive without poses, within a minute.

    pictures: some ``FRAMES`` chosen frames (h, w) or (h, w, 3) uint8, undistorted, best where the
    drive bends; camera: as for ``find_poses``; mask (h, w): False where nothing of the world is
    seen; frames: how many were chosen of the whole drive. Raises ValueError for fewer than two
    pictures.

    >>> quality = drive_quality(frames[20:32], camera, frames=240)  # doctest: +SKIP
    >>> quality.focal_deviation / quality.focal, quality.lacking  # doctest: +SKIP
    (0.02, ())
    """
    if len(pictures) < 2:
        raise ValueError(f"drive: found {len(pictures)} frame(s); expected at least two.")
    parallax = _parallax(pictures, mask)
    lacking = []
    if frames < ENOUGH_FRAMES:
        lacking.append(
            f"Only {frames} frames have parallax; expected at least {ENOUGH_FRAMES}: a longer "
            "drive, or more frames a second."
        )
    if parallax < ENOUGH_PARALLAX:
        lacking.append(
            f"From frame to frame what is seen moves by {parallax:.2%} of the picture's width; "
            f"expected at least {ENOUGH_PARALLAX:.1%}: frames that are farther apart."
        )
    try:
        found = find_poses(pictures, camera, mask)
    except ValueError as error:
        nothing = (len(pictures), 0, parallax, np.nan, np.nan, 0.0, np.nan)
        return DriveQuality(*nothing, (*lacking, str(error)))
    registered = int(found.registered.sum())
    focal, points = float(found.intrinsics[0, 0]), len(found.points) / registered
    lacking += _lacking(found, len(pictures), points)
    return DriveQuality(
        len(pictures),
        registered,
        parallax,
        focal,
        found.focal_deviation,
        points,
        float(np.median(found.errors)),
        tuple(lacking),
    )


def _parallax(pictures: Sequence[NDArray[np.uint8]], mask: NDArray[np.bool_] | None) -> float:
    """Median over neighbouring frames of what no turn explains, of the picture's width."""
    features = [sift_features(picture, mask, 1000) for picture in pictures[:6]]
    height, width = pictures[0].shape[:2]
    ways = []
    for before, after in pairwise(features):
        rows = match_features(before, after)
        moved = before.places[rows[:, 0]], after.places[rows[:, 1]]
        ways.append(median_parallax(*moved, (width, height)) / width)
    return float(np.median(ways))


def _lacking(found: FoundPoses, asked: int, points: float) -> list[str]:
    sentences = []
    registered = int(found.registered.sum())
    focal = float(found.intrinsics[0, 0])
    if registered < asked:
        sentences.append(
            f"{asked - registered} of {asked} frames get no pose: they are blurred, too far apart, "
            "or show too little that stands still."
        )
    if not found.focal_deviation <= TOLD * focal:
        sentences.append(focal_sentence(focal, found.focal_deviation))
    if points < ENOUGH_POINTS:
        sentences.append(
            f"{points:.0f} sparse points a frame; expected at least {ENOUGH_POINTS}: more light, "
            "a clean windscreen, less compression."
        )
    return sentences
