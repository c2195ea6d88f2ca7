"""Which pictures of the built-in drive are taken, from where, at which exposure."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.geometry.cameras import moved_left
from pipelines.virtual.city.drive import SimulatedDrive, expose_photograph, plan_drive
from pipelines.virtual.city.drive_photographs import EXPOSURE, photograph_drive
from pipelines.virtual.city.photographing import Shot

OFFSETS = (1.0, 2.5)


class _Places:
    """A stage whose pictures are as bright as the camera's place tells, and remember it."""

    width, height = 8, 5

    def __init__(self) -> None:
        self.labelled: list[NDArray[np.float64]] = []

    def shoot(
        self,
        intrinsics: NDArray[np.float64],
        to_world: NDArray[np.float64],
        *,
        labels: bool = False,
    ) -> Shot:
        shape = (self.height, self.width)
        if labels:
            self.labelled.append(to_world)
        return Shot(
            self.radiance(to_world),
            np.full(shape if labels else (0, 0), to_world[0, 3], np.float32),
            np.full(shape if labels else (0, 0), True),
        )

    def radiance(self, to_world: NDArray[np.float64]) -> NDArray[np.float32]:
        light = 0.3 + 0.02 * to_world[:3, 3]
        return np.broadcast_to(light.astype(np.float32), (self.height, self.width, 3))


def _drive() -> tuple[SimulatedDrive, NDArray[np.bool_]]:
    return plan_drive(4, 3.0, 8, 5, exposure_spread=0.2), np.array([False, True, False, True])


def test_frames_held_out_have_the_middle_cameras_truth() -> None:
    drive, held_out = _drive()
    stage = _Places()
    taken = photograph_drive(stage, drive, held_out, offsets=OFFSETS)
    np.testing.assert_array_equal(stage.labelled, drive.poses[held_out, 1])
    np.testing.assert_allclose(taken.truth_depth[:, 0, 0], [3.0, 9.0])
    assert taken.truth_depth.dtype == np.float32
    assert taken.truth_pole.shape == (2, 5, 8)
    for number, pose in enumerate(drive.poses[held_out, 1]):
        for place, offset in enumerate(OFFSETS):
            expected = to_8bit(EXPOSURE * stage.radiance(moved_left(pose, offset)))
            np.testing.assert_array_equal(taken.beside[number, place], expected)


def test_photographs_have_their_exposures_and_the_noise_of_one_seed() -> None:
    drive, held_out = _drive()
    stage, told = _Places(), []
    taken = photograph_drive(
        stage, drive, held_out, offsets=(), noise=0.02, seed=7, progress=told.append
    )
    random = np.random.default_rng(7)
    for frame in range(4):
        for camera in range(3):
            expected = expose_photograph(
                stage.radiance(drive.poses[frame, camera]),
                drive.gains[frame, camera],
                EXPOSURE,
                0.02,
                random,
            )
            np.testing.assert_array_equal(taken.photographs[frame, camera], expected)
    assert told == [0.25, 0.5, 0.75, 1.0]
