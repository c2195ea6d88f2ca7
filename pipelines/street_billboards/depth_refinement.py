"""Disparities made better by the photographs they come from: at edges, and below a pixel.

Semi-global matching is right to a fraction of a pixel, prefers whole ones, and spreads what is near
over what is beside it. Three steps mend that:

- at edges a pixel takes the disparity of the pixels around it that look like it: the median weighted
  by likeness and distance (Ma et al., Constant time weighted median filtering for stereo matching and
  beyond, ICCV 2013);
- a plane through each pixel's surroundings tells how disparity changes across its window, and the
  window is moved along that plane until the photographs agree (Lucas and Kanade 1981; Bleyer et al.,
  PatchMatch stereo, BMVC 2011, for the slanted window);
- a plane through the surroundings again, for what noise is left.

Disparities are pixels; nan: unknown. Everything here keeps unknown pixels unknown, but ``filled``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Map = NDArray[np.float32]
Photograph = NDArray[np.uint8]

_RELAXED = {"contract", "reassoc", "nsz", "arcp"}
_STEP = 1.0
"""Pixels of disparity that make an edge."""
_SIDE = 2
"""Pixels that a window reaches to each side."""
_DAMPING = 60.0
"""Squared grey levels a pixel that texture is weighed against: what noise looks like."""
_FARTHEST = 0.6
"""Pixels: what lies farther from the matching's answer is another match."""


class Partner(NamedTuple):
    """Another photograph: the pixel p of disparity d is at turn @ (x, y, 1) + d * shift in it."""

    grey: Map
    """(h, w), in grey levels of 256, at the first photograph's exposure or not."""
    turn: Map
    """(3, 3)."""
    shift: Map
    """(3,)."""


def rectified_partner(grey: Map, sign: int) -> Partner:
    """The other photograph of a rectified pair; sign -1: it is the right one, 1: the left one."""
    return Partner(grey, np.eye(3, dtype=np.float32), np.array([sign, 0, 0], np.float32))


def refined(
    disparity: Map, photograph: Photograph, grey: Map, partners: list[Partner]
) -> tuple[Map, Map]:
    """Refined disparities (h, w) and, in [0, 1], how much the photographs had to say of each.

    photograph (h, w, 3) sRGB and grey (h, w) of the same camera. Partners may be occluded: those
    that look different are left out, pixel by pixel.
    """
    cleaned = _voted(disparity, photograph, _edges(disparity), 7, 7)
    smooth, across, down = _planes(cleaned, 3, np.float32(0.5))
    moved, told = _moved(
        smooth,
        across,
        down,
        np.ascontiguousarray(grey, dtype=np.float32),
        np.stack([one.grey for one in partners]).astype(np.float32),
        np.stack([one.turn for one in partners]).astype(np.float32),
        np.stack([one.shift for one in partners]).astype(np.float32),
    )
    return _planes(moved, 2, np.float32(0.4))[0], told


def filled(disparity: Map, photograph: Photograph) -> Map:
    """Disparities (h, w) everywhere: holes take the far side's, then that of pixels alike.

    What only one camera sees lies behind what hides it from the other. Holes of whole rows take the
    nearest row's. All nan where nothing is known.
    """
    known = np.isfinite(disparity)
    if not known.any():
        return disparity.copy()
    dense = _from_the_sides(disparity)
    rows = np.flatnonzero(known.any(axis=1))
    nearest = rows[np.abs(np.arange(len(dense))[:, None] - rows[None, :]).argmin(axis=1)]
    dense = dense[nearest]
    return np.asarray(_voted(dense, photograph, ~known, 9, 9))


@njit(cache=True, nogil=True)
def _from_the_sides(disparity: Map) -> Map:
    height, width = disparity.shape
    dense = disparity.copy()
    for y in range(height):
        last = np.float32(np.nan)
        x = 0
        while x < width:
            if np.isfinite(disparity[y, x]):
                last = disparity[y, x]
                x += 1
                continue
            end = x
            while end < width and not np.isfinite(disparity[y, end]):
                end += 1
            following = disparity[y, end] if end < width else np.float32(np.nan)
            value = last
            if not np.isfinite(last) or following < last:
                value = following
            dense[y, x:end] = value
            x = end
    return dense


@njit(cache=True, nogil=True)
def _edges(disparity: Map) -> NDArray[np.bool_]:
    """Pixels with a step of disparity within four pixels beside, or two above or below."""
    height, width = disparity.shape
    edge = np.zeros((height, width), np.bool_)
    for y in range(height):
        for x in range(width):
            here = disparity[y, x]
            if not np.isfinite(here):
                continue
            for away in range(1, 5):
                # A slanted surface changes, too: by less than this for each pixel.
                step = _STEP + 0.4 * away
                if (x >= away and abs(disparity[y, x - away] - here) > step) or (
                    x + away < width and abs(disparity[y, x + away] - here) > step
                ):
                    edge[y, x] = True
                    break
                if away <= 2 and (
                    (y >= away and abs(disparity[y - away, x] - here) > step + 0.2 * away)
                    or (
                        y + away < height and abs(disparity[y + away, x] - here) > step + 0.2 * away
                    )
                ):
                    edge[y, x] = True
                    break
    return edge


@njit(cache=True, nogil=True)
def _voted(
    disparity: Map, photograph: Photograph, asked: NDArray[np.bool_], wide: int, high: int
) -> Map:
    """Where asked, the median of the window's disparities, weighted by likeness and distance."""
    height, width = disparity.shape
    answer = disparity.copy()
    most = (2 * wide + 1) * (2 * high + 1)
    values, weights = np.empty(most, np.float32), np.empty(most, np.float32)
    likeness = np.exp(-np.arange(766) / 30.0).astype(np.float32)
    closeness = np.empty((high + 1, wide + 1), np.float32)
    for j in range(high + 1):
        for i in range(wide + 1):
            closeness[j, i] = np.exp(-np.sqrt(i * i + j * j) / 6.0)
    for y in range(height):
        for x in range(width):
            if not asked[y, x]:
                continue
            red, green, blue = photograph[y, x]
            count = 0
            total = np.float32(0.0)
            for v in range(max(0, y - high), min(height, y + high + 1)):
                for u in range(max(0, x - wide), min(width, x + wide + 1)):
                    value = disparity[v, u]
                    if not np.isfinite(value):
                        continue
                    apart = (
                        abs(np.int32(photograph[v, u, 0]) - np.int32(red))
                        + abs(np.int32(photograph[v, u, 1]) - np.int32(green))
                        + abs(np.int32(photograph[v, u, 2]) - np.int32(blue))
                    )
                    weight = likeness[apart] * closeness[abs(v - y), abs(u - x)]
                    values[count] = value
                    weights[count] = weight
                    total += weight
                    count += 1
            below = np.float32(0.0)
            for k in np.argsort(values[:count]):
                below += weights[k]
                if below >= 0.5 * total:
                    answer[y, x] = values[k]
                    break
    return answer


@njit(cache=True, nogil=True, fastmath=_RELAXED, error_model="numpy")
def _planes(disparity: Map, side: int, near: np.float32) -> tuple[Map, Map, Map]:
    """Value and slopes across and down of the plane through each pixel's surface.

    Of the window, what is within ``near`` pixels of the plane that the innermost 5 x 5 have.
    """
    height, width = disparity.shape
    smooth = disparity.copy()
    across, down = np.zeros((height, width), np.float32), np.zeros((height, width), np.float32)
    for y in range(height):
        for x in range(width):
            here = disparity[y, x]
            if here != here:
                continue
            a, b, c = np.float32(0.0), np.float32(0.0), np.float32(0.0)
            for inner in (True, False):
                reach = 2 if inner else side
                allowed = np.float32(1.0) if inner else near
                n = sx = sy = sd = sxx = sxy = syy = sxd = syd = np.float32(0.0)
                for j in range(max(-reach, -y), min(reach, height - 1 - y) + 1):
                    for i in range(max(-reach, -x), min(reach, width - 1 - x) + 1):
                        d = disparity[y + j, x + i] - here
                        fi, fj = np.float32(i), np.float32(j)
                        # False for the unknown, too.
                        if abs(d - a * fi - b * fj - c) < allowed:
                            n += np.float32(1.0)
                            sx += fi
                            sy += fj
                            sd += d
                            sxx += fi * fi
                            sxy += fi * fj
                            syy += fj * fj
                            sxd += fi * d
                            syd += fj * d
                if n < 6:
                    break
                mx, my, md = sx / n, sy / n, sd / n
                # A little stiffness: three pixels in a row do not tell a slope across them.
                cxx = sxx / n - mx * mx + np.float32(0.05)
                cyy = syy / n - my * my + np.float32(0.05)
                cxy = sxy / n - mx * my
                cxd, cyd = sxd / n - mx * md, syd / n - my * md
                det = cxx * cyy - cxy * cxy
                a = (cxd * cyy - cyd * cxy) / det
                b = (cyd * cxx - cxd * cxy) / det
                c = md - a * mx - b * my
            across[y, x], down[y, x] = a, b
            if abs(c) < 1:
                smooth[y, x] = here + c
    return smooth, across, down


@njit(cache=True, nogil=True, fastmath=_RELAXED, error_model="numpy")
def _moved(
    disparity: Map, across: Map, down: Map, grey: Map, greys: Map, turns: Map, shifts: Map
) -> tuple[Map, Map]:
    """One step of Gauss and Newton on each pixel's window, its differences less their mean."""
    height, width = disparity.shape
    partners, rows, columns = greys.shape
    answer = disparity.copy()
    told = np.zeros((height, width), np.float32)
    one = np.float32(1.0)
    for y in range(_SIDE, height - _SIDE):
        for x in range(_SIDE, width - _SIDE):
            here = disparity[y, x]
            if here != here:
                continue
            middle = grey[y, x]
            pull = push = np.float32(0.0)
            for k in range(partners):
                turn, shift = turns[k], shifts[k]
                weights = errors = slopes = both = square = spread = np.float32(0.0)
                for j in range(-_SIDE, _SIDE + 1):
                    for i in range(-_SIDE, _SIDE + 1):
                        px, py = np.float32(x + i), np.float32(y + j)
                        d = here + across[y, x] * np.float32(i) + down[y, x] * np.float32(j)
                        w = one / (turn[2, 0] * px + turn[2, 1] * py + turn[2, 2] + d * shift[2])
                        u = (turn[0, 0] * px + turn[0, 1] * py + turn[0, 2] + d * shift[0]) * w
                        v = (turn[1, 0] * px + turn[1, 1] * py + turn[1, 2] + d * shift[1]) * w
                        # The last row has no next: half a pixel of slack, not to lose it.
                        if not (u >= 0 and v >= -0.5 and u < columns - 1 and v < rows - 0.5):
                            continue
                        v = min(max(v, np.float32(0.0)), np.float32(rows - 1.001))
                        g, h = int(u), int(v)
                        f, t = u - np.float32(g), v - np.float32(h)
                        nw, ne = greys[k, h, g], greys[k, h, g + 1]
                        sw, se = greys[k, h + 1, g], greys[k, h + 1, g + 1]
                        top, low = nw + (ne - nw) * f, sw + (se - sw) * f
                        seen = top + (low - top) * t
                        slope = ((ne - nw) * (one - t) + (se - sw) * t) * (
                            shift[0] - u * shift[2]
                        ) * w + (low - top) * (shift[1] - v * shift[2]) * w
                        error = grey[y + j, x + i] - seen
                        unlike = grey[y + j, x + i] - middle
                        weight = one / (one + unlike * unlike * np.float32(1 / 800))
                        weights += weight
                        errors += weight * error
                        slopes += weight * slope
                        both += weight * slope * error
                        square += weight * slope * slope
                        spread += weight * error * error
                if weights < 2:
                    continue
                both -= slopes * errors / weights
                square -= slopes * slopes / weights
                spread = (spread - errors * errors / weights) / weights
                # What does not look alike is hidden there.
                sure = one / (one + spread * np.float32(1 / 150))
                pull += sure * both
                push += sure * square
            step = pull / (push + np.float32(_DAMPING))
            if abs(step) <= _FARTHEST:
                answer[y, x] = here + step
                told[y, x] = push / (push + np.float32(_DAMPING))
    return answer, told
