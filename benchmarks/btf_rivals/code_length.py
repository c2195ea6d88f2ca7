"""What integers cost under an adaptive binary arithmetic code, computed without running it.

Each magnitude is coded in unary, every bin by a model that counts what it has seen in the same
context (Krichevsky, Trofimov 1981), what is above 14 in Elias' gamma code, the sign in one bit. A
context is made of magnitudes that a decoder already has, so that no table is stored. Such a model's
code length depends on its final counts alone, whatever their order, so it has a closed form. A real
arithmetic coder takes some ten bytes more than this: the rivals are given these.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Neighbours = Sequence[tuple[tuple[int, ...], float]]
"""Shifts towards a symbol from ones coded before it, with their weights."""

SCORES: Neighbours = (
    ((0, 0, 1), 0.17), ((0, 1, 0), 0.17), ((0, 1, 1), 0.1), ((0, 1, -1), 0.1), ((0, 0, 2), 0.08),
    ((0, 2, 0), 0.08), ((1, 0, 0), 0.15), ((2, 0, 0), 0.1), ((3, 0, 0), 0.05),
)  # fmt: skip
"""Of (component, row, column)."""
CORE: Neighbours = (
    ((0, 1, 0, 0), 0.25), ((0, 0, 1, 0), 0.25), ((0, 1, 1, 0), 0.1), ((1, 0, 0, 0), 0.2),
    ((0, 0, 0, 1), 0.2),
)  # fmt: skip
"""Of (component, view, light, channel)."""
FACTOR: Neighbours = (((1, 0), 0.3), ((0, 1), 0.3), ((2, 0), 0.2), ((0, 2), 0.2))
"""Of a matrix."""
_EDGES = np.array([0.05, 0.15, 0.3, 0.5, 0.75, 1.1, 1.6, 2.3, 3.3, 5.0, 8.0, 13.0, 20.0])
"""Where one context ends and the next begins: weighted magnitudes of the neighbours."""
_BINS = 14
"""Bins of a magnitude; what is above is coded by itself."""
_PRIOR = 0.4
"""What every model has seen of either bin before the first."""


def code_bits(symbols: NDArray[np.integer], neighbours: Neighbours) -> float:
    """Bits of an array of integers, coded in the order of its memory.

    >>> zeros = np.zeros((4, 50, 50), np.int32)
    >>> code_bits(zeros, SCORES) < 10
    True
    """
    magnitudes = np.abs(symbols).astype(np.int64)
    contexts = contexts_of(magnitudes, neighbours).ravel()
    held = np.minimum(magnitudes, _BINS).ravel()
    width = _BINS + 1
    stopped = np.bincount(contexts * width + held, minlength=(len(_EDGES) + 1) * width)
    stopped = stopped.reshape(-1, width)
    gone_on = stopped[:, ::-1].cumsum(axis=1)[:, ::-1] - stopped
    bits = float(np.sum(_adaptive_bits(stopped[:, :_BINS], gone_on[:, :_BINS])))
    above = magnitudes[magnitudes >= _BINS] - _BINS + 1
    bits += float(np.sum(2 * np.floor(np.log2(above)) + 1))
    return bits + float(np.count_nonzero(magnitudes))


def contexts_of(magnitudes: NDArray[np.integer], neighbours: Neighbours) -> NDArray[np.int64]:
    """The context's number of each symbol, from the magnitudes of those before it."""
    held = np.minimum(magnitudes, 40).astype(np.float32)
    weighted = np.zeros_like(held)
    for shift, weight in neighbours:
        to = tuple(slice(max(0, s), n + min(0, s)) for s, n in zip(shift, held.shape, strict=True))
        come = tuple(
            slice(max(0, -s), n - max(0, s)) for s, n in zip(shift, held.shape, strict=True)
        )
        if all(abs(s) < n for s, n in zip(shift, held.shape, strict=True)):
            weighted[to] += np.float32(weight) * held[come]
    return np.digitize(weighted, _EDGES)


def _adaptive_bits(zeros: NDArray[np.integer], ones: NDArray[np.integer]) -> NDArray[np.floating]:
    """Bits of so many zeros and ones under one adaptive model each."""
    from scipy.special import betaln

    nats = betaln(_PRIOR, _PRIOR) - betaln(zeros + _PRIOR, ones + _PRIOR)
    return np.asarray(nats / np.log(2.0))


def quantised(values: NDArray[np.floating], *, plane: bool = True) -> NDArray[np.int32]:
    """Values over their step as integers, those that cost more than they are worth rounded down.

    At the optimum a bit saves ln 2 / 6 squared steps, and a value that stands among small ones
    costs more bits than one among large ones: its neighbours in the last two axes tell (``plane``).
    """
    from scipy.ndimage import uniform_filter

    magnitudes = np.abs(values).astype(np.float32)
    if plane:
        window = (1,) * (values.ndim - 2) + (3, 3)
        around = uniform_filter(np.minimum(magnitudes, 30.0), size=window, mode="nearest")
        bits = np.clip(2.0 - np.log2(around + 1e-3), 0.5, 7.0)
    else:
        bits = np.full_like(magnitudes, 1.7)
    rounded = np.floor(magnitudes + 0.5 - np.log(2.0) / 12 * bits)
    return (np.sign(values) * np.maximum(rounded, 0.0)).astype(np.int32)
