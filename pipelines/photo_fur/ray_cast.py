"""The square of fur from aside, ray by ray, by NumPy alone: what the stage's picture is checked by.

From straight above each pixel shows its own colour, at whatever depth. From aside a wrong depth
moves hairs, so a picture tells whether depths were read, coded and drawn as Eq. 1 has them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import encode_srgb
from pipelines.drawing.stage import Camera
from pipelines.photo_fur.attenuation import Tails
from pipelines.photo_fur.frames import BACKGROUND
from pipelines.photo_fur.photograph import FurPhotograph, fur_colours
from pipelines.photo_fur.shells import ShellMesh
from pipelines.photo_fur.stage_view import Fill

_MOST_PIXELS = 20_000
"""Of a larger picture every so many pixels are cast."""


class Square(NamedTuple):
    """What is cast, in the plain look."""

    photograph: FurPhotograph
    mesh: ShellMesh
    fill: Fill
    tails: Tails


class Cast(NamedTuple):
    """Some pixels of a picture."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    codes: NDArray[np.float64]
    """(rows, columns, 3): sRGB, in [0, 1]."""


def cast_square(square: Square, camera: Camera, size: tuple[int, int], samples: int) -> Cast:
    """The plain look of a level square, lit along the view, before the stage's background.

    size: (height, width) of the picture; samples: along each side of a pixel.
    """
    step = math.ceil(math.sqrt(size[0] * size[1] / _MOST_PIXELS))
    rows, columns = (np.arange(step // 2, length, step) for length in size)
    within = (np.arange(samples) + 0.5) / samples
    down = (rows[:, None] + within).ravel() / size[0]
    right = (columns[:, None] + within).ravel() / size[1]
    ways, facing = _rays(camera, down, right, size[1] / size[0])
    seen = _shown(square, np.asarray(camera.position), ways, facing)
    shape = (len(rows), samples, len(columns), samples, 3)
    return Cast(rows, columns, encode_srgb(seen.reshape(shape).mean(axis=(1, 3))))


def _rays(
    camera: Camera, down: NDArray[np.floating], right: NDArray[np.floating], aspect: float
) -> tuple[NDArray[np.float64], float]:
    """Directions (down, right, 3) through a picture's places in [0, 1], and how straight the
    camera looks at what is level."""
    forward = np.subtract(camera.target, camera.position)
    forward = forward / np.linalg.norm(forward)
    aside = np.cross(forward, camera.up)
    aside /= np.linalg.norm(aside)
    above = np.cross(aside, forward)
    half = math.tan(math.radians(camera.view_angle) / 2)
    x = (2 * right - 1)[None, :, None] * half * aspect
    y = (1 - 2 * down)[:, None, None] * half
    return forward + x * aside + y * above, float(-forward[2])


def _shown(
    square: Square,
    eye: NDArray[np.floating],
    ways: NDArray[np.float64],
    facing: float,
) -> NDArray[np.float64]:
    """Radiance (…, 3) along rays: of the first layer that shows a hair."""
    mesh, layers = square.mesh, square.mesh.layers
    skin = mesh.vertices[-1].astype(np.float64)
    low, high = skin.min(axis=0), skin.max(axis=0)
    start, end = mesh.uvs.min(axis=0), mesh.uvs.max(axis=0)
    texels = _texels(square.photograph, layers, square.tails)
    steps, decay = 255 // layers, square.photograph.attenuation.coefficient / layers
    found = np.broadcast_to(np.array(BACKGROUND), ways.shape).copy()
    open_ = np.ones(ways.shape[:-1], bool)
    for n in range(1, layers + 1):
        height = low[2] + mesh.thickness * (1 - n / layers)
        with np.errstate(divide="ignore"):
            far = (height - eye[2]) / ways[..., 2]
        place = (eye + far[..., None] * ways)[..., :2]
        inside = ((place >= low[:2]) & (place <= high[:2])).all(axis=-1) & (far > 0) & open_
        share = (place[inside] - low[:2]) / (high[:2] - low[:2])
        texel = _interpolated(texels, start + share * (end - start))
        code = np.floor(texel[:, 3] + 0.5)
        stands = code < n * steps
        if square.fill == "bands":
            stands &= code >= (n - 1) * steps
        above = np.maximum(n - 1 - np.floor(code / steps), 0)
        shown = texel[:, :3] * np.exp(-decay * above)[:, None] * facing
        at = np.nonzero(inside)
        hit = tuple(axis[stands] for axis in at)
        found[hit] = shown[stands]
        open_[hit] = False
    return found


def _texels(photograph: FurPhotograph, layers: int, tails: Tails) -> NDArray[np.float64]:
    """Linear colours and depth codes (y, x, 4), by Eq. 1 and 4."""
    from pipelines.drawing.colour import decode_srgb

    medium, steps = photograph.attenuation, 255 // layers
    grey = photograph.luminance.astype(np.float64)
    with np.errstate(divide="ignore"):
        depth = layers * np.log(medium.brightest / grey) / medium.coefficient
    depth = np.clip(depth, 0.0, layers - 1e-9)
    code = np.floor(depth) * steps + np.minimum(np.floor(depth % 1 * steps), steps - 1)
    if tails == "dropped":
        code[(grey > medium.brightest) | (grey < medium.darkest)] = 255
    if photograph.opaque is not None:
        code[~photograph.opaque] = 255
    return np.dstack([decode_srgb(fur_colours(photograph) / 255.0), code])


def _interpolated(texels: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Texels (n, 4) at texture coordinates (n, 2), linear, mirrored beyond the photograph."""
    height, width = texels.shape[:2]
    x = places[:, 0] * width - 0.5
    y = (1 - places[:, 1]) * height - 0.5
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    right, down = (x - column)[:, None], (y - row)[:, None]

    def at(rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.float64]:
        there = _mirrored(rows, height), _mirrored(columns, width)
        found: NDArray[np.float64] = texels[there]
        return found

    upper = at(row, column) * (1 - right) + at(row, column + 1) * right
    lower = at(row + 1, column) * (1 - right) + at(row + 1, column + 1) * right
    return upper * (1 - down) + lower * down


def _mirrored(index: NDArray[np.int64], length: int) -> NDArray[np.int64]:
    index = index % (2 * length)
    return np.minimum(index, 2 * length - 1 - index)


def aslant_rmse(picture: NDArray[np.uint8], cast: Cast) -> float:
    """RMSE in [0, 1] of a picture (y, x, 3) against its cast pixels."""
    found = picture[np.ix_(cast.rows, cast.columns)] / 255.0
    return float(np.sqrt(np.mean((found - cast.codes) ** 2)))
