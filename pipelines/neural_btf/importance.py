"""Directions of light drawn where a material sends light from, with their exact density.

One table a material, of all its texels: cells of view by cells of light. Cells are of equal area on
the disc below the hemisphere, so evenly drawn points of them are directions by the cosine: row
sin²(theta), column phi from the material's x.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance
from pipelines.neural_btf.material import Material, surface_radiance

FloatArray = NDArray[np.float64]

VIEW_CELLS = (6, 12)
LIGHT_CELLS = (12, 24)
_SAMPLES = 16
_EVEN = 0.1
"""Part of the light that every cell has, so that no direction is left out where a texel differs
from the others."""
_LEAST_COSINE = 1e-3


@dataclass(frozen=True)
class ImportanceTable:
    """Where light is drawn from, by where a material is seen from.

    >>> even = ImportanceTable(np.full((*VIEW_CELLS, *LIGHT_CELLS), 1 / 288, np.float32))
    >>> up = np.array([[0.0, 0.0, 1.0]])
    >>> light = even.sample(up, np.array([[0.25, 0.5]]))
    >>> light.round(6).tolist(), (even.pdf(light, up) * np.pi).round(6).tolist()
    ([[-0.5, 0.0, 0.866025]], [0.866025])
    """

    shares: NDArray[np.float32]
    """(*VIEW_CELLS, *LIGHT_CELLS), above 0; those of a view sum to 1."""

    def sample(self, view: FloatArray, uniforms: FloatArray) -> FloatArray:
        """Unit vectors (n, 3) to the light for views (n, 3) from numbers (n, 2) in [0, 1)."""
        rows, columns = self._sums
        row, down = _interval(rows, _cells(view, VIEW_CELLS), uniforms[:, 0])
        column, along = _interval(columns, row, uniforms[:, 1])
        square = (row % LIGHT_CELLS[0] + down) / LIGHT_CELLS[0]
        phi = (column % LIGHT_CELLS[1] + along) * (2 * math.pi / LIGHT_CELLS[1])
        sine = np.sqrt(square)
        return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.sqrt(1.0 - square)], axis=-1)

    def pdf(self, light: FloatArray, view: FloatArray) -> FloatArray:
        """Density (n,) per steradian with which `sample` draws light (n, 3); 0 below the surface.

        Of a share s of a cell, of n, it is s n cos(theta) / pi.
        """
        shares = self._shares.reshape(-1, math.prod(LIGHT_CELLS))
        found = shares[_cells(view, VIEW_CELLS), _cells(light, LIGHT_CELLS)]
        density: FloatArray = found * np.maximum(light[:, 2], 0.0) * (shares.shape[1] / math.pi)
        return density

    @functools.cached_property
    def _shares(self) -> FloatArray:
        """In double precision, a view's with the sum 1: what is drawn is what is looked up."""
        shares = self.shares.astype(np.float64)
        return shares / shares.sum(axis=(2, 3), keepdims=True)

    @functools.cached_property
    def _sums(self) -> tuple[FloatArray, FloatArray]:
        """Upper ends (view, light row), (view * light row, light column) of intervals of [0, 1]."""
        shares = self._shares.reshape(-1, *LIGHT_CELLS)
        rows = shares.sum(axis=2)
        columns = (shares / rows[..., None]).reshape(-1, LIGHT_CELLS[1])
        sums = np.cumsum(rows, axis=1), np.cumsum(columns, axis=1)
        for ends in sums:
            ends[:, -1] = 1.0
        return sums


def importance_table(material: Material, seed: int = 0) -> ImportanceTable:
    """The table of a material.

    A share is in proportion to the root of the mean square of the BRDF's luminance over
    ``_SAMPLES`` random places and directions a pair of cells: of all tables the one with the least
    variance over a material's texels (its mean square is the sum of BRDF² over share). A tenth is
    even.
    """
    rng = np.random.default_rng(seed)
    shape = (*VIEW_CELLS, *LIGHT_CELLS, _SAMPLES)
    cells = np.indices(shape).reshape(5, -1)
    view = _directions(cells[:2], VIEW_CELLS, rng)
    light = _directions(cells[2:4], LIGHT_CELLS, rng)
    places = rng.random((cells.shape[1], 2))
    found = luminance(surface_radiance(material, places, light, view).astype(np.float64))
    brdf = np.maximum(found, 0.0) / np.maximum(light[:, 2], _LEAST_COSINE)
    strength = np.sqrt(np.mean(brdf.reshape(*VIEW_CELLS, -1, _SAMPLES) ** 2, axis=-1))
    total = strength.sum(axis=-1, keepdims=True)
    count = strength.shape[-1]
    shares = np.divide(strength, total, out=np.full_like(strength, 1 / count), where=total > 0)
    shares = (1 - _EVEN) * shares + _EVEN / count
    return ImportanceTable(shares.reshape(*VIEW_CELLS, *LIGHT_CELLS).astype(np.float32))


def _directions(
    cells: NDArray[np.intp], counts: tuple[int, int], rng: np.random.Generator
) -> FloatArray:
    """Unit vectors (n, 3), one random in each of cells (2, n)."""
    row, column = (cells + rng.random(cells.shape)) / np.array(counts)[:, None]
    sine, phi = np.sqrt(row), 2 * np.pi * column
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.sqrt(1 - row)], axis=-1)


def _cells(vectors: FloatArray, counts: tuple[int, int]) -> NDArray[np.int64]:
    """Numbers (n,) of the cells that hold unit vectors (n, 3)."""
    rows, columns = counts
    x, y = vectors[:, 0], vectors[:, 1]
    row = np.minimum((x * x + y * y) * rows, rows - 1).astype(np.int64)
    column = np.floor(np.arctan2(y, x) * (columns / (2 * math.pi))).astype(np.int64)
    return row * columns + column % columns


def _interval(
    ends: FloatArray, line: NDArray[np.int64], uniform: FloatArray
) -> tuple[NDArray[np.int64], FloatArray]:
    """The interval of [0, 1] that holds a number, and its place in it, 0 to 1.

    ``ends`` (lines, n) are upper ends; intervals are numbered through all lines.
    """
    lines, count = ends.shape
    through = (ends + np.arange(lines)[:, None]).ravel()
    found = np.searchsorted(through, line + uniform, side="right")
    found = np.clip(found, line * count, line * count + count - 1)
    upper = ends.ravel()[found]
    lower = np.where(found % count == 0, 0.0, ends.ravel()[found - 1])
    place = np.clip((uniform - lower) / (upper - lower), 0.0, 1.0)
    return found, place
