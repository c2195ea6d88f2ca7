"""The built-in drive photographed: every camera's pictures, and what is true in some frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.geometry.cameras import moved_left
from pipelines.virtual.city.drive import SimulatedDrive, expose_photograph
from pipelines.virtual.city.photographing import Shot

EXPOSURE = 0.95
"""From the simulated city's radiance to pictures."""


class CityCamera(Protocol):
    """What takes the pictures: a `CityStage`."""

    width: int
    height: int

    def shoot(
        self,
        intrinsics: NDArray[np.float64],
        to_world: NDArray[np.float64],
        *,
        labels: bool = False,
    ) -> Shot:
        """What a camera with K (3, 3) at a pose (4, 4) sees."""


class DrivePhotographs(NamedTuple):
    """A drive of f frames and c cameras; of k frames the middle camera's truth."""

    photographs: NDArray[np.uint8]
    """(f, c, y, x, 3), sRGB, each at its own exposure and with noise."""
    truth_depth: NDArray[np.float32]
    """(k, y, x), metres along the axis; inf is sky."""
    truth_pole: NDArray[np.bool_]
    """(k, y, x), where a thin pole is."""
    beside: NDArray[np.uint8]
    """(k, o, y, x, 3), what the middle camera would see beside the path; no noise."""


def photograph_drive(
    stage: CityCamera,
    drive: SimulatedDrive,
    held_out: NDArray[np.bool_],
    *,
    offsets: Sequence[float],
    noise: float = 0.0,
    seed: int = 0,
    progress: Callable[[float], None] = lambda fraction: None,
) -> DrivePhotographs:
    """Take all pictures of a drive, and the truth of the frames held out (f,).

    offsets: metres to the left of the path, of the pictures beside it; noise: as for
    `drive.expose_photograph`, of white; progress is told the fraction done. Raises ValueError
    where the cameras are none of the stage's (``CityStage.shoot``).
    """
    frames, cameras = drive.poses.shape[:2]
    middle = cameras // 2
    photographs = np.empty((frames, cameras, stage.height, stage.width, 3), np.uint8)
    truth_depth, truth_pole, beside = [], [], []
    random = np.random.default_rng(seed)
    for frame in range(frames):
        for camera in range(cameras):
            labels = bool(held_out[frame]) and camera == middle
            pose, lens = drive.poses[frame, camera], drive.intrinsics[camera]
            shot = stage.shoot(lens, pose, labels=labels)
            photographs[frame, camera] = expose_photograph(
                shot.radiance, drive.gains[frame, camera], EXPOSURE, noise, random
            )
            if labels:
                truth_depth.append(shot.depth)
                truth_pole.append(shot.pole)
                moved = [stage.shoot(lens, moved_left(pose, offset)) for offset in offsets]
                beside.append([to_8bit(EXPOSURE * one.radiance) for one in moved])
        progress((frame + 1) / frames)
    return DrivePhotographs(
        photographs,
        np.array(truth_depth, np.float32),
        np.array(truth_pole, bool),
        np.array(beside, np.uint8),
    )
