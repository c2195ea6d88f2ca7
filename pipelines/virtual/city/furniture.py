"""What stands on the pavements: thin poles, trees; covers in the road."""

from __future__ import annotations

import numpy as np

from pipelines.virtual.city.parts import (
    POSTERS,
    Look,
    Part,
    blob,
    box,
    grid_surface,
    join_parts,
    mark_as_pole,
    panel,
    tube,
)

Generator = np.random.Generator

_POLES = ((0.45, 0.46, 0.47), (0.07, 0.16, 0.11), (0.10, 0.10, 0.11), (0.55, 0.52, 0.45))


def pole(generator: Generator) -> Part:
    """A street lamp or a sign post that stands at the origin; the road is towards -y.

    The post, 10 to 16 cm thick, is marked as a pole; arms, lamps and plates are not.
    """
    look = Look("metal", _POLES[generator.integers(len(_POLES))])
    radius = generator.uniform(0.05, 0.08)
    if generator.random() < 0.5:
        return _lamp(radius, generator.uniform(4.8, 6.0), look)
    return _sign_post(radius, generator.uniform(3.0, 3.8), look, generator)


def _post(radius: float, height: float, look: Look) -> Part:
    shaft = tube((0, 0, 0), (0, 0, height), radius, look, sides=12, rings=14)
    angle = np.linspace(0.0, 2 * np.pi, 13)
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(13, height)], axis=-1)
    cap = np.stack([rim, np.broadcast_to([0.0, 0.0, height], rim.shape)])
    up = np.broadcast_to(np.array([0.0, 0.0, 1.0]), cap.shape)
    return mark_as_pole(join_parts([shaft, grid_surface(cap, cap[..., :2], look, normals=up)]))


def _lamp(radius: float, height: float, look: Look) -> Part:
    arm_end = (0.0, -1.3, height + 0.15)
    head = Look("paint", (0.16, 0.16, 0.17))
    glow = Look("paint", (0.8, 0.78, 0.7))
    return join_parts(
        [
            _post(radius, height, look),
            box((-0.14, -0.14, 0), (0.14, 0.14, 0.35), look),
            tube((0, 0, height - 0.08), arm_end, 0.035, look, sides=8, rings=4),
            box((-0.13, -1.75, height + 0.09), (0.13, -1.15, height + 0.22), head),
            panel((-0.1, -1.2, height + 0.07), (0.2, 0, 0), (0, -0.5, 0), glow),
        ]
    )


def _sign_post(radius: float, height: float, look: Look, generator: Generator) -> Part:
    """A plate across the road: its picture towards those who come along +x or -x."""
    back = Look("metal", (0.35, 0.35, 0.36))
    picture = Look(POSTERS[generator.integers(len(POSTERS))])
    colour = ((0.5, 0.04, 0.03), (0.03, 0.1, 0.4), (0.6, 0.5, 0.05))[generator.integers(3)]
    side = generator.uniform(0.5, 0.7)
    bottom = height - side - 0.05
    near, half = radius + 0.02, side / 2
    rim = Look("paint", colour)
    inner = 0.8 * side
    corner_front = (-near - 0.045, inner / 2, bottom + 0.1 * side)
    return join_parts(
        [
            _post(radius, height, look),
            box((-near - 0.025, -half, bottom), (-near, half, bottom + side), rim),
            panel(corner_front, (0, -inner, 0), (0, 0, inner), picture, fitted=True),
            box((near, -half, bottom), (near + 0.025, half, bottom + side), back),
        ]
    )


def tree(generator: Generator) -> Part:
    """A trunk with a crown of blobs."""
    bark = Look("leaves", (0.16, 0.12, 0.09))
    green = np.array([0.10, 0.17, 0.05]) * generator.uniform(0.8, 1.3)
    green[0] *= generator.uniform(0.7, 1.6)
    height = generator.uniform(2.3, 3.0)
    radius = generator.uniform(0.13, 0.19)
    parts = [tube((0, 0, 0), (0, 0, height + 1.2), radius, bark, sides=12, rings=6)]
    for number in range(13):
        angle = 2.4 * number + generator.uniform(-0.4, 0.4)
        away = generator.uniform(0.3, 0.85)
        centre = np.array([away * np.cos(angle), away * np.sin(angle), height + 0.5])
        centre[2] += generator.uniform(0.0, 1.9)
        tone = green * generator.uniform(0.85, 1.15)
        look = Look("leaves", (float(tone[0]), float(tone[1]), float(tone[2])))
        parts.append(blob(centre, generator.uniform(0.4, 0.75), look, generator, segments=14))
    pit = Look("leaves", (0.10, 0.08, 0.06))
    parts.append(panel((-0.6, -0.6, 0.015), (1.2, 0, 0), (0, 1.2, 0), pit))
    return join_parts(parts)


def cover(generator: Generator) -> Part:
    """A round cover in the road, 65 cm, 1.5 cm above it."""
    angle = np.linspace(0.0, 2 * np.pi, 25)
    rings = np.array([0.325, 0.02])[:, None]
    disc = np.stack(
        np.broadcast_arrays(rings * np.cos(angle), rings * np.sin(angle), 0.015), axis=-1
    )
    look = Look("coins", (0.5, 0.5, 0.5))
    up = np.broadcast_to(np.array([0.0, 0.0, 1.0]), disc.shape)
    # The coin at the photograph's upper right (384 x 303 pixels): its middle, its size.
    uvs = np.array([0.871, 0.856]) + disc[..., :2] * [0.215, 0.275]
    return grid_surface(disc, uvs, look, normals=up)
