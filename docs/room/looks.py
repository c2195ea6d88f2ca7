"""What the room is made of, and its measures: metres, z up."""

from __future__ import annotations

from docs.room.building import BOARDS, LEAF, PLASTER, WEAVE, WOOD, Look

EYE = (0.0, 0.0, 1.25)
WEST, EAST, SOUTH, NORTH, TOP = -2.8, 3.2, -3.1, 3.0, 2.75
THICK = 0.22
SILL, HEAD = 0.6, 2.4

WALL = Look((0.76, 0.71, 0.63), PLASTER)
TEAL = Look((0.10, 0.20, 0.20), PLASTER)
WHITE = Look((0.80, 0.77, 0.71), gloss=0.03)
CEILING = Look((0.82, 0.79, 0.73), PLASTER)
FLOOR = Look((0.36, 0.215, 0.115), BOARDS, gloss=0.04)
WALNUT = Look((0.19, 0.095, 0.045), WOOD, gloss=0.03)
OAK = Look((0.42, 0.25, 0.12), WOOD, gloss=0.03)
LINEN = Look((0.72, 0.64, 0.52), WEAVE, thin=True)
MUSTARD = Look((0.48, 0.26, 0.06), WEAVE)
BLUE = Look((0.06, 0.10, 0.17), WEAVE)
RUST = Look((0.42, 0.11, 0.04), WEAVE)
CREAM = Look((0.66, 0.57, 0.45), WEAVE)
BRASS = Look((0.62, 0.42, 0.16), gloss=0.25)
CLAY = Look((0.50, 0.20, 0.10), PLASTER)
GLAZED = Look((0.06, 0.16, 0.22), gloss=0.05)
GREEN = Look((0.07, 0.19, 0.035), LEAF, gloss=0.03, thin=True)
SHADE = Look((0.75, 0.6, 0.4), emission=(3.6, 2.4, 1.2), thin=True)
BOOKS = (
    (0.36, 0.06, 0.035), (0.055, 0.11, 0.20), (0.07, 0.16, 0.085), (0.50, 0.36, 0.18),
    (0.62, 0.55, 0.44), (0.16, 0.06, 0.05), (0.04, 0.045, 0.055), (0.45, 0.19, 0.05),
    (0.20, 0.26, 0.27), (0.56, 0.43, 0.12),
)  # fmt: skip
