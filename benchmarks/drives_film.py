"""Figures of poses that are found in a film, or adjusted: against true ones, nulls beside them.

Films of the simulated city with a bend and without one; :func:`found_figures` measures any other
film with known poses in the same way.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.adjusted_poses import adjust_poses
from pipelines.street_billboards.poses.found_poses import find_poses, guessed_pinhole
from pipelines.street_billboards.poses.joined_pieces import pose_similarity
from pipelines.street_billboards.poses.scale import by_road, road_below
from pipelines.virtual.city.bend import STRAIGHT, road_bend
from pipelines.virtual.city.city import make_city
from pipelines.virtual.city.drive import expose_photograph, plan_drive
from pipelines.virtual.city.drive_photographs import EXPOSURE
from pipelines.virtual.city.photographing import CityStage
from storage.readers.street_photographs import street_photographs

FloatArray = NDArray[np.float64]

FRAMES, SPACING, DEGREES = 45, 1.5, 40.0
SIZE, VIEW_ANGLE = (1226, 370), 82.0
"""As of KITTI's cameras."""
STRAIGHT_FRAMES, SMALL = 24, (640, 400)
RIG_FRAMES = 10
NOISE = 0.004
CAMERA_HEIGHT = 1.9
PLACE_NOISE, TURN_NOISE = 0.02, np.radians(0.1)
COVERED = 2.0
"""Deviations within which an error is covered."""


class VirtualFilm(NamedTuple):
    """A film of the simulated city: f frames, c cameras."""

    pictures: NDArray[np.uint8]
    """(f, c, h, w, 3)."""
    poses: FloatArray
    """(f, c, 4, 4)."""
    intrinsics: FloatArray
    """(c, 3, 3)."""


def film_figures() -> dict[str, Any]:
    """All of them: two minutes on two cores."""
    bends = virtual_film(FRAMES, DEGREES, SIZE, cameras=(1,), view_angle=VIEW_ANGLE)
    found = found_figures(bends.pictures[:, 0], bends.poses[:, 0], bends.intrinsics[0], "film")
    straight = virtual_film(STRAIGHT_FRAMES, 0.0, SMALL, cameras=(1,))
    other = found_figures(
        straight.pictures[:, 0], straight.poses[:, 0], straight.intrinsics[0], "film_straight"
    )
    told = other["film_straight_focal_error"] <= COVERED * other["film_straight_focal_deviation"]
    claimed = other["film_straight_focal_error"] <= COVERED * found["film_focal_deviation"]
    rig = virtual_film(RIG_FRAMES, 0.0, SMALL, cameras=(0, 1, 2))
    return {
        **found,
        **other,
        "film_focal_told": float(told),
        "film_focal_told_null": float(claimed),  # if all films told it as well as the bend does
        "poses_s_per_frame": found["film_s_per_frame"],
        **adjusted_figures(rig),
    }


def virtual_film(
    frames: int,
    degrees: float,
    size: tuple[int, int],
    *,
    cameras: tuple[int, ...],
    view_angle: float = 75.0,
    seed: int = 0,
) -> VirtualFilm:
    """A drive along a road that bends, photographed with noise and changing exposure."""
    metres = frames * SPACING
    bend = road_bend(metres, degrees) if degrees else STRAIGHT
    drive = plan_drive(
        frames, SPACING, *size, view_angle=view_angle, camera_height=CAMERA_HEIGHT, bend=bend
    )
    random = np.random.default_rng(seed)
    chosen = list(cameras)
    with CityStage(make_city(metres, seed, bend), street_photographs(), *size) as stage:
        pictures = [
            [
                expose_photograph(
                    stage.shoot(drive.intrinsics[camera], pose[camera]).radiance,
                    gain[camera],
                    EXPOSURE,
                    NOISE,
                    random,
                )
                for camera in chosen
            ]
            for pose, gain in zip(drive.poses, drive.gains, strict=True)
        ]
    return VirtualFilm(np.array(pictures), drive.poses[:, chosen], drive.intrinsics[chosen])


def found_figures(
    pictures: Iterable[NDArray[np.uint8]], poses: FloatArray, intrinsics: FloatArray, name: str
) -> dict[str, Any]:
    """What a film of pictures (h, w) or (h, w, 3) tells alone, of its true poses (f, 4, 4) and K.

    Figures are named ``NAME_ate_m`` and so on; nulls are a car that drives straight ahead at one
    speed, and the focal length that is guessed before.
    """
    every = list(pictures)
    height, width = every[0].shape[:2]
    guess = guessed_pinhole(width, height)
    start = time.process_time()
    found = find_poses(every, guess)
    seconds = time.process_time() - start
    there = found.registered
    true, focal = poses[there], float(intrinsics[0, 0])
    scale = by_road(found.poses, road_below(found.poses, found.points, found.nearest), 1.0).scale
    by_truth = pose_similarity(found.poses[there], true).scale
    return {
        f"{name}_registered": float(there.mean()),
        f"{name}_ate_m": trajectory_error(found.poses[there, :3, 3], true[:, :3, 3]),
        f"{name}_ate_null_m": trajectory_error(_straight_ahead(len(true)), true[:, :3, 3]),
        f"{name}_metres": float(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1).sum()),
        f"{name}_focal_error": abs(found.intrinsics[0, 0] / focal - 1),
        f"{name}_focal_error_null": abs(guess.focal / focal - 1),
        f"{name}_focal_deviation": found.focal_deviation / float(found.intrinsics[0, 0]),
        f"{name}_camera_height_m": by_truth / scale,
        f"{name}_points_per_frame": len(found.points) / int(there.sum()),
        f"{name}_s_per_frame": seconds / len(every),
    }


def adjusted_figures(film: VirtualFilm) -> dict[str, Any]:
    """Noise of 2 cm and 0.1 degree on every pose, before and after ``adjust_poses``."""
    from scipy.spatial.transform import Rotation

    random = np.random.default_rng(0)
    noisy = film.poses.copy()
    noisy[..., :3, 3] += random.normal(scale=PLACE_NOISE, size=(*noisy.shape[:2], 3))
    turns = random.normal(scale=TURN_NOISE, size=(noisy.shape[0] * noisy.shape[1], 3))
    noisy[..., :3, :3] @= Rotation.from_rotvec(turns).as_matrix().reshape(*noisy.shape[:2], 3, 3)
    start = time.process_time()
    found = adjust_poses(iter(film.pictures), noisy, film.intrinsics)
    seconds = time.process_time() - start
    after, before = step_errors(found.poses, film.poses), step_errors(noisy, film.poses)
    return {
        "adjusted_way_m": after[0],
        "adjusted_way_null_m": before[0],
        "adjusted_turn_degrees": after[1],
        "adjusted_turn_null_degrees": before[1],
        "adjusted_s_per_frame": seconds / len(noisy),
    }


def trajectory_error(places: FloatArray, truth: FloatArray) -> float:
    """Root mean square distance of places (k, 3) from true ones after the best similarity.

    Umeyama, "Least-squares estimation of transformation parameters between two point patterns"
    (1991); ATE of the benchmarks of odometry.
    """
    from_places, from_truth = places - places.mean(axis=0), truth - truth.mean(axis=0)
    left, sizes, right = np.linalg.svd(from_truth.T @ from_places)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    turn = left @ np.diag(signs) @ right
    scale = (sizes * signs).sum() / (from_places**2).sum()
    off = scale * from_places @ turn.T - from_truth
    return float(np.sqrt((off**2).sum(axis=1).mean()))


def step_errors(poses: FloatArray, truth: FloatArray) -> tuple[float, float]:
    """Root mean squares of what steps between neighbouring frames (f, c, 4, 4) are off: metres and
    degrees. Depth along the road is made of steps."""
    steps, true = (np.linalg.inv(each[:-1]) @ each[1:] for each in (poses, truth))
    way = np.linalg.norm(steps[..., :3, 3] - true[..., :3, 3], axis=-1)
    traces = np.einsum("fcij,fcij->fc", steps[..., :3, :3], true[..., :3, :3])
    turn = np.degrees(np.arccos(np.clip((traces - 1) / 2, -1, 1)))
    return float(np.sqrt((way**2).mean())), float(np.sqrt((turn**2).mean()))


def _straight_ahead(count: int) -> FloatArray:
    return np.column_stack([np.arange(count, dtype=float), np.zeros(count), np.zeros(count)])


if __name__ == "__main__":
    import json

    print(json.dumps(film_figures()))
