"""Disparities made better by the photographs they come from: at edges, and below a pixel.

Semi-global matching is right to a fraction of a pixel, prefers whole ones, and spreads what is near
over what is beside it. Three steps mend that:

- at edges a pixel takes the disparity of the pixels around it that look like it: the median,
  weighted by likeness and distance (Ma et al., Constant time weighted median filtering for stereo
  matching and beyond, ICCV 2013);
- a plane through each pixel's surroundings tells how disparity changes across its window, and the
  window is moved along that plane until the photographs agree (Lucas and Kanade 1981; the slanted
  window: Bleyer et al., PatchMatch stereo, BMVC 2011);
- a plane through the surroundings again, for what noise is left.

Disparities are pixels; nan: unknown. What is unknown stays so, but in ``filled``.

Sums over windows go offset by offset along runs of pixels, whose length is a constant: compiled,
that takes several pixels at a time.
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
_DAMPING = np.float32(120.0)
"""Squared grey levels a pixel that texture is weighed against: what noise looks like."""
_FARTHEST = np.float32(0.6)
"""Pixels: what lies farther from the matching's answer is another match."""
_RUN = 64
"""Pixels of a row whose windows are summed together."""
_ON_PLANE = np.float32(0.5)
"""Pixels from a window's plane within which it is one surface."""


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
    cleaned = _voted(disparity, photograph, _edges(disparity), 6, 2)
    smooth, across, down = _planes(cleaned, 2, 0.5)
    ours = np.ascontiguousarray(grey, dtype=np.float32)
    compared = [
        _compared(smooth, ours, one.grey.astype(np.float32), one.turn, one.shift)
        for one in partners
    ]
    errors, slopes = (np.stack(both) for both in zip(*compared, strict=True))
    moved, told = _moved(smooth, across, down, ours, errors, slopes)
    answer = _planes(moved, 2, 0.4)[0]
    # There, windows hold two surfaces.
    told[_edges(answer)] *= 0.5
    return answer, told


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
    return np.asarray(_voted(dense, photograph, ~known, 9, 1))


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
    disparity: Map, photograph: Photograph, asked: NDArray[np.bool_], side: int, step: int
) -> Map:
    """Where asked, the median of the window's disparities, weighted by likeness and distance.

    The window reaches ``side`` pixels to each side; each ``step``-th of them has a vote.
    """
    height, width = disparity.shape
    answer = disparity.copy()
    most = (2 * side // step + 1) ** 2
    values, weights = np.empty(most, np.float32), np.empty(most, np.float32)
    likeness = np.exp(-np.arange(766) / 30.0).astype(np.float32)
    closeness = np.empty((side + 1, side + 1), np.float32)
    for j in range(side + 1):
        for i in range(side + 1):
            closeness[j, i] = np.exp(-np.sqrt(i * i + j * j) / 6.0)
    for y in range(height):
        for x in range(width):
            if not asked[y, x]:
                continue
            red, green, blue = photograph[y, x]
            count = 0
            total = np.float32(0.0)
            for j in range(-side, side + 1, step):
                v = y + j
                if v < 0 or v >= height:
                    continue
                for i in range(-side, side + 1, step):
                    u = x + i
                    if u < 0 or u >= width or not np.isfinite(disparity[v, u]):
                        continue
                    apart = (
                        abs(np.int32(photograph[v, u, 0]) - np.int32(red))
                        + abs(np.int32(photograph[v, u, 1]) - np.int32(green))
                        + abs(np.int32(photograph[v, u, 2]) - np.int32(blue))
                    )
                    weight = likeness[apart] * closeness[abs(j), abs(i)]
                    values[count] = disparity[v, u]
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


def _planes(disparity: Map, side: int, near: float) -> tuple[Map, Map, Map]:
    """Value and slopes across and down of the plane through each pixel's surface.

    Of the window, what is within a pixel of its middle, then within ``near`` pixels of that plane.
    """
    height, width = disparity.shape
    fits = _planes_of_runs(_padded(disparity, side), height, width, side, np.float32(near))
    smooth = np.where(np.abs(fits[0]) < 1, disparity + fits[0], disparity)
    return smooth, fits[1], fits[2]


def _padded(values: Map, side: int) -> Map:
    """With nan around (…, h, w), and behind it to a whole number of runs."""
    more = [(0, 0)] * (values.ndim - 2) + [(side, side), (side, side + -values.shape[-1] % _RUN)]
    return np.pad(values, more, constant_values=np.nan).astype(np.float32, copy=False)


@njit(cache=True, nogil=True, fastmath=_RELAXED, error_model="numpy")
def _planes_of_runs(padded: Map, height: int, width: int, side: int, near: np.float32) -> Map:
    """(3, height, width): offset from the value and slopes of each pixel's plane."""
    fits = np.zeros((3, height, width), np.float32)
    sums = np.zeros(9 * _RUN, np.float32)
    plane = np.zeros(3 * _RUN, np.float32)
    one, none = np.float32(1.0), np.float32(0.0)
    for y in range(height):
        for start in range(0, width, _RUN):
            here = padded[y + side, start + side : start + side + _RUN]
            plane[:] = none
            for allowed in (one, near):
                sums[:] = none
                for j in range(-side, side + 1):
                    for i in range(-side, side + 1):
                        fi, fj = np.float32(i), np.float32(j)
                        begin = start + side + i
                        there = padded[y + side + j, begin : begin + _RUN]
                        for x in range(_RUN):
                            d = there[x] - here[x]
                            off = d - plane[x] - plane[_RUN + x] * fi - plane[2 * _RUN + x] * fj
                            counts = abs(off) < allowed  # False for the unknown, too
                            w = one if counts else none
                            d = d if counts else none
                            sums[x] += w
                            sums[_RUN + x] += w * fi
                            sums[2 * _RUN + x] += w * fj
                            sums[3 * _RUN + x] += w * (fi * fi)
                            sums[4 * _RUN + x] += w * (fi * fj)
                            sums[5 * _RUN + x] += w * (fj * fj)
                            sums[6 * _RUN + x] += d
                            sums[7 * _RUN + x] += d * fi
                            sums[8 * _RUN + x] += d * fj
                for x in range(_RUN):
                    n = sums[x]
                    each = one / max(n, one)
                    mx, my, md = sums[_RUN + x], sums[2 * _RUN + x], sums[6 * _RUN + x]
                    mx, my, md = mx * each, my * each, md * each
                    # A little stiffness: three pixels in a row do not tell a slope across them.
                    cxx = sums[3 * _RUN + x] * each - mx * mx + np.float32(0.05)
                    cyy = sums[5 * _RUN + x] * each - my * my + np.float32(0.05)
                    cxy = sums[4 * _RUN + x] * each - mx * my
                    cxd = sums[7 * _RUN + x] * each - mx * md
                    cyd = sums[8 * _RUN + x] * each - my * md
                    det = cxx * cyy - cxy * cxy
                    a, b = (cxd * cyy - cyd * cxy) / det, (cyd * cxx - cxd * cxy) / det
                    enough = n >= 6
                    plane[x] = md - a * mx - b * my if enough else none
                    plane[_RUN + x] = a if enough else none
                    plane[2 * _RUN + x] = b if enough else none
            for x in range(min(_RUN, width - start)):
                for k in range(3):
                    fits[k, y, start + x] = plane[k * _RUN + x]
    return fits


@njit(cache=True, nogil=True, fastmath=_RELAXED, error_model="numpy")
def _compared(disparity: Map, grey: Map, other: Map, turn: Map, shift: Map) -> tuple[Map, Map]:
    """How much brighter each pixel is than in the other photograph, and how that would change.

    Grey levels, and grey levels a pixel of disparity; slope nan where the other does not see it.
    """
    height, width = disparity.shape
    rows, columns = other.shape
    error = np.zeros((height, width), np.float32)
    slope = np.full((height, width), np.nan, np.float32)
    seen = np.zeros(2, np.float32)
    one = np.float32(1.0)
    for y in range(height):
        for x in range(width):
            if disparity[y, x] != disparity[y, x]:
                continue
            fx, fy = np.float32(x), np.float32(y)
            inside = True
            for k in range(2):
                d = disparity[y, x] + (np.float32(0.5) if k else np.float32(-0.5))
                w = one / (turn[2, 0] * fx + turn[2, 1] * fy + turn[2, 2] + d * shift[2])
                u = (turn[0, 0] * fx + turn[0, 1] * fy + turn[0, 2] + d * shift[0]) * w
                v = (turn[1, 0] * fx + turn[1, 1] * fy + turn[1, 2] + d * shift[1]) * w
                # The last row has no next: half a pixel of slack, not to lose it.
                if not (u >= 0 and v >= -0.5 and u < columns - 1 and v < rows - 0.5):
                    inside = False
                    break
                v = min(max(v, np.float32(0.0)), np.float32(rows - 1.001))
                g, h = int(u), int(v)
                f, t = u - np.float32(g), v - np.float32(h)
                top = other[h, g] + (other[h, g + 1] - other[h, g]) * f
                low = other[h + 1, g] + (other[h + 1, g + 1] - other[h + 1, g]) * f
                seen[k] = top + (low - top) * t
            if inside:
                error[y, x] = grey[y, x] - np.float32(0.5) * (seen[0] + seen[1])
                slope[y, x] = seen[1] - seen[0]
    return error, slope


def _moved(
    disparity: Map, across: Map, down: Map, grey: Map, errors: Map, slopes: Map
) -> tuple[Map, Map]:
    """One step of Gauss and Newton for each pixel's window, and how much the photographs told.

    errors, slopes (k, h, w): as ``_compared`` has them. Each partner's differences count less their
    mean: what it sees may be brighter there.
    """
    height, width = disparity.shape
    step, told = _steps_of_runs(
        _padded(disparity, _SIDE),
        _padded(across, _SIDE),
        _padded(down, _SIDE),
        _padded(grey, _SIDE),
        _padded(errors, _SIDE),
        _padded(slopes, _SIDE),
        height,
        width,
    )
    taken = np.abs(step) <= _FARTHEST
    return np.where(taken, disparity + step, disparity), np.where(taken, told, 0)


@njit(cache=True, nogil=True, fastmath=_RELAXED, error_model="numpy")
def _steps_of_runs(
    disparity: Map,
    across: Map,
    down: Map,
    grey: Map,
    errors: Map,
    slopes: Map,
    height: int,
    width: int,
) -> tuple[Map, Map]:
    steps, told = np.zeros((height, width), np.float32), np.zeros((height, width), np.float32)
    sums = np.zeros(6 * _RUN, np.float32)
    pull, push = np.zeros(_RUN, np.float32), np.zeros(_RUN, np.float32)
    one, none = np.float32(1.0), np.float32(0.0)
    for y in range(height):
        row = y + _SIDE
        for start in range(0, width, _RUN):
            begin = start + _SIDE
            here, own = disparity[row, begin : begin + _RUN], grey[row, begin : begin + _RUN]
            ax, ay = across[row, begin : begin + _RUN], down[row, begin : begin + _RUN]
            pull[:] = none
            push[:] = none
            for k in range(len(errors)):
                sums[:] = none
                for j in range(-_SIDE, _SIDE + 1):
                    for i in range(-_SIDE, _SIDE + 1):
                        fi, fj = np.float32(i), np.float32(j)
                        at = begin + i
                        there = disparity[row + j, at : at + _RUN]
                        looks = grey[row + j, at : at + _RUN]
                        e = errors[k, row + j, at : at + _RUN]
                        g = slopes[k, row + j, at : at + _RUN]
                        for x in range(_RUN):
                            # The plane at that pixel, less the disparity it was compared at.
                            ahead = here[x] + ax[x] * fi + ay[x] * fj - there[x]
                            counts = (abs(ahead) < _ON_PLANE) & (g[x] == g[x])
                            slope = g[x] if counts else none
                            error = e[x] - g[x] * ahead if counts else none
                            unlike = looks[x] - own[x]
                            w = one / (one + unlike * unlike * np.float32(1 / 800))
                            w = w if counts else none
                            sums[x] += w
                            sums[_RUN + x] += w * error
                            sums[2 * _RUN + x] += w * slope
                            sums[3 * _RUN + x] += w * error * slope
                            sums[4 * _RUN + x] += w * slope * slope
                            sums[5 * _RUN + x] += w * error * error
                for x in range(_RUN):
                    weight, e_sum, g_sum = sums[x], sums[_RUN + x], sums[2 * _RUN + x]
                    each = one / max(weight, one)
                    both = sums[3 * _RUN + x] - e_sum * g_sum * each
                    square = sums[4 * _RUN + x] - g_sum * g_sum * each
                    spread = (sums[5 * _RUN + x] - e_sum * e_sum * each) * each
                    # What does not look alike is hidden there.
                    sure = one / (one + spread * np.float32(1 / 150))
                    sure = sure if weight >= 2 else none
                    pull[x] += sure * both
                    push[x] += sure * square
            for x in range(min(_RUN, width - start)):
                steps[y, start + x] = pull[x] / (push[x] + _DAMPING)
                told[y, start + x] = push[x] / (push[x] + _DAMPING)
    return steps, told
