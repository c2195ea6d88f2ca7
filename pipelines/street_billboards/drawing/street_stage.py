"""Views of a street on the stage: billboards before the sky, from places on the path and beside."""

from __future__ import annotations

from types import TracebackType
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.stage import Stage
from pipelines.street_billboards.billboards import Billboards
from pipelines.street_billboards.capture.sky import pixel_rays, sky_along
from pipelines.street_billboards.drawing.processor_street import ProcessorStreet
from pipelines.street_billboards.drawing.shader_street import ShaderStreet
from pipelines.street_billboards.drawing.stage_camera import stage_camera
from pipelines.street_billboards.textures.atlases import Page
from pipelines.street_billboards.textures.texture_tables import CompressedTextures

FloatArray = NDArray[np.float64]


class StreetPicture(NamedTuple):
    """A picture of the street, linear light."""

    alone: NDArray[np.float32]
    """(y, x, 3), billboards before black."""
    with_sky: NDArray[np.float32]
    """(y, x, 3), billboards before the sky."""
    covered: NDArray[np.float32]
    """(y, x), share of each pixel with a billboard."""
    billboards: int
    """That were sent."""


class StreetStage:
    """A stage with a street on it; use it as a context manager.

    sky: radiance, equirectangular (``sky.sky_map``); size: width and height in pixels.
    show_billboards: in colours of their own, with their rims.
    """

    def __init__(
        self,
        billboards: Billboards,
        pages: list[Page],
        sky: NDArray[np.float32],
        size: tuple[int, int],
        *,
        supersampling: int = 1,
        show_billboards: bool = False,
    ) -> None:
        self._size = size
        self._street = ShaderStreet(billboards, pages, show_billboards=show_billboards)
        self._stage = Stage(*size, supersampling=supersampling)
        self._stage.add(*self._street.actors)
        self._sky = sky
        self.renderer_name = self._stage.renderer_name

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stage.__exit__(kind, error, trace)

    def view(self, intrinsics: FloatArray, to_world: FloatArray) -> StreetPicture:
        """What a camera (K (3, 3), pose (4, 4)) sees."""
        width, height = self._size
        sent = self._street.look(intrinsics, to_world, width, height)
        self._stage.look(stage_camera(intrinsics, to_world, height))
        drawn = self._stage.radiance()
        alone, covered = drawn[..., :3], drawn[..., 3]
        behind = sky_along(self._sky, pixel_rays(intrinsics, to_world, width, height))
        return StreetPicture(alone, alone + (1 - covered[..., None]) * behind, covered, sent)


def flight_poses(poses: FloatArray, frames: int, swerve: float) -> FloatArray:
    """Poses (frames, 4, 4) along those of a drive (f, 4, 4), swerving ``swerve`` m to the left.

    >>> drive = np.tile(np.eye(4), (3, 1, 1))
    >>> drive[:, 2, 3] = [0.0, 3.0, 6.0]
    >>> flight_poses(drive, 5, swerve=1.0)[:, [0, 2], 3].round(3).tolist()
    [[0.0, 0.0], [-0.5, 1.5], [-1.0, 3.0], [-0.5, 4.5], [-0.0, 6.0]]
    """
    from scipy.spatial.transform import Rotation, Slerp

    at = np.linspace(0, len(poses) - 1, frames)
    numbers = np.arange(len(poses))
    turns = Slerp(numbers, Rotation.from_matrix(poses[:, :3, :3]))(at).as_matrix()
    made = np.tile(np.eye(4), (frames, 1, 1))
    made[:, :3, :3] = turns
    for axis in range(3):
        made[:, axis, 3] = np.interp(at, numbers, poses[:, axis, 3])
    aside = swerve * np.sin(np.pi * at / max(len(poses) - 1, 1)) ** 2
    made[:, :3, 3] -= aside[:, None] * turns[:, :, 0]
    return made


def shader_and_processor_pictures(
    billboards: Billboards,
    pages: list[Page],
    textures: CompressedTextures,
    intrinsics: FloatArray,
    to_world: FloatArray,
    size: tuple[int, int],
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """One picture (y, x, 3), decoded in the shader and by the processor."""
    pictures = []
    for street in (ShaderStreet(billboards, pages), ProcessorStreet(billboards, textures)):
        with Stage(*size) as stage:
            street.look(intrinsics, to_world, *size)
            stage.add(*street.actors)
            stage.look(stage_camera(intrinsics, to_world, size[1]))
            pictures.append(to_8bit(stage.radiance()[..., :3]))
    return pictures[0], pictures[1]
