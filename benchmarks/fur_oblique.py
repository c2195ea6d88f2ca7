"""Fur drawn from one photograph taken from above, against its own hairs, traced from aside.

A tile of the virtual pelt is photographed, and grows on a plane, a cylinder and a sphere; there it
is traced from 30, 50 and 70 degrees under three lamps. The same photograph, repeated over the same
bodies, is drawn in the full look and in the paper's. FLIP compares whole pictures, background and
all, at its authors' 67 pixels a degree.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.fur_laying import coordinates_of, laid_by_coordinates
from pipelines.drawing.colour import to_8bit
from pipelines.drawing.picture_metrics import flip_map, ssim_map
from pipelines.drawing.stage import Camera, Light, Stage
from pipelines.geometry.meshes import Mesh
from pipelines.photo_fur.attenuation import CALIBRATED_ENDS
from pipelines.photo_fur.frames import BACKGROUND
from pipelines.photo_fur.laid_fur import Hair, LaidFur, laid_fur, laid_surface, shells_seen
from pipelines.photo_fur.photograph import FurPhotograph, fur_photograph
from pipelines.photo_fur.photograph_lie import photograph_lie
from pipelines.photo_fur.shells import shell_vertices
from pipelines.photo_fur.stage_view import FurLight, fur_surface, fur_texture
from pipelines.virtual.pelt.coats import (
    Body,
    Coat,
    View,
    bent,
    make_coat,
    oblique_view,
    photograph_coat,
)
from pipelines.virtual.pelt.hairs import GOLDEN, FurKind, Hairs, grow_hairs
from pipelines.virtual.pelt.pelt import exposed, photograph_hairs, white_of
from pipelines.virtual.pelt.scattering import Source

LAYERS = 15
SIZE = (192, 256)
POLARS = (30, 50, 70)
AZIMUTHS: dict[Body, float] = {"plane": -60.0, "cylinder": 0.0, "sphere": -60.0}
_PHOTOGRAPH, _HAIRS = 512, 16_000
_LAMP_EXPONENT = 60.0
_SUPERSAMPLING = 3
_DISTANCE = 20.0


class Picture(NamedTuple):
    """8-bit sRGB colours (y, x, 3) over the background, and the fur's share (y, x) of pixels."""

    colours: NDArray[np.uint8]
    share: NDArray[np.floating]


class Scene(NamedTuple):
    """What is drawn, and how it is seen and lit."""

    body: Body
    coat: Coat
    view: View
    lamp: tuple[float, float, float] | None
    """Unit vector to the lamp; None for one along the view."""


def oblique_figures(kind: FurKind, seed: int, samples: int) -> dict[str, Any]:
    """Mean FLIP over bodies, angles and lamps, of both looks, and their ratio; the same for a
    shuffled photograph in the full look; SSIM beside."""
    random = np.random.default_rng(seed)
    hairs = grow_hairs(_HAIRS, random, kind)
    radiance, white = _photographed(hairs, 2 * samples, random)
    pixels = radiance.reshape(-1, 3)
    shuffled = np.random.default_rng(0).permutation(pixels).reshape(radiance.shape)
    full = fur_photograph(radiance, ends=CALIBRATED_ENDS)
    null = fur_photograph(shuffled, ends=CALIBRATED_ENDS)
    plain = fur_photograph(radiance)
    looks: dict[str, Callable[[Scene], Picture]] = {
        "": lambda scene: _drawn_full(scene, full),
        "_plain": lambda scene: _drawn_plain(scene, plain),
        "_null": lambda scene: _drawn_full(scene, null),
    }
    flips: dict[str, dict[str, float]] = {name: {} for name in looks}
    ssims: dict[str, list[float]] = {name: [] for name in looks}
    rough: dict[str, list[float]] = {name: [] for name in (*looks, "_traced")}
    for body, azimuth in AZIMUTHS.items():
        coat = make_coat(hairs, body)
        for polar in POLARS:
            view = oblique_view(body, polar, azimuth)
            for name, lamp in _lamps().items():
                scene = Scene(body, coat, view, lamp)
                truth = _traced(scene, samples, white, random)
                pictures = {look: draw(scene) for look, draw in looks.items()}
                for look, drawn in pictures.items():
                    flip = flip_map(drawn.colours, truth.colours)
                    flips[look][f"{body} {polar} {name}"] = float(flip.mean())
                    ssims[look].append(float(ssim_map(drawn.colours, truth.colours).mean()))
                if body == "sphere":
                    for look, picture in (pictures | {"_traced": truth}).items():
                        rough[look].append(outline_roughness(picture.share))
    roughness = {name: float(np.mean(each)) for name, each in rough.items()}
    means = {name: float(np.mean(list(each.values()))) for name, each in flips.items()}
    return {
        "oblique_flip_ratio": means[""] / means["_plain"],
        "oblique_flip_ratio_null": means["_null"] / means["_plain"],
        **{f"oblique_flip{name}": mean for name, mean in means.items()},
        **{f"oblique_ssim{name}": float(np.mean(each)) for name, each in ssims.items()},
        **{f"silhouette_hairiness{name}": roughness[name] / roughness["_traced"] for name in looks},
        "oblique_flip_each": flips[""],
        "oblique_flip_plain_each": flips["_plain"],
    }


def oblique_pictures(seed: int, samples: int) -> list[list[NDArray[np.uint8]]]:
    """Each body from 50 degrees, lit from aside: traced, in the full look, in the paper's."""
    random = np.random.default_rng(seed)
    hairs = grow_hairs(_HAIRS, random, GOLDEN)
    radiance, white = _photographed(hairs, 2 * samples, random)
    full, plain = fur_photograph(radiance, ends=CALIBRATED_ENDS), fur_photograph(radiance)
    found = []
    for body, azimuth in AZIMUTHS.items():
        view = oblique_view(body, 50.0, azimuth)
        scene = Scene(body, make_coat(hairs, body), view, _lamps()["aside"])
        traced = _traced(scene, samples, white, random)
        pictures = (traced, _drawn_full(scene, full), _drawn_plain(scene, plain))
        found.append([picture.colours for picture in pictures])
    return found


def _photographed(
    hairs: Hairs, samples: int, random: np.random.Generator
) -> tuple[NDArray[np.floating], float]:
    """A tile's exposed photograph from above, and the radiance that it shows as white."""
    picture = photograph_hairs(hairs, _PHOTOGRAPH, samples, random)
    white = white_of(picture.radiance)
    return exposed(picture.radiance, white), white


def _lamps() -> dict[str, tuple[float, float, float] | None]:
    return {"along the view": None, "aside": _towards(40.0, 50.0), "behind": _towards(120.0, 65.0)}


def _towards(azimuth: float, polar: float) -> tuple[float, float, float]:
    around, lean = math.radians(azimuth), math.radians(polar)
    return (
        math.sin(lean) * math.cos(around),
        math.sin(lean) * math.sin(around),
        math.cos(lean),
    )


def outline_roughness(share: NDArray[np.floating]) -> float:
    """Deviation in pixels of a ball's outline from its own mean over 15 degrees; share (y, x)."""
    from scipy.ndimage import map_coordinates, uniform_filter1d

    rows, columns = np.nonzero(share >= 0.5)
    row, column = rows.mean(), columns.mean()
    angle = np.radians(np.arange(0, 360, 0.5))[:, None]
    radius = np.arange(0.0, min(share.shape) / 2 - 1, 0.25)[None]
    there = [row - radius * np.sin(angle), column + radius * np.cos(angle)]
    inside = map_coordinates(share, there, order=1) >= 0.5
    outline = radius[0][inside.shape[1] - 1 - inside[:, ::-1].argmax(axis=1)]
    return float((outline - uniform_filter1d(outline, 30, mode="wrap")).std())


def _traced(scene: Scene, samples: int, white: float, random: np.random.Generator) -> Picture:
    source = Source(scene.lamp or scene.view.towards, _LAMP_EXPONENT)
    radiance, share = photograph_coat(scene.coat, scene.view, SIZE, samples, source, random)
    behind = (1 - share[..., None]) * np.array(BACKGROUND)
    return Picture(to_8bit(np.minimum(radiance / white + behind, 1.0)), share)


def _drawn_full(scene: Scene, photograph: FurPhotograph) -> Picture:
    fur = repeated_over(scene.body, scene.coat, photograph)
    image = fur_texture(photograph, LAYERS, tails="end layers")
    light = FurLight() if scene.lamp is None else FurLight(0.0, 0.0, 1.0, scene.lamp)
    rows = fur.thickness * _SUPERSAMPLING * SIZE[0] / scene.view.height
    actor = laid_surface(
        fur, image, photograph.attenuation, light, shells=shells_seen(rows), wrap="repeat"
    )
    return _seen(scene, actor)


def _drawn_plain(scene: Scene, photograph: FurPhotograph) -> Picture:
    skin = scene.coat.skin
    image = fur_texture(photograph, LAYERS, tails="end layers")
    shells = shell_vertices(skin.vertices, _normals(skin), scene.coat.thickness, LAYERS)
    actor = fur_surface(
        shells,
        _normals(skin),
        skin.triangles,
        coordinates_of(skin),
        image,
        photograph.attenuation,
        fill="bands",
        wrap="repeat",
        interpolate=True,
        lit=True,
    )
    return _seen(scene, actor)


def _seen(scene: Scene, actor: Any) -> Picture:
    height, width = SIZE
    view = scene.view
    middle = np.asarray(view.middle)
    eye = middle + _DISTANCE * np.asarray(view.towards)
    with Stage(width, height, background=BACKGROUND, supersampling=_SUPERSAMPLING) as stage:
        stage.add(actor)
        stage.light(Light() if scene.lamp is None else Light(scene.lamp))
        stage.look(Camera(tuple(eye), tuple(middle), view.up, 30.0, view.height))
        drawn = stage.radiance()
    return Picture(to_8bit(drawn[..., :3]), drawn[..., 3])


def repeated_over(body: Body, coat: Coat, photograph: FurPhotograph) -> LaidFur:
    """A tile's photograph on a body by its texture coordinates, in one patch, with the lie that is
    seen in it."""
    skin, uvs = coat.skin, coordinates_of(coat.skin)
    direction = photograph_lie(photograph.luminance).direction
    height, width = direction.shape
    columns = np.floor(uvs[:, 0] * width).astype(int) % width
    rows = (height - 1 - np.floor(uvs[:, 1] * height).astype(int)) % height
    angle = direction[rows, columns]
    flat = np.stack([uvs[:, 0], uvs[:, 1], 0 * angle], axis=-1).astype(np.float64)
    step = 1e-3 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    tangents = bent(flat + step, body) - bent(flat, body)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    laying = laid_by_coordinates(skin)
    hair = Hair(tangents, np.ones(len(uvs)))
    return laid_fur(skin.vertices, _normals(skin), hair, laying, coat.thickness, LAYERS)


def _normals(skin: Mesh) -> NDArray[np.floating]:
    assert skin.normals is not None
    return skin.normals
