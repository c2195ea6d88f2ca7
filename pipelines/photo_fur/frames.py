"""Pictures of the fur: which views, and how they are taken (figures 3 to 6)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.stage import Camera, Light, Stage, fitting_distance, orbit
from pipelines.photo_fur.attenuation import Tails
from pipelines.photo_fur.laid_fur import LaidFur, laid_surface, rows_of_fur, shells_seen
from pipelines.photo_fur.photograph import FurPhotograph
from pipelines.photo_fur.shells import ShellMesh
from pipelines.photo_fur.stage_view import Fill, FurLight, fur_surface, fur_texture

BACKGROUND = (0.32, 0.34, 0.37)
LEAST_SIDE = 384
"""Pictures of a smaller photograph show a texel in several pixels."""
_VIEW_ANGLE = 30.0
_MARGIN = 1.03
_LAMP_BESIDE, _LAMP_ABOVE = 35.0, 40.0
"""Degrees from the view, and above the horizon."""


class View(NamedTuple):
    """One picture to take. Angles in degrees, as ``stage.orbit`` has them."""

    azimuth: float
    elevation: float
    as_photographed: bool = False
    """Straight above, orthographic, unlit, nearest texel: shows the photograph itself."""


SQUARE_VIEWS = (View(-90.0, 90.0, as_photographed=True), View(-60.0, 28.0))
"""Above and from the side (figure 3)."""

ROUND_VIEWS = tuple(View(azimuth, 22.0) for azimuth in (-90.0, 0.0, 90.0, 180.0))
"""Four sides, 90 degrees apart (figure 5)."""


class Frames(NamedTuple):
    """The pictures of one mesh, one a view."""

    pictures: NDArray[np.uint8]
    """(view, y, x, 3) 8-bit sRGB."""
    coverage: NDArray[np.float64]
    """(view,) share of the pixels with fur."""


def draw_frames(
    photograph: FurPhotograph,
    mesh: ShellMesh,
    views: Sequence[View],
    *,
    size: tuple[int, int],
    supersampling: int = 2,
    tails: Tails = "end layers",
    fill: Fill = "columns",
    progress: Callable[[float], None] | None = None,
) -> Frames:
    """Draw the fur from every view, in pictures of size = (height, width) pixels.

    The light comes along the view, as it did in the photograph (Lambert). ``supersampling``:
    samples along each side of a pixel; ``progress`` is called with the fraction done. Raises
    ``drawing.stage.NoGraphicsError`` where nothing can be drawn.
    """
    image = fur_texture(photograph, mesh.layers, tails=tails)

    def fur(view: View, camera: Camera) -> Any:
        return fur_surface(
            mesh.vertices,
            mesh.normals,
            mesh.triangles,
            mesh.uvs,
            image,
            photograph.attenuation,
            fill=fill,
            wrap="mirrored",
            interpolate=not view.as_photographed,
            lit=not view.as_photographed,
        )

    return _taken(fur, mesh.vertices.reshape(-1, 3), views, size, supersampling, progress)


def draw_laid_frames(
    photograph: FurPhotograph,
    fur: LaidFur,
    views: Sequence[View],
    size: tuple[int, int],
    supersampling: int,
    tails: Tails,
    progress: Callable[[float], None],
) -> Frames:
    """Draw fur laid in patches from every view, each lit from its upper left and a little along it.

    size: (height, width) of the pictures, pixels. Raises as ``draw_frames`` does.
    """
    image = fur_texture(photograph, fur.layers, tails=tails)

    def laid(view: View, camera: Camera) -> Any:
        lamp = orbit((0.0, 0.0, 0.0), 1.0, view.azimuth - _LAMP_BESIDE, _LAMP_ABOVE).position
        light = FurLight(sky=0.15, headlight=0.35, lamp=0.75, light=lamp)
        rows = rows_of_fur(camera, fur.skin, fur.thickness, supersampling * size[0])
        shells = shells_seen(rows)
        return laid_surface(fur, image, photograph.attenuation, light, shells=shells)

    return _taken(laid, fur.reach, views, size, supersampling, progress)


def _taken(
    actor: Callable[[View, Camera], Any],
    points: NDArray[np.float32],
    views: Sequence[View],
    size: tuple[int, int],
    supersampling: int,
    progress: Callable[[float], None] | None,
) -> Frames:
    """Pictures of what is drawn for each view and its camera, all with all points (n, 3); a lamp
    along the view lights what does not light itself."""
    height, width = size
    pictures, coverage = [], []
    cameras = view_cameras(views, points, width / height)
    for done, (view, camera) in enumerate(zip(views, cameras, strict=True)):
        if progress is not None:
            progress(done / len(views))
        scale = 1 if view.as_photographed else supersampling
        with Stage(width, height, background=BACKGROUND, supersampling=scale) as stage:
            stage.add(actor(view, camera))
            stage.light(Light())
            stage.look(camera)
            picture = stage.radiance()
        pictures.append(to_8bit(picture[..., :3]))
        coverage.append(float(np.mean(picture[..., 3] > 0)))
    return Frames(np.stack(pictures), np.array(coverage))


def top_view_size(shape: tuple[int, ...]) -> tuple[int, int]:
    """Size of the square's pictures: the photograph's, or several times it where that is small.

    >>> top_view_size((512, 700)), top_view_size((128, 200))
    ((512, 700), (384, 600))
    """
    height, width = shape
    times = max(1, LEAST_SIDE // min(shape))
    return height * times, width * times


def stretched(mesh: ShellMesh, aspect: float) -> ShellMesh:
    """The unit square stretched in x to a photograph's proportions, width over height."""
    vertices = mesh.vertices * np.array([aspect, 1.0, 1.0])
    return mesh._replace(vertices=vertices.astype(np.float32))


def view_cameras(views: Sequence[View], points: NDArray[np.float32], aspect: float) -> list[Camera]:
    """One camera a view, which has all points (n, 3) in a picture of width / height ``aspect``.

    All that are perspective stand equally far away.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    x, y, z = ((low + high) / 2).tolist()
    lens = {"view_angle": _VIEW_ANGLE}
    distance = _MARGIN * max(
        fitting_distance(points, (x, y, z), *view[:2], aspect=aspect, **lens) for view in views
    )
    return [
        orbit((x, y, z), distance, *view[:2], height=float(high[1] - low[1]))
        if view.as_photographed
        else orbit((x, y, z), distance, *view[:2], **lens)
        for view in views
    ]
