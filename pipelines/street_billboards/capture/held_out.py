"""Which frames of a drive are kept to judge pictures by, and used for nothing else."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_EVERY, _FIRST = 10, 5

FEWEST_FRAMES = _FIRST + 2
"""Of a drive: one is held out, and there is one after it."""


def held_out(frames: int) -> NDArray[np.bool_]:
    """Which of so many frames are held out (frames,): every tenth.

    >>> np.flatnonzero(held_out(26)).tolist()
    [5, 15, 25]
    """
    return np.arange(frames) % _EVERY == _FIRST
