"""Poses of a film's frames, its focal length and sparse points, from its pictures alone.

SIFT of each frame is matched with the eight frames before; COLMAP's mapping, set for driving,
makes poses of it, piece by piece of a long film; a bundle adjustment of our own ends each piece and
tells how well the focal length is known; the pieces are joined on the frames that they share.
"""

from __future__ import annotations

import tempfile
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.bundle import Priors, adjust_bundle, residuals, sum_by
from pipelines.street_billboards.poses.features import Features, sift_features
from pipelines.street_billboards.poses.focal_deviation import focal_deviation
from pipelines.street_billboards.poses.joined_pieces import Piece, join_pieces
from pipelines.street_billboards.poses.mapping import Mapped, Pinhole, map_frames, write_matches

PIECE = 100
"""Frames that are mapped together."""
OVERLAP = 15
"""Frames that two pieces share."""
GUESSED_FOCAL = 0.7
"""Of the longer side: between a dash-cam's and a phone's."""
TOLD = 0.05
"""Relative deviation of a focal length that is well enough known."""
SYSTEMATIC = 0.005
"""Relative deviation that no film gets below: of a principal point beside the middle, of a lens
that still bends a little, of features that are found a little off everywhere alike. Films of known
focal lengths were up to 0.9 % off where their covariances said 0.3 %."""
_FREE = 10.0
"""A prior of the focal length's logarithm that says nothing."""
_FEWEST = 8


class FoundPoses(NamedTuple):
    """f frames, n points; the unit and the axes of the world mean nothing yet (:mod:`scale`).

    poses: (f, 4, 4) float64, camera to world, x right, y down, z forward; nan where none was found.
    registered: (f,) bool, whether a pose was found.
    intrinsics: (3, 3) float64, K in pixels.
    focal_deviation: pixels, one standard deviation; 0: the focal length was given; inf: untold.
    points: (n, 3) float64.
    errors: (n,) float64, root mean square of each point's residuals, pixels.
    sightings: (n,) int64, frames in which it was found.
    nearest: (n,) int64, the frame nearest to it of those.
    colours: (n, 3) uint8.
    notes: sentences on what is uncertain or missing, with the way out.
    """

    poses: NDArray[np.float64]
    registered: NDArray[np.bool_]
    intrinsics: NDArray[np.float64]
    focal_deviation: float
    points: NDArray[np.float64]
    errors: NDArray[np.float64]
    sightings: NDArray[np.int64]
    nearest: NDArray[np.int64]
    colours: NDArray[np.uint8]
    notes: tuple[str, ...]


def guessed_pinhole(width: int, height: int) -> Pinhole:
    """A camera of which nothing is known."""
    return Pinhole(
        width,
        height,
        GUESSED_FOCAL * max(width, height),
        ((width - 1) / 2, (height - 1) / 2),
        is_known=False,
    )


def find_poses(
    pictures: Iterable[NDArray[np.uint8]],
    camera: Pinhole,
    mask: NDArray[np.bool_] | None = None,
    *,
    progress: Callable[[float], None] = lambda fraction: None,
) -> FoundPoses:
    """Find the poses of frames, in their order, from what they show.

    pictures: (h, w) or (h, w, 3) uint8 of every frame, undistorted, taken one by one; camera: what
    is known of it, or :func:`guessed_pinhole`; mask (h, w): False where nothing of the world is
    seen (the bonnet); progress is told the frames done. Of a long film a hundred frames at a time
    are worked on. Raises ValueError where fewer than eight frames get a pose.

    >>> found = find_poses(frames, guessed_pinhole(1226, 370))  # doctest: +SKIP
    >>> found.intrinsics[0, 0], found.focal_deviation  # doctest: +SKIP
    (707.4, 6.1)
    """
    pieces: list[Piece] = []
    counted = _Counted(pictures, mask, progress)
    for start, frames in counted.pieces():
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "matches.db"
            write_matches(file, camera, frames)
            mapped = map_frames(file, counted.count - start, camera)
        if mapped is not None and len(mapped.frames) >= 3:
            pieces.append(_piece(mapped, camera, start, counted))
    return _whole(pieces, camera, counted.count)


class _Counted:
    """Features of frames as they come; the last of them stay for the next piece."""

    def __init__(
        self,
        pictures: Iterable[NDArray[np.uint8]],
        mask: NDArray[np.bool_] | None,
        progress: Callable[[float], None],
    ) -> None:
        self.count = 0
        self._colours: list[NDArray[np.uint8]] = []
        self._last: deque[Features] = deque(maxlen=OVERLAP)
        self._stream = self._features(pictures, mask, progress)

    def _features(
        self,
        pictures: Iterable[NDArray[np.uint8]],
        mask: NDArray[np.bool_] | None,
        progress: Callable[[float], None],
    ) -> Iterator[Features]:
        for picture in pictures:
            found = sift_features(picture, mask)
            column, row = np.rint(found.places).astype(int).T
            seen = picture[row.clip(0, len(picture) - 1), column.clip(0, picture.shape[1] - 1)]
            seen = seen[:, None] if seen.ndim == 1 else seen
            self._colours.append(np.broadcast_to(seen, (len(seen), 3)).copy())
            self._last.append(found)
            self.count += 1
            progress(self.count)
            yield found

    def pieces(self) -> Iterator[tuple[int, Iterator[Features]]]:
        """Each piece's first frame and its features."""
        while True:
            shared = list(self._last)
            start = self.count - len(shared)
            first = next(self._stream, None)
            if first is None:
                return
            yield start, chain(shared, [first], islice(self._stream, PIECE - len(shared) - 1))

    def colours(self, frame: NDArray[np.int64], feature: NDArray[np.int64]) -> NDArray[np.uint8]:
        """Of features (m,) of frames (m,)."""
        return np.array(
            [self._colours[f][i] for f, i in zip(frame, feature, strict=True)], np.uint8
        ).reshape(-1, 3)


def _piece(mapped: Mapped, camera: Pinhole, start: int, counted: _Counted) -> Piece:
    prior = Priors() if camera.is_known else Priors(focal=_FREE)
    bundle = adjust_bundle(mapped.bundle, mapped.seen, prior)
    deviation = 0.0 if camera.is_known else focal_deviation(bundle, mapped.seen).stated
    off, depth = residuals(bundle, mapped.seen)
    count = len(bundle.points)
    sightings = np.bincount(mapped.seen.point, minlength=count)
    errors = np.sqrt(sum_by(mapped.seen.point, (off**2).sum(axis=1), count) / sightings)
    order = np.lexsort((depth, mapped.seen.point))
    nearest = order[np.searchsorted(mapped.seen.point[order], np.arange(count))]
    frames = start + mapped.frames
    frame = frames[mapped.seen.frame[nearest]]
    return Piece(
        frames,
        bundle,
        mapped.seen,
        deviation,
        errors,
        frame,
        counted.colours(frame, mapped.feature[nearest]),
    )


def _whole(pieces: list[Piece], camera: Pinhole, count: int) -> FoundPoses:
    joined = join_pieces(pieces, fixed_focal=camera.is_known) if pieces else None
    found = 0 if joined is None else len(joined.frames)
    if joined is None or found < _FEWEST:
        raise ValueError(
            f"film: found poses of {found} of {count} frames; expected at least {_FEWEST}: sharp "
            "pictures of a street that overlap, taken while driving."
        )
    poses = np.full((count, 4, 4), np.nan)
    poses[joined.frames] = joined.poses
    registered = np.zeros(count, np.bool_)
    registered[joined.frames] = True
    intrinsics = joined.intrinsics
    focal = float(intrinsics[0, 0])
    relative = float(np.hypot(joined.deviation, SYSTEMATIC)) if joined.deviation > 0 else 0.0
    deviation = relative * focal
    notes = [*joined.notes]
    if found < count:
        notes.append(f"{count - found} of {count} frames have no pose and are left out.")
    if relative > TOLD:
        notes.append(focal_sentence(focal, deviation))
    return FoundPoses(
        poses,
        registered,
        intrinsics,
        deviation,
        joined.points,
        joined.errors,
        joined.sightings,
        joined.nearest,
        joined.colours,
        tuple(notes),
    )


def focal_sentence(focal: float, deviation: float) -> str:
    """What is said of a focal length that the film does not tell."""
    if np.isfinite(deviation) and deviation < focal:
        known = f"{focal:.0f} pixels with a standard deviation of {deviation / focal:.0%}"
    else:
        known = f"{focal:.0f} pixels, which is a guess"
    return (
        f"The film hardly tells its focal length: {known}. Depths are stretched as much. Give "
        "`focal`, or a film in which the car turns."
    )
