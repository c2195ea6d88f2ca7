"""How colours vary over boards, cloth, leaves: compiled functions of a place on a surface."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from docs.room.building import BOARDS, LEAF, PAINTING, PLASTER, RUG, SPINE, WEAVE, WOOD

_BOARD, _BOARD_LENGTH = 0.14, 1.7
_GAP = 0.0022
_DARK_BLUE, _CREAM, _OCHRE = (0.035, 0.05, 0.10), (0.62, 0.53, 0.40), (0.50, 0.26, 0.07)


@njit(cache=True, nogil=True)
def fill_albedo(colour, pattern, seed, uv, found):  # type: ignore[no-untyped-def]
    """Albedo ``found`` (N, 3) at places uv (N, 2) of surfaces: (N, 3), (N,), (N,)."""
    for i in range(len(pattern)):
        base = colour[i, 0], colour[i, 1], colour[i, 2]
        shown = _albedo(base, pattern[i], seed[i], uv[i, 0], uv[i, 1])
        for channel in range(3):
            found[i, channel] = min(max(shown[channel], 0.0), 0.92)


@njit(cache=True, nogil=True)
def _albedo(base, pattern, seed, u, v):  # type: ignore[no-untyped-def]
    if pattern == BOARDS:
        return _boards(base, seed, u, v)
    if pattern == WOOD:
        return _times(base, _grain(seed, u, v))
    if pattern == PLASTER:
        return _times(base, 0.97 + 0.06 * _cloud(seed, 3.0 * u, 3.0 * v))
    if pattern == RUG:
        return _rug(base, seed, u, v)
    if pattern == WEAVE:
        thread = 0.5 + 0.5 * math.sin(700.0 * u) * math.sin(700.0 * v)
        return _times(base, 0.82 + 0.2 * thread + 0.16 * (_cloud(seed, 9.0 * u, 9.0 * v) - 0.5))
    if pattern == PAINTING:
        return _painting(base, seed, u, v)
    if pattern == SPINE:
        return _spine(base, seed, u, v)
    if pattern == LEAF:
        vein = math.exp(-((v - 0.5) ** 2) / 0.004)
        return _times(base, 0.85 + 0.35 * vein + 0.2 * _cloud(seed, 6.0 * u, 6.0 * v))
    return base


@njit(cache=True, nogil=True)
def _boards(base, seed, u, v):  # type: ignore[no-untyped-def]
    row = math.floor(v / _BOARD)
    shifted = u + _BOARD_LENGTH * _random(seed, row, 1)
    board = math.floor(shifted / _BOARD_LENGTH)
    at = shifted - board * _BOARD_LENGTH
    across = v - row * _BOARD
    tint = 0.72 + 0.5 * _random(seed + 7, row, board)
    shade = tint * _grain(seed + row * 131 + board * 17, u, v)
    if min(across, _BOARD - across) < _GAP or min(at, _BOARD_LENGTH - at) < _GAP:
        shade *= 0.3
    warm = 0.1 * (_random(seed + 11, row, board) - 0.5)
    return base[0] * shade * (1.0 + warm), base[1] * shade, base[2] * shade * (1.0 - warm)


@njit(cache=True, nogil=True)
def _grain(seed, u, v):  # type: ignore[no-untyped-def]
    """About 1: streaks along u, and the rings that a saw cuts."""
    bent = v + 0.015 * _cloud(seed + 3, 1.3 * u, 6.0 * v)
    rings = 0.5 + 0.5 * math.sin(
        2.0 * math.pi * (bent * 26.0 + 1.5 * _cloud(seed, 0.8 * u, 2.0 * v))
    )
    return (
        0.82
        + 0.16 * rings
        + 0.2 * (_cloud(seed + 5, 5.0 * u, 240.0 * v) - 0.5)
        + 0.1 * (_cloud(seed + 6, 2.0 * u, 30.0 * v))
    )


@njit(cache=True, nogil=True)
def _rug(base, seed, u, v):  # type: ignore[no-untyped-def]
    """A kilim of bands, diamonds and a border; 2.6 by 1.8 metres."""
    edge = min(min(u, 2.6 - u), min(v, 1.8 - v))
    shade = 0.85 + 0.25 * _cloud(seed, 160.0 * u, 160.0 * v)
    if edge < 0.05:
        return _times(_CREAM, shade)
    if edge < 0.17:
        tooth = abs((u + v) / 0.12 % 1.0 - 0.5) < 0.25
        return _times(_DARK_BLUE if tooth else _OCHRE, shade)
    if edge < 0.2:
        return _times(_CREAM, shade)
    x, y = (u - 1.3) / 0.5, (v - 0.9) / 0.35
    cell = abs((x + 0.5) % 1.0 - 0.5) + abs((y + 0.5) % 1.0 - 0.5)
    if cell < 0.12:
        return _times(_CREAM, shade)
    if cell < 0.2:
        return _times(_DARK_BLUE, shade)
    if 0.42 < cell < 0.5:
        return _times(_OCHRE, shade)
    return _times(base, shade)


@njit(cache=True, nogil=True)
def _painting(base, seed, u, v):  # type: ignore[no-untyped-def]
    """A landscape of hills under a pale sky, in the base colour's mood; 1 metre is the whole."""
    ridge = 0.55 + 0.3 * (_cloud(seed, 3.0 * u, 0.5) - 0.5)
    near = 0.3 + 0.3 * (_cloud(seed + 1, 5.0 * u, 4.5) - 0.5)
    stroke = 0.75 + 0.5 * _cloud(seed + 2, 60.0 * u, 25.0 * v)
    if v < near:
        return base[0] * 0.35 * stroke, base[1] * 0.4 * stroke, base[2] * 0.3 * stroke
    if v < ridge:
        return _times(base, 0.8 * stroke)
    pale = 0.75 + 0.25 * _cloud(seed + 3, 4.0 * u, 8.0 * v)
    return 0.75 * pale, 0.68 * pale, 0.55 * pale


@njit(cache=True, nogil=True)
def _spine(base, seed, u, v):  # type: ignore[no-untyped-def]
    """A book's back, u along it: bands of gold or paper, and a label with lines of letters."""
    style = seed % 3
    worn = 0.8 + 0.35 * _cloud(seed, 40.0 * u, 90.0 * v)
    if style == 0 and (abs(u - 0.03) < 0.004 or abs(u - 0.16) < 0.004):
        return 0.55, 0.4, 0.14
    if style == 1 and 0.085 < u < 0.14:
        letters = _random(seed, math.floor(u / 0.006), math.floor(v / 0.004)) > 0.5
        return (0.12, 0.1, 0.08) if letters and 0.095 < u < 0.13 else _times(_CREAM, worn)
    if style == 2 and 0.05 < u < 0.15 and abs(v % 0.02 - 0.01) < 0.004:
        return _times(_CREAM, 0.5 + 0.5 * _random(seed, math.floor(u / 0.005), 3))
    return _times(base, worn)


# ---- noise -----------------------------------------------------------------------------------


@njit(cache=True, nogil=True)
def _random(seed, i, j):  # type: ignore[no-untyped-def]
    """A number in [0, 1) for a cell."""
    h = np.uint64(np.int64(seed)) * np.uint64(0x9E3779B97F4A7C15)
    h ^= np.uint64(np.int64(i)) * np.uint64(0xBF58476D1CE4E5B9)
    h ^= np.uint64(np.int64(j)) * np.uint64(0x94D049BB133111EB)
    h = (h ^ (h >> np.uint64(31))) * np.uint64(0xD6E8FEB86659FD93)
    h = (h ^ (h >> np.uint64(29))) * np.uint64(0xD6E8FEB86659FD93)
    return np.float64((h ^ (h >> np.uint64(32))) >> np.uint64(11)) / 9007199254740992.0


@njit(cache=True, nogil=True)
def _cloud(seed, x, y):  # type: ignore[no-untyped-def]
    """Value noise of three octaves in [0, 1]."""
    total, weight = 0.0, 0.5
    for octave in range(3):
        i, j = math.floor(x), math.floor(y)
        a, b = x - i, y - j
        a, b = a * a * (3.0 - 2.0 * a), b * b * (3.0 - 2.0 * b)
        low = (1.0 - a) * _random(seed + octave, i, j) + a * _random(seed + octave, i + 1, j)
        high = (1.0 - a) * _random(seed + octave, i, j + 1) + a * _random(
            seed + octave, i + 1, j + 1
        )
        total += weight * ((1.0 - b) * low + b * high)
        weight *= 0.5
        x, y = 2.0 * x, 2.0 * y
    return total / 0.875


@njit(cache=True, nogil=True)
def _times(colour, factor):  # type: ignore[no-untyped-def]
    return colour[0] * factor, colour[1] * factor, colour[2] * factor
