"""The pictures of the draped cloth that are shown: an orbit, a moving sun, a close-up."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.stage import Camera, orbit
from pipelines.light.built_in_environments import sky
from pipelines.light.directions import Pairs
from pipelines.light.environment_maps import Radiance, rotate_environment
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.draping.gathering import Lighting, floor_shading, lighting_of
from pipelines.neural_btf.draping.rendering import Rendered, View, render
from pipelines.neural_btf.draping.scene import draped_scene
from pipelines.neural_btf.draping.simulation import SIDE
from pipelines.neural_btf.importance import ImportanceTable, importance_table
from pipelines.neural_btf.material import Material, MeasuredBtf, mean_colour

CAMERA_AZIMUTH = 65.0
SUN_AZIMUTH = -15.0
"""Degrees: on the left of the camera, so that threads cast shadows along the cloth."""
_SUN_ELEVATION = 36.0
_SKY_ROWS = 64
_COMPARED_SAMPLES = 16


COMPARED_SIZE = (64, 48)
"""Width and height of the pictures that figures are taken of."""


class ClothFrames(NamedTuple):
    """Pictures of a draped cloth, 8-bit sRGB, and what they are judged by."""

    orbit: NDArray[np.uint8]
    """(frame, y, x, 3): the camera goes around."""
    moving_light: NDArray[np.uint8]
    """(frame, y, x, 3): the sun goes around. The first picture is the orbit's first."""
    closeup: NDArray[np.uint8]
    """(y, x, 3)."""
    compared: NDArray[np.float32]
    """(material, y, x, 3) linear, exposed as the close-up, which it is, of COMPARED_SIZE: of the
    compressed BTF, the measured one and its mean colour, from the same random numbers."""


class Shots(NamedTuple):
    """How pictures are taken."""

    width: int
    """Pixels; the height is three quarters."""
    samples: int
    """A pixel, even."""
    frames: int
    """Of the orbit, and of the moving light."""
    tiles: float
    """Of the material along the cloth's 2 m."""


def daylight(turn: float = 0.0) -> Radiance:
    """A clear sky with a large soft sun at SUN_AZIMUTH, turned by degrees: (H, 2 H, 3)."""
    radiance = sky(
        _SKY_ROWS,
        sun_azimuth=SUN_AZIMUTH,
        sun_elevation=_SUN_ELEVATION,
        sun_radius=6.0,
        turbidity=4.0,
    )
    return rotate_environment(radiance, turn)


def whole_camera(turn: float = 0.0) -> Camera:
    """Sees the cloth and its shadow; turned about the table by degrees."""
    return orbit((0.0, 0.0, 0.54), 3.75, CAMERA_AZIMUTH + turn, 22.0, view_angle=24.0)


def close_camera() -> Camera:
    """Sees a hand's breadth of the table's edge and of a fold below it."""
    return orbit((0.25, 0.40, 0.98), 0.62, CAMERA_AZIMUTH - 4.0, 32.0, view_angle=30.0)


def draw_frames(
    compressed: CompressedBtf,
    images: NDArray[Any],
    pairs: Pairs,
    shots: Shots,
    progress: Callable[[float], None] = lambda fraction: None,
) -> ClothFrames:
    """All pictures of a material, and of its photographs (image, y, x, 3) what is compared.

    The whole pictures have one exposure, the close-up its own: the 99 % quantile of the cloth's
    radiance is shown as 0.8.
    """
    studio = _Studio(compressed, shots)
    light = studio.light(0.0)
    done = 2 * shots.frames
    around = [studio.take(compressed, light, whole_camera())]
    for number in range(1, shots.frames):
        progress(number / done)
        turn = 360.0 * number / shots.frames
        around.append(studio.take(compressed, light, whole_camera(turn)))
    exposure = auto_exposure(around[0].pictures[0][around[0].cloth == 1.0])
    moving = [around[0]]
    for number in range(1, shots.frames):
        progress((shots.frames + number) / done)
        turned = studio.light(360.0 * number / shots.frames)
        moving.append(studio.take(compressed, turned, whole_camera()))
    close = studio.take(compressed, light, close_camera())
    close_exposure = auto_exposure(close.pictures[0])
    materials = compressed, MeasuredBtf(images, pairs), mean_colour(images, pairs)
    return ClothFrames(
        np.stack([to_8bit(taken.pictures[0] * exposure) for taken in around]),
        np.stack([to_8bit(taken.pictures[0] * exposure) for taken in moving]),
        to_8bit(close.pictures[0] * close_exposure),
        studio.compare(materials, light, close_camera()) * np.float32(close_exposure),
    )


class _Studio:
    """The scene, and one table of directions for all pictures."""

    def __init__(self, compressed: CompressedBtf, shots: Shots) -> None:
        self._shots = shots
        self._scene = draped_scene()
        self._table: ImportanceTable = importance_table(compressed)
        tile = SIDE / shots.tiles
        self._tile = (tile, tile * compressed.height / compressed.width)

    def light(self, turn: float) -> tuple[Lighting, NDArray[np.float32]]:
        """Daylight turned by degrees, and the floor under it."""
        lighting = lighting_of(daylight(turn))
        cells = int(np.clip(self._shots.width // 6, 24, 128))
        return lighting, floor_shading(self._scene, lighting, cells, 4 * self._shots.samples)

    def take(
        self, material: Material, light: tuple[Lighting, NDArray[np.float32]], camera: Camera
    ) -> Rendered:
        """One picture as it is shown."""
        width = self._shots.width
        view = View(camera, (width, width * 3 // 4), self._shots.samples, self._tile)
        return render(self._scene, *light, [material], self._table, view)

    def compare(
        self,
        materials: Sequence[Material],
        light: tuple[Lighting, NDArray[np.float32]],
        camera: Camera,
    ) -> NDArray[np.float32]:
        """Small pictures (material, y, x, 3)."""
        view = View(camera, COMPARED_SIZE, _COMPARED_SAMPLES, self._tile)
        return render(self._scene, *light, materials, self._table, view).pictures
