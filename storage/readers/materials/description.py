"""Materials as files describe them: numbers, and where their textures are."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.materials.material import Colour, Wrap

Channel = Callable[[NDArray[np.floating]], NDArray[np.floating]]
"""Of a picture's codes (H, W, 4) in [0, 1] the share (H, W) in [0, 1] that something is of."""

_SILENT = 1e-3


class Placing(NamedTuple):
    """How a texture lies: the number of its set of texture coordinates, and what turns these into
    its own, u = a u + b v + c, v = d u + e v + f, v from the bottom."""

    set: int = 0
    matrix: tuple[float, float, float, float, float, float] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


class Map(NamedTuple):
    """A picture on a surface. ``key``: equal for equal pictures; ``shown``: its name for people;
    ``opened``: its bytes, may raise BadInput; ``gain``: codes are times the second plus the first;
    ``bend``: of normals, what the parts along the surface are multiplied by."""

    key: Hashable
    shown: str
    opened: Callable[[], bytes]
    placing: Placing = Placing()
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    gain: tuple[float, float] = (0.0, 1.0)
    bend: float = 1.0


class Share(NamedTuple):
    """One channel of the surface's texture: 0 of specular, 1 of roughness, 2 of metal."""

    map: Map
    target: int
    channel: Channel


class Description(NamedTuple):
    """A material with its textures not decoded; fields as `material.Varying` has them.

    guessed_normal: ``normal`` may be heights: the picture tells.
    """

    name: str
    base: Colour
    metal: float
    specular: Colour
    roughness: float
    colour: Map | None = None
    shares: tuple[Share, ...] = ()
    normal: Map | None = None
    guessed_normal: bool = False


def grey(name: str) -> Description:
    """A matt grey: what a part has whose file gives it no material."""
    return Description(name, (0.6, 0.6, 0.6), 0.0, (0.0, 0.0, 0.0), math.sqrt(0.3))


def held(values: list[float], what: str, notes: list[str], most: float = 1.0) -> list[float]:
    """Numbers within [0, ``most``]; of those that were farther outside than a thousandth a note
    says ``what`` they are."""
    inside = [min(max(value, 0.0), most) for value in values]
    if any(abs(a - b) > _SILENT for a, b in zip(values, inside, strict=True)):
        shown = " ".join(f"{value:.6g}" for value in values)
        notes.append(f"{what} is {shown}: held within 0 and {most:g}.")
    return inside
