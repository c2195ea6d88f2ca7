"""Given poses with noise of centimetres, improved by what the pictures show.

Features that given poses allow to be one are points; points and poses are adjusted together, the
given ones as priors, the cameras of a rig as one. Scale, place and direction stay those given.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.bundle import (
    Bundle,
    FloatArray,
    Priors,
    Sightings,
    adjust_bundle,
    residuals,
)
from pipelines.street_billboards.poses.features import Features, match_features, sift_features
from pipelines.street_billboards.poses.joined_pieces import pose_similarity
from pipelines.street_billboards.poses.tracks import (
    Matches,
    kept_sightings,
    tracks_of,
    triangulated,
)

NEIGHBOURS = 4
"""Frames before that each camera's picture is matched with."""
_ROUNDS = (12.0, 4.0, 2.0)
"""Pixels that sightings may be off, before each adjustment."""
_MOST_MOVED = 3
"""Times the noise of the given poses that they may be moved, root mean square."""
_FEWEST = 30
"""Points of a frame, below which its pose is left as it was given."""


class AdjustedPoses(NamedTuple):
    """f frames of c cameras.

    poses: (f, c, 4, 4) float64, camera to world, as the given ones.
    moved, turned: (f,) float64, metres and radians by which each frame's was changed.
    residual: median of the sightings' residuals in pixels, before and after.
    points: of the world that were used.
    notes: sentences.
    """

    poses: FloatArray
    moved: FloatArray
    turned: FloatArray
    residual: tuple[float, float]
    points: int
    notes: tuple[str, ...]


def adjust_poses(
    frames: Iterable[Sequence[NDArray[np.uint8]]],
    poses: FloatArray,
    intrinsics: FloatArray,
    mask: NDArray[np.bool_] | None = None,
    *,
    noise: tuple[float, float] = (0.05, 0.004),
    progress: Callable[[float], None] = lambda fraction: None,
) -> AdjustedPoses:
    """Take the noise from given poses.

    frames: of each instant the c photographs (h, w, 3) uint8, undistorted, one instant at a time;
    poses (f, c, 4, 4), camera to world; intrinsics (c, 3, 3); mask (h, w): False where nothing of
    the world is seen; noise: standard deviations of the given poses, metres and radians. The rig is
    the mean of what the given poses say of it, and rigid. Raises ValueError where the photographs
    have too few points in common that the poses allow, and where what they show would move the
    poses by more than three times their noise: the poses or the focal length are wrong.
    """
    rig, path = mean_rig(poses)
    matches, pictures = _matched(frames, mask, len(rig), progress)
    row, track = tracks_of(matches)
    picture = np.searchsorted(matches.starts, row, side="right") - 1
    seen = Sightings(picture // len(rig), picture % len(rig), track, matches.places[row])
    count = int(track.max(initial=-1)) + 1
    first = Bundle(path, rig, intrinsics, np.zeros((count, 3)))
    bundle, every = first, seen
    before = np.nan
    for most in _ROUNDS:
        whole = bundle._replace(points=triangulated(bundle, every, count))
        fitting, seen, _ = kept_sightings(whole, every, most)
        _check(seen, pictures)
        if most == _ROUNDS[0]:
            before = _median_residual(fitting, seen)
        adjusted = adjust_bundle(fitting._replace(poses=path), seen, _priors(noise))
        bundle = adjusted
    found = _result(path, bundle, seen, before)
    _check_moved(found, noise)
    return found


def mean_rig(poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A rigid rig (c, 4, 4), camera to rig, and its path (f, 4, 4) of poses (f, c, 4, 4).

    The rig's axes are those of its first camera.
    """
    to_first = np.linalg.inv(poses[:, :1]) @ poses
    rig = np.stack([_mean_pose(column) for column in np.moveaxis(to_first, 1, 0)])
    by_camera = poses @ np.linalg.inv(rig)
    return rig, np.stack([_mean_pose(row) for row in by_camera])


def _mean_pose(poses: FloatArray) -> FloatArray:
    """The mean of poses (k, 4, 4): of the turns the chordal one."""
    left, _, right = np.linalg.svd(poses[:, :3, :3].mean(axis=0))
    mean = np.eye(4)
    mean[:3, :3] = left @ np.diag([1, 1, np.sign(np.linalg.det(left @ right))]) @ right
    mean[:3, 3] = poses[:, :3, 3].mean(axis=0)
    return mean


def _priors(noise: tuple[float, float]) -> Priors:
    return Priors(place=noise[0], turn=noise[1])


def _matched(
    frames: Iterable[Sequence[NDArray[np.uint8]]],
    mask: NDArray[np.bool_] | None,
    cameras: int,
    progress: Callable[[float], None],
) -> tuple[Matches, int]:
    """Features of all pictures, each matched with those before of its camera and beside it."""
    before: deque[list[tuple[int, Features]]] = deque(maxlen=NEIGHBOURS)
    starts, places, pairs = [0], [], []
    for number, photographs in enumerate(frames):
        now: list[tuple[int, Features]] = []
        for camera in range(cameras):
            found = sift_features(photographs[camera], mask)
            others = [earlier[camera] for earlier in before] + now[-1:]
            for start, other in others:
                first = np.array([start, starts[-1]])
                pairs.append(match_features(other, found) + first)
            now.append((starts[-1], found))
            places.append(found.places)
            starts.append(starts[-1] + len(found.places))
        before.append(now)
        progress(number + 1)
    every = Matches(
        np.array(starts),
        np.concatenate(places).astype(np.float64),
        np.concatenate(pairs) if pairs else np.zeros((0, 2), np.int64),
    )
    return every, len(places)


def _check(seen: Sightings, pictures: int) -> None:
    if len(seen.point) < _FEWEST * pictures:
        raise ValueError(
            f"adjust: found {len(seen.point)} sightings of common points in {pictures} photographs "
            f"that the given poses allow; expected at least {_FEWEST} a photograph: poses that are "
            "off by centimetres, and the right focal length."
        )


def _median_residual(bundle: Bundle, seen: Sightings) -> float:
    return float(np.median(np.linalg.norm(residuals(bundle, seen)[0], axis=1)))


def _check_moved(found: AdjustedPoses, noise: tuple[float, float]) -> None:
    moved, turned = (float(np.sqrt(np.mean(off**2))) for off in (found.moved, found.turned))
    if moved > _MOST_MOVED * noise[0] or turned > _MOST_MOVED * noise[1]:
        raise ValueError(
            f"adjust: what is seen would move the given poses by {moved:.2f} m and "
            f"{np.degrees(turned):.2f} degrees; expected at most {_MOST_MOVED} times their noise "
            f"({noise[0]:g} m, {np.degrees(noise[1]):.2g} degrees): a wrong focal length, or poses "
            "of other photographs."
        )


def _result(path: FloatArray, bundle: Bundle, seen: Sightings, before: float) -> AdjustedPoses:
    """Put back onto the given path as a whole."""
    frames = len(path)
    few = np.bincount(seen.frame, minlength=frames) < _FEWEST
    back = pose_similarity(bundle.poses[~few], path[~few])
    adjusted = back.poses(bundle.poses)
    adjusted[few] = path[few]
    moved = np.linalg.norm(adjusted[:, :3, 3] - path[:, :3, 3], axis=1)
    traces = np.einsum("fij,fij->f", adjusted[:, :3, :3], path[:, :3, :3])
    turned = np.arccos(np.clip((traces - 1) / 2, -1, 1))
    rig = bundle.rig.copy()
    rig[:, :3, 3] *= back.scale
    notes = []
    if few.any():
        notes.append(f"{few.sum()} of {frames} frames show too little: their poses stay as given.")
    return AdjustedPoses(
        adjusted[:, None] @ rig[None],
        moved,
        turned,
        (before, _median_residual(bundle, seen)),
        len(bundle.points),
        tuple(notes),
    )
