"""The built-in drive: where the cameras are, how they expose, and their noise.

A car drives along the right lane with three cameras in a row across it, all looking forward, or
with the middle one of them alone.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.geometry.cameras import moved_left
from pipelines.virtual.city.bend import STRAIGHT, Bend, bent_poses

FloatArray = NDArray[np.float64]

_LANE = -1.75
_SWAY, _WAVELENGTH = 0.25, 70.0
"""Metres that the car strays to either side, and of road in which it does so."""
_CAMERA_GAINS = 0.04
_DRIFT = 45.0
"""Metres of road in which the exposure goes up and down."""
_READING = 0.1
"""Variance of reading, of that of photons at white."""


class SimulatedDrive(NamedTuple):
    """f frames of c cameras."""

    intrinsics: FloatArray
    """(c, 3, 3), pixels."""
    poses: FloatArray
    """(f, c, 4, 4), from the camera's axes to the world's."""
    gains: FloatArray
    """(f, c), factors on linear light, about 1."""


def plan_drive(
    frames: int,
    spacing: float,
    width: int,
    height: int,
    *,
    view_angle: float = 75.0,
    baseline: float = 0.8,
    camera_height: float = 1.9,
    seed: int = 0,
    exposure_spread: float = 0.12,
    bend: Bend = STRAIGHT,
    cameras: Literal[1, 3] = 3,
) -> SimulatedDrive:
    """A drive from x = 0 towards +x: a frame every ``spacing`` metres of the road.

    bend: of the road, as of the city that is driven through.
    view_angle: horizontal, degrees. Cameras are, from 0 to 2, ``baseline`` metres to the left of
    the car's middle, in it, and to its right, at ``camera_height`` metres; a single one is the
    second of these. A camera's gain is a constant of a few percent times a slow drift, whose
    standard deviation over a long drive is ``exposure_spread``. Raises ValueError for sizes that
    are not positive.

    >>> drive = plan_drive(frames=12, spacing=2.0, width=64, height=40)
    >>> drive.poses.shape, drive.gains.shape
    ((12, 3, 4, 4), (12, 3))
    """
    if frames < 1 or not spacing > 0.0 or width < 1 or height < 1 or not 0 < view_angle < 180:
        raise ValueError(
            f"drive: found {frames} frames, {spacing} m apart, {width} x {height} pixels, "
            f"{view_angle} degrees; expected all to be more than 0, and less than 180 degrees."
        )
    generator = np.random.default_rng([seed, 4])
    phase = generator.uniform(0.0, 2 * np.pi)
    x = np.arange(frames) * spacing
    turn = 2 * np.pi / _WAVELENGTH
    y = _LANE + _SWAY * np.sin(turn * x + phase)
    heading = np.arctan(_SWAY * turn * np.cos(turn * x + phase))
    car = np.stack([_pose(*row, camera_height) for row in zip(x, y, heading, strict=True)])
    if bend.angle:
        car = bent_poses(car, bend)
    mounted = slice(None) if cameras == 3 else slice(1, 2)
    offsets = np.array([baseline, 0.0, -baseline])[mounted]
    poses = np.stack([[moved_left(pose, offset) for offset in offsets] for pose in car])
    focal = width / (2.0 * np.tan(np.radians(view_angle) / 2.0))
    camera = [[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]]
    own = 1.0 + _CAMERA_GAINS * generator.uniform(-1.0, 1.0, 3)
    drift_phase = generator.uniform(0.0, 2 * np.pi, 2)
    drift = np.sin(2 * np.pi * x / _DRIFT + drift_phase[0]) + 0.5 * np.sin(
        2 * np.pi * x / (0.37 * _DRIFT) + drift_phase[1]
    )
    slow = np.exp(exposure_spread * drift / np.sqrt(0.625))
    return SimulatedDrive(
        intrinsics=np.tile(np.array(camera, np.float64), (cameras, 1, 1)),
        poses=poses,
        gains=slow[:, None] * own[None, mounted],
    )


def _pose(x: float, y: float, heading: float, z: float) -> FloatArray:
    sine, cosine = np.sin(heading), np.cos(heading)
    return np.array(
        [[sine, 0.0, cosine, x], [-cosine, 0.0, sine, y], [0.0, -1.0, 0.0, z], [0.0, 0.0, 0.0, 1.0]]
    )


def expose_photograph(
    radiance: NDArray[np.floating],
    gain: float,
    exposure: float,
    noise: float,
    generator: np.random.Generator,
) -> NDArray[np.uint8]:
    """What a sensor makes of radiance (h, w, 3): 8-bit sRGB of radiance * gain * exposure.

    noise: standard deviation at white, in linear light, 0 for none. Its variance is proportional to
    the light (photons) plus a tenth of white (reading).
    """
    light = np.asarray(radiance, np.float64) * (gain * exposure)
    if noise > 0.0:
        deviation = noise * np.sqrt((np.clip(light, 0.0, 1.0) + _READING) / (1.0 + _READING))
        light = light + deviation * generator.standard_normal(light.shape)
    return to_8bit(light)
