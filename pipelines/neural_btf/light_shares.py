"""Where a material sends light, as a table to draw directions from.

Cells are of equal area on the disc below the hemisphere, so evenly drawn points of them are
directions by the cosine: row sin²(theta), column phi from the material's x.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance
from pipelines.neural_btf.compressed import CompressedBtf

VIEW_CELLS = (6, 12)
LIGHT_CELLS = (12, 24)
_SAMPLES = 32
_EVEN = 0.2
"""Part of the light that every cell has, so that no direction is left out where a texel differs
from the mean of all."""
_LEAST_COSINE = 1e-3


def light_shares(btf: CompressedBtf, seed: int = 0) -> NDArray[np.float32]:
    """Shares (view row, view column, light row, light column) that sum to 1 for every view.

    Of the mean luminance of the BRDF over ``_SAMPLES`` random texels and directions a pair of
    cells; a fifth is even.
    """
    rng = np.random.default_rng(seed)
    shape = (*VIEW_CELLS, *LIGHT_CELLS, _SAMPLES)
    cells = np.indices(shape).reshape(5, -1)
    view = _directions(cells[:2], VIEW_CELLS, rng)
    light = _directions(cells[2:4], LIGHT_CELLS, rng)
    texels = rng.integers(btf.texels, size=cells.shape[1])
    found = np.maximum(luminance(btf.radiance(texels, light, view)), 0.0)
    brdf = found / np.maximum(light[:, 2], _LEAST_COSINE)
    mean = brdf.reshape(*VIEW_CELLS, -1, _SAMPLES).mean(axis=-1, dtype=np.float64)
    total = mean.sum(axis=-1, keepdims=True)
    shares = np.divide(mean, total, out=np.full_like(mean, 1 / mean.shape[-1]), where=total > 0)
    shares = (1 - _EVEN) * shares + _EVEN / mean.shape[-1]
    return shares.reshape(*VIEW_CELLS, *LIGHT_CELLS).astype(np.float32)


def _directions(
    cells: NDArray[np.intp], counts: tuple[int, int], rng: np.random.Generator
) -> NDArray[np.float64]:
    """Unit vectors (n, 3), one random in each of cells (2, n)."""
    row, column = (cells + rng.random(cells.shape)) / np.array(counts)[:, None]
    sine, phi = np.sqrt(row), 2 * np.pi * column
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.sqrt(1 - row)], axis=-1)
