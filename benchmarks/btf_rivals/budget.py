"""The finest step whose code fits into a number of bytes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol, TypeVar

FILLED = 0.985
"""A code that fits and uses this much of its bytes is good enough."""
_TRIES = 24
_RANGE = 9.0
"""Steps within a factor of e^9 of the first are tried, finer ones add nothing."""


class HasBytes(Protocol):
    """Anything that knows its size."""

    @property
    def bytes(self) -> int:
        """Bytes."""
        ...


Code = TypeVar("Code", bound=HasBytes)


def filled(encode: Callable[[float], Code], budget: int, step: float) -> Code | None:
    """The code of ``encode(step)`` that fills ``budget`` bytes, or None where nothing fits.

    Finer steps take more bytes; the search starts at ``step`` and assumes bytes to be about a power
    of it. Never above the budget; where it cannot be filled, the largest code met that fits.
    """
    best: Code | None = None
    fine = coarse = None  # log step and log bytes of a code too large, and of one that fits
    place = math.log(step)
    for tries in range(_TRIES):
        code = encode(math.exp(place))
        size = math.log(max(1, code.bytes) / budget)
        if size > 0:
            fine = place, size
        else:
            coarse = place, size
            if best is None or code.bytes > best.bytes:
                best = code
            if code.bytes >= FILLED * budget:
                return code
        if fine is None or coarse is None:
            stride = min(max(abs(size), 0.02) * 1.5**tries, 3.0)
            place += math.copysign(stride, size)
            if abs(place - math.log(step)) > _RANGE:
                break
        else:
            share = (fine[1] + 0.006) / (fine[1] - coarse[1])
            place = fine[0] + min(max(share, 0.1), 0.9) * (coarse[0] - fine[0])
            if coarse[0] - fine[0] < 1e-4:
                break
    return best
