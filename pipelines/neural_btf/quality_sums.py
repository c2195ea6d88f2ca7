"""One pass over a BTF and its restoration: sums that figures of quality are made of.

Texels come by blocks of whole rows, so that differences to the texel beside and below are taken as
in whole photographs; memory is bounded whatever the size.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs
from pipelines.neural_btf.abrdf_pool import AbrdfReader

GRAZING = np.radians(59.5)
"""Views from here on are grazing ones: the rings at 60 degrees and more."""

_Rows = NDArray[np.float32]


class GradientEnergy(NamedTuple):
    """Sums of squared differences to the texel beside and below, of each photograph (image,)."""

    measured: NDArray[np.float64]
    restored: NDArray[np.float64]
    shared: NDArray[np.float64]
    """Products of measured and restored differences: noise does not add to it."""


@dataclass(frozen=True)
class Comparison:
    """A BTF of N photographs of M texels beside what is restored; squared errors in radiance."""

    of_image: NDArray[np.float64]
    """(N,) mean squared error of each photograph, over texels and channels."""
    of_texel: NDArray[np.float64]
    """(M,)."""
    flat_of_image: NDArray[np.float64]
    """(N,) of a null that gives every photograph its mean colour; which is the mean ABRDF for
    every texel, too."""
    flat_of_texel: NDArray[np.float64]
    shuffled_of_image: NDArray[np.float64]
    """(N,) of a null that gives the restored texels in an order drawn by lot; its expectation."""
    variance: float
    """Of all measured values."""
    grazing: NDArray[np.int64]
    """Numbers of the photographs from grazing views."""
    gradients: GradientEnergy
    """Of the photographs from grazing views."""
    measured: NDArray[np.float32]
    """(j, y, x, 3) the photographs that pictures are judged by."""
    restored: NDArray[np.float32]


def compare(
    restore: AbrdfReader,
    measured: AbrdfReader,
    pairs: Pairs,
    size: tuple[int, int],
    *,
    judged: NDArray[np.integer],
    block: int,
    progress: Callable[[float], None] = lambda fraction: None,
) -> Comparison:
    """Compare ABRDFs (texel, image, 3) of both readers, in radiance, about ``block`` at a time.

    ``size``: rows and columns of a photograph. ``judged``: numbers of the photographs to keep.
    """
    images, (height, width) = len(pairs.light), size
    texels = height * width
    grazing = np.flatnonzero(pairs.view[:, 0] >= GRAZING)
    mean = _mean_abrdf(measured, _row_blocks(size, block), texels)
    of_image, flat_of_image, spread = (np.zeros(images) for _ in range(3))
    of_texel, flat_of_texel = np.zeros(texels), np.zeros(texels)
    energy = _Energies(len(grazing))
    kept = np.zeros((2, len(judged), texels, 3), np.float32)
    for first, last in _row_blocks(size, block):
        truth = measured(first, last).astype(np.float32)
        given = np.asarray(restore(first, last), np.float32)
        kept[:, :, first:last] = truth[:, judged].swapaxes(0, 1), given[:, judged].swapaxes(0, 1)
        energy.add(*(_in_rows(part[:, grazing], width) for part in (truth, given)))
        apart, truth, given = given - truth, truth - mean, given - mean
        squares, flat = _squares(apart), _squares(truth)
        of_image += squares.sum(axis=0)
        flat_of_image += flat.sum(axis=0)
        of_texel[first:last], flat_of_texel[first:last] = squares.mean(axis=1), flat.mean(axis=1)
        spread += _squares(given).sum(axis=0)
        progress(last / texels)
    # Of an order drawn by lot, measured and restored values are independent: the mean squared
    # error is the sum of both mean squares around the measured mean.
    shuffled = (spread + flat_of_image) / texels
    pictures = kept.reshape(2, len(judged), height, width, 3)
    return Comparison(
        of_image / texels,
        of_texel,
        flat_of_image / texels,
        flat_of_texel,
        shuffled,
        float(flat_of_texel.mean() + mean.astype(np.float64).var()),
        grazing,
        energy.sums(),
        pictures[0],
        pictures[1],
    )


def _row_blocks(size: tuple[int, int], block: int) -> Iterator[tuple[int, int]]:
    """First and last + 1 of blocks of whole rows, of ``block`` texels or a little more or less."""
    height, width = size
    rows = max(1, block // width)
    for row in range(0, height, rows):
        yield row * width, min(row + rows, height) * width


def _mean_abrdf(
    measured: AbrdfReader, blocks: Iterator[tuple[int, int]], texels: int
) -> NDArray[np.float32]:
    """(image, 3)."""
    total = sum(measured(*block).sum(axis=0, dtype=np.float64) for block in blocks)
    return np.asarray(total / texels, np.float32)


def _squares(values: NDArray[np.float32]) -> NDArray[np.float64]:
    """Mean square over the channels, (texel, image), of (texel, image, 3)."""
    found: NDArray[np.float64] = np.einsum("tic,tic->ti", values, values).astype(np.float64) / 3
    return found


def _in_rows(values: NDArray[np.float32], width: int) -> _Rows:
    return values.reshape(len(values) // width, width, *values.shape[1:])


class _Energies:
    """Sums of gradients' products, row block by row block; remembers the last row of each."""

    def __init__(self, images: int) -> None:
        self._sums = np.zeros((3, images))
        self._above: tuple[_Rows, _Rows] | None = None

    def add(self, truth: _Rows, given: _Rows) -> None:
        """The next rows (row, column, image, 3), measured and restored."""
        self._add(np.diff(truth, axis=1), np.diff(given, axis=1))
        above, self._above = self._above, (truth[-1:], given[-1:])
        if above is not None:
            truth, given = np.concatenate([above[0], truth]), np.concatenate([above[1], given])
        self._add(np.diff(truth, axis=0), np.diff(given, axis=0))

    def _add(self, truth: _Rows, given: _Rows) -> None:
        for total, one, other in zip(
            self._sums, (truth, given, truth), (truth, given, given), strict=True
        ):
            total += np.einsum("yxic,yxic->i", one, other)

    def sums(self) -> GradientEnergy:
        """Of all rows so far."""
        return GradientEnergy(*self._sums)
