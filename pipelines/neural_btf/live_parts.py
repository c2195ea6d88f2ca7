"""What a live picture of a BTF elsewhere starts with, and frames of the stage beside it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.stage import PAINTED, Camera, Stage, orbit, surface
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.hanging_cloth import (
    HangingCloth,
    Surroundings,
    hanging_cloth,
    surroundings,
)
from pipelines.neural_btf.stage_view import Scenery, Showing, draw_cloth
from pipelines.neural_btf.surface_lookup import (
    dimming,
    held_directions,
    in_frames,
    surface_frames,
    unit,
)

HOME = orbit((0.0, 0.0, -0.02), 4.0, -66.0, 4.0, view_angle=30.0)
HOME_LIGHT = (-0.5, -0.75, 0.45)
_SIDE_LIGHT = (0.96, -0.2, 0.2)
_CLOSE = orbit((-0.25, 0.0, 0.1), 1.5, -100.0, 12.0, view_angle=30.0)
_EXPOSED_WIDTH = 160
_SMALLEST_INPUT = 256
SUPERSAMPLING = 2


class ReferenceView(NamedTuple):
    """A frame (height, width, 3) uint8 of the stage that a live picture must show, too."""

    name: str
    camera: Camera
    light: tuple[float, float, float]
    tiles: float
    frame: NDArray[np.uint8]


def scenery_of(btf: CompressedBtf) -> Scenery:
    """The cloth of a material in its room."""
    return Scenery(btf, hanging_cloth(btf.height / btf.width), surroundings())


def home_exposure(scenery: Scenery, tiles: float) -> float:
    """Factor that exposes the cloth from the first camera under the first light."""
    showing = Showing(unit_light(HOME_LIGHT), tiles, 1.0)
    size = (_EXPOSED_WIDTH, _EXPOSED_WIDTH * 3 // 4)
    picture = decoded_cloth(scenery._replace(around=None), showing, HOME, size)
    return auto_exposure(picture[picture[..., 3] == 1.0][:, :3])


def reference_views(
    scenery: Scenery, tiles: float, exposure: float, width: int
) -> tuple[ReferenceView, ...]:
    """The cloth at first, lit from its side, and from close, ``width`` x 3/4 pixels."""
    wanted = (
        ("front", HOME, HOME_LIGHT, tiles),
        ("side", HOME, _SIDE_LIGHT, tiles),
        ("close", _CLOSE, HOME_LIGHT, tiles),
    )
    found = []
    for name, camera, direction, count in wanted:
        light = unit_light(direction)
        showing = Showing(light, count, exposure)
        drawn = draw_cloth(
            scenery,
            showing,
            camera,
            width=width,
            height=width * 3 // 4,
            supersampling=SUPERSAMPLING,
        )
        found.append(ReferenceView(name, camera, light, count, to_8bit(drawn[..., :3])))
    return tuple(found)


def poster(scenery: Scenery, tiles: float, exposure: float, width: int) -> NDArray[np.uint8]:
    """The cloth at first, (width * 3/4, width, 3) sRGB."""
    n = SUPERSAMPLING
    showing = Showing(unit_light(HOME_LIGHT), tiles, exposure)
    drawn = decoded_cloth(scenery, showing, HOME, (width * n, width * 3 // 4 * n))
    return to_8bit(drawn[..., :3].reshape(width * 3 // 4, n, width, n, 3).mean(axis=(1, 3)))


def input_picture(photograph: NDArray[np.floating]) -> NDArray[np.uint8]:
    """A measured photograph (y, x, 3), exposed and large enough to be looked at."""
    encoded = to_8bit(photograph * auto_exposure(photograph))
    times = max(1, -(-_SMALLEST_INPUT // min(photograph.shape[:2])))
    return encoded.repeat(times, axis=0).repeat(times, axis=1)


def unit_light(direction: tuple[float, float, float]) -> tuple[float, float, float]:
    """A direction of length 1."""
    length = math.sqrt(sum(part * part for part in direction))
    x, y, z = (part / length for part in direction)
    return x, y, z


class ClothSights(NamedTuple):
    """What pixels of a picture see of the cloth, N of them."""

    seen: NDArray[np.bool_]
    """(y, x) which pixels."""
    picture: NDArray[np.float32]
    """(y, x, 4) what the others show."""
    places: NDArray[np.float64]
    """(N, 2) in the material, in tiles."""
    footprint: NDArray[np.float64]
    """(N,) root of the area of the material that a pixel sees, in tiles."""
    light: NDArray[np.float64]
    """(N, 3) unit vectors to the light in the material's frame, not held."""
    view: NDArray[np.float64]
    """(N, 3) unit vectors to the eye in the material's frame, not held."""


def decoded_cloth(
    scenery: Scenery, showing: Showing, camera: Camera, size: tuple[int, int]
) -> NDArray[np.float32]:
    """What `stage_view.draw_cloth` draws, decoded by torch: (y, x, 4) for ``size`` (x, y).

    Faster without a graphics card, and independent of the shader that decodes. The camera is a
    perspective one.
    """
    sights = cloth_sights(scenery, showing, camera, size)
    light, view = held_directions(sights.light), held_directions(sights.view)
    radiance = scenery.btf.radiance_at(sights.places, light, view, sights.footprint)
    dimmed = radiance * dimming(sights.light[:, 2])[:, None]
    sights.picture[sights.seen, :3] = np.maximum(dimmed, 0) * showing.exposure
    return sights.picture


def cloth_sights(
    scenery: Scenery, showing: Showing, camera: Camera, size: tuple[int, int]
) -> ClothSights:
    """Where ``size`` (x, y) pixels of a perspective camera see the cloth, and from where."""
    cloth = scenery.cloth
    # Nothing else is darker than black.
    picture = _painted(scenery, np.full((len(cloth.vertices), 3), -1.0), camera, size)
    seen = picture[..., 0] < 0
    position, normal, tangent = (
        _painted(scenery, values, camera, size)[seen][:, :3].astype(np.float64)
        for values in (cloth.vertices, cloth.normals, cloth.tangents)
    )
    placed = draw_cloth(scenery, showing, camera, width=size[0], height=size[1], places=True)
    places = placed[seen].astype(np.float64)
    towards = unit(np.asarray(camera.position) - position)
    normal *= np.where(np.sum(normal * towards, axis=1, keepdims=True) < 0, -1.0, 1.0)
    frame = surface_frames(normal, tangent)
    light = np.einsum("nij,j->ni", frame, np.asarray(showing.light))
    view = in_frames(frame, towards)
    return ClothSights(seen, picture, places[:, :2], places[:, 2], light, view)


def _painted(
    scenery: Scenery, values: NDArray[np.floating], camera: Camera, size: tuple[int, int]
) -> NDArray[np.float32]:
    """The picture (y, x, 4) with values (V, 3) on the cloth."""
    shown: list[tuple[HangingCloth | Surroundings, NDArray[np.floating]]]
    shown = [(scenery.cloth, values)]
    if scenery.around is not None:
        shown.append((scenery.around, scenery.around.radiance))
    with Stage(*size) as stage:
        for mesh, colours in shown:
            attributes = {"shown": colours}
            stage.add(
                surface(
                    mesh.vertices, mesh.triangles, attributes=attributes, shader=PAINTED, lit=False
                )
            )
        stage.look(camera)
        return stage.radiance()
