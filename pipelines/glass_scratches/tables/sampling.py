"""The scratch BSDF in space: evaluate, sample, pdf, in the scratch's frame (u, v, n).

Directions are unit vectors (along u, across v, normal n) that point away from the surface; n < 0 is
inside the glass. A direction has a lean s, its u times the index where it is, and an angle phi in
the cross-section, from the normal of its side towards v. In (s, sin phi) étendue is even: with
k = sqrt(index² - s²) on its side, index² |n| dω = k ds d(sin phi). So a table's part of a bin is
spread evenly over the bin's sines, and over leans

- as a Gaussian around the mirrored lean, folded where a side's leans end, where walls keep it;
- by what étendue there is, the semicircle's law, where they forget it.

What a view gets is the sum of what it has from each direction: part times radiance over n².

Between the leans of tables is interpolated. The view's phi is taken at the nearest bin. So
evaluate, sample and pdf agree exactly.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pipelines.glass_scratches.tables.lobe import Direction


@njit(cache=True, nogil=True, inline="always")
def phi_bin(v, n, bins):  # type: ignore[no-untyped-def]
    """The bin of a direction's phi on its own side: n is positive there."""
    angle = np.arctan2(v, max(n, 0.0))
    return min(max(int((angle / np.pi + 0.5) * bins), 0), bins - 1)


@njit(cache=True, nogil=True, inline="always")
def side_bin(direction, bins):  # type: ignore[no-untyped-def]
    """The bin of a direction of both sides: inside from ``bins`` on."""
    _, v, n = direction
    return phi_bin(v, n, bins) if n > 0.0 else bins + phi_bin(v, -n, bins)


@njit(cache=True, nogil=True, inline="always")
def _lean(lobe, direction):  # type: ignore[no-untyped-def]
    u, _, n = direction
    return u if n > 0.0 else u * lobe.refractive_index


@njit(cache=True, nogil=True)
def _tables(lobe, view):  # type: ignore[no-untyped-def]
    """The table below a view's lean, the one above, and the share of the latter."""
    lean = abs(_lean(lobe, view))
    last = len(lobe.leans) - 1
    if lobe.keeps:
        if lean >= 1.0:
            return last, last, 0.0
        last -= 1  # there is nothing between the last lean below 1 and 1
    if lean >= lobe.leans[last]:
        return last, last, 0.0
    low = 0
    while lobe.leans[low + 1] <= lean:
        low += 1
    return low, low + 1, (lean - lobe.leans[low]) / (lobe.leans[low + 1] - lobe.leans[low])


@njit(cache=True, nogil=True)
def _lean_density(lobe, view, light):  # type: ignore[no-untyped-def]
    """Density of the light's lean, for the view's."""
    side = 1.0 if light.n > 0.0 else lobe.refractive_index
    lean = light.u * side
    if not lobe.keeps:
        return 2.0 * np.sqrt(max(side * side - lean * lean, 0.0)) / (np.pi * side * side)
    mirrored = -_lean(lobe, view)
    total = 0.0
    for image in (lean, 2.0 * side - lean, -2.0 * side - lean):
        z = (image - mirrored) / lobe.blur
        total += np.exp(-0.5 * z * z)
    return total / (lobe.blur * np.sqrt(2.0 * np.pi))


@njit(cache=True, nogil=True, inline="always")
def _spread(lobe, view, light, column):  # type: ignore[no-untyped-def]
    """What turns a part of a bin into a density per steradian of its side."""
    bins = len(lobe.sines) - 1
    width = lobe.sines[column % bins + 1] - lobe.sines[column % bins]
    side = 1.0 if light.n > 0.0 else lobe.refractive_index
    rest = np.sqrt(max(1.0 - light.u * light.u, 1e-12))
    return _lean_density(lobe, view, light) * side * abs(light.n) / (rest * width)


@njit(cache=True, nogil=True)
def evaluate(lobe, place, view, light):  # type: ignore[no-untyped-def]
    """Part of the light from a direction that a view gets, per steradian."""
    bins = len(lobe.sines) - 1
    row, column = side_bin(view, bins), side_bin(light, bins)
    low, high, share = _tables(lobe, view)
    part = (1.0 - share) * lobe.rho[low, place, row, column] * lobe.weights[low, column]
    if share > 0.0:
        part += share * lobe.rho[high, place, row, column] * lobe.weights[high, column]
    return part * _spread(lobe, view, light, column) if part > 0.0 else 0.0


@njit(cache=True, nogil=True)
def pdf(lobe, place, view, light):  # type: ignore[no-untyped-def]
    """Density per steradian with which :func:`sample` returns the light."""
    bins = len(lobe.sines) - 1
    row, column = side_bin(view, bins), side_bin(light, bins)
    low, high, share = _tables(lobe, view)
    part = (1.0 - share) * _chance(lobe, low, place, row, column)
    if share > 0.0:
        part += share * _chance(lobe, high, place, row, column)
    return part * _spread(lobe, view, light, column) if part > 0.0 else 0.0


@njit(cache=True, nogil=True, inline="always")
def _chance(lobe, table, place, row, column):  # type: ignore[no-untyped-def]
    kept = lobe.share[table, place, row]
    if kept <= 0.0:
        return 0.0
    return lobe.rho[table, place, row, column] * lobe.weights[table, column] / kept


@njit(cache=True, nogil=True)
def leaving_share(lobe, place, view):  # type: ignore[no-untyped-def]
    """Parts of a view's light that come from outside, and from inside."""
    bins = len(lobe.sines) - 1
    row = side_bin(view, bins)
    low, high, share = _tables(lobe, view)
    outside = (1.0 - share) * lobe.share[low, place, row] * lobe.cdf[low, place, row, bins]
    inside = (1.0 - share) * lobe.share[low, place, row]
    if share > 0.0:
        outside += share * lobe.share[high, place, row] * lobe.cdf[high, place, row, bins]
        inside += share * lobe.share[high, place, row]
    return outside, inside - outside


@njit(cache=True, nogil=True)
def sample(lobe, place, view, numbers):  # type: ignore[no-untyped-def]
    """A light for the view, from four numbers in [0, 1): table, bin, and two for the lean.

    Without absorption its weight, evaluate / pdf, is 1: by Eq. 5 all that is left to look up is the
    light.
    """
    u0, u1, u2, u3 = numbers
    bins = len(lobe.sines) - 1
    low, high, share = _tables(lobe, view)
    row = lobe.cdf[high if u0 < share else low, place, side_bin(view, bins)]
    first, after = 0, 2 * bins
    while after - first > 1:
        middle = (first + after) // 2
        if row[middle] <= u1:
            first = middle
        else:
            after = middle
    width = row[first + 1] - row[first]
    inside = min(max((u1 - row[first]) / width, 0.0), 1.0) if width > 0 else 0.5
    column = first % bins
    sine = lobe.sines[column] + inside * (lobe.sines[column + 1] - lobe.sines[column])
    side = 1.0 if first < bins else lobe.refractive_index
    along = _sampled_lean(lobe, view, side, u2, u3) / side
    rest = np.sqrt(max(1.0 - along * along, 0.0))
    up = rest * np.sqrt(max(1.0 - sine * sine, 0.0))
    return Direction(along, rest * sine, up if first < bins else -up)


@njit(cache=True, nogil=True)
def _sampled_lean(lobe, view, side, u2, u3):  # type: ignore[no-untyped-def]
    """The lean of a light on a side of that index, drawn for that of a view."""
    if not lobe.keeps:
        return side * np.sqrt(u2) * np.cos(2.0 * np.pi * u3)  # the semicircle's law
    normal = np.sqrt(-2.0 * np.log(1.0 - u2)) * np.cos(2.0 * np.pi * u3)
    lean = -_lean(lobe, view) + lobe.blur * normal
    if lean > side:
        lean = 2.0 * side - lean
    if lean < -side:
        lean = -2.0 * side - lean
    return min(max(lean, -side), side)
