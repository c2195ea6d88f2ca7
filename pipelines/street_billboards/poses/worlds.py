"""Whether a drive's poses and lenses are what they are taken for, and what to do where not.

Nobody's files say which axes, which unit and which way up they mean. The photographs do: under
right poses the points that several of them show lie where each of them has them
(``sight_stars``). Readings of the poses are compared by that: other axes of the camera, the
inverse, mirrored, in reverse order, another focal length. One that is clearly best is taken and
said; where none is good the drive is refused. The road, as these points have it, tells up and the
unit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import permutations, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.road_plane import Road, find_road, sweep_road
from pipelines.street_billboards.poses.sight_stars import (
    Star,
    confirmed_share,
    find_stars,
    mean_residual,
    sights,
)
from pipelines.street_billboards.poses.units import in_metres

FloatArray = NDArray[np.float64]

_WINDOWS, _LENGTH = 4, 4
"""Places along the drive that are looked at, and frames of each."""
_LEAST_SIGHTS = 200
_GOOD = 0.55
"""Share of the sights that right poses confirm, be they off by centimetres; others a third."""
_SURELY = 0.85
"""Share that they confirm where no other reading is asked about."""
_ROUGH_STARS = 3
"""That all readings are compared by, before the likely ones are by all."""
_BETTER, _EQUAL = 0.15, 0.05
"""Of it: how much more another reading has to confirm, and what two that are as good may differ."""
_AS_EXACT = 1.1
"""Of the least mean residual: what two readings that are as good may differ."""
_NEARLY = 12.0
"""Pixels within which poses are right that are not exact."""
_FOCAL_STEPS = np.exp(np.arange(-15, 16) * 0.02)
"""Factors of the focal length that are tried: by 2 %, up to 35 %."""
_FINE_STEPS = np.exp(np.arange(-9, 10) * 0.0025)
"""Of the best of them, that are tried then."""
_FOCAL_GAIN = 0.9
"""Mean residual with another focal length, over that with the given one, from which on it is
taken."""
_FOCAL_RIGHT = 0.015
"""Of the focal length: what is off by less is left as it is."""
_FOCAL_TOLD = 0.06
"""Of the focal length: where so wide a range explains the photographs, they do not tell it."""
_FOCAL_EQUAL = 1.05
"""Over the least residual: what explains the photographs as well."""
_UPRIGHT = 20.0
"""Degrees between two directions that are one: roads climb, cameras are mounted as they are."""


class World(NamedTuple):
    """A drive as it is: f frames of c cameras, z up, metres, OpenCV's axes, camera to world."""

    poses: FloatArray
    """(f, c, 4, 4)."""
    intrinsics: FloatArray
    """(c, 3, 3)."""
    order: NDArray[np.int64]
    """(f,): which of the given frames each is; not rising where these were out of order."""
    notes: tuple[str, ...]
    """What was mended, a sentence each."""


class _Reading(NamedTuple):
    """One way to take the given poses."""

    name: str
    faults: int
    """How much has to be wrong for it."""
    poses: FloatArray


def right_world(
    load: Callable[[int], NDArray[np.uint8]],
    poses: FloatArray,
    intrinsics: FloatArray,
    *,
    camera_height: float = 1.5,
    is_metric: bool = False,
) -> World:
    """The world in which a drive's photographs agree, z up and in metres.

    load: photographs (c, h, w, 3) of one frame, sRGB, undistorted, in the order of time; poses
    (f, c, 4, 4) as given, meant as camera to world with OpenCV's axes; intrinsics (c, 3, 3),
    pixels; camera_height: metres above the road, which the unit is told by where it is none of the
    usual ones; is_metric: the unit is known to be the metre. Some dozen frames are looked at.

    Raises ValueError with one sentence where poses are no rigid motions, where the photographs show
    too little that several of them share, and where no reading of the poses fits them.
    """
    check_rigid(poses)
    order = along_the_way(poses[:, 0, :3, 3])
    stars = find_stars(lambda frame: load(int(order[frame])), windows(len(poses)))
    found = read_world(
        stars,
        poses[order],
        intrinsics,
        camera_height=camera_height,
        is_metric=is_metric,
        load=lambda frame: load(int(order[frame])),
    )
    if np.array_equal(order, np.arange(len(poses))):
        return found
    said = "The frames' times are out of order: they are taken in the order of their way."
    return found._replace(order=order, notes=(said, *found.notes))


def read_world(
    stars: Sequence[Star],
    poses: FloatArray,
    intrinsics: FloatArray,
    *,
    camera_height: float,
    is_metric: bool = False,
    load: Callable[[int], NDArray[np.uint8]] | None = None,
) -> World:
    """``right_world`` from what photographs share (``sight_stars.find_stars``).

    load: as there, in the order of the poses; without, the road is told by shared features alone.
    """
    shared = [
        np.isfinite(star.seen[:, [other != star.view[0] for other, _ in star.others], 0]).sum()
        for star in stars
    ]
    if sum(shared) < _LEAST_SIGHTS:
        raise ValueError(
            "Neighbouring photographs share too few features to compare the poses with; expected "
            "them to show the same things: they are in another order than the poses, too far "
            "apart, or blank."
        )
    read, notes = _best_reading(stars, poses, intrinsics)
    lens, more = _right_focal(stars, read, intrinsics)
    _check_confirmed(stars, read, lens)
    road = None if load is None else sweep_road(load, read, lens)
    road = road or find_road(stars, read, lens)
    upright, turned = _upright(read, road)
    scaled, unit = (upright, []) if is_metric else in_metres(upright, road, camera_height)
    return World(scaled, lens, np.arange(len(poses)), (*notes, *more, *turned, *unit))


def check_rigid(poses: FloatArray) -> None:
    """Raises ValueError unless poses (…, 4, 4) are rotations, perhaps mirrored, and places."""
    flat = poses.reshape(-1, 4, 4)
    if not np.isfinite(flat).all():
        missing = int((~np.isfinite(flat).all(axis=(1, 2))).sum())
        raise ValueError(f"{missing} poses are missing (not a number); expected one a photograph.")
    turns = flat[:, :3, :3]
    off = np.abs(turns @ turns.swapaxes(1, 2) - np.eye(3)).max()
    if off > 1e-3 or np.abs(flat[:, 3] - [0, 0, 0, 1]).max() > 1e-6:
        raise ValueError(
            f"The poses are no rotations (off by {off:.3g}); expected orthonormal 3 x 3 parts and "
            "a last row of 0 0 0 1."
        )


def windows(frames: int) -> list[range]:
    """Consecutive frames at places all along a drive."""
    length = min(_LENGTH, frames)
    starts = np.unique(np.linspace(0, frames - length, _WINDOWS).astype(int))
    return [range(start, start + length) for start in starts]


def along_the_way(places: FloatArray) -> NDArray[np.int64]:
    """The frames (f, 3) as given, or along the way where that is less than half as far."""
    count = len(places)
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)
    given = float(np.trace(apart, 1))
    far = int(apart[0].argmax())
    ends = (far, int(apart[far].argmax()))
    ways = [_nearest_each(apart, end) for end in ends]
    lengths = [float(apart[way[:-1], way[1:]].sum()) for way in ways]
    if min(lengths) > 0.5 * given:
        return np.arange(count)
    best = ways[int(np.argmin(lengths))]
    # The end that was given first is the first.
    return best if best[0] < best[-1] else best[::-1].copy()


def _nearest_each(apart: FloatArray, start: int) -> NDArray[np.int64]:
    way, left = [start], np.ones(len(apart), bool)
    left[start] = False
    while left.any():
        nearest = int(np.where(left, apart[way[-1]], np.inf).argmin())
        way.append(nearest)
        left[nearest] = False
    return np.array(way)


# ---- which reading ---------------------------------------------------------------------------


def _best_reading(
    stars: Sequence[Star], poses: FloatArray, intrinsics: FloatArray
) -> tuple[FloatArray, list[str]]:
    """The reading that most sights confirm; of those that are as good the one of fewest faults.

    A camera that is rolled is as good on a straight road. The given one stays where it is good.
    """
    readings = _readings(poses)
    given = next(readings)
    share = _confirmed(stars, given.poses, intrinsics)
    if share >= _SURELY:
        return given.poses, []
    few = stars[:: max(len(stars) // _ROUGH_STARS, 1)]
    rough = [(_confirmed(few, one.poses, intrinsics), one) for one in readings]
    least = max(score for score, _ in rough) - 2 * _BETTER
    likely = [one for score, one in rough if score >= least]
    scores = [(_confirmed(stars, one.poses, intrinsics), one) for one in likely]
    best = max(score for score, _ in scores)
    if share >= best - _BETTER:
        return given.poses, []
    equal = [one for score, one in scores if score >= best - _EQUAL]
    left = [mean_residual([sights(s, one.poses, intrinsics) for s in stars]) for one in equal]
    exact = [(o.faults, off, k) for k, (o, off) in enumerate(zip(equal, left, strict=True))]
    _, _, row = min(one for one in exact if one[1] <= _AS_EXACT * min(left))
    return equal[row].poses, [equal[row].name]


def _confirmed(stars: Sequence[Star], poses: FloatArray, intrinsics: FloatArray) -> float:
    return confirmed_share([sights(star, poses, intrinsics) for star in stars])


def _check_confirmed(stars: Sequence[Star], poses: FloatArray, intrinsics: FloatArray) -> None:
    found = [sights(star, poses, intrinsics) for star in stars]
    share = confirmed_share(found)
    if share >= _GOOD:
        return
    reason = (
        "they are off by some pixels each, so adjust them or give better ones"
        if confirmed_share(found, _NEARLY) >= _SURELY
        else "the photographs are in another order than the poses or of another drive, or the "
        "lenses are far off"
    )
    raise ValueError(
        f"Of what several photographs show the poses confirm {share:.0%}; expected {_GOOD:.0%} at "
        f"least: {reason}."
    )


def _readings(poses: FloatArray) -> Iterator[_Reading]:
    """Ways to take poses, the given one first."""
    inverse = np.linalg.inv(poses)
    mirrored = np.linalg.det(poses[0, 0, :3, :3]) < 0
    for inverted, base in ((0, poses), (1, inverse)):
        for order, way in ((0, "as they are"), (1, "reversed")):
            listed = base[::-1] if order else base
            for axes in _axes():
                turn = np.eye(4)
                turn[:3, :3] = axes
                flips = np.linalg.det(axes) < 0
                # A camera that is mirrored is so in a world that is: both, or none.
                world = np.diag([1.0, -1.0, 1.0, 1.0]) if flips != mirrored else np.eye(4)
                read = world @ listed @ turn
                if np.linalg.det(read[0, 0, :3, :3]) < 0:
                    continue
                plain = np.array_equal(axes, np.eye(3))
                opengl = np.array_equal(axes, np.diag([1.0, -1.0, -1.0]))
                faults = 2 * inverted + 2 * order + (0 if plain else 1 if opengl else 3 + 3 * flips)
                faults += bool(_up(read)[2] < -np.cos(np.radians(_UPRIGHT)))
                yield _Reading(_said(inverted, way, axes), faults, np.ascontiguousarray(read))


def _axes() -> Iterator[FloatArray]:
    """The 48 ways to name and point three axes, the given one first."""
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            axes = np.zeros((3, 3))
            axes[order, range(3)] = signs
            yield axes


def _said(inverted: int, way: str, axes: FloatArray) -> str:
    parts = []
    if inverted:
        parts.append("from the world to the camera")
    if way != "as they are":
        parts.append("in reverse order")
    if np.array_equal(axes, np.diag([1.0, -1.0, -1.0])):
        parts.append("with OpenGL's axes of the camera (y up, z back)")
    elif np.linalg.det(axes) < 0:
        parts.append("mirrored (of another handedness)")
    elif not np.array_equal(axes, np.eye(3)):
        parts.append("with other axes of the camera")
    return f"The poses are {' and '.join(parts)}: the photographs say so, and they are turned."


# ---- the lens --------------------------------------------------------------------------------


def _right_focal(
    stars: Sequence[Star], poses: FloatArray, intrinsics: FloatArray
) -> tuple[FloatArray, list[str]]:
    """Intrinsics whose focal lengths, times one factor, explain the photographs best."""

    def left(factor: float) -> float:
        lenses = _zoomed(intrinsics, factor)
        return mean_residual([sights(star, poses, lenses) for star in stars])

    coarse = np.array([left(factor) for factor in _FOCAL_STEPS])
    tried = _FOCAL_STEPS[coarse.argmin()] * _FINE_STEPS
    residuals = np.array([left(factor) for factor in tried])
    least = float(residuals.min())
    factor = float(tried[residuals.argmin()])
    every = np.concatenate([_FOCAL_STEPS, tried])
    as_good = every[np.concatenate([coarse, residuals]) <= _FOCAL_EQUAL * least]
    wide = float(as_good.max() / as_good.min()) - 1
    given = float(coarse[len(_FOCAL_STEPS) // 2])
    if wide > _FOCAL_TOLD:
        return intrinsics, [
            f"The focal length cannot be told from this drive to better than {wide:.0%}: it is "
            "taken as given."
        ]
    if abs(factor - 1) < _FOCAL_RIGHT or least > _FOCAL_GAIN * given:
        return intrinsics, []
    if coarse.argmin() in (0, len(_FOCAL_STEPS) - 1):
        raise ValueError(
            f"The focal length is off by more than {abs(factor - 1):.0%}; expected one with which "
            "poses and photographs agree."
        )
    return _zoomed(intrinsics, factor), [
        f"The focal length is {factor:.1%} of what is given: so the photographs agree with the "
        "poses."
    ]


def _zoomed(intrinsics: FloatArray, factor: float) -> FloatArray:
    made = intrinsics.copy()
    made[:, (0, 1), (0, 1)] *= factor
    return made


# ---- up and unit -----------------------------------------------------------------------------


def _upright(poses: FloatArray, road: Road | None) -> tuple[FloatArray, list[str]]:
    """Poses with z up; as they are where z is nearly up."""
    up = _up(poses) if road is None else road.up
    if up[2] > np.cos(np.radians(_UPRIGHT)):
        return poses, []
    axis = int(np.abs(up).argmax())
    straight = np.zeros(3)
    straight[axis] = np.sign(up[axis])
    along = abs(up[axis]) > np.cos(np.radians(_UPRIGHT))
    turn = np.eye(4)
    turn[:3, :3] = _turn_to_z(straight if along else up)
    name = f"{'-' if straight[axis] < 0 else ''}{'xyz'[axis]}" if along else "an axis of its own"
    return turn @ poses, [f"The world's up is {name}, not z: it is turned."]


def _up(poses: FloatArray) -> FloatArray:
    """What is up for the cameras, (3,)."""
    mean: FloatArray = -poses[..., :3, 1].reshape(-1, 3).mean(axis=0)
    return mean / np.linalg.norm(mean)


def _turn_to_z(up: FloatArray) -> FloatArray:
    """A rotation (3, 3) that takes a unit vector to z."""
    beside = np.eye(3)[int(np.abs(up).argmin())]
    x = np.cross(beside, up)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])
