"""Depth maps of a whole drive, frame by frame, before the sky that is behind all of them.

Of cameras in a row by ``stereo`` of neighbours. Of one camera, or of several that look different
ways, by ``plane_sweep`` along the road, each on its own: what the frames beside it do not confirm
is unknown, so what moves on its own has no depth. Cameras in a row have stereo alone: together with
the sweep as many pixels are known, as many of them bad, at three times the work.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from itertools import pairwise
from threading import Lock
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.capture import stereo
from pipelines.street_billboards.capture.multi_view_consistency import (
    DepthView,
    OtherDepthViews,
    confirmed_depth,
)
from pipelines.street_billboards.capture.plane_sweep import Photograph, SweptDepth, sweep_depth
from pipelines.street_billboards.capture.sky import SkyView, sky_map, sky_pixels
from pipelines.street_billboards.capture.stereo import DepthMaps

FloatArray = NDArray[np.float64]
Map = NDArray[np.float32]

Made = TypeVar("Made")

_SKY_FRAMES = 6
"""Frames that the sky is put together from."""
_BESIDE = 3
"""Frames before and after one that it is compared with; as many in all at a drive's ends."""
_SHORTEST = 80
"""Steps from one of them to the next that reach as far as depth does, at most."""
_CONFIRMED = 2
"""Frames that must have the same depth."""
_KEPT = 4 * _BESIDE + 2
"""Frames whose photographs and own depths are kept: one and its neighbours ask for fewer."""
_SAME_WAY = 25.0
"""Degrees between what two neighbours look at that see the same."""


class RigFrame(NamedTuple):
    """What the c cameras on a car photographed at one instant."""

    photographs: NDArray[np.uint8]
    """(c, y, x, 3), sRGB."""
    intrinsics: FloatArray
    """(c, 3, 3), pixels."""
    poses: FloatArray
    """(c, 4, 4), from the cameras' axes to the world's."""


class DriveFrames(NamedTuple):
    """The frames of a drive, loaded when they are asked for."""

    load: Callable[[int], RigFrame]
    poses: FloatArray
    """(f, c, 4, 4), of all frames."""
    taken: NDArray[np.integer]
    """(t,), rising: frames that depth may be found from; others are held out."""


class DriveDepth:
    """Depth of a drive's frames, each found when it is asked for; what is kept meanwhile is little.

    nearest, farthest: metres between which depth is looked for. Several threads may ask at once.

    >>> frames = DriveFrames(load, poses, np.flatnonzero(~held_out))  # doctest: +SKIP
    >>> maps = DriveDepth(frames, nearest=2.0, farthest=40.0).before_sky(12)  # doctest: +SKIP
    """

    def __init__(self, frames: DriveFrames, *, nearest: float, farthest: float) -> None:
        self._frames = frames
        self._nearest, self._farthest = nearest, farthest
        self._in_a_row = stand_in_a_row(frames.poses[0])
        self._loaded = _Kept(frames.load)
        self._swept = _Kept(self._sweep)

    def maps(self, frame: int) -> DepthMaps:
        """Depth of one frame's c cameras, held out or not; nan where unknown, the sky too.

        Raises ValueError as ``stereo.depth_maps`` does, and for a frame that has no others.
        """
        if self._in_a_row:
            shown = self._loaded(frame)
            return stereo.depth_maps(*shown, nearest=self._nearest, farthest=self._farthest)
        cameras = range(self._frames.poses.shape[1])
        found = [self._confirmed(frame, camera) for camera in cameras]
        return DepthMaps._make(np.stack(maps) for maps in zip(*found, strict=True))

    def before_sky(self, frame: int) -> DepthMaps:
        """The same, inf where the pixels show the sky."""
        maps = self.maps(frame)
        views = sky_views(self._loaded(frame), maps)
        return DepthMaps(open_to_sky(views), maps.deviation)

    def sky(self) -> NDArray[np.float32]:
        """The sky (``sky.sky_map``) of half a dozen of the frames taken."""
        taken = self._frames.taken
        views: list[SkyView] = []
        for frame in map(int, taken[:: max(len(taken) // _SKY_FRAMES, 1)]):
            views += sky_views(self._loaded(frame), self.maps(frame))
        return sky_map(views)

    def _sweep(self, frame: int) -> list[SweptDepth]:
        """Of each camera, as its photographs along the road have it."""
        shown = self._loaded(frame)
        others = [self._loaded(one) for one in self._beside(frame)]
        return [
            sweep_depth(
                _photograph(shown, camera),
                [_photograph(one, camera) for one in others],
                nearest=self._nearest,
                farthest=self._farthest,
            )
            for camera in range(len(shown.poses))
        ]

    def _confirmed(self, frame: int, camera: int) -> tuple[Map, Map]:
        """What the camera's frames beside it have, too: depth and deviation (y, x)."""
        own, others = self._swept(frame)[camera], self._beside(frame)
        maps = [self._swept(one)[camera] for one in others]
        poses = self._frames.poses[:, camera]
        lens = _lens(self._loaded(frame), camera)
        view = DepthView(own.depth, own.deviation, lens, np.ascontiguousarray(poses[frame]))
        asked = OtherDepthViews(
            np.stack([one.depth for one in maps]),
            np.stack([one.deviation for one in maps]),
            np.stack([_lens(self._loaded(one), camera) for one in others]),
            np.asarray(np.linalg.inv(poses[others]), np.float64),
        )
        return confirmed_depth(view, asked, min(_CONFIRMED, len(others)))

    def _beside(self, frame: int) -> list[int]:
        places = self._frames.poses[:, 0, :3, 3]
        return frames_beside(places, self._frames.taken, frame, self._farthest / _SHORTEST)


class _Kept(Generic[Made]):
    """What a function makes of a frame, made once; the last few are kept."""

    def __init__(self, make: Callable[[int], Made]) -> None:
        self._make, self._lock = make, Lock()
        self._kept: dict[int, Future[Made]] = {}

    def __call__(self, frame: int) -> Made:
        with self._lock:
            known = self._kept.pop(frame, None)
            found = Future[Made]() if known is None else known
            self._kept[frame] = found
            if len(self._kept) > _KEPT:
                del self._kept[next(iter(self._kept))]
        if known is None:
            try:
                found.set_result(self._make(frame))
            except BaseException as error:
                found.set_exception(error)
                raise
        return found.result()


def frames_beside(
    places: FloatArray, taken: NDArray[np.integer], frame: int, least: float
) -> list[int]:
    """Which of the frames taken one is compared with: three before and three after, rising.

    places (f, 3) of all frames; least: metres from each to the next, which a car that stands still
    or creeps does not come. At either end of the drive there are more of the other side. Raises
    ValueError where there is none.

    >>> places = np.array([[0.0, 0, 0], [1, 0, 0], [1.01, 0, 0], [2, 0, 0]])
    >>> frames_beside(places, np.arange(4), 1, 0.5)
    [0, 3]
    """

    def chosen(side: NDArray[np.integer]) -> list[int]:
        found, last = list[int](), frame
        for one in map(int, side):
            if np.linalg.norm(places[one] - places[last]) >= least and len(found) < 2 * _BESIDE:
                found.append(one)
                last = one
        return found

    before, after = chosen(taken[taken < frame][::-1]), chosen(taken[taken > frame])
    more = max(_BESIDE, 2 * _BESIDE - min(len(before), len(after)))
    found = sorted(before[:more] + after[:more])
    if not found:
        raise ValueError(
            f"frame {frame}: no other frame was taken {least:g} m from it; expected a drive."
        )
    return found


def stand_in_a_row(poses: FloatArray) -> bool:
    """Whether each of c cameras (c, 4, 4) stands beside the next and looks the same way.

    >>> pair = np.stack([np.eye(4), np.eye(4)])
    >>> pair[1, 0, 3] = 0.5
    >>> stand_in_a_row(pair), stand_in_a_row(pair[:1])
    (True, False)
    """
    for one, other in pairwise(poses):
        way = np.linalg.inv(one) @ other
        apart = float(np.linalg.norm(way[:3, 3]))
        if not abs(way[0, 3]) > 0.5 * apart or way[2, 2] < np.cos(np.radians(_SAME_WAY)):
            return False
    return len(poses) > 1


def _photograph(frame: RigFrame, camera: int) -> Photograph:
    return Photograph(*(values[camera] for values in frame))


def _lens(frame: RigFrame, camera: int) -> FloatArray:
    k = frame.intrinsics[camera]
    return np.array([k[0, 0], k[1, 1], k[0, 2], k[1, 2]], np.float64)


def open_to_sky(views: Sequence[SkyView]) -> NDArray[np.float32]:
    """The views' depths (c, y, x), inf where their pixels show the sky."""
    depth = [np.where(sky_pixels(view), np.float32(np.inf), view.depth) for view in views]
    return np.array(depth, np.float32)


def sky_views(frame: RigFrame, maps: DepthMaps) -> list[SkyView]:
    """A frame's photographs with their depths, in which the sky is looked for."""
    return list(map(SkyView, frame.photographs, maps.depth, frame.intrinsics, frame.poses))
