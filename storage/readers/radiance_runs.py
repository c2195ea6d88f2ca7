"""The run-length codes of Radiance pictures, compiled: a scanline may be in any of three.

After Ward's "Radiance File Formats" and ``color.c``. The code since 1991 goes channel by channel
and begins 2, 2, the length in two bytes; the older one repeats a whole pixel, (1, 1, 1, n), each
further such pixel counting 256 times as much; a flat line is one without such pixels.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

_SHORTEST, _LONGEST = 8, 0x7FFF  # lines that the code by channel is for


def decoded_lines(stored: NDArray[np.uint8], lines: int, length: int) -> NDArray[np.uint8] | None:
    """RGBE (lines, length, 4) of the bytes behind a header, None where they are too few or wrong.

    Bytes behind the last line are passed over, as all readers do.
    """
    pixels = np.empty((lines, length, 4), np.uint8)
    return pixels if _decode(stored, pixels) else None


@njit(cache=True, nogil=True)
def _decode(stored: Any, pixels: Any) -> bool:
    lines, length, _ = pixels.shape
    at = 0
    for line in range(lines):
        if _by_channel(stored, at, length):
            at = _decode_channels(stored, at + 4, pixels[line])
        else:
            at = _decode_pixels(stored, at, pixels, line)
        if at < 0:
            return False
    return True


@njit(cache=True, nogil=True)
def _by_channel(stored: Any, at: int, length: int) -> bool:
    return bool(
        _SHORTEST <= length <= _LONGEST
        and at + 4 <= len(stored)
        and stored[at] == 2
        and stored[at + 1] == 2
        and stored[at + 2] == length >> 8
        and stored[at + 3] == length & 255
    )


@njit(cache=True, nogil=True)
def _decode_channels(stored: Any, at: int, line: Any) -> int:
    """Where the next line begins, -1 where there is none."""
    for channel in range(4):
        column = 0
        while column < len(line):
            if at + 2 > len(stored):
                return -1
            count = int(stored[at])
            at += 1
            run = count > 128
            count -= 128 * run
            if column + count > len(line) or at + (1 if run else count) > len(stored):
                return -1
            for _ in range(count):
                line[column, channel] = stored[at]
                column += 1
                at += not run
            at += run
    return at


@njit(cache=True, nogil=True)
def _decode_pixels(stored: Any, at: int, pixels: Any, line: int) -> int:
    """Where the next line begins, -1 where there is none."""
    length = pixels.shape[1]
    column = shift = 0
    while column < length:
        if at + 4 > len(stored):
            return -1
        if stored[at] == 1 and stored[at + 1] == 1 and stored[at + 2] == 1:
            if (line == 0 and column == 0) or shift > 24:
                return -1
            count = int(stored[at + 3]) << shift
            if count > length - column:
                return -1
            before = pixels[line, column - 1] if column else pixels[line - 1, length - 1]
            for _ in range(count):
                pixels[line, column] = before
                column += 1
            shift += 8
        else:
            pixels[line, column] = stored[at : at + 4]
            column += 1
            shift = 0
        at += 4
    return at
