"""A bend in the street: what is straight along x, laid along an arc.

The road's middle goes along x, then along a circle, then straight on; what stands beside it turns
with it. A film of a straight drive tells no focal length: one of this does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LARGEST = 45.0
"""Degrees: what stands ahead is drawn by its x."""
LEAST_RADIUS = 25.0
"""Metres of the road's middle: yards end 17 m beside it."""


class Bend(NamedTuple):
    """An arc of the road."""

    start: float
    """Metres along the road at which it begins."""
    length: float
    """Metres of the road's middle."""
    angle: float
    """Radians by which the road turns to the left."""


STRAIGHT = Bend(0.0, 1.0, 0.0)


def road_bend(length: float, degrees: float) -> Bend:
    """A bend to the left (less than 0: to the right) in the middle half of a drive of ``length`` m.

    Raises ValueError for more than 45 degrees, and where the arc is narrower than 25 m.
    """
    bend = Bend(length / 4, length / 2, float(np.radians(degrees)))
    if abs(degrees) > LARGEST or bend.length < LEAST_RADIUS * abs(bend.angle):
        raise ValueError(
            f"bend: found {degrees} degrees in {bend.length:g} m of road; expected at most "
            f"{LARGEST:g}, and a radius of at least {LEAST_RADIUS:g} m."
        )
    return bend


def headings(along: NDArray[np.floating], bend: Bend) -> FloatArray:
    """Radians that the road has turned to the left at metres along it (n,)."""
    return bend.angle * np.clip((np.asarray(along, float) - bend.start) / bend.length, 0.0, 1.0)


def bent_points(points: NDArray[np.floating], bend: Bend) -> FloatArray:
    """Places (…, 3) of the straight street where they are in the bent one.

    >>> bent_points(np.array([[10.0, 2.0, 1.0]]), STRAIGHT).tolist()
    [[10.0, 2.0, 1.0]]
    """
    along, left, up = np.moveaxis(np.asarray(points, np.float64), -1, 0)
    turn = headings(along, bend)
    x, y = _middle(along, turn, bend)
    return np.stack([x - left * np.sin(turn), y + left * np.cos(turn), up], axis=-1)


def turned_vectors(
    vectors: NDArray[np.floating], along: NDArray[np.floating], bend: Bend
) -> FloatArray:
    """Directions (n, 3) at metres along the road (n,), turned as it."""
    x, y, z = np.moveaxis(np.asarray(vectors, np.float64), -1, 0)
    turn = headings(along, bend)
    cosine, sine = np.cos(turn), np.sin(turn)
    return np.stack([cosine * x - sine * y, sine * x + cosine * y, z], axis=-1)


def bent_poses(poses: FloatArray, bend: Bend) -> FloatArray:
    """Poses (…, 4, 4) of the straight street where they are in the bent one.

    The cameras of one rig are turned alike only if they are side by side: give the rig's pose.
    """
    bent = poses.copy()
    bent[..., :3, 3] = bent_points(poses[..., :3, 3], bend)
    for axis in range(3):
        bent[..., :3, axis] = turned_vectors(poses[..., :3, axis], poses[..., 0, 3], bend)
    return bent


def straightened_points(points: NDArray[np.floating], bend: Bend) -> FloatArray:
    """Places (…, 3) of the bent street where they are in the straight one, where these are nearer
    to the road's middle than its radius."""
    places = np.asarray(points, np.float64)
    if bend.angle == 0.0:
        return places
    radius = bend.length / bend.angle
    x, y, up = np.moveaxis(places, -1, 0)
    side = np.sign(radius)
    # Angles about the arc's centre, from where it begins.
    turn = side * np.clip(np.arctan2(x - bend.start, side * (radius - y)), 0.0, side * bend.angle)
    along = bend.start + radius * turn
    middle = _middle(along, turn, bend)
    cosine, sine = np.cos(turn), np.sin(turn)
    from_x, from_y = x - middle[0], y - middle[1]
    left = cosine * from_y - sine * from_x
    return np.stack([along + cosine * from_x + sine * from_y, left, up], axis=-1)


def _middle(along: FloatArray, turn: FloatArray, bend: Bend) -> tuple[FloatArray, FloatArray]:
    """The road's middle at metres along it."""
    if bend.angle == 0.0:
        return along, np.zeros_like(along)
    radius = bend.length / bend.angle
    before = np.minimum(along, bend.start)
    beyond = np.maximum(along - bend.start - bend.length, 0.0)
    x = before + radius * np.sin(turn) + beyond * np.cos(turn)
    y = radius * (1.0 - np.cos(turn)) + beyond * np.sin(turn)
    return x, y
