"""Whether places are those of cameras on one car that drives, whatever their unit."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.drives.recordings import shown_number

LEAST_BASELINE = 1e-3
"""Between two cameras of one instant, in median steps of the car."""
LEAST_WAY = 0.1
"""Metres, as far as the car has to come at least; or a baseline, if that is longer."""
BASELINE_CHANGE = 0.05
"""How much longer than its shortest the distance of two cameras may become."""
LARGEST_GAP = 20
"""The longest step from an instant to the next, in medians of all steps."""


class LooseRig(BadInput):
    """Cameras that are not on one car."""


def check_way(
    file: Path, times: NDArray[np.float64], places: NDArray[np.float64], metric: bool
) -> float:
    """The car's median step. ``places`` (f, c, 3), cameras from left to right.

    Raises BadInput for a car that stays within 0.1 m (if the unit is known) or the mean distance
    of neighbouring cameras, and for a step of more than 20 times the median. The median is that of
    the way: half of it is driven in longer steps, so that a car that waits has no say.
    """
    middle = places.mean(axis=1)
    baseline = 0.0
    if places.shape[1] > 1:
        baseline = float(np.linalg.norm(np.diff(places[0], axis=0), axis=1).mean())
    # Not the length of the path: that of a parked car grows with the noise of its places.
    moved = float(np.linalg.norm(middle - middle[0], axis=1).max())
    least = max(LEAST_WAY if metric else 0.0, baseline, 1e-9 * float(np.abs(middle).max()))
    if moved < least or not moved > 0:
        expected = f"at least {least:.3g}" if least else "a car that drives"
        raise BadInput(file, "way of the car", f"{moved:.3g}", expected)
    steps = np.linalg.norm(np.diff(middle, axis=0), axis=1)
    usual = _median_of_the_way(steps)
    longest = int(steps.argmax())
    if steps[longest] > LARGEST_GAP * usual:
        before, after = (shown_number(time) for time in times[longest : longest + 2])
        field = f"way of the car between time {before} and {after}"
        found = f"{steps[longest]:.1f}, {steps[longest] / usual:.0f} times the median"
        raise BadInput(file, field, found, f"no gap (at most {LARGEST_GAP} times)")
    return usual


def _median_of_the_way(steps: NDArray[np.float64]) -> float:
    """The step at the middle of the way, but for the longest steps, which may be gaps."""
    left_out = 1 + len(steps) // 50
    ordered = np.sort(steps)[:-left_out]
    if not ordered.any():
        return float(steps.max())
    driven = np.cumsum(ordered)
    return float(ordered[np.searchsorted(driven, driven[-1] / 2)])


def check_rig(
    file: Path,
    names: Sequence[str],
    times: NDArray[np.float64],
    places: NDArray[np.float64],
    step: float,
) -> None:
    """``times`` (f, c), of each photograph, and ``places`` (f, c, 3), NaN where there is none;
    ``step``: the car's median one. Cameras at one place at all times are views of one.

    Raises LooseRig for cameras nearer to each other than a thousandth of a step, and for two whose
    distance changes by more than 5 % and more than the car drives between their photographs.
    """
    speed = _speeds(times, places)
    for first, second in combinations(range(len(names)), 2):
        apart = np.linalg.norm(places[:, first] - places[:, second], axis=1)
        if np.isnan(apart).all() or not np.nanmax(apart) > 0:
            continue
        near, far = int(np.nanargmin(apart)), int(np.nanargmax(apart))
        between = np.abs(times[:, first] - times[:, second]) * speed
        field = f"distance of cameras {names[first]} and {names[second]}"
        at_near = f"{apart[near]:.4f} at time {_time(times[near])}"
        least = LEAST_BASELINE * step
        if np.nanmedian(apart) < least:
            raise LooseRig(file, field, at_near, f"at least {least:.2g}, or none")
        allowed = BASELINE_CHANGE * apart[near] + between[near] + between[far]
        if apart[far] - apart[near] > allowed + 1e-6 * step:
            found = f"{at_near} and {apart[far]:.4f} at time {_time(times[far])}"
            expected = f"a rigid rig (a change of at most {BASELINE_CHANGE:.0%})"
            raise LooseRig(file, field, found, expected)


def _time(times: NDArray[np.float64]) -> str:
    return shown_number(float(np.nanmin(times)))


def _speeds(times: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """How fast the car is at each instant, at most: (f,) lengths a unit of time."""
    speeds = np.zeros(len(times))
    for camera in range(times.shape[1]):
        there = np.nonzero(~np.isnan(places[:, camera, 0]))[0]
        if len(there) < 2:
            continue
        steps = np.linalg.norm(np.diff(places[there, camera], axis=0), axis=1)
        own = steps / np.diff(times[there, camera])
        around = np.maximum(np.append(own, own[-1]), np.insert(own, 0, own[0]))
        speeds[there] = np.maximum(speeds[there], around)
    return speeds
