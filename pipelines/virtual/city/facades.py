"""Fronts of houses: walls with recessed windows, doors, shops, cornices; walls that close gaps.

A front is built in its own frame: x to the right from 0 to its width, y = 0 the wall, -y the
street, z up from the pavement.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipelines.virtual.city.parts import (
    POSTERS,
    Look,
    Part,
    box,
    copy_part,
    grid_surface,
    join_parts,
    panel,
    place_part,
    tube,
    wall_with_holes,
)

Colour = tuple[float, float, float]
Generator = np.random.Generator

_BRICKS: tuple[Colour, ...] = (
    (0.30, 0.21, 0.18), (0.24, 0.19, 0.17), (0.42, 0.36, 0.28), (0.33, 0.30, 0.28),
    (0.36, 0.24, 0.19),
)  # fmt: skip
_PLASTERS: tuple[Colour, ...] = (
    (0.56, 0.50, 0.40), (0.52, 0.53, 0.52), (0.60, 0.42, 0.28), (0.44, 0.50, 0.42),
    (0.58, 0.36, 0.30), (0.36, 0.43, 0.52), (0.62, 0.58, 0.48), (0.55, 0.47, 0.25),
)  # fmt: skip
_STONE: Colour = (0.46, 0.43, 0.38)
_FRAMES: tuple[Colour, ...] = (
    (0.75, 0.75, 0.72), (0.70, 0.68, 0.60), (0.16, 0.12, 0.09), (0.12, 0.18, 0.14),
)  # fmt: skip
_STRONG: tuple[Colour, ...] = (
    (0.35, 0.05, 0.04), (0.04, 0.12, 0.26), (0.05, 0.20, 0.09), (0.45, 0.28, 0.04),
    (0.09, 0.09, 0.10), (0.30, 0.12, 0.20),
)  # fmt: skip
_DEPTH_OF_HOUSE = 8.0


class _Front(NamedTuple):
    """Measures of a house's front, metres, and what it is made of."""

    width: float
    ground: float  # height of the ground floor
    storey: float  # height of each floor above
    floors: int  # above the ground floor
    windows: int  # of a floor, side by side
    wall: Look
    trim: Look  # reveals, sills, cornices
    frame: Look  # of windows

    @property
    def height(self) -> float:
        return self.ground + self.floors * self.storey + 0.5

    def openings(self, wide: float) -> np.ndarray:
        """Left edges (windows,) of openings of one width, each in the middle of its cell."""
        return (np.arange(self.windows) + 0.5) * (self.width / self.windows) - wide / 2


def _one_of(generator: Generator, choices: tuple[Colour, ...]) -> Colour:
    colour = np.asarray(choices[generator.integers(len(choices))])
    r, g, b = np.clip(
        colour * generator.uniform(0.85, 1.15) + generator.normal(0, 0.01, 3), 0.02, 1
    )
    return float(r), float(g), float(b)


def house(width: float, generator: Generator) -> Part:
    """A house of 3 or 4 floors, ``width`` metres wide."""
    brick = generator.random() < 0.45
    wall = (
        Look("brick", _one_of(generator, _BRICKS))
        if brick
        else Look("plaster", _one_of(generator, _PLASTERS))
    )
    trim = Look("plaster", _STONE if brick else _lighter(wall.albedo))
    frame = Look("paint", _one_of(generator, _FRAMES))
    floors = int(generator.integers(2, 4))
    ground, storey = generator.uniform(3.3, 3.9), generator.uniform(2.7, 3.1)
    windows = max(2, round(width / generator.uniform(2.0, 2.9)))
    front = _Front(width, ground, storey, floors, windows, wall, trim, frame)
    height = front.height
    parts = [_upper_floors(front, generator)]
    if generator.random() < 0.5:
        parts.append(_shop(width, ground, trim, generator))
    else:
        parts.append(_dwelling(front, generator))
    parts.append(box((0, -0.1, ground - 0.12), (width, 0, ground + 0.12), trim, faces="-x+x-y-z+z"))
    parts.append(box((0, -0.3, height - 0.3), (width, 0, height), trim, faces="-x+x-y-z+z"))
    parts.append(_body(width, height, wall, generator))
    if generator.random() < 0.6:  # a rainwater pipe
        at = width - 0.25
        pipe = Look("metal", (0.25, 0.25, 0.26))
        parts.append(tube((at, -0.14, 0), (at, -0.14, height - 0.3), 0.05, pipe, rings=12, sides=8))
    return join_parts(parts)


def _lighter(colour: Colour) -> Colour:
    r, g, b = (min(0.75, 0.5 * c + 0.35) for c in colour)
    return r, g, b


def _body(width: float, height: float, wall: Look, generator: Generator) -> Part:
    """Side walls and a roof, flat or sloping."""
    deep = _DEPTH_OF_HOUSE
    sides = Look("plaster", _lighter(wall.albedo)) if generator.random() < 0.5 else wall
    parts = [box((0, 0.0, 0), (width, deep, height), sides, faces="-x+x", longest=1.6)]
    if generator.random() < 0.55:
        roof = Look("roof", _one_of(generator, ((0.24, 0.11, 0.07), (0.14, 0.13, 0.13))))
        rise = generator.uniform(2.0, 3.2)
        slope = (0, 0.3 + deep / 2, rise)
        parts.append(panel((0, -0.3, height), (width, 0, 0), slope, roof, longest=1.6))
        for x, along in ((0.0, -1.0), (width, 1.0)):
            start = (x, deep / 2 if along < 0 else 0.0, height)
            # Gables: a triangle is a parallelogram folded at the ridge; its far half is never seen.
            points = np.array([[start, start], [start, start]], float)
            points[:, :, 0] = x
            points[0, :, 1] = (deep, 0.0) if along < 0 else (0.0, deep)
            points[1, :, 1], points[1, :, 2] = deep / 2, height + rise
            uvs = points[..., 1:] / 1.2
            normals = np.broadcast_to(np.array([along, 0.0, 0.0]), points.shape)
            parts.append(grid_surface(points, uvs, sides, normals=normals))
        if generator.random() < 0.7:
            x, brick = generator.uniform(1, width - 1.5), Look("brick", (0.28, 0.2, 0.17))
            parts.append(box((x, 2.2, height), (x + 0.7, 2.8, height + rise + 0.8), brick))
    else:
        flat = Look("asphalt", (0.2, 0.2, 0.2))
        parts.append(panel((0, 0, height), (width, 0, 0), (0, deep, 0), flat, longest=4.0))
        parapet = box((0, -0.05, height), (width, 0.25, height + 0.5), wall, faces="-x+x-y+y+z")
        parts.append(parapet)
    return join_parts(parts)


def _upper_floors(front: _Front, generator: Generator) -> Part:
    opening = min(generator.uniform(1.0, 1.5), front.width / front.windows - 0.6)
    tall = generator.uniform(1.5, 1.8)
    lefts = front.openings(opening)
    bottoms = front.ground + np.arange(front.floors) * front.storey + 0.85
    xs = np.concatenate([[0.0], np.stack([lefts, lefts + opening], axis=1).ravel(), [front.width]])
    heights = np.stack([bottoms, bottoms + tall], axis=1).ravel()
    zs = np.concatenate([[front.ground], heights, [front.height]])
    holes = np.zeros((len(zs) - 1, len(xs) - 1), np.bool_)
    holes[1::2, 1::2] = True
    x, z = np.meshgrid(lefts, bottoms)
    places = np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3)
    looks = generator.random(len(places)) < 0.35
    style = int(generator.integers(0, 3))
    parts = [wall_with_holes(xs, zs, holes, front.wall)]
    for lit, chosen in ((0.4, places[looks]), (1.0, places[~looks])):
        if len(chosen):
            unit = window(opening, tall, front.trim, front.frame, style=style, lit=lit)
            parts.append(copy_part(unit, chosen))
    if generator.random() < 0.3 and opening > 1.1:
        rail = _balcony(opening + 0.5, front.trim)
        last = front.windows * (front.floors - 1) + 1
        at = places[: last : max(2, front.windows)] - [0.25, 0, 0.55]
        parts.append(copy_part(rail, at))
    return join_parts(parts)


def window(
    width: float, height: float, trim: Look, frame: Look, *, style: int = 0, lit: float = 1.0
) -> Part:
    """What fills a hole in a wall, from the origin up: reveals, frame, pane, sill."""
    depth = 0.18
    pane = Look("interior", (lit, lit, 0.95 * lit), gloss=1.0)
    parts = [
        panel((0, 0, 0), (0, depth, 0), (0, 0, height), trim),
        panel((width, depth, 0), (0, -depth, 0), (0, 0, height), trim),
        panel((0, depth, height), (width, 0, 0), (0, -depth, 0), trim),
        panel((0, 0, 0), (width, 0, 0), (0, depth, 0), trim),
        panel((0, depth, 0), (width, 0, 0), (0, 0, height), pane, fitted=True, longest=9.0),
        box((-0.08, -0.07, -0.09), (width + 0.08, 0.0, 0.0), trim, longest=9.0),
    ]
    bar, front = 0.07, depth - 0.06
    bars = [
        (0.0, bar, 0.0, height),
        (width - bar, width, 0.0, height),
        (bar, width - bar, 0.0, bar),
        (bar, width - bar, height - bar, height),
    ]
    middle = width / 2
    if style != 1:
        bars.append((middle - 0.03, middle + 0.03, bar, height - bar))
    if style != 0:
        bars.append((bar, width - bar, 0.66 * height, 0.66 * height + 0.05))
    parts += [
        box((a, front, c), (b, depth, d), frame, faces="-x+x-y-z+z", longest=9.0)
        for a, b, c, d in bars
    ]
    return join_parts(parts)


def _balcony(width: float, trim: Look) -> Part:
    iron = Look("metal", (0.06, 0.06, 0.065))
    parts = [box((0, -0.9, -0.12), (width, 0, 0), trim, faces="-x+x-y-z+z")]
    parts += [
        box((x - 0.015, -0.89, 0), (x + 0.015, -0.86, 0.95), iron, faces="-x+x-y+y")
        for x in np.arange(0.05, width, 0.14)
    ]
    parts.append(box((0, -0.9, 0.95), (width, -0.85, 1.0), iron))
    for x in (0.0, width - 0.05):
        parts.append(box((x, -0.85, 0.95), (x + 0.05, 0, 1.0), iron))
    return join_parts(parts)


def _dwelling(front: _Front, generator: Generator) -> Part:
    """A ground floor with a door and windows, on a plinth of stone."""
    door = int(generator.integers(front.windows))
    opening = min(1.25, front.width / front.windows - 0.6)
    left = front.openings(opening)
    sill, head = 0.95, min(2.5, front.ground - 0.5)
    xs = np.concatenate([[0.0], np.stack([left, left + opening], axis=1).ravel(), [front.width]])
    zs = [0.0, sill, head, front.ground]
    holes = np.zeros((3, len(xs) - 1), np.bool_)
    holes[1, 1::2] = True
    holes[0, 1 + 2 * door] = True
    others = np.delete(left, door)
    places = np.stack([others, 0 * others, np.full_like(others, sill)], axis=-1)
    parts = [wall_with_holes(xs, zs, holes, front.wall)]
    if len(places):
        glazed = window(opening, head - sill, front.trim, front.frame, style=2)
        parts.append(copy_part(glazed, places))
    parts.append(place_part(_door(opening, head, front.trim, generator), (left[door], 0, 0)))
    stone = Look("paving", (0.3, 0.29, 0.27))
    for a, b in ((0.0, left[door]), (left[door] + opening, front.width)):
        parts.append(box((a, -0.05, 0), (b, 0, 0.5), stone, faces="-x+x-y+z"))
    return join_parts(parts)


def _door(width: float, height: float, trim: Look, generator: Generator) -> Part:
    depth = 0.3
    leaf = Look("wood", _one_of(generator, _STRONG))
    pane = Look("interior", (0.5, 0.5, 0.5), gloss=1.0)
    parts = [
        panel((0, 0, 0), (0, depth, 0), (0, 0, height), trim),
        panel((width, depth, 0), (0, -depth, 0), (0, 0, height), trim),
        panel((0, depth, height), (width, 0, 0), (0, -depth, 0), trim),
        panel((0, depth, 0), (width, 0, 0), (0, 0, height - 0.5), leaf),
        panel((0, depth, height - 0.5), (width, 0, 0), (0, 0, 0.5), pane, fitted=True),
        box((0, -0.3, 0), (width, depth, 0.12), Look("plaster", _STONE), faces="-x+x-y+z"),
    ]
    for low, high in ((0.3, 0.9), (1.05, height - 0.7)):
        raised = ((0.15, depth - 0.03, low), (width - 0.15, depth, high))
        parts.append(box(*raised, leaf, faces="-x+x-y-z+z"))
    handle = Look("metal", (0.5, 0.42, 0.2))
    parts.append(box((width - 0.14, depth - 0.08, 0.95), (width - 0.09, depth, 1.1), handle))
    return join_parts(parts)


def _shop(width: float, ground: float, trim: Look, generator: Generator) -> Part:
    """A shop front: panes between pillars, a door, a sign with pictures, perhaps an awning."""
    paint = Look("wood", _one_of(generator, _STRONG))
    panes = max(2, round(width / 3.2))
    pillar, sill, head = 0.3, 0.5, 2.6
    lines = np.linspace(0.0, width, panes + 1)
    lefts, rights = lines[:-1] + pillar, lines[1:] - pillar
    xs = np.concatenate([[0.0], np.stack([lefts, rights], axis=1).ravel(), [width]])
    door = int(generator.integers(panes))
    holes = np.zeros((3, len(xs) - 1), np.bool_)
    holes[1, 1::2] = True
    holes[0, 1 + 2 * door] = True
    parts = [wall_with_holes(xs, [0.0, sill, head, ground], holes, paint)]
    depth = 0.25
    frame = Look("metal", (0.2, 0.2, 0.2))
    for number, (left, right) in enumerate(zip(lefts, rights, strict=True)):
        low = 0.0 if number == door else sill
        wide = right - left
        dim = generator.uniform(0.4, 1.0)
        glass = Look("shop", (dim, dim, 0.95 * dim), gloss=1.0)
        shift = (generator.uniform(0.0, 3.0), generator.uniform(-0.3, 0.3))
        hole = [
            panel((0, 0, low), (0, depth, 0), (0, 0, head - low), paint),
            panel((wide, depth, low), (0, -depth, 0), (0, 0, head - low), paint),
            panel((0, depth, head), (wide, 0, 0), (0, -depth, 0), paint),
            panel((0, -0.03, low), (wide, 0, 0), (0, depth + 0.03, 0), trim),
            panel((0, depth, low), (wide, 0, 0), (0, 0, head - low), glass, shift=shift),
        ]
        if number == door:
            for x in (0.25 * wide, 0.75 * wide):
                hole.append(box((x, depth - 0.05, 0), (x + 0.07, depth, head), frame))
            hole.append(box((0, depth - 0.05, 2.1), (wide, depth, 2.18), frame))
        parts.append(place_part(join_parts(hole), (left, 0, 0)))
    sign = Look("wood", _one_of(generator, _STRONG))
    parts.append(box((0.2, -0.12, head + 0.1), (width - 0.2, 0, ground - 0.2), sign))
    picture = Look(POSTERS[generator.integers(len(POSTERS))])
    side = ground - head - 0.36
    at = generator.uniform(0.5, width - 1.5)
    corner = (at, -0.14, head + 0.13)
    parts.append(panel(corner, (1.5 * side, 0, 0), (0, 0, side), picture, fitted=True))
    words = Look("page", (0.9, 0.85, 0.7))
    start = at + 2.0 if at < width / 2 - 1 else max(0.4, at - 3.0)
    parts.append(
        panel((start, -0.14, head + 0.13), (4.0 * side, 0, 0), (0, 0, side), words, fitted=True)
    )
    if generator.random() < 0.5:
        parts.append(_awning(lefts[0], rights[-1], head + 0.05, generator))
    return join_parts(parts)


def _awning(left: float, right: float, top: float, generator: Generator) -> Part:
    """Striped cloth, sloping over the pavement, seen from both sides."""
    colours = _one_of(generator, _STRONG), (0.6, 0.58, 0.52)
    count = max(2, round((right - left) / 0.4))
    wide = (right - left) / count
    parts = []
    for number in range(count):
        look = Look("plaster", colours[number % 2])
        x = left + number * wide
        slope, fringe = (0, 1.1, 0.55), (0, 0, 0.2)
        low = (x, -1.1, top - 0.55)
        parts.append(panel(low, (wide, 0, 0), slope, look))
        parts.append(panel((x + wide, -1.1, top - 0.55), (-wide, 0, 0), slope, look))
        edge = (x, -1.1, top - 0.75)
        parts.append(panel(edge, (wide, 0, 0), fringe, look))
        parts.append(panel((x + wide, -1.1, top - 0.75), (-wide, 0, 0), fringe, look))
    return join_parts(parts)


def gap_wall(width: float, generator: Generator) -> Part:
    """A wall of bricks with a coping and a picture, across a gap between houses."""
    height = generator.uniform(2.3, 3.0)
    brick = Look("brick", _one_of(generator, _BRICKS))
    stone = Look("plaster", _STONE)
    parts = [
        panel((0, 0, 0), (width, 0, 0), (0, 0, height), brick),
        box((0, -0.06, height), (width, 0.3, height + 0.1), stone),
    ]
    if width > 1.8:
        picture = Look(POSTERS[generator.integers(len(POSTERS))])
        wide = min(1.6, width - 0.4)
        corner = ((width - wide) / 2, -0.04, 0.7)
        parts.append(panel(corner, (wide, 0, 0), (0, 0, 1.2), picture, fitted=True))
        edge = Look("metal", (0.1, 0.1, 0.1))
        left, right = corner[0] - 0.05, corner[0] + wide + 0.05
        parts.append(box((left, -0.025, 0.65), (right, 0, 1.95), edge, faces="-x+x-y-z+z"))
    return join_parts(parts)
