"""What a `.tbtf` file holds, in NumPy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

LARGEST_SYMBOL = 127
"""Symbols are from -127 to 127: never more than a byte for each."""


@dataclass(frozen=True)
class Quantised:
    """Whole numbers that stand for values: value = symbol * step, in float32.

    >>> codes = Quantised(np.array([[1, -2], [0, 3]], np.int32), np.array([0.5, 0.25], np.float32))
    >>> codes.values().tolist()
    [[0.5, -0.5], [0.0, 0.75]]
    """

    symbols: NDArray[np.int32]
    """Any shape, from -127 to 127."""
    step: NDArray[np.float32]
    """() for a tensor of the decoder, (C,) for latents (n, C); above 0."""

    def values(self) -> NDArray[np.float32]:
        """The values, in the symbols' shape: one product in float32 each."""
        found: NDArray[np.float32] = self.symbols.astype(np.float32) * self.step
        return found


Tensor = Quantised | NDArray[np.float32]
"""Symbols, or float32 values as they are (the paper's form)."""


def values_of(tensor: Tensor) -> NDArray[np.float32]:
    """The float32 values of either form."""
    return tensor.values() if isinstance(tensor, Quantised) else tensor


def level_size(height: int, width: int, level: int) -> tuple[int, int]:
    """Rows and columns of a level of latents; 0 is the finest.

    >>> level_size(100, 100, 3), level_size(5, 1, 2)
    ((13, 13), (2, 1))
    """
    return -(-height >> level), -(-width >> level)


@dataclass(frozen=True)
class BtfFile:
    """A compressed BTF: decoders, levels of latents, and what turns them into radiance.

    C is the number of latents (8 in the paper), k that of latent vectors of the finest level.
    """

    decoder: Mapping[str, Tensor]
    """Weights (out, in) and biases (out,) of layers: ``weight_1``, ``bias_1``, ``weight_2``, …; the
    first layer takes C + 4 inputs, the last gives 3."""
    latents: Tensor
    """(k, C), finest level; its own step a channel."""
    height: int
    """Rows of texels."""
    width: int
    """Columns of texels."""
    alpha: float
    """What the decoder's 1 stands for, in radiance (float32)."""
    ids: NDArray[np.int32] | None = None
    """(height * width,) the latent vector of every texel; None: each has its own."""
    mips: tuple[Quantised, ...] = ()
    """Coarser levels 1, 2, …: (rows * columns, C) row by row, all with the same steps."""
    parallax: NDArray[np.float32] | None = None
    """(9, 2) coefficients of the offset (column, row) in texels by view."""
    least: float = 0.0
    """Decoded values, over alpha, are held to this and to `largest` (float32); may be infinite."""
    largest: float = 1.0
    student: Mapping[str, Tensor] = field(default_factory=dict)
    """A second, smaller decoder of the same latents; empty where there is none."""
