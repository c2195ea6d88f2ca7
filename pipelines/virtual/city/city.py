"""A street to drive through: houses, poles, trees, parked cars, made from a seed.

x runs along the road, y to its left, z up; metres. The road (y = -3.5 to 3.5) lies at z = 0 between
pavements 12 cm higher; houses stand along y = +-6.5 to 7.5. Each house and each bay has a random
generator of its own, so that a longer street begins as a shorter one does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.virtual.city.bend import STRAIGHT, Bend, bent_points, turned_vectors
from pipelines.virtual.city.cars import car
from pipelines.virtual.city.facades import gap_wall, house
from pipelines.virtual.city.furniture import cover, pole, tree
from pipelines.virtual.city.light import sky_visibility
from pipelines.virtual.city.parts import (
    MATERIALS,
    Look,
    Part,
    box,
    join_parts,
    panel,
    place_part,
)

__all__ = ["BEFORE", "BEYOND", "MATERIALS", "City", "make_city"]

BEFORE, BEYOND = 10.0, 40.0
"""Metres of street before the first camera and beyond the last."""
_BAY = 11.5
_ROAD, _KERB, _PAVEMENT, _POLE, _PARKED = 3.5, 0.12, 7.9, 4.2, 3.8
_MIRRORED = np.array([1.0, -1.0, 1.0], np.float32)
# What the generators' seeds are told apart by.
_HOUSES, _BAYS, _SURFACE = 1, 2, 3


class City(NamedTuple):
    """Triangles with looks and light, metres."""

    vertices: NDArray[np.float32]
    """(v, 3)."""
    normals: NDArray[np.float32]
    """(v, 3), of length 1."""
    uvs: NDArray[np.float32]
    """(v, 2), repeats of the texture."""
    tint: NDArray[np.float32]
    """(v, 3), linear factor of the texture's colours."""
    sky_visibility: NDArray[np.float32]
    """(v,), light of an overcast sky that arrives, of that on open ground, in [0, 1]."""
    gloss: NDArray[np.float32]
    """(v,), 0 matt, 1 pane or paint: Fresnel's reflectance is added."""
    triangles: NDArray[np.int32]
    """(t, 3), counterclockwise from their front."""
    material: NDArray[np.int32]
    """(t,), places in MATERIALS."""
    pole: NDArray[np.bool_]
    """(t,), thin poles."""
    bend: Bend = STRAIGHT
    """Of the road: x and y are along and beside it only where it is straight."""


def make_city(length: float, seed: int = 0, bend: Bend = STRAIGHT) -> City:
    """A street for a drive from x = 0 to ``length`` metres.

    It reaches from x = -10 to length + 40 and is closed there. The same seed gives the same city;
    a bend (`bend.road_bend`) bends all of it. Raises ValueError for a length that is not positive.
    """
    if not 0.0 < length < np.inf:
        raise ValueError(f"length is {length}; expected metres, more than 0.")
    start, end = -BEFORE, length + BEYOND
    parts = [_ground(start, end, seed)]
    for side in (0, 1):
        parts += _row_of_houses(side, start, end, seed)
        parts += _furniture(side, start, end, seed)
    parts += _closed(start, end, seed)
    whole = join_parts(parts)
    if bend.angle:
        along = whole.vertices[:, 0]
        whole = whole._replace(
            vertices=bent_points(whole.vertices, bend).astype(np.float32),
            normals=turned_vectors(whole.normals, along, bend).astype(np.float32),
        )
    visibility = sky_visibility(whole.vertices, whole.normals, whole.triangles)
    return City(**whole._asdict(), sky_visibility=visibility, bend=bend)


def _ground(start: float, end: float, seed: int) -> Part:
    """Road, markings, kerbs, pavements."""
    span = end - start
    grey = Look("asphalt", (0.15, 0.15, 0.155))
    slabs = Look("paving", (0.30, 0.29, 0.28))
    stone = Look("plaster", (0.40, 0.40, 0.39))
    white = Look("asphalt", (0.55, 0.55, 0.53))
    parts = [panel((start, -_ROAD, 0), (span, 0, 0), (0, 2 * _ROAD, 0), grey)]
    edge = _ROAD + 0.18
    deep = _PAVEMENT - edge
    for y, front in ((_ROAD, "-y"), (-edge, "+y")):
        low, high = (start, y, 0.0), (end, y + 0.18, _KERB)
        parts.append(box(low, high, stone, faces=f"{front}+z"))
    parts.append(panel((start, edge, _KERB), (span, 0, 0), (0, deep, 0), slabs))
    parts.append(panel((start, -_PAVEMENT, _KERB), (span, 0, 0), (0, deep, 0), slabs))
    # The yards behind walls and houses.
    for y in (_PAVEMENT, -_PAVEMENT - 9.0):
        yard = Look("leaves", (0.12, 0.14, 0.07))
        parts.append(panel((start, y, _KERB), (span, 0, 0), (0, 9.0, 0), yard, longest=3.0))
    for x in np.arange(start, end - 3.0, 6.0):
        parts.append(panel((x, -0.06, 0.015), (3.0, 0, 0), (0, 0.12, 0), white))
    for y in (-3.25, 3.13):
        parts.append(panel((start, y, 0.015), (span, 0, 0), (0, 0.12, 0), white))
    for number in range(int(span // 14.0)):
        generator = np.random.default_rng([seed, _SURFACE, number])
        x = start + 14.0 * number + generator.uniform(0.0, 6.0)
        tone = generator.uniform(0.6, 1.5)
        patch = Look("asphalt", (0.15 * tone, 0.15 * tone, 0.15 * tone))
        y = generator.uniform(-2.6, 1.0)
        along, across = (generator.uniform(2.0, 6.0), 0, 0), (0, generator.uniform(0.8, 1.6), 0)
        parts.append(panel((x, y, 0.015), along, across, patch, shift=(x, y)))
        parts.append(place_part(cover(generator), (x + 7.0, generator.uniform(-2.0, 2.0), 0.0)))
    return join_parts(parts)


def _row_of_houses(side: int, start: float, end: float, seed: int) -> list[Part]:
    parts = []
    x, number = start, 0
    while x < end:
        generator = np.random.default_rng([seed, _HOUSES, side, number])
        width = generator.uniform(8.0, 14.0)
        parts.append(_along(side, house(width, generator), x, width, generator.uniform(6.5, 7.5)))
        x += width
        if generator.random() < 0.35:
            gap = generator.uniform(1.5, 4.0)
            parts.append(_along(side, gap_wall(gap, generator), x, gap, 7.2))
            x += gap
        number += 1
    return parts


def _along(side: int, front: Part, x: float, width: float, y: float) -> Part:
    """A front from x to x + width, on the left (side 0) or the right of the road."""
    if side == 0:
        return place_part(front, (x, y, _KERB))
    return place_part(front, (x + width, -y, _KERB), 180.0)


def _furniture(side: int, start: float, end: float, seed: int) -> list[Part]:
    sign, turn = (1.0, 0.0) if side == 0 else (-1.0, 180.0)
    parts = []
    for number in range(int((end - start) // _BAY)):
        generator = np.random.default_rng([seed, _BAYS, side, number])
        x = start + (number + 0.25) * _BAY + generator.uniform(-1.25, 1.25)
        post = pole(generator)
        if side == 1:  # the plate still faces those who come
            post = post._replace(
                vertices=post.vertices * _MIRRORED,
                normals=post.normals * _MIRRORED,
                triangles=post.triangles[:, ::-1],
            )
        parts.append(place_part(post, (x, sign * _POLE, _KERB)))
        middle = start + (number + 0.75) * _BAY
        if generator.random() < 0.7:
            towards = 180.0 if side == 0 else 0.0
            if generator.random() < 0.15:
                towards = 180.0 - towards
            # Half of the car is on the pavement.
            roll = float(np.degrees(np.arctan(_KERB / 1.5)))
            roll = -roll if (side == 0) == (towards == 180.0) else roll
            at = (middle + generator.uniform(-0.7, 0.7), sign * _PARKED, _KERB / 2)
            parts.append(place_part(car(generator), at, towards, roll))
        if generator.random() < 0.4:
            at = (middle + generator.uniform(-2.0, 2.0), sign * 5.35, _KERB)
            parts.append(place_part(tree(generator), at, turn))
    return parts


def _closed(start: float, end: float, seed: int) -> list[Part]:
    """Houses across both ends."""
    parts = []
    for number, (x, degrees) in enumerate(((end, -90.0), (start, 90.0))):
        generator = np.random.default_rng([seed, _HOUSES, 2, number])
        front = house(17.0, generator)
        y = 8.5 if degrees < 0 else -8.5
        parts.append(place_part(front, (x, y, 0.0), degrees))
    return parts
