"""Coarser levels of latents against averaged photographs: is the far view that of the near one?

A level of latents is right if it decodes to what many fine texels show together. The rival is to
decode all of them and to take the mean, which costs 4^level times as much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.latent_texture import averaged, level_sizes


class LevelErrors(NamedTuple):
    """Mean squared error against averaged measured photographs, a number a level 1, 2, …"""

    own: NDArray[np.float64]
    """Of what the level decodes to."""
    averaged: NDArray[np.float64]
    """Of the averages of what the finest level decodes to."""
    flat: NDArray[np.float64]
    """Of a null: the mean colour of every photograph."""

    @property
    def figures(self) -> dict[str, float]:
        """``mip_error_ratio``: RMSE of all levels over that of the averages; its null; each one."""
        found = {
            "mip_error_ratio": _ratio(self.own.mean(), self.averaged.mean()),
            "mip_error_ratio_null": _ratio(self.flat.mean(), self.averaged.mean()),
        }
        for level, pair in enumerate(zip(self.own, self.averaged, strict=True), start=1):
            found[f"mip_error_ratio_level_{level}"] = _ratio(*pair)
        return found


def averaged_photographs(
    images: NDArray[np.floating], size: tuple[int, int]
) -> NDArray[np.float32]:
    """Photographs (n, y, x, 3) averaged over the texels of a coarser level of this size.

    >>> images = np.arange(6.0).reshape(1, 2, 3, 1) * np.ones(3)
    >>> averaged_photographs(images, (1, 3))[0, ..., 0].tolist()
    [[1.5, 2.5, 3.5]]
    """
    count, height, width, _ = images.shape
    texels = images.transpose(1, 2, 0, 3).reshape(height * width, count, 3)
    coarse = averaged(texels, (height, width), size).reshape(*size, count, 3)
    return np.ascontiguousarray(coarse.transpose(2, 0, 1, 3))


def level_errors(
    measured: NDArray[np.floating],
    finest: NDArray[np.floating],
    levels: Sequence[NDArray[np.floating]],
) -> LevelErrors:
    """Compare levels 1, 2, … of restored photographs with averages of the measured ones.

    measured, finest (n, y, x, 3): measured, and restored by the finest level; ``levels``:
    photographs restored by each coarser one, of `latent_texture.level_sizes`. Raises ValueError for
    a level of another size.

    >>> truth = np.random.default_rng(0).random((5, 8, 8, 3))
    >>> far = [averaged_photographs(truth + 0.2, (side, side)) for side in (4, 2)]
    >>> round(level_errors(truth, truth + 0.1, far).figures["mip_error_ratio"], 3)
    2.0
    """
    rows = []
    mean = measured.mean(axis=(1, 2), keepdims=True)
    sizes = level_sizes(*measured.shape[1:3])[1:]
    for level, (restored, size) in enumerate(zip(levels, sizes, strict=False), start=1):
        if restored.shape[1:3] != size:
            raise ValueError(
                f"level {level} has photographs of {restored.shape[1:3]} texels; expected {size}."
            )
        truth, near = (averaged_photographs(images, size) for images in (measured, finest))
        rows.append([_squared(truth, one) for one in (restored, near, mean)])
    return LevelErrors(*np.array(rows).reshape(-1, 3).T)


def restored_levels(compressed: CompressedBtf, pairs: Pairs) -> list[NDArray[np.float32]]:
    """Photographs (pair, rows, columns, 3) of each coarser level of a compressed BTF, radiance.

    A level's texels are larger, so that its parallax is fewer of them.
    """
    found = []
    size = compressed.height, compressed.width
    for latents, (rows, columns) in zip(compressed.mips, level_sizes(*size)[1:], strict=False):
        shift = compressed.parallax
        if shift is not None:
            shift = shift * np.array([columns / size[1], rows / size[0]], np.float32)
        level = replace(
            compressed, latents=latents, ids=None, height=rows, width=columns, parallax=shift
        )
        found.append(level.photographs(pairs))
    return found


def _squared(truth: NDArray[np.floating], given: NDArray[np.floating]) -> float:
    return float(np.mean((given.astype(np.float64) - truth) ** 2))


def _ratio(squared: float, other: float) -> float:
    """Ratio of the roots; 1 where both are 0."""
    return 1.0 if squared == other else float(np.sqrt(squared / other)) if other else np.inf
