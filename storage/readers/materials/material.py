"""Materials as the reader of scenes gives them."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Wrap = Literal["repeat", "mirror", "clamp"]
Colour = tuple[float, float, float]

LEAST_ROUGHNESS = 1e-3
"""Mirrors, whose slope would be 0, are read as this rough."""
DIELECTRIC = 0.04
"""Fresnel reflectance at normal incidence that glTF 2.0 gives what is no metal."""


class Texture(NamedTuple):
    """``texels`` (H, W, 3) uint8, row 0 at the top (v = 1); ``wrap``, along u and v, says what is
    outside of [0, 1]; ``mapping``, 0 or 1, which of the scene's two texture coordinates place it.
    """

    texels: NDArray[np.uint8]
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    mapping: int = 0


class Varying(NamedTuple):
    """What differs from place to place on a material: factors, each times a texture.

    base: linear colour; times the corners' colours and ``colour``, sRGB codes. metal, roughness:
    in [0, 1]; specular: F0, a linear colour, of what is no metal. ``surface`` has shares of
    specular (red), roughness (green) and metal (blue). ``normal``: 2 t - 1 along u, along v and
    along the normal, the first two times ``bend``.

    The albedo is base x (1 - metal), F0 goes from specular to base with metal, Beckmann's slope
    is the roughness squared.
    """

    base: Colour
    metal: float
    specular: Colour
    roughness: float
    colour: Texture | None = None
    surface: Texture | None = None
    normal: Texture | None = None
    bend: float = 1.0


class Material(NamedTuple):
    """How a part reflects light; one with textures or with colours of vertices, on average.

    name: as in the file; names need not differ.
    albedo: diffuse reflectance in [0, 1], red, green and blue of linear sRGB.
    specular: Fresnel reflectance at normal incidence, F0, in [0, 1]; 0 is without gloss.
    roughness: Beckmann's slope m in (0, 1].
    tint: what the gloss is multiplied by, of mean 1: metals colour it.
    varying: None where it is the same everywhere.
    """

    name: str
    albedo: Colour
    specular: float
    roughness: float
    tint: Colour = (1.0, 1.0, 1.0)
    varying: Varying | None = None


def default_material(name: str = "default") -> Material:
    """What a part has whose file gives it no material: a matt grey."""
    return Material(name, (0.6, 0.6, 0.6), 0.0, 0.3)
