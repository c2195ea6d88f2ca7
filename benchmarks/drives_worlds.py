"""Drives whose poses mean something else, or nothing: how many are mended, or refused for that.

The simulated city, three cameras or the middle one: what comes back is compared with the truth up
to where the world's zero is and where its x points.
"""

from __future__ import annotations

import json
import re
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.sight_stars import Star, find_stars
from pipelines.street_billboards.poses.worlds import (
    World,
    check_rigid,
    read_world,
    right_world,
    windows,
)

FloatArray = NDArray[np.float64]

FRAMES, SPACING, WIDTH, HEIGHT = 14, 3.0, 640, 400
CAMERA_HEIGHT = 1.9
_METRES, _DEGREES, _SCALE, _FOCAL = 0.15, 0.6, 0.08, 0.025
"""What may be off: places, rotations, a unit that the road alone tells, focal lengths."""
_UP = 3.0

OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])


class Drive(NamedTuple):
    """Photographs (f, c, h, w, 3) and what took them."""

    photographs: NDArray[np.uint8]
    poses: FloatArray
    intrinsics: FloatArray


class Case(NamedTuple):
    """A drive that is given wrongly."""

    name: str
    drive: Drive
    refused: str | None = None
    """What the sentence has to say; None: mended to the truth."""
    frames: NDArray[np.int64] = np.arange(FRAMES)
    """Which of the true frames each of the given ones is."""


def run() -> dict[str, Any]:
    """All figures; ``worlds_wrong`` names what was not right."""
    rig = photographed()
    alone = Drive(rig.photographs[:, 1:2], rig.poses[:, 1:2], rig.intrinsics[1:2])
    wrong, right, null, count = [], 0, 0, 0
    for truth, cases in ((rig, rig_cases(rig)), (alone, alone_cases(alone))):
        stars = _stars(truth)
        for case in cases:
            count += 1
            good = _is_right(case, truth, stars)
            right += good
            null += case.refused is None and fits(as_given(case), case, truth)
            if not good:
                wrong.append(f"{len(truth.intrinsics)}: {case.name}")
    return {
        "worlds": count,
        "worlds_right": right / count,
        "worlds_right_null": null / count,
        "worlds_wrong": wrong,
    }


def photographed() -> Drive:
    """The simulated city from three cameras."""
    from pipelines.virtual.city.city import make_city
    from pipelines.virtual.city.drive import expose_photograph, plan_drive
    from pipelines.virtual.city.drive_photographs import EXPOSURE
    from pipelines.virtual.city.photographing import CityStage
    from storage.readers.street_photographs import street_photographs

    drive = plan_drive(FRAMES, SPACING, WIDTH, HEIGHT, camera_height=CAMERA_HEIGHT)
    shown = np.zeros((FRAMES, 3, HEIGHT, WIDTH, 3), np.uint8)
    random = np.random.default_rng(0)
    with CityStage(make_city(FRAMES * SPACING, 0), street_photographs(), WIDTH, HEIGHT) as stage:
        for place in np.ndindex(FRAMES, 3):
            light = stage.shoot(drive.intrinsics[place[1]], drive.poses[place]).radiance
            shown[place] = expose_photograph(
                light, float(drive.gains[place]), EXPOSURE, 0.004, random
            )
    return Drive(shown, drive.poses, drive.intrinsics)


# ---- the cases -------------------------------------------------------------------------------


def rig_cases(rig: Drive) -> list[Case]:
    """Of three cameras."""
    poses, shuffled = rig.poses, np.random.default_rng(4).permutation(FRAMES)
    back, missing, skewed = np.arange(FRAMES)[::-1], poses.copy(), poses.copy()
    missing[3, 1] = np.nan
    skewed[..., 0, :3] *= 1.2
    blank = np.full_like(rig.photographs, 128)
    return [
        *_both(rig),
        *(_posed(f"up is {name}", rig, turn @ poses) for name, turn in _turns().items()),
        _posed("OpenGL, y up", rig, _turns()["y"] @ poses @ OPENGL),
        _posed("OpenGL, feet", rig, scaled(poses @ OPENGL, 1 / 0.3048)),
        _posed("inverse, millimetres", rig, inverse(scaled(poses, 1000.0))),
        _posed("mirrored, centimetres", rig, scaled(mirrored(poses, 1), 100.0)),
        _posed("inverse of OpenGL's", rig, inverse(poses @ OPENGL)),
        *(_zoomed(rig, factor) for factor in (0.9, 0.95, 1.05, 1.1)),
        _zoomed(rig._replace(poses=poses @ OPENGL), 1.1, "OpenGL, "),
        Case(
            "in any order",
            Drive(rig.photographs[shuffled], poses[shuffled], rig.intrinsics),
            frames=shuffled,
        ),
        Case(
            "photographs in any order",
            rig._replace(photographs=rig.photographs[shuffled]),
            "another order",
        ),
        Case(
            "photographs of one place",
            rig._replace(photographs=np.repeat(rig.photographs[:1], FRAMES, axis=0)),
            "another order than the poses or of another drive",
        ),
        _posed(
            "places off by decimetres", rig, noisy(poses, 0.4, 1.5), "off by some pixels|another"
        ),
        _posed("a pose missing", rig, missing, "missing"),
        _posed("no rotations", rig, skewed, "no rotations"),
        Case("blank photographs", rig._replace(photographs=blank), "too few features"),
        Case(
            "the other way",
            Drive(rig.photographs[back], poses[back], rig.intrinsics),
            frames=back,
        ),
    ]


def alone_cases(alone: Drive) -> list[Case]:
    """Of one camera."""
    poses, shuffled = alone.poses, np.random.default_rng(4).permutation(FRAMES)
    return [
        *_both(alone),
        _posed("KITTI's world", alone, _turns()["-y"] @ poses),
        Case(
            "photographs in any order",
            alone._replace(photographs=alone.photographs[shuffled]),
            "another order",
        ),
    ]


def _both(drive: Drive) -> list[Case]:
    """What a rig and a single camera are asked."""
    poses = drive.poses
    return [
        Case("as it is", drive),
        _posed("OpenGL", drive, poses @ OPENGL),
        _posed("inverse", drive, inverse(poses)),
        _posed("reversed", drive, poses[::-1].copy()),
        *(_posed(f"mirrored {'xyz'[axis]}", drive, mirrored(poses, axis)) for axis in range(3)),
        *(_posed(f"times {unit:g}", drive, scaled(poses, unit)) for unit in (1000.0, 100.0, 0.31)),
        _posed("places off by centimetres", drive, noisy(poses, 0.02, 0.1)),
    ]


def _posed(name: str, drive: Drive, poses: FloatArray, refused: str | None = None) -> Case:
    return Case(name, drive._replace(poses=poses), refused)


def _zoomed(drive: Drive, factor: float, more: str = "") -> Case:
    lens = drive.intrinsics.copy()
    lens[:, (0, 1), (0, 1)] *= factor
    return Case(f"{more}focal length times {factor:g}", drive._replace(intrinsics=lens))


def inverse(poses: FloatArray) -> FloatArray:
    """World to camera instead of camera to world."""
    return np.asarray(np.linalg.inv(poses), np.float64)


def scaled(poses: FloatArray, factor: float) -> FloatArray:
    """Poses in another unit."""
    made = poses.copy()
    made[..., :3, 3] *= factor
    return made


def mirrored(poses: FloatArray, axis: int) -> FloatArray:
    """Poses of a world of the other handedness: this axis points the other way, in both."""
    flip = np.eye(4)
    flip[axis, axis] = -1
    return flip @ poses @ flip


def noisy(poses: FloatArray, metres: float, degrees: float) -> FloatArray:
    """Poses with noise of these standard deviations along and about each axis."""
    import cv2

    random, made = np.random.default_rng(9), poses.copy()
    for place in np.ndindex(poses.shape[:2]):
        turn = cv2.Rodrigues(np.radians(degrees) * random.standard_normal(3))[0]
        made[place][:3, :3] = turn @ made[place][:3, :3]
        made[place][:3, 3] += metres * random.standard_normal(3)
    return made


def _turns() -> dict[str, FloatArray]:
    """Worlds whose up is another axis, by its name."""
    found = {}
    for name, up in (
        ("y", (0, 1, 0)),
        ("-y", (0, -1, 0)),
        ("-z", (0, 0, -1)),
        ("x", (1, 0, 0)),
        ("oblique", (0.5, 0.6, 0.62)),
    ):
        axis = np.array(up, np.float64) / np.linalg.norm(up)
        beside = np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
        beside /= np.linalg.norm(beside)
        turn = np.eye(4)
        turn[:3, :3] = np.stack([beside, np.cross(axis, beside), axis], axis=1)
        found[name] = turn
    return found


# ---- the judgement ---------------------------------------------------------------------------


def _stars(drive: Drive) -> list[Star]:
    return find_stars(lambda frame: drive.photographs[frame], windows(FRAMES))


def _is_right(case: Case, truth: Drive, stars: list[Star]) -> bool:
    try:
        found = _read(case.drive, truth, stars)
    except ValueError as error:
        return case.refused is not None and re.search(case.refused, str(error)) is not None
    return case.refused is None and fits(found, case, truth)


def _read(drive: Drive, truth: Drive, stars: list[Star]) -> World:
    """As ``right_world`` does; what the photographs share is found once where they are the same."""
    if drive.photographs is not truth.photographs:
        return right_world(
            lambda frame: drive.photographs[frame],
            drive.poses,
            drive.intrinsics,
            camera_height=CAMERA_HEIGHT,
        )
    check_rigid(drive.poses)
    return read_world(
        stars,
        drive.poses,
        drive.intrinsics,
        camera_height=CAMERA_HEIGHT,
        load=lambda frame: drive.photographs[frame],
    )


def as_given(case: Case) -> World:
    """What is there if nothing is done."""
    return World(case.drive.poses, case.drive.intrinsics, np.arange(FRAMES), ())


def fits(found: World, case: Case, truth: Drive) -> bool:
    """Whether a world is the true one but for its zero and the direction of its x."""
    poses = truth.poses[case.frames[found.order]]
    ours, theirs = (np.linalg.inv(some[0, 0]) @ some for some in (found.poses, poses))
    way = np.linalg.norm(theirs[..., :3, 3], axis=-1)
    apart = np.linalg.norm(ours[..., :3, 3] - theirs[..., :3, 3], axis=-1)
    turned = ours[..., :3, :3].swapaxes(-1, -2) @ theirs[..., :3, :3]
    angles = np.degrees(np.arccos(np.clip((np.trace(turned, axis1=-2, axis2=-1) - 1) / 2, -1, 1)))
    up = float(found.poses[0, 0, 2, :3] @ poses[0, 0, 2, :3])
    focal = found.intrinsics[:, 0, 0] / truth.intrinsics[:, 0, 0]
    return bool(
        (apart < _METRES + _SCALE * way).all()
        and angles.max() < _DEGREES
        and up > np.cos(np.radians(_UP))
        and np.abs(focal - 1).max() < _FOCAL
    )


if __name__ == "__main__":
    print(json.dumps(run()))
