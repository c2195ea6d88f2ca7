"""The photograph with its scratches, and layers like them."""

from __future__ import annotations

import colorsys

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.glass_scratches.photograph.photograph_layers import PhotographScratches

_USUAL = 0.22


def photograph_picture(luminance: NDArray[np.floating]) -> NDArray[np.uint8]:
    """A photograph (y, x) in grey (y, x, 3), its median shown as 0.22."""
    grey = np.clip(luminance * (_USUAL / max(float(np.median(luminance)), 1e-9)), 0.0, 1.0)
    return to_8bit(np.repeat(grey[..., None], 3, axis=2))


def found_picture(
    luminance: NDArray[np.floating], scratches: PhotographScratches
) -> NDArray[np.uint8]:
    """The photograph in grey, darkened, and its scratches in their layers' colours (y, x, 3)."""
    picture = photograph_picture(luminance) // 2
    segments = scratches.segments
    for row, layer in enumerate(scratches.layer):
        hue = float(scratches.angle[layer]) / np.pi
        half = 0.5 * segments.length[row]
        u = np.arange(-half, half + 0.25, 0.5)
        angle = segments.angle[row] + segments.turn[row] * u / segments.length[row]
        # Along the arc from its middle: the mean direction so far is half the turn.
        way = 0.5 * (segments.angle[row] + angle)
        x = np.floor(segments.centre[row, 0] + u * np.cos(way)).astype(int)
        y = np.floor(segments.centre[row, 1] - u * np.sin(way)).astype(int)
        inside = (x >= 0) & (y >= 0) & (x < picture.shape[1]) & (y < picture.shape[0])
        picture[y[inside], x[inside]] = np.rint(255 * np.array(colorsys.hsv_to_rgb(hue, 0.7, 1.0)))
    return picture


def like_picture(
    luminance: NDArray[np.floating],
    scratches: PhotographScratches,
    coverage: NDArray[np.floating],
) -> NDArray[np.uint8]:
    """A tile's coverage (L, R, R) as such a photograph would show it (R, R, 3): on even ground."""
    shown = 1.0 - np.prod(1.0 - coverage[:, ::-1].astype(np.float64), axis=0)
    noise = scratches.noise * np.random.default_rng(0).standard_normal(shown.shape)
    sign = -1.0 if scratches.dark else 1.0
    light = float(np.median(luminance)) * (1.0 + sign * scratches.full * shown + noise)
    grey = np.clip(light * (_USUAL / max(float(np.median(luminance)), 1e-9)), 0.0, 1.0)
    return to_8bit(np.repeat(grey[..., None], 3, axis=2))
