"""Rivals that know nothing of the texels: what every other has to beat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.btf_rivals.rival import MeasuredBtf, Rival


def nulls(measured: MeasuredBtf) -> list[Rival]:
    """`flat`, the mean colour of each photograph, and `grey`, one for all; in half floats."""
    colours: NDArray[np.float64] = np.asarray(measured.abrdfs.mean(axis=0, dtype=np.float64))
    flat: NDArray[np.float16] = colours.astype(np.float16)
    grey = np.full_like(flat, colours.mean())
    return [
        _constant("flat", flat, flat.nbytes),
        _constant("grey", grey, grey.itemsize),
    ]


def _constant(name: str, colours: NDArray[np.float16], size: int) -> Rival:
    def restore(first: int, last: int) -> NDArray[np.float32]:
        return np.repeat(colours[None].astype(np.float32), last - first, axis=0)

    return Rival(name, size, {}, restore)
