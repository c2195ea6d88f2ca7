"""What stands in the room, in metres, z up; the glass stands at (0, 0, 1.25)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from docs.room.building import PAINTING, RUG, Builder, FloatArray, Look, Surfaces
from docs.room.looks import (
    BLUE,
    BOOKS,
    BRASS,
    CEILING,
    CLAY,
    CREAM,
    EAST,
    FLOOR,
    GLAZED,
    GREEN,
    HEAD,
    LINEN,
    MUSTARD,
    NORTH,
    OAK,
    RUST,
    SHADE,
    SILL,
    SOUTH,
    TEAL,
    THICK,
    TOP,
    WALL,
    WALNUT,
    WEST,
    WHITE,
)
from docs.room.shelves import book, lying, shelves


class Window(NamedTuple):
    """A hole of a wall: a rectangle from its corner along two sides."""

    corner: FloatArray
    one: FloatArray
    other: FloatArray


def furnished_room(step: float = 0.22) -> tuple[Surfaces, list[Window]]:
    """The room's surfaces in pieces of at most ``step`` metres, and its windows."""
    room = Builder(step, seed=7)
    windows = _shell(room)
    shelves(room)
    _reading_corner(room)
    _table_and_rug(room)
    _south_side(room)
    _plant(room, (-2.35, 2.5, 0.0))
    return room.surfaces(), windows


# ---- walls -----------------------------------------------------------------------------------


def _shell(room: Builder) -> list[Window]:
    width, depth = EAST - WEST, NORTH - SOUTH
    room.quad((WEST, SOUTH, 0), (width, 0, 0), (0, depth, 0), FLOOR)
    room.quad((WEST, SOUTH, TOP), (0, depth, 0), (width, 0, 0), CEILING)
    for y in (-1.9, -0.1, 1.7):
        room.box((WEST, y - 0.08, TOP - 0.16), (EAST, y + 0.08, TOP), WALNUT)
    north = [(-2.1, -0.62)]
    west = [(-2.25, -0.85), (0.25, 1.75)]
    up = (0.0, 0.0, TOP)
    high = (SILL, HEAD)
    room.wall(
        (WEST, NORTH, 0), (width, 0, 0), up, WALL, [((a - WEST, b - WEST), high) for a, b in north]
    )
    room.wall(
        (WEST, SOUTH, 0),
        (0, depth, 0),
        up,
        WALL,
        [((a - SOUTH, b - SOUTH), high) for a, b in west],
    )
    room.quad((WEST, SOUTH, 0), up, (width, 0, 0), TEAL)
    room.quad((EAST, SOUTH, 0), (0, depth, 0), up, WALL)
    for low, most in (
        ((WEST, NORTH - 0.02, 0), (EAST, NORTH, 0.12)),
        ((WEST, SOUTH, 0), (EAST, SOUTH + 0.02, 0.12)),
        ((WEST, SOUTH, 0), (WEST + 0.02, NORTH, 0.12)),
        ((EAST - 0.02, SOUTH, 0), (EAST, NORTH, 0.12)),
    ):
        room.box(low, most, WHITE)
    windows = [_window(room, (a, NORTH), (b, NORTH)) for a, b in north]
    windows += [_window(room, (WEST, a), (WEST, b)) for a, b in west]
    return windows


def _window(room: Builder, start: tuple[float, float], end: tuple[float, float]) -> Window:
    """Reveal, frame, bars, sill and curtains of a window between two points of a wall."""
    a, b = np.array([*start, 0.0]), np.array([*end, 0.0])
    length = float(np.linalg.norm(b - a))
    along = (b - a) / length
    out = np.array([0.0, 1.0, 0.0]) if start[1] == end[1] else np.array([-1.0, 0.0, 0.0])
    up = np.array([0.0, 0.0, 1.0])

    def bar(left: float, right: float, low: float, high: float, near: float, far: float) -> None:
        ends = np.array([a + left * along + near * out, a + right * along + far * out])
        least, most = ends.min(axis=0), ends.max(axis=0)
        room.box((*least[:2], low), (*most[:2], high), WHITE)

    bar(-0.04, 0.0, SILL, HEAD, -0.02, THICK)
    bar(length, length + 0.04, SILL, HEAD, -0.02, THICK)
    bar(-0.04, length + 0.04, HEAD, HEAD + 0.05, -0.02, THICK)
    bar(-0.1, length + 0.1, SILL - 0.045, SILL, -0.13, THICK)
    middle = length / 2
    for left, right in ((0.0, middle), (middle, length)):  # two leaves of 2 x 3 panes
        bar(left, left + 0.055, SILL, HEAD, 0.07, 0.13)
        bar(right - 0.055, right, SILL, HEAD, 0.07, 0.13)
        bar(left, right, SILL, SILL + 0.07, 0.07, 0.13)
        bar(left, right, HEAD - 0.055, HEAD, 0.07, 0.13)
        centre = (left + right) / 2
        bar(centre - 0.02, centre + 0.02, SILL, HEAD, 0.085, 0.115)
        for part in (1 / 3, 2 / 3):
            height = SILL + part * (HEAD - SILL)
            bar(left, right, height - 0.02, height + 0.02, 0.085, 0.115)
    for left, right in ((-0.34, -0.01), (length + 0.01, length + 0.34)):
        _curtain(room, a + left * along - 0.09 * out, a + right * along - 0.09 * out, out)
    rod = np.sort(np.array([a - 0.42 * along - 0.1 * out, b + 0.42 * along - 0.08 * out]), axis=0)
    room.box((*rod[0, :2], 2.56), (*rod[1, :2], 2.585), BRASS)
    return Window(a + SILL * up + THICK * out, b - a, (HEAD - SILL) * up)


def _curtain(room: Builder, start: FloatArray, end: FloatArray, out: FloatArray) -> None:
    columns, rows = np.linspace(0.0, 1.0, 49), np.linspace(0.0, 1.0, 9)
    phase = room.random.random() * 6
    waves = np.sin(columns * 2 * np.pi * 4.5 + phase) + 0.4 * np.sin(columns * 17 + phase)
    depth = (0.03 + 0.012 * rows[:, None]) * waves[None]
    points = start + columns[None, :, None] * (end - start) + depth[..., None] * out
    points = points + (2.55 - 2.52 * rows)[:, None, None] * np.array([0.0, 0.0, 1.0])
    uv = np.stack(np.broadcast_arrays(columns[None], 2.5 * rows[:, None]), axis=-1)
    room.sheet(points, uv, LINEN)


# ---- by the window ---------------------------------------------------------------------------


def _reading_corner(room: Builder) -> None:
    """An armchair before the north window, and a lamp between window and shelves."""
    _armchair(room, (-1.35, 2.0), 0.5)
    x, y = -0.3, 2.55
    room.turned(
        [(0.0, 0.0), (0.15, 0.0), (0.15, 0.02), (0.014, 0.035), (0.012, 1.5)], (x, y, 0), BRASS
    )
    profile = [(0.235, 0.0), (0.232, 0.03), (0.165, 0.29), (0.16, 0.31)]
    room.turned(profile, (x, y, 1.36), SHADE, 32)


def _armchair(room: Builder, place: tuple[float, float], turn: float) -> None:
    x, y = place
    cosine, sine = np.cos(turn), np.sin(turn)

    def part(low: tuple[float, float, float], high: tuple[float, float, float], look: Look) -> None:
        middle = (np.array(low) + np.array(high)) / 2
        half = (np.array(high) - np.array(low)) / 2
        at = np.array(
            [cosine * middle[0] - sine * middle[1], sine * middle[0] + cosine * middle[1]]
        )
        centre = np.array([x + at[0], y + at[1], middle[2]])
        room.box(centre - half, centre + half, look, turn)

    part((-0.36, -0.36, 0.16), (0.36, 0.34, 0.34), MUSTARD)
    part((-0.28, -0.38, 0.34), (0.28, 0.26, 0.46), MUSTARD)
    part((-0.36, 0.24, 0.16), (0.36, 0.40, 0.98), MUSTARD)
    for side in (-1.0, 1.0):
        low, high = sorted((side * 0.28, side * 0.42))
        part((low, -0.38, 0.16), (high, 0.34, 0.62), MUSTARD)
        for end in (-0.33, 0.31):
            part(
                (side * 0.36 - 0.025, end - 0.025, 0),
                (side * 0.36 + 0.025, end + 0.025, 0.16),
                WALNUT,
            )
    part((-0.22, 0.10, 0.46), (0.20, 0.24, 0.82), RUST)


def _table_and_rug(room: Builder) -> None:
    room.box((-0.95, 0.5, 0.0), (1.65, 2.3, 0.012), Look((0.34, 0.07, 0.035), RUG))
    x, y = 0.55, 1.45
    room.box((x - 0.5, y - 0.3, 0.40), (x + 0.5, y + 0.3, 0.435), OAK)
    for dx in (-0.44, 0.44):
        for dy in (-0.24, 0.24):
            room.box((x + dx - 0.02, y + dy - 0.02, 0.0), (x + dx + 0.02, y + dy + 0.02, 0.4), OAK)
    for thick, colour, turn in (
        (0.03, BOOKS[1], 0.2),
        (0.025, BOOKS[4], -0.1),
        (0.02, BOOKS[0], 0.5),
    ):
        base = 0.435 + {0.03: 0.0, 0.025: 0.03, 0.02: 0.055}[thick]
        room.box((x - 0.38, y - 0.1, base), (x - 0.12, y + 0.1, base + thick), book(colour), turn)
    bowl = [
        (0.0, 0.0),
        (0.05, 0.0),
        (0.12, 0.06),
        (0.15, 0.11),
        (0.142, 0.11),
        (0.11, 0.06),
        (0.0, 0.02),
    ]
    room.turned(bowl, (x + 0.18, y, 0.435), GLAZED)
    for dx, dy, dz in (
        (0.0, 0.0, 0.0),
        (0.06, 0.04, 0.01),
        (-0.05, 0.05, 0.005),
        (0.01, 0.02, 0.06),
    ):
        room.ball(
            (x + 0.18 + dx, y - 0.02 + dy, 0.53 + dz), 0.04, Look((0.75, 0.28, 0.02), gloss=0.04)
        )


# ---- behind ----------------------------------------------------------------------------------


def _south_side(room: Builder) -> None:
    """A sofa with pictures over it, a sideboard with a lamp, a door."""
    x, y = -0.4, SOUTH + 0.02
    room.box((x - 1.0, y, 0.12), (x + 1.0, y + 0.9, 0.36), BLUE)
    room.box((x - 1.0, y, 0.36), (x + 1.0, y + 0.24, 0.86), BLUE)
    for side in (-1.0, 1.0):
        low, high = sorted((x + side * 0.86, x + side * 1.06))
        room.box((low, y, 0.12), (high, y + 0.9, 0.6), BLUE)
        middle = x + side * 0.43
        room.box((middle - 0.41, y + 0.2, 0.36), (middle + 0.41, y + 0.92, 0.47), BLUE)
    for dx, look, turn in ((-0.65, MUSTARD, 0.15), (0.62, RUST, -0.2), (0.3, CREAM, 0.1)):
        room.box((x + dx - 0.2, y + 0.24, 0.47), (x + dx + 0.2, y + 0.36, 0.84), look, turn)
    for dx, z, wide, high, mood in (
        (-0.75, 1.25, 0.5, 0.65, (0.20, 0.34, 0.36)),
        (-0.05, 1.2, 0.75, 0.55, (0.45, 0.30, 0.12)),
        (0.72, 1.3, 0.42, 0.55, (0.25, 0.36, 0.18)),
    ):
        room.box((x + dx - wide / 2, y, z), (x + dx + wide / 2, y + 0.03, z + high), OAK)
        left, right = x + dx - wide / 2, x + dx + wide / 2
        mount = (left + 0.035, y + 0.032, z + 0.035)
        room.quad(mount, (0, 0, high - 0.07), (wide - 0.07, 0, 0), WHITE)
        corner = (right - 0.09, y + 0.034, z + 0.09)
        room.quad(corner, (0.18 - wide, 0, 0), (0, 0, high - 0.18), Look(mood, PAINTING))
    # A sideboard on the east wall, its lamp, and a large picture.
    room.box((EAST - 0.45, -1.0, 0.12), (EAST, 0.9, 0.78), OAK)
    for low in (-0.98, -0.35, 0.28):
        room.box((EAST - 0.465, low, 0.15), (EAST - 0.45, low + 0.6, 0.75), WALNUT)
    vase = [(0.0, 0.0), (0.07, 0.0), (0.1, 0.1), (0.05, 0.24), (0.02, 0.3), (0.012, 0.42)]
    room.turned(vase, (EAST - 0.24, -0.6, 0.78), CLAY)
    room.turned([(0.16, 0.0), (0.11, 0.2)], (EAST - 0.24, -0.6, 1.15), SHADE)
    lying(room, EAST - 0.4, 0.78, 0.3)
    room.box((EAST - 0.03, -0.3, 1.15), (EAST, 0.9, 1.95), WALNUT)
    room.quad(
        (EAST - 0.032, 0.85, 1.2), (0, -1.1, 0), (0, 0, 0.7), Look((0.42, 0.24, 0.16), PAINTING)
    )
    # The door.
    room.box((EAST - 0.02, 1.5, 0.0), (EAST, 2.5, 2.1), WHITE)
    for low, high in ((0.2, 0.95), (1.1, 1.95)):
        room.box((EAST - 0.03, 1.65, low), (EAST, 1.95, high), WHITE)
        room.box((EAST - 0.03, 2.05, low), (EAST, 2.35, high), WHITE)
    room.ball((EAST - 0.07, 1.6, 1.02), 0.03, BRASS)


def _plant(room: Builder, foot: tuple[float, float, float]) -> None:
    """A palm in a clay pot: arching stalks, with leaves on both sides."""
    x, y, z = foot
    pot = [
        (0.0, 0.0),
        (0.13, 0.0),
        (0.18, 0.3),
        (0.195, 0.33),
        (0.175, 0.33),
        (0.16, 0.29),
        (0.0, 0.28),
    ]
    room.turned(pot, foot, CLAY)
    for stalk in range(13):
        way = stalk * 2.399963
        reach, rise = 0.35 + 0.3 * room.random.random(), 1.0 + 0.55 * room.random.random()
        outward = np.array([np.cos(way), np.sin(way), 0.0])
        for number in range(14):
            t = 0.3 + 0.7 * number / 13
            at = np.array([x, y, z + 0.28]) + reach * t * t * outward
            at[2] += rise * (t - 0.32 * t**3)
            for side in (-1.0, 1.0):
                across = side * np.cross(outward, [0.0, 0.0, 1.0])
                tip = 0.55 * outward * t + 0.8 * across + np.array([0, 0, 0.25 - 0.7 * t])
                _leaf(room, at, tip / np.linalg.norm(tip), 0.26 * np.sin(np.pi * (0.15 + 0.75 * t)))


def _leaf(room: Builder, base: FloatArray, way: FloatArray, length: float) -> None:
    along, across = np.linspace(0.0, 1.0, 5), np.array([-1.0, 0.0, 1.0])
    wide = 0.016 * np.sin(np.pi * np.clip(along * 0.93 + 0.05, 0, 1))
    side = np.cross(way, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    points = (
        base + length * along[:, None, None] * way + wide[:, None, None] * across[:, None] * side
    )
    points[..., 2] -= 0.35 * length * along[:, None] ** 2
    uv = np.stack(np.broadcast_arrays(along[:, None], (across + 1)[None] / 2), axis=-1)
    room.sheet(points, uv, GREEN)
