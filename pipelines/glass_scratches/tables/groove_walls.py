"""Grooves side by side, as paths of light meet them: walls of glass, smooth or ground.

A table of glass is that of a surface that holds nothing but this scratch, groove beside groove:
then what comes from either side meets walls, and light is neither lost nor counted twice. A lone
scratch has land beside it in place of neighbours; that differs for what a wall sends up inside the
glass.

Rough walls are ground by what made the scratch: fine ridges run along it, steep at random. They are
part of the cross-section, and light meets them as it meets any wall, again and again where it must.
So nothing has to be assumed about how they hide each other, and no light gets lost.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

_RIDGES = 10
"""Of each wall, rough."""
_GROOVES = 32
"""Rough grooves side by side, each other than the next."""
_TRIES = 200


class GrooveWalls(NamedTuple):
    """Straight pieces of grooves side by side, (G, K): where they begin, their unit directions,
    their lengths. Glass lies on the right of them, air on the left. ``width`` of a groove;
    ``lowest`` point of all. After the last groove comes the first."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    along_x: NDArray[np.float64]
    along_y: NDArray[np.float64]
    length: NDArray[np.float64]
    width: float
    lowest: float


def groove_walls(profile: NDArray[np.float64], slope: float = 0.0, seed: int = 0) -> GrooveWalls:
    """Walls of a profile (P, 2) between its crests; width 1.

    ``slope``: standard deviation of the slope of the ridges of ground walls, 0 for smooth ones.
    Raises ValueError for a negative slope, where ridges as steep would cross in this profile, and
    as `check_within_opening`.

    >>> from pipelines.glass_scratches.tables.profiles import built_in_profile
    >>> groove_walls(built_in_profile("v", 10.0, 4.0)).length.round(3).tolist()
    [[0.64, 0.64]]
    """
    if not (np.isfinite(slope) and slope >= 0.0):
        raise ValueError(f"slope of the walls is {slope:g}; expected 0 or more.")
    check_within_opening(profile)
    width = float(profile[-1, 0] - profile[0, 0])
    shape = (profile - profile[0]) / width
    grooves = [shape] if slope == 0.0 else _ground(shape, slope, np.random.default_rng(seed))
    points = np.stack(grooves)
    step = np.diff(points, axis=1)
    length = np.hypot(step[..., 0], step[..., 1])
    x, y = np.moveaxis(points[:, :-1], -1, 0)
    return GrooveWalls(
        np.ascontiguousarray(x),
        np.ascontiguousarray(y),
        step[..., 0] / length,
        step[..., 1] / length,
        length,
        1.0,
        float(points[..., 1].min()),
    )


def check_within_opening(profile: NDArray[np.float64]) -> None:
    """Raises ValueError for a profile (P, 2) that is wider below than its opening: side by side
    such grooves would run into each other."""
    slack = 1e-9 * (profile[-1, 0] - profile[0, 0])
    if profile[:, 0].min() < profile[0, 0] - slack or profile[:, 0].max() > profile[-1, 0] + slack:
        raise ValueError(
            "the profile is wider below than its opening; expected nothing beyond its ends, or "
            "the paper's walls (walls=paper)."
        )


def groove_points(walls: GrooveWalls) -> NDArray[np.float64]:
    """The corners (G, K + 1, 2) of the grooves, each from its own left end."""
    last = (
        walls.x[:, -1] + walls.length[:, -1] * walls.along_x[:, -1],
        walls.y[:, -1] + walls.length[:, -1] * walls.along_y[:, -1],
    )
    return np.stack(
        [
            np.concatenate([walls.x, last[0][:, None]], 1),
            np.concatenate([walls.y, last[1][:, None]], 1),
        ],
        axis=-1,
    )


def _ground(
    shape: NDArray[np.float64], slope: float, rng: np.random.Generator
) -> list[NDArray[np.float64]]:
    """Grooves with ridges on their walls, as many as it takes for a mean."""
    grooves: list[NDArray[np.float64]] = []
    for _ in range(_TRIES * _GROOVES):
        points = _with_ridges(shape, slope, rng)
        if not _crosses(points):
            grooves.append(points)
            if len(grooves) == _GROOVES:
                return grooves
    raise ValueError(
        f"walls as rough as a slope of {slope:g} cross each other in this profile; "
        "expected smoother ones, or a wider profile."
    )


def _with_ridges(
    shape: NDArray[np.float64], slope: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """A groove whose straight pieces are ridges, to both sides of the piece: two facets each."""
    steps = np.diff(shape, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    ridge = lengths.sum() / (2 * _RIDGES)
    points = [shape[:1]]
    for start, step, length in zip(shape[:-1], steps, lengths, strict=True):
        count = max(1, round(float(length / ridge)))
        across = np.array([-step[1], step[0]]) / length
        tops = (np.arange(count) + 0.5) / count
        feet = (np.arange(count) + 1.0) / count
        height = rng.normal(0.0, slope, count) * length / (2 * count)
        ridges = np.empty((2 * count, 2))
        ridges[0::2] = start + tops[:, None] * step + height[:, None] * across
        ridges[1::2] = start + feet[:, None] * step
        points.append(ridges)
    found = np.concatenate(points)
    found[:, 1] = np.minimum(found[:, 1], 0.0)  # what rose over the surface is ground off
    found[:, 0] = np.clip(found[:, 0], 0.0, 1.0)
    found[-1] = shape[-1]
    return found


def _crosses(points: NDArray[np.float64]) -> bool:
    """Whether pieces that are not neighbours touch each other."""
    return bool(_any_crossing(points)) or bool((np.hypot(*np.diff(points, axis=0).T) < 1e-9).any())


@njit(cache=True, nogil=True)
def _any_crossing(points):  # type: ignore[no-untyped-def]
    count = len(points) - 1
    for a in range(count):
        ax, ay = points[a]
        bx, by = points[a + 1]
        for c in range(a + 2, count):
            cx, cy = points[c]
            dx, dy = points[c + 1]
            one = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
            other = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
            third = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
            last = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
            if one * other <= 0.0 and third * last <= 0.0:
                return True
    return False
