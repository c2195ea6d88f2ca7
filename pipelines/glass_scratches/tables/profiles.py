"""Cross-sections of scratches as polylines across the scratch (section 3.1 of the scratch paper).

A profile runs from left to right: v across the scratch, n upwards, micrometres. Only its shape
matters to the tables, not its size. It is what lies between the two ends of the opening, which are
at n = 0: of a scratch with raised borders (pile-up, as Raymond et al. 2016 have it) that is the
part between the crests. What lies outside of them would shine below the horizon, and belongs to
the surface around the scratch.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Shape = Literal["v", "u", "trapezoid", "raised"]

_ARC_PIECES = 48
_BORDER_PIECES = 24
_FLAT_SHARE = 0.4
_BORDER_HEIGHT, _BORDER_WIDTH = 0.3, 0.35


def built_in_profile(shape: Shape, width: float, depth: float) -> NDArray[np.float64]:
    """A profile (P, 2) of the given shape, as :func:`cut_profile` returns it; micrometres.

    ``v``: two straight walls. ``u``: an arc of a circle. ``trapezoid``: straight walls and a flat
    bottom of 0.4 of the width. ``raised``: walls that rise over the surface in rounded crests,
    0.3 of the depth high, before the surface falls back to its level; width and depth are then
    those at the surface's level, so that the opening is wider and the profile deeper.

    Raises ValueError for a width or depth that is not positive, and for a u deeper than half its
    width (its opening would be narrower than it).

    >>> built_in_profile("v", width=10.0, depth=4.0).tolist()
    [[-5.0, 0.0], [0.0, -4.0], [5.0, 0.0]]
    >>> built_in_profile("u", width=10.0, depth=4.0).shape
    (49, 2)
    """
    for name, value in (("width", width), ("depth", depth)):
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} of the profile is {value:g}; expected more than 0 µm.")
    if shape == "u" and depth > width / 2:
        raise ValueError(
            f"depth of the profile is {depth:g}; expected at most {width / 2:g} µm, half the width "
            "of a u."
        )
    half = width / 2
    points = {
        "v": lambda: np.array([(-half, 0.0), (0.0, -depth), (half, 0.0)]),
        "u": lambda: _arc(half, depth),
        "trapezoid": lambda: np.array(
            [
                (-half, 0.0),
                (-_FLAT_SHARE * half, -depth),
                (_FLAT_SHARE * half, -depth),
                (half, 0.0),
            ]
        ),
        "raised": lambda: _raised(half, depth),
    }[shape]()
    return cut_profile(points, shape)


def cut_profile(points: ArrayLike, name: str) -> NDArray[np.float64]:
    """The part of a cross-section (P, 2) between the crests beside its deepest point.

    Both sides are cut at the height of the lower crest; the opening's middle becomes v = 0 and its
    height n = 0. Overhangs inside are allowed. A profile that runs from right to left is turned.

    Raises ValueError, with ``name`` in it, for what is no scratch: fewer than three points, values
    that are not finite, no point deeper than its ends, ends that run back under themselves, a
    polyline that crosses or touches itself.

    >>> cut_profile([(0, 0), (2, 1), (4, -3), (6, 1), (8, 0)], "groove").tolist()
    [[-2.0, 0.0], [0.0, -4.0], [2.0, 0.0]]
    """
    given = np.asarray(points, dtype=np.float64)
    if given.ndim != 2 or given.shape[1] != 2 or len(given) < 3 or not np.isfinite(given).all():
        raise ValueError(
            f"{name}: profile has the shape {given.shape}; expected at least three finite points "
            "(v, n)."
        )
    if given[-1, 0] < given[0, 0]:
        given = given[::-1]
    deepest = int(np.argmin(given[:, 1]))
    left, right = given[: deepest + 1], given[deepest:]
    level = min(left[:, 1].max(), right[:, 1].max())
    if not level > given[deepest, 1]:
        raise ValueError(
            f"{name}: the deepest point is at an end of the profile; expected higher points on "
            "both sides of it, or the setting level for a tilted scan."
        )
    kept = np.concatenate([_up_to(left[::-1], level)[:0:-1], _up_to(right, level)])
    middle = (kept[0, 0] + kept[-1, 0]) / 2
    cut: NDArray[np.float64] = kept - [middle, level]
    cut[[0, -1], 1] = 0.0
    for end, step in (("left", cut[1, 0] - cut[0, 0]), ("right", cut[-1, 0] - cut[-2, 0])):
        if step < 0:
            raise ValueError(
                f"{name}: the profile runs back under its {end} end; expected one height for each "
                "v there."
            )
    crossing = None
    if not (np.diff(cut[:, 0]) > 0).all():  # the graph of a function does not cross itself
        crossing = _first_crossing(np.vstack([cut, cut[:1]]))
    if crossing is not None:
        one, other = crossing
        raise ValueError(
            f"{name}: the profile crosses itself between its pieces {one + 1} and {other + 1}; "
            "expected a line without crossings."
        )
    return cut


def _arc(half: float, depth: float) -> NDArray[np.float64]:
    radius = (half**2 + depth**2) / (2 * depth)
    widest = np.arcsin(min(half / radius, 1.0))
    angles = np.linspace(-widest, widest, _ARC_PIECES + 1)
    return np.stack([radius * np.sin(angles), radius - depth - radius * np.cos(angles)], axis=-1)


def _raised(half: float, depth: float) -> NDArray[np.float64]:
    """Right side: from the bottom straight up to the surface's level, then a cosine's crest."""
    steps = np.linspace(0.0, 1.0, _BORDER_PIECES + 1)
    v = half * (1 + 2 * _BORDER_WIDTH * steps)
    n = depth * _BORDER_HEIGHT * (1 - np.cos(2 * np.pi * steps)) / 2
    right = np.stack([v, n], axis=-1)
    return np.concatenate([right[::-1] * [-1, 1], [(0.0, -depth)], right])


def _up_to(side: NDArray[np.float64], level: float) -> NDArray[np.float64]:
    """A side from the deepest point upwards to where it first reaches the level."""
    first = int(np.argmax(side[:, 1] >= level))
    below, above = side[first - 1], side[first]
    share = (level - below[1]) / (above[1] - below[1])
    return np.vstack([side[:first], below + share * (above - below)])


def _first_crossing(ring: NDArray[np.float64]) -> tuple[int, int] | None:
    """Two pieces of a closed polyline (P + 1, 2) that meet other than at their common end."""
    start, step = ring[:-1], np.diff(ring, axis=0)
    count = len(step)
    scale = float(np.abs(ring).max())
    for one in range(count):
        others = np.arange(one + 1, count)
        offset = start[others] - start[one]
        cross = step[one, 0] * step[others, 1] - step[one, 1] * step[others, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (offset[:, 0] * step[others, 1] - offset[:, 1] * step[others, 0]) / cross
            along_other = (offset[:, 0] * step[one, 1] - offset[:, 1] * step[one, 0]) / cross
        near = 1e-12
        meets = ((along >= -near) & (along <= 1 + near) & (along_other >= -near)) & (
            along_other <= 1 + near
        )
        neighbour = (others == one + 1) | ((one == 0) & (others == count - 1))
        meets &= ~neighbour
        # Parallel neighbours that fold back onto each other, and parallel pieces that overlap.
        flat = np.abs(cross) <= 1e-14 * scale**2
        apart = np.abs(offset[:, 0] * step[one, 1] - offset[:, 1] * step[one, 0])
        length = float(np.hypot(*step[one]))
        same_line = flat & (apart <= 1e-12 * scale * length)
        a = offset @ step[one] / length**2
        b = (offset + step[others]) @ step[one] / length**2
        low, high = np.minimum(a, b), np.maximum(a, b)
        overlap = np.minimum(high, 1.0) - np.maximum(low, 0.0)
        meets = np.where(flat, same_line & (overlap > near), meets)
        if meets.any():
            return one, int(others[np.argmax(meets)])
    return None
