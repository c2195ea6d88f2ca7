"""Planes through the disparities of windows: how a slanted surface's disparity changes.

Sums over windows go offset by offset along runs of pixels, whose length is a constant: compiled,
that takes several pixels at a time.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Map = NDArray[np.float32]

RELAXED = {"contract", "reassoc", "nsz", "arcp"}
"""What the compiler may do with sums over windows."""
RUN = 64
"""Pixels of a row whose windows are summed together."""


def fit_disparity_planes(disparity: Map, side: int, near: float) -> tuple[Map, Map, Map]:
    """Value and slopes across and down of the plane through each pixel's surface.

    Of the window, what is within a pixel of its middle, then within ``near`` pixels of that plane.
    """
    height, width = disparity.shape
    fits = _planes_of_runs(padded_to_runs(disparity, side), height, width, side, np.float32(near))
    smooth = np.where(np.abs(fits[0]) < 1, disparity + fits[0], disparity)
    return smooth, fits[1], fits[2]


def padded_to_runs(values: Map, side: int) -> Map:
    """With nan around (…, h, w), and behind it to a whole number of runs."""
    more = [(0, 0)] * (values.ndim - 2) + [(side, side), (side, side + -values.shape[-1] % RUN)]
    return np.pad(values, more, constant_values=np.nan).astype(np.float32, copy=False)


@njit(cache=True, nogil=True, fastmath=RELAXED, error_model="numpy")
def _planes_of_runs(padded: Map, height: int, width: int, side: int, near: np.float32) -> Map:
    """(3, height, width): offset from the value and slopes of each pixel's plane."""
    fits = np.zeros((3, height, width), np.float32)
    sums = np.zeros(9 * RUN, np.float32)
    plane = np.zeros(3 * RUN, np.float32)
    one, none = np.float32(1.0), np.float32(0.0)
    for y in range(height):
        for start in range(0, width, RUN):
            here = padded[y + side, start + side : start + side + RUN]
            plane[:] = none
            for allowed in (one, near):
                sums[:] = none
                for j in range(-side, side + 1):
                    for i in range(-side, side + 1):
                        fi, fj = np.float32(i), np.float32(j)
                        begin = start + side + i
                        there = padded[y + side + j, begin : begin + RUN]
                        for x in range(RUN):
                            d = there[x] - here[x]
                            off = d - plane[x] - plane[RUN + x] * fi - plane[2 * RUN + x] * fj
                            counts = abs(off) < allowed  # False for the unknown, too
                            w = one if counts else none
                            d = d if counts else none
                            sums[x] += w
                            sums[RUN + x] += w * fi
                            sums[2 * RUN + x] += w * fj
                            sums[3 * RUN + x] += w * (fi * fi)
                            sums[4 * RUN + x] += w * (fi * fj)
                            sums[5 * RUN + x] += w * (fj * fj)
                            sums[6 * RUN + x] += d
                            sums[7 * RUN + x] += d * fi
                            sums[8 * RUN + x] += d * fj
                for x in range(RUN):
                    n = sums[x]
                    each = one / max(n, one)
                    mx, my, md = sums[RUN + x], sums[2 * RUN + x], sums[6 * RUN + x]
                    mx, my, md = mx * each, my * each, md * each
                    # A little stiffness: three pixels in a row do not tell a slope across them.
                    cxx = sums[3 * RUN + x] * each - mx * mx + np.float32(0.05)
                    cyy = sums[5 * RUN + x] * each - my * my + np.float32(0.05)
                    cxy = sums[4 * RUN + x] * each - mx * my
                    cxd = sums[7 * RUN + x] * each - mx * md
                    cyd = sums[8 * RUN + x] * each - my * md
                    det = cxx * cyy - cxy * cxy
                    a, b = (cxd * cyy - cyd * cxy) / det, (cyd * cxx - cxd * cxy) / det
                    enough = n >= 6
                    plane[x] = md - a * mx - b * my if enough else none
                    plane[RUN + x] = a if enough else none
                    plane[2 * RUN + x] = b if enough else none
            for x in range(min(RUN, width - start)):
                for k in range(3):
                    fits[k, y, start + x] = plane[k * RUN + x]
    return fits
