"""A spherical Gaussian light on a matt surface: its irradiance, exactly, and the SG it looks like.

Wang et al. (2009) take the clamped cosine for an SG too (λ = 2.133, μ = 1.170), and visibility at
the axis of the product. That is off by a tenth of the light for a narrow one, and it darkens
surfaces twice: the cosine's SG reaches below the horizon, where d is negative.

Here the irradiance E(n·p, λ) of an unhidden light is the integral itself. Only for *where* the
light comes from, the product of SG and cosine becomes an SG: the one with its mean direction and
its mean resultant length (the moments of von Mises and Fisher's distribution). Its share above the
horizon is what d = horizon says; so with ``whole`` = f(horizon, λ') of it, E f(d, λ') / whole is E
where nothing but the surface itself hides light.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import i0e, i1e

FloatArray = NDArray[np.float64]

COLUMNS = 513
"""Cosines from -1 to 1."""
_NODES = 96
_REACH = 9.0
"""Beyond so many widths 1 / sqrt(λ), exp(-λ (1 - cos)) does not count."""


class CosineLobes(NamedTuple):
    """Of N sharpnesses (rows), at COLUMNS even cosines n·p from -1 to 1.

    irradiance: (N, COLUMNS) float64 of an SG of amplitude 1.
    sharpness: (N, COLUMNS) float64, λ' of the lobe.
    along, up: (N, COLUMNS) float64; the lobe's axis is along p + up n.
    """

    irradiance: FloatArray
    sharpness: FloatArray
    along: FloatArray
    up: FloatArray


def cosine_lobes(sharpness: ArrayLike) -> CosineLobes:
    """Tables for lights of these sharpnesses (N,), above 0.

    With n as the pole the integral over the azimuth is a Bessel function; what is left is one
    integral over the polar angle, taken by Gauss and Legendre where the SG counts.
    """
    sharp = np.asarray(sharpness, np.float64)[:, None, None]
    cosine = np.linspace(-1.0, 1.0, COLUMNS)[None, :, None]
    away = np.arccos(cosine)
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    reach = _REACH / np.sqrt(sharp)
    last = np.minimum(away + reach, math.pi / 2)
    first = np.clip(np.minimum(away, math.pi / 2) - reach, 0.0, None)
    polar = first + (last - first) * (1 + nodes) / 2
    sine, height = np.sin(polar), np.cos(polar)
    off = np.cos(polar - away)
    # Relative to the brightest node: a light below the horizon has a direction too.
    brightest = off.max(axis=-1, keepdims=True)
    common = np.exp(sharp * (off - brightest)) * (last - first) / 2 * weights * sine * height
    across = np.sqrt(np.maximum(1 - cosine**2, 0.0))
    around = sharp * sine * across
    total = np.sum(common * i0e(around), axis=-1)
    upwards = np.sum(common * height * i0e(around), axis=-1)
    # The first moment across n, over the sine of the light's own angle: I1(z) / z stays finite.
    ratio = np.where(around > 1e-8, i1e(around) / np.maximum(around, 1e-8), 0.5)
    sideways = np.sum(common * sine**2 * ratio, axis=-1) * sharp[..., 0]
    across, cosine = across[..., 0], cosine[..., 0]
    length = np.hypot(sideways * across, upwards)
    faded = np.exp(sharp[..., 0] * (brightest[..., 0] - 1))
    return CosineLobes(
        2 * math.pi * total * faded,
        sharpness_of_resultant(length / total),
        sideways / length,
        (upwards - sideways * cosine) / length,
    )


def sharpness_of_resultant(length: ArrayLike) -> FloatArray:
    """λ of the SG whose mean direction is this long: coth λ - 1 / λ, between 0 and 1.

    Banerjee's approximation, mended by Newton's method.
    """
    known = np.asarray(length, np.float64)
    sharp = known * (3 - known**2) / (1 - known**2)
    for _ in range(6):
        steep = np.sinh(np.minimum(sharp, 300.0))
        slope = 1 / sharp**2 - 1 / steep**2
        sharp = sharp - (1 / np.tanh(sharp) - 1 / sharp - known) / slope
    return sharp
