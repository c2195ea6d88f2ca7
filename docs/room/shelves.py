"""Bookshelves with books and other things."""

from __future__ import annotations

import numpy as np

from docs.room.building import PAINTING, PLASTER, SPINE, Builder, Look
from docs.room.looks import BOOKS, BRASS, CLAY, CREAM, GLAZED, NORTH, WALNUT


def shelves(room: Builder) -> None:
    """Bookshelves along the north wall, right of the window."""
    left, right, front = 0.02, 2.32, NORTH - 0.34
    levels = (0.10, 0.48, 0.86, 1.22, 1.56, 1.90)
    room.quad((left, NORTH - 0.012, 0), (right - left, 0, 0), (0, 0, 2.28), WALNUT)
    for x in np.linspace(left, right, 4):
        room.box((x - 0.017, front, 0.0), (x + 0.017, NORTH, 2.28), WALNUT)
    for z in (*levels, 2.25):
        room.box((left, front + 0.01, z), (right, NORTH, z + 0.03), WALNUT)
    bays = np.linspace(left, right, 4)
    for level, z in enumerate(levels):
        top = (*levels, 2.25)[level + 1] - z - 0.03
        for bay in range(3):
            low, high = bays[bay] + 0.03, bays[bay + 1] - 0.03
            objects = (level * 3 + bay) % 5
            if objects == 1:
                half = (low + high) / 2
                _books(room, low, half - 0.05, z + 0.03, top, front)
                _thing(room, (half + (high - half) / 2, front + 0.16, z + 0.03), level + bay, top)
            elif objects == 3:
                lying(room, low, z + 0.03, front)
                _books(room, low + 0.32, high, z + 0.03, top, front)
            else:
                _books(room, low, high, z + 0.03, top, front)


def _books(room: Builder, low: float, high: float, z: float, top: float, front: float) -> None:
    x = low
    series, left = room.random.integers(len(BOOKS)), 0
    while x < high - 0.05:
        if left == 0:
            series, left = room.random.integers(len(BOOKS)), int(room.random.integers(1, 6))
            tall = (0.62 + 0.33 * room.random.random()) * top
            thick = 0.018 + 0.035 * room.random.random()
            deep = 0.02 + 0.06 * room.random.random()
        left -= 1
        colour = tuple(np.array(BOOKS[series]) * (0.8 + 0.4 * room.random.random()))
        height = min(tall * (0.97 + 0.06 * room.random.random()), top - 0.01)
        room.box((x, front + deep, z), (x + thick, NORTH - 0.04, z + height), book(colour))
        x += thick + 0.0015
        if room.random.random() < 0.04:
            x += 0.06


def book(colour: tuple[float, ...]) -> Look:
    """A book's binding."""
    return Look((colour[0], colour[1], colour[2]), SPINE, gloss=0.02)


def lying(room: Builder, x: float, z: float, front: float) -> None:
    """A few books on each other, from x rightwards and z upwards."""
    for _ in range(int(room.random.integers(3, 6))):
        thick = 0.022 + 0.025 * room.random.random()
        colour = BOOKS[room.random.integers(len(BOOKS))]
        size = 0.25 + 0.04 * room.random.random()
        shift = 0.02 * room.random.random()
        low, high = (x + shift, front + 0.04, z), (x + shift + size, front + 0.24, z + thick)
        room.box(low, high, book(colour), turn=0.15 * (room.random.random() - 0.5))
        z += thick


def _thing(room: Builder, foot: tuple[float, float, float], which: int, top: float) -> None:
    """A vase, a globe, a bowl, a small picture or a box."""
    x, y, z = foot
    if which % 5 == 0:
        profile = [
            (0.0, 0.0),
            (0.05, 0.0),
            (0.085, 0.07),
            (0.075, 0.14),
            (0.03, 0.19),
            (0.045, 0.24),
        ]
        room.turned(profile, foot, GLAZED)
    elif which % 5 == 1:
        room.turned([(0.0, 0.0), (0.06, 0.0), (0.012, 0.03), (0.012, 0.06)], foot, BRASS)
        room.ball((x, y, z + 0.16), 0.1, Look((0.12, 0.25, 0.28), PLASTER, gloss=0.04))
    elif which % 5 == 2:
        profile = [
            (0.0, 0.0),
            (0.05, 0.0),
            (0.10, 0.05),
            (0.125, 0.10),
            (0.118, 0.10),
            (0.09, 0.05),
        ]
        room.turned(profile, foot, CLAY)
    elif which % 5 == 3:
        room.box((x - 0.1, y, z), (x + 0.1, y + 0.02, z + min(0.26, top - 0.02)), BRASS)
        room.quad(
            (x - 0.085, y - 0.002, z + 0.015), (0.17, 0, 0), (0, 0, min(0.23, top - 0.05)),
            Look((0.3, 0.42, 0.5), PAINTING),
        )  # fmt: skip
    else:
        room.box((x - 0.1, y - 0.05, z), (x + 0.1, y + 0.1, z + 0.12), CREAM)
