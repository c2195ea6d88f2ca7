"""The pelt on the eared body close, against the light, and in wind: drawn of its package."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from assets_defs.photo_fur.graph import FUR
from pipelines.drawing.stage import Camera
from pipelines.photo_fur.frames import View
from pipelines.photo_fur.laid_fur import Wind
from pipelines.photo_fur.live_parts import OUTDOORS, FurLook, FurScene, nearer
from pipelines.photo_fur.stage_view import FurLight
from storage.packages import read_package
from storage.versions import VersionedStore
from tsuya.exports.packaged_fur import packaged_fur

_SIZE = (360, 480)
_VIEW = View(-62.0, 20.0)
_DUSK = (0.02, 0.025, 0.03)
_MOMENTS = 16
_GUST = 2 * math.pi / 2.1
"""Seconds from one gust to the next."""


def fur_scene(store: VersionedStore, photo: str, mesh: str) -> FurScene:
    """What a package of the store holds."""
    dataset = store.open(FUR.slot("fur_package", {"photo": photo, "mesh": mesh}))
    packed = packaged_fur(read_package(dataset["file"].values.tobytes()))
    return FurScene(packed.photograph(), packed.mesh, packed.fur(), "end layers")


def close_and_against_the_light(scene: FurScene) -> list[NDArray[np.uint8]]:
    """By day from near, and with the lamp behind, from where all is seen."""
    whole, day = _camera(scene), _look(OUTDOORS)
    around, up = math.radians(105.0), math.radians(25.0)
    behind = (math.cos(around) * math.cos(up), math.sin(around) * math.cos(up), math.sin(up))
    back = _look(FurLight(sky=0.12, headlight=0.05, lamp=1.3, light=behind))
    return [
        scene.live_frame(day, nearer(whole, 0.35), _SIZE),
        scene.live_frame(back, whole, _SIZE, _DUSK),
    ]


def in_wind(scene: FurScene) -> NDArray[np.uint8]:
    """Frames (moment, y, x, 3) from one gust to the next."""
    near, day = nearer(_camera(scene), 0.6), _look(OUTDOORS)
    moments = _GUST * np.arange(_MOMENTS) / _MOMENTS
    return np.stack(
        [
            scene.live_frame(replace(day, wind=Wind(0.9, float(moment))), near, _SIZE)
            for moment in moments
        ]
    )


def _camera(scene: FurScene) -> Camera:
    (camera,) = scene.cameras([_VIEW], _SIZE[1] / _SIZE[0])
    return camera


def _look(light: FurLight) -> FurLook:
    return FurLook(15, "columns", light, look="full")
