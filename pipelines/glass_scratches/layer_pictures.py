"""Pictures of scratch layers: the three stages of figure 4, and all layers together."""

from __future__ import annotations

import colorsys

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.layers import Features, LayerSpec


def stages(spec: LayerSpec, seed: int, size: int) -> NDArray[np.uint8]:
    """Figure 4, (3, size, size): cell noise, the same turned and stretched, and thresholded.

    One layer of straight, equal scratches; the third picture is where the second is below the
    threshold (it is shown as F1 / 1.5). Rows run downwards.
    """
    from scipy.spatial import cKDTree

    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, np.pi)
    steps = (np.arange(size) + 0.5) / size - 0.5
    x, y = np.meshgrid(steps, -steps)
    reach = 0.75  # of the turned picture's corners
    along = x * np.cos(angle) + y * np.sin(angle)
    aside = y * np.cos(angle) - x * np.sin(angle)
    across = 6.0  # cells over the first picture
    even = rng.random((round((2 * reach * across) ** 2), 2)) * 2 * reach * across - reach * across
    noise, _ = cKDTree(even).query(np.stack([x, y], axis=-1).reshape(-1, 2) * across)
    cells = np.array([2 * reach / spec.length, 2 * reach / spec.width])
    points = rng.random((round(cells.prod()), 2)) * cells - cells / 2
    stretched, _ = cKDTree(points).query(
        np.stack([along / spec.length, aside / spec.width], axis=-1).reshape(-1, 2)
    )
    shown = [np.clip(field / 1.5, 0.0, 1.0) * 255 for field in (noise, stretched)]
    shown.append((stretched < spec.threshold) * 255.0)
    return np.stack(shown).round().astype(np.uint8).reshape(3, size, size)


def layers_picture(
    coverage: NDArray[np.float32], angles: NDArray[np.floating]
) -> NDArray[np.uint8]:
    """All layers (L, R, R) in one picture (R, R, 3), each in the colour of its direction."""
    picture = np.zeros((*coverage.shape[1:], 3))
    for layer, angle in zip(coverage, angles, strict=True):
        colour = np.array(colorsys.hsv_to_rgb(float(angle) / np.pi % 1.0, 0.35, 1.0))
        picture += layer[::-1, :, None] * colour
    return (np.clip(picture, 0.0, 1.0) ** (1 / 2.2) * 255).round().astype(np.uint8)


def kept_bytes(features: Features) -> int:
    """Bytes of the scratches alone, without maps and search grid."""
    return sum(
        array.nbytes
        for name, array in features._asdict().items()
        if isinstance(array, np.ndarray) and not name.startswith("cell_")
    )
