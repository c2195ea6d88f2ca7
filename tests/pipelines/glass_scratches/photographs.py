"""Photographs of scratched glass whose scratches are known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from pipelines.glass_scratches.layers.coverage import coverage_maps
from pipelines.glass_scratches.layers.features import Layers
from pipelines.glass_scratches.layers.scratch_layers import make_layers
from pipelines.glass_scratches.layers.settings import LayerSpec

SPEC = LayerSpec(length=0.6, width=0.06, coverage=0.02, layers=3)


def ground(size: int) -> NDArray[np.float64]:
    """Light that varies slowly, as behind glass out of focus."""
    y, x = np.mgrid[:size, :size] / size
    return np.asarray(0.1 + 0.07 * x + 0.03 * np.sin(5 * y))


def photograph(
    spec: LayerSpec, seed: int, size: int = 384, contrast: float = 0.5
) -> tuple[Layers, NDArray[np.float64]]:
    """Layers, and their coverage as light (size, size) over such a ground, blurred and noisy."""
    layers = make_layers(spec, seed)
    maps = coverage_maps(layers, size, 16)
    covered = 1.0 - np.prod(1.0 - maps[:, ::-1].astype(np.float64), axis=0)
    noise = np.random.default_rng(seed).standard_normal((size, size))
    clean = gaussian_filter(ground(size) * (1.0 + contrast * covered), 0.6)
    return layers, np.asarray(clean * (1.0 + 0.02 * noise))
