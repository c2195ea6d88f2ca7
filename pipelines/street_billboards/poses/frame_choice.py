"""Which frames of a film poses are found for: chosen by parallax, not by time.

What tells distances is what a camera sees move otherwise than it turns. Corners are followed from
frame to frame (Lucas and Kanade, by OpenCV); the turn that explains most of their ways is taken
off, and what is left, the parallax, says when the next frame is due. So a car that waits gives no
frames, and one that turns on the spot only as many as are needed to follow it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

PARALLAX = 0.012
"""Of the picture's width, median: from a frame to the next that is chosen."""
FEWEST = 8
_WIDTH = 480
"""Pixels to which pictures are made smaller for following."""
_CORNERS = 400
_FEWEST_FOLLOWED = 60
"""Corners, from which on new ones are looked for."""
_READY = 0.7
"""Part of the parallax from which on the sharpest frame is waited for."""
_LOST = 0.25
"""Share of corners that are followed to the next frame of one shot at least."""
_BACK = 1.0
"""Pixels of the small picture that following to and back may be off."""
_FOCAL = 0.9
"""Widths of the picture: the focal length that turns are taken off with. It need not be right."""

Grey = NDArray[np.uint8]


class FrameChoice(NamedTuple):
    """k chosen frames of one shot.

    frames: (k,) int64, rising, numbers of frames.
    parallax: (k - 1,) float64, medians from one to the next, of the picture's width.
    sharpness: (k,) float64, mean magnitude of the pictures' Laplacian, codes.
    notes: sentences on what was left out.
    """

    frames: NDArray[np.int64]
    parallax: NDArray[np.float64]
    sharpness: NDArray[np.float64]
    notes: tuple[str, ...]


def choose_frames(
    pictures: Iterable[tuple[int, Grey]], *, parallax: float = PARALLAX
) -> FrameChoice:
    """Choose frames of a film by their motion.

    pictures: numbers, rising, and grey pictures (h, w) uint8 of every frame, of which some two are
    held at a time; parallax: median from one chosen frame to the next, of the picture's width.
    Where several frames would do, the sharpest is taken. Of a film that is cut, the shot with most
    chosen frames is kept and that is said.

    Raises ValueError for fewer than 8 frames with parallax: nothing, or nearly nothing, moves.
    """
    shots: list[_Shot] = []
    total, last = 0, None
    for number, picture in pictures:
        total, last = total + 1, picture
        small = _Small(number, *_made_small(picture))
        if not shots or not shots[-1].follow(small):
            shots.append(_Shot(small, parallax))
    if last is None:
        raise ValueError("film: found no frame; expected a film of a drive.")
    longest = max(shots, key=lambda shot: len(shot.chosen))
    if len(longest.chosen) < FEWEST:
        raise ValueError(
            f"film: found {len(longest.chosen)} frame(s) with parallax of {total}; expected at "
            f"least {FEWEST}: the camera stands still, or only turns."
        )
    return FrameChoice(
        np.array([number for number, _ in longest.chosen], np.int64),
        np.array(longest.parallaxes),
        np.array([sharpness for _, sharpness in longest.chosen]),
        tuple(_notes(shots, longest, total)),
    )


class _Small(NamedTuple):
    number: int
    grey: Grey
    sharpness: float


def _made_small(picture: Grey) -> tuple[Grey, float]:
    import cv2

    sharpness = float(np.abs(cv2.Laplacian(picture, cv2.CV_16S)).mean())
    height, width = picture.shape
    scale = min(1.0, _WIDTH / width)
    size = round(width * scale), round(height * scale)
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8), sharpness


class _Shot:
    """Frames without a cut, followed one by one."""

    def __init__(self, first: _Small, parallax: float) -> None:
        self.chosen: list[tuple[int, float]] = [(first.number, first.sharpness)]
        self.parallaxes: list[float] = []
        self._parallax = parallax
        self._waiting: list[tuple[_Small, float]] = []
        self._start(first)

    def _start(self, frame: _Small) -> None:
        """Follow anew from a chosen frame."""
        import cv2

        self._last = frame
        found = cv2.goodFeaturesToTrack(frame.grey, _CORNERS, 0.003, 7)
        self._from: NDArray[np.float32] = (
            np.zeros((0, 2), np.float32) if found is None else np.float32(found).reshape(-1, 2)
        )
        self._to = self._from
        self._waiting = []

    def follow(self, frame: _Small) -> bool:
        """Whether the frame belongs to the shot; if so it is taken into account."""
        found, kept = _followed(self._last.grey, frame.grey, self._to)
        if len(kept) >= _FEWEST_FOLLOWED // 2 and kept.mean() < _LOST and self._is_cut(frame):
            return False
        self._from, self._to, self._last = self._from[kept], found[kept], frame
        self._judge(frame)
        return True

    def _is_cut(self, frame: _Small) -> bool:
        """Whether new corners of the last frame are not found either."""
        import cv2

        corners = cv2.goodFeaturesToTrack(self._last.grey, _CORNERS, 0.003, 7)
        if corners is None:
            return True
        return bool(
            _followed(self._last.grey, frame.grey, corners.reshape(-1, 2))[1].mean() < _LOST
        )

    def _judge(self, frame: _Small) -> None:
        width = frame.grey.shape[1]
        moved = median_parallax(self._from, self._to, frame.grey.shape[::-1]) / width
        is_last_chance = len(self._to) < _FEWEST_FOLLOWED
        if moved >= _READY * self._parallax or is_last_chance:
            self._waiting.append((frame, moved))
        if moved >= self._parallax or (is_last_chance and self._waiting):
            self._choose(is_lost=is_last_chance)

    def _choose(self, *, is_lost: bool) -> None:
        """The sharpest of those that wait; what came after it is looked at again from there."""
        waiting = self._waiting
        best = max(range(len(waiting)), key=lambda row: waiting[row][0].sharpness)
        frame, moved = waiting[best]
        corners = len(self._from)
        self._start(frame)
        # With hardly a corner in the picture (a tunnel's end, a white wall) nothing was learnt.
        if not is_lost or len(self._from) > corners:
            self.chosen.append((frame.number, frame.sharpness))
            self.parallaxes.append(moved)
        for later, _ in waiting[best + 1 :]:
            found, kept = _followed(self._last.grey, later.grey, self._to)
            self._from, self._to, self._last = self._from[kept], found[kept], later
            self._judge(later)


def _followed(before: Grey, after: Grey, places: Any) -> tuple[Any, NDArray[np.bool_]]:
    """Where corners (n, 2) of one picture are in the next, and which are found there and back."""
    import cv2

    if not len(places):
        return places, np.zeros(0, np.bool_)
    follow = partial(cv2.calcOpticalFlowPyrLK, winSize=(15, 15), maxLevel=4)
    found, there, _ = follow(before, after, places, None)
    back, again, _ = follow(after, before, found, None)
    apart = np.linalg.norm(back - places, axis=1)
    height, width = after.shape
    inside = ((found >= 0) & (found < [width, height])).all(axis=1)
    return found, (there[:, 0] > 0) & (again[:, 0] > 0) & (apart < _BACK) & inside


def median_parallax(
    before: NDArray[np.floating], after: NDArray[np.floating], size: tuple[int, ...]
) -> float:
    """Median way of places (n, 2) in pixels that no turn of the camera explains; 0 for none.

    size: the picture's width and height. The turn is fitted to the ways by least absolute
    deviations (reweighted least squares), so that what is near does not turn the camera.
    """
    if len(before) < 3:
        return 0.0
    way = (after - before).astype(np.float64)
    turns = _turn_flow((before + after).astype(np.float64) / 2, size)
    weight = np.ones(len(way))
    rest = way
    for _ in range(8):
        weighted = turns * weight[:, None, None]
        turn = np.linalg.lstsq(
            np.einsum("nij,nik->jk", weighted, turns),
            np.einsum("nij,ni->j", weighted, way),
            rcond=None,
        )[0]
        rest = way - turns @ turn
        weight = 1.0 / np.maximum(np.linalg.norm(rest, axis=1), 0.1)
    return float(np.median(np.linalg.norm(rest, axis=1)))


def _turn_flow(places: NDArray[np.float64], size: tuple[int, ...]) -> NDArray[np.float64]:
    """(n, 2, 3): ways in pixels of places for small turns about x, y, z of the camera."""
    focal = _FOCAL * size[0]
    x, y = ((places - [(size[0] - 1) / 2, (size[1] - 1) / 2]) / focal).T
    rows = [[x * y, -(1 + x * x), y], [1 + y * y, -x * y, -x]]
    return focal * np.moveaxis(np.array(rows), -1, 0)


def _notes(shots: list[_Shot], longest: _Shot, total: int) -> Iterator[str]:
    if len(shots) > 1:
        yield (
            f"The film is cut into {len(shots)} shots: the one with most motion, frames "
            f"{longest.chosen[0][0]} to {longest.chosen[-1][0]}, is used."
        )
    yield (
        f"{len(longest.chosen)} of {total} frames were chosen by parallax; those between them, "
        "and where the car stands, are left out."
    )
