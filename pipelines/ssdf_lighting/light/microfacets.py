"""The gloss of the materials: Beckmann's distribution, Smith's shadowing, a dielectric's Fresnel.

Torrance and Sparrow's f = D F G / (4 n·i n·o) with the terms of Walter, Marschner, Li and Torrance,
"Microfacet models for refraction", 2007. The ray-traced reference takes it as it is; the lobes of
the shading are fitted to it.

All functions take arrays that broadcast: cosines, F0 (reflectance along the normal) and the slope
m of the roughness.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

_LEAST_COSINE = 1e-6


class Materials(NamedTuple):
    """Matt albedo with a gloss on top, one row an object; both reflect as if alone.

    albedo: (M, 3) float64, linear, 0 to 1.
    specular: (M,) float64, F0 of the gloss, 0 to below 1; 0: there is none.
    roughness: (M,) float64, Beckmann's root mean square slope m, above 0.
    tint: (M, 3) float64, what the gloss is multiplied by: metals colour it. None: 1.
    """

    albedo: FloatArray
    specular: FloatArray
    roughness: FloatArray
    tint: FloatArray | None = None


def check_materials(materials: Materials) -> None:
    """Raise ValueError unless the arrays belong together and hold what they may."""
    albedo, specular, roughness, _ = materials
    count = len(albedo)
    if albedo.shape != (count, 3) or specular.shape != (count,) or roughness.shape != (count,):
        raise ValueError(
            f"materials: found shapes {albedo.shape}, {specular.shape} and {roughness.shape}; "
            "expected (M, 3), (M,) and (M,)."
        )
    for name, values, fits, expected in (
        ("albedo", albedo, (albedo >= 0) & (albedo <= 1), "0 to 1"),
        ("specular", specular, (specular >= 0) & (specular < 1), "0 to below 1"),
        ("roughness", roughness, (roughness >= 0.01) & (roughness <= 2), "0.01 to 2"),
    ):
        if not fits.all():
            raise ValueError(f"{name}: found {values[~fits][0]}, expected {expected}.")


def beckmann(cosine: ArrayLike, roughness: ArrayLike) -> FloatArray:
    """D(h) per steradian where n·h is ``cosine`` > 0: exp(-tan² / m²) / (pi m² cos⁴)."""
    squared = np.maximum(np.asarray(cosine, np.float64), _LEAST_COSINE) ** 2
    slope = np.asarray(roughness, np.float64) ** 2
    value: FloatArray = np.exp((1 - 1 / squared) / slope) / (math.pi * slope * squared**2)
    return value


def smith(cosine: ArrayLike, roughness: ArrayLike) -> FloatArray:
    """Share G1 of the microfacets that a direction sees: Walter's fit, 0.35 % off at most; 0 for a
    direction below the surface."""
    c = np.asarray(cosine, np.float64)
    level = np.sqrt(np.maximum(1 - c * c, 1e-12))
    a = np.minimum(np.maximum(c, 0.0) / (np.asarray(roughness) * level), 1.6)
    share: FloatArray = (3.535 * a + 2.181 * a * a) / (1 + 2.276 * a + 2.577 * a * a)
    return np.where(a >= 1.6, 1.0, share)


def fresnel(cosine: ArrayLike, specular: ArrayLike) -> FloatArray:
    """Unpolarised reflectance of a dielectric whose reflectance along the normal is F0 < 1.

    Exact: Schlick's polynomial is a fifth too dark at 60 degrees for F0 = 0.04.

    >>> fresnel([1.0, 0.5], 0.04).round(4).tolist()
    [0.04, 0.0892]
    """
    root = np.sqrt(np.asarray(specular, np.float64))
    index = (1 + root) / (1 - root)
    c = np.clip(np.asarray(cosine, np.float64), _LEAST_COSINE, 1.0)
    g = np.sqrt(index * index - 1 + c * c)
    across, along = (g - c) / (g + c), (c * (g + c) - 1) / (c * (g - c) + 1)
    reflectance: FloatArray = 0.5 * across**2 * (1 + along**2)
    return reflectance


def gloss(
    n_i: ArrayLike,
    n_o: ArrayLike,
    n_h: ArrayLike,
    o_h: ArrayLike,
    specular: ArrayLike,
    roughness: ArrayLike,
) -> FloatArray:
    """f n·i = D F G / (4 n·o) per steradian, from the cosines n·i, n·o, n·h and o·h.

    0 for light from below the surface; from a view below, it is what a grazing view sees.
    """
    seen = np.maximum(np.asarray(n_o, np.float64), LEAST_VIEW)
    masked = smith(n_i, roughness) * smith(seen, roughness)
    value: FloatArray = beckmann(n_h, roughness) * fresnel(o_h, specular) * masked / (4 * seen)
    return np.where(np.asarray(n_i) > 0, value, 0.0)


LEAST_VIEW = 1e-3
"""The least n·o: an interpolated normal may turn away from the viewer."""
