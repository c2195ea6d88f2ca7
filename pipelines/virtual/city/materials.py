"""Photographs to the textures of the built-in city: rectified, evened out, repeatable."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb, to_8bit
from pipelines.virtual.city.parts import MATERIALS, MEAN_TEXEL

_SIDE = 512
Image = NDArray[np.float32]

# Corners in brick.png, turned by a quarter: from mortar to mortar, eleven courses; left to right,
# about 4.6 bricks. In pixels: top left, top right, bottom right, bottom left.
_BRICKS = np.array([[0, 112], [511, 42.5], [511, 504], [0, 442.5]], np.float32)


def city_textures(
    photographs: Mapping[str, NDArray[np.uint8]],
) -> dict[str, NDArray[np.uint8]]:
    """Textures of MATERIALS by name, (height, width, 3) uint8 sRGB, and ``"stains"``.

    photographs: (height, width, 3) uint8 sRGB: brick, gravel, grass, coffee, moon, coins, page,
    motorcycle_left, astronaut, chelsea, rocket. Those that repeat have a mean of MEAN_TEXEL in
    linear light, and so have stains, which every surface is multiplied by at a larger scale. Raises
    ValueError where a photograph is missing.
    """
    needed = {"brick", "gravel", "grass", "coffee", "moon", "coins", "page", "motorcycle_left"}
    needed |= {"astronaut", "chelsea", "rocket"}
    if missing := sorted(needed - set(photographs)):
        raise ValueError(f"photographs: missing {', '.join(missing)}.")
    light = {name: decode_srgb(photographs[name] / 255.0).astype(np.float32) for name in needed}
    gravel = make_tileable(even_brightness(light["gravel"]))
    grass = make_tileable(even_brightness(light["grass"]))
    moon = make_tileable(even_brightness(light["moon"][:400]))
    bricks = _bricks(light["brick"])
    linear = {
        "brick": bricks,
        "plaster": _contrast(gravel, 0.35) * _contrast(grass, 0.25),
        "asphalt": _contrast(gravel, 0.8),
        "paving": _contrast(bricks.mean(axis=2, keepdims=True), 0.8) * _contrast(gravel, 0.35),
        "leaves": grass**1.5,
        "wood": _contrast(make_tileable(even_brightness(light["coffee"][290:, :130], 20.0)), 0.6),
        "metal": _contrast(gravel, 0.3),
        "roof": _contrast(bricks.mean(axis=2, keepdims=True), 1.2) * _contrast(grass, 0.3),
        "paint": _contrast(moon, 0.15),
    }
    textures = {name: _coded(image) for name, image in linear.items()}
    textures["stains"] = _coded(_stains(grass, gravel))
    for name in ("astronaut", "chelsea", "coffee", "rocket", "page", "coins"):
        textures[name] = np.ascontiguousarray(photographs[name])
    textures["interior"] = to_8bit(_interior(light["motorcycle_left"][:190, 180:560]))
    textures["shop"] = to_8bit(0.5 * light["motorcycle_left"][:, 90:650])
    assert set(MATERIALS) <= set(textures)
    return textures


def even_brightness(image: Image, sigma: float = 60.0) -> Image:
    """A photograph of a material (y, x, 3) without slow changes of brightness, of mean 1."""
    grey = image.mean(axis=2)
    slow = cv2.GaussianBlur(grey, (0, 0), sigma, borderType=cv2.BORDER_REFLECT)
    level = image / slow[..., None]
    return level / level.mean()


def make_tileable(image: Image, overlap: float = 0.15) -> Image:
    """A picture (y, x, c) whose ends fit together: faded over by ``overlap`` of each side.

    Fading keeps the variance: the weights' squares sum to 1.
    """
    for axis in (0, 1):
        length = image.shape[axis]
        width = round(overlap * length)
        t = (np.arange(width) + 0.5) / width
        weight = np.sin(t * np.pi / 2).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        counter = np.cos(t * np.pi / 2).reshape(weight.shape)
        mean = image.mean(axis=(0, 1))
        head, body, tail = np.split(image - mean, [width, length - width], axis=axis)
        faded = head * weight + tail * counter
        image = (np.concatenate([faded, body], axis=axis) + mean).astype(np.float32)
    return np.maximum(image, 0.0)


def _contrast(image: Image, factor: float) -> Image:
    sized = cv2.resize(image, (_SIDE, _SIDE), interpolation=cv2.INTER_AREA)
    sized = sized.reshape(_SIDE, _SIDE, -1)
    mean = sized.mean(axis=(0, 1))
    return np.maximum(1.0 + factor * (sized / mean - 1.0), 0.02)


def _bricks(photograph: Image) -> Image:
    """Eleven courses, straight, bricks and mortar of their own colours."""
    turned = np.rot90(photograph)
    square = np.array([[0, 0], [_SIDE, 0], [_SIDE, _SIDE], [0, _SIDE]], np.float32)
    straight = cv2.warpPerspective(
        np.ascontiguousarray(turned),
        cv2.getPerspectiveTransform(_BRICKS, square),
        (_SIDE, _SIDE),
        flags=cv2.INTER_AREA,
    )
    level = even_brightness(straight.astype(np.float32), 90.0)
    grey = level.mean(axis=2, keepdims=True)
    dark, bright = np.quantile(grey, [0.3, 0.93])
    mortar = np.clip((grey - dark) / (bright - dark), 0.0, 1.0)
    # Photographed bricks are too alike for a wall: each of the cells gets a tone of its own.
    tones = 1.0 + 0.25 * np.random.default_rng(5).normal(size=(11, 5))
    rows = np.minimum(np.arange(_SIDE) * 11 // _SIDE, 10)
    shifted = (np.arange(_SIDE)[None] * 4.6 / _SIDE + 0.5 * (rows % 2)[:, None]) % 4.6
    tone = cv2.GaussianBlur(
        tones[rows[:, None], shifted.astype(int)].astype(np.float32), (0, 0), 3.0
    )
    fine = grey / cv2.GaussianBlur(grey, (0, 0), 2.0)[..., None]
    brick = np.array([1.0, 0.55, 0.42], np.float32) * tone[..., None] * fine**2
    coloured = brick * (1 - mortar) + np.array([0.95, 0.9, 0.85], np.float32) * mortar
    return (coloured / coloured.mean()).astype(np.float32)


def _stains(grass: Image, gravel: Image) -> Image:
    """Blotches at many scales, of photographs."""
    total = np.zeros((_SIDE, _SIDE, 1), np.float32)
    for image, sigma, strength in ((grass, 14.0, 0.07), (gravel, 6.0, 0.07), (grass, 2.0, 0.09)):
        sized = cv2.resize(image.mean(axis=2), (_SIDE, _SIDE), interpolation=cv2.INTER_AREA)
        wide = np.tile(sized, (3, 3))
        soft = cv2.GaussianBlur(wide, (0, 0), sigma)[_SIDE : 2 * _SIDE, _SIDE : 2 * _SIDE]
        total += strength * ((soft - soft.mean()) / soft.std())[..., None]
    return np.repeat(np.clip(1.0 + total, 0.4, 1.8), 3, axis=2)


def _interior(photograph: Image) -> Image:
    """A dim room behind a pane: curtains at both sides, a sill, what a lamp shows."""
    room = 0.35 * cv2.resize(photograph, (256, 192), interpolation=cv2.INTER_AREA)
    x = np.linspace(0.0, 1.0, 256, dtype=np.float32)
    folds = 0.22 + 0.1 * np.sin(x * 110.0) + 0.05 * np.sin(x * 41.0)
    curtain = np.clip((np.abs(x - 0.5) - 0.27) * 30.0, 0.0, 1.0)[None, :, None]
    room = room * (1 - curtain) + folds[None, :, None] * curtain
    room *= np.linspace(1.0, 0.5, 192, dtype=np.float32)[:, None, None]
    return room.astype(np.float32)


def _coded(image: Image) -> NDArray[np.uint8]:
    """As 8-bit sRGB with a mean of MEAN_TEXEL."""
    return to_8bit(np.broadcast_to(image * (MEAN_TEXEL / image.mean()), (*image.shape[:2], 3)))
