"""Pictures of a street: from where frames were held out, from beside the path, along a flight."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.picture_metrics import ImageMetrics, image_metrics
from pipelines.geometry.cameras import moved_left
from pipelines.street_billboards import figures
from pipelines.street_billboards.drawing.street_stage import (
    StreetStage,
    flight_poses,
    shader_and_processor_pictures,
)
from pipelines.street_billboards.street_model import StreetModel

FloatArray = NDArray[np.float64]
Pictures = NDArray[np.uint8]

_UNSEEN = 2
"""Frames that the flight leaves out: nobody before them saw the ground that they look at."""
_COVERED = 0.5
"""Share of a pixel from which on billboards cover it."""


class Viewpoints(NamedTuple):
    """Where pictures are taken from, by one camera; poses from its axes to the world's."""

    intrinsics: FloatArray
    """(3, 3), pixels."""
    size: tuple[int, int]
    """Width and height, pixels."""
    held_out: FloatArray
    """(k, 4, 4)."""
    beside: FloatArray
    """(k, o, 4, 4), to the left of these."""
    flight: FloatArray
    """(n, 4, 4)."""


class StreetFrames(NamedTuple):
    """Pictures in 8-bit sRGB; k frames held out, o places beside each, n frames of the flight."""

    rendered: Pictures
    """(k, y, x, 3), at the exposure of the true ones."""
    alone: Pictures
    """(k, y, x, 3), billboards before black, not exposed anew."""
    covered: NDArray[np.bool_]
    """(k, y, x), where billboards are."""
    beside: Pictures
    """(k, o, y, x, 3)."""
    beside_covered: NDArray[np.bool_]
    """(k, o, y, x)."""
    flight: Pictures
    """(n, y, x, 3)."""
    shaded: Pictures
    """(y, x, 3), the first frame held out, without sky, textures decoded in the shader."""
    decoded: Pictures
    """(y, x, 3), the same, decoded by the processor."""
    metrics: list[ImageMetrics]
    """Of the k frames where they are covered."""
    visible_billboards: int
    """In the first frame held out."""
    renderer: str


def viewpoints(
    intrinsics: FloatArray,
    poses: FloatArray,
    held_out: NDArray[np.bool_],
    size: tuple[int, int],
    *,
    offsets: Sequence[float],
    flight_frames: int,
    swerve: float,
) -> Viewpoints:
    """Where a drive is looked at from: poses (f, 4, 4), of which some are held out (f,).

    offsets: metres to the left of the path; swerve: metres that the flight leaves it.
    """
    held = poses[held_out]
    beside = np.array([[moved_left(pose, offset) for offset in offsets] for pose in held])
    return Viewpoints(
        intrinsics, size, held, beside, flight_poses(poses[_UNSEEN:], flight_frames, swerve)
    )


def draw_view(
    street: StreetModel,
    intrinsics: FloatArray,
    to_world: FloatArray,
    size: tuple[int, int],
    *,
    supersampling: int = 2,
) -> Pictures:
    """What a camera (K (3, 3), pose (4, 4)) sees, (y, x, 3); size: width and height in pixels.

    Raises ``drawing.stage.NoGraphicsError`` where nothing can be drawn, ValueError unless pixels
    are square and the principal point is in the picture's middle.
    """
    with StreetStage(
        street.billboards, street.pages, street.sky, size, supersampling=supersampling
    ) as stage:
        return to_8bit(stage.view(intrinsics, to_world).with_sky)


def draw_frames(
    street: StreetModel,
    views: Viewpoints,
    truth: Pictures,
    *,
    supersampling: int = 2,
    progress: Callable[[float], None] = lambda fraction: None,
) -> StreetFrames:
    """Draw a street from all viewpoints and compare with the true pictures (k, y, x, 3).

    supersampling: samples along a pixel's side. Raises ``drawing.stage.NoGraphicsError`` where
    nothing can be drawn.
    """
    every = [*views.held_out, *views.beside.reshape(-1, 4, 4), *views.flight]
    drawn = []
    with StreetStage(
        street.billboards, street.pages, street.sky, views.size, supersampling=supersampling
    ) as stage:
        for number, pose in enumerate(every):
            drawn.append(stage.view(views.intrinsics, pose))
            progress(number / len(every))
    shown = np.stack([to_8bit(view.with_sky) for view in drawn])
    seen = np.stack([view.covered > _COVERED for view in drawn])
    held, flying = len(views.held_out), len(every) - len(views.flight)
    compare = list(zip(shown[:held], truth, seen[:held], strict=True))
    rendered = np.stack([figures.match_exposure(*one) for one in compare])
    judged = zip(rendered, truth, seen[:held], strict=True)
    shaded, decoded = shader_and_processor_pictures(
        street.billboards,
        street.pages,
        street.textures,
        views.intrinsics,
        views.held_out[0],
        views.size,
    )
    by_offset = views.beside.shape[:2]
    return StreetFrames(
        rendered=rendered,
        alone=np.stack([to_8bit(view.alone) for view in drawn[:held]]),
        covered=seen[:held],
        beside=shown[held:flying].reshape(*by_offset, *shown.shape[1:]),
        beside_covered=seen[held:flying].reshape(*by_offset, *seen.shape[1:]),
        flight=shown[flying:],
        shaded=shaded,
        decoded=decoded,
        metrics=[image_metrics(*one) for one in judged],
        visible_billboards=drawn[0].billboards,
        renderer=stage.renderer_name,
    )
