"""Memory that was freed goes back to the system between assets."""

from __future__ import annotations

import ctypes
import sys


def give_back_freed_memory() -> None:
    """Let the C library return what it keeps for later.

    One process makes one asset after the other: what the first needed for a moment would stay with
    it while the last one needs as much again. Does nothing where the C library is not glibc.
    """
    if not sys.platform.startswith("linux"):
        return
    try:
        trim = ctypes.CDLL("libc.so.6").malloc_trim
    except (OSError, AttributeError):
        return
    trim(0)
