"""The run-length codes of Radiance pictures: a scanline may be in any of three.

After Ward's "Radiance File Formats" and ``color.c``. The code since 1991 goes channel by channel
and begins 2, 2, the length in two bytes; the older one repeats a whole pixel, (1, 1, 1, n), each
further such pixel counting 256 times as much; a flat line is one without such pixels. OpenCV knows
the first code alone and takes the others for it where it can.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_SHORTEST, _LONGEST = 8, 0x7FFF  # lines that the code by channel is for
_MOST_COUNTS = 4  # pixels of a run's length


def decoded_lines(stored: bytes, at: int, lines: int, length: int) -> NDArray[np.uint8] | None:
    """RGBE (lines, length, 4) of the bytes from ``at`` on, None where they are too few or wrong.

    Bytes behind the last line are passed over, as all readers do.
    """
    start = bytes([2, 2, length >> 8 & 255, length & 255])
    by_channel = _SHORTEST <= length <= _LONGEST
    planes = np.empty((lines, 4, length), np.uint8)
    before = b""
    for line in planes:
        if by_channel and stored.startswith(start, at):
            found = _channels(stored, at + 4, length)
        else:
            found = _pixels(stored, at, length, before)
        if found is None:
            return None
        coded, at = found
        line[:] = np.frombuffer(coded, np.uint8).reshape(4, length)
        before = coded[length - 1 :: length]
    return planes.transpose(0, 2, 1)


def _channels(stored: bytes, at: int, length: int) -> tuple[bytes, int] | None:
    """The four channels one after the other, and where the next line begins."""
    parts = []
    for _ in range(4):
        left = length
        while left > 0:
            count = stored[at] if at < len(stored) else 0
            if count > 128:
                count -= 128
                part = stored[at + 1 : at + 2] * count
                at += 2
            else:
                part = stored[at + 1 : at + 1 + count]
                at += 1 + count
            if not part or len(part) < count:
                return None
            parts.append(part)
            left -= count
        if left < 0:
            return None
    return b"".join(parts), at


def _pixels(stored: bytes, at: int, length: int, before: bytes) -> tuple[bytes, int] | None:
    """As `_channels`; ``before`` is the last pixel of the line before."""
    many = max(min(length * (1 + _MOST_COUNTS), (len(stored) - at) // 4), 0)  # of any line
    pixels = np.frombuffer(stored[at : at + 4 * many], np.uint8).reshape(many, 4)
    repeats = (pixels[:, :3] == 1).all(axis=1)
    if many >= length and not repeats[:length].any():
        return pixels[:length].T.tobytes(), at + 4 * length
    row = np.arange(many)
    owner = np.maximum.accumulate(np.where(repeats, -1, row))
    digit = (row - owner - 1).clip(max=_MOST_COUNTS)  # of a count, in base 256
    counts = np.where(repeats, pixels[:, 3].astype(np.int64) << (8 * digit), 1)
    ends = np.cumsum(counts)
    last = int(np.searchsorted(ends, length))
    if last == many or ends[last] != length or (digit[: last + 1] >= _MOST_COUNTS).any():
        return None
    shown = pixels[owner[: last + 1]]
    if owner[0] < 0:
        if not before:
            return None
        shown[owner[: last + 1] < 0] = np.frombuffer(before, np.uint8)
    return np.repeat(shown, counts[: last + 1], axis=0).T.tobytes(), at + 4 * (last + 1)
