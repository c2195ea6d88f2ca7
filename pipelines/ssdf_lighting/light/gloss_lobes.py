"""The gloss as a spherical Gaussian: for each view, the SG that its reflected light looks like.

Wang et al. (2009) warp the SG of the normal distribution to the mirror direction and take Fresnel's
and Smith's terms there. At grazing views the true lobe is neither there nor so bright: by 20 to
40 % of the light, for wide lights. As the matt part's (:mod:`.cosine_lobes`), this SG has the
albedo, the mean direction and the mean resultant length of the true lobe above the horizon.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.light.cosine_lobes import sharpness_of_resultant
from pipelines.ssdf_lighting.light.microfacets import LEAST_VIEW, Materials, fresnel, smith
from pipelines.ssdf_lighting.light.spherical_gaussians import integral

FloatArray = NDArray[np.float64]

COLUMNS = 65
"""Cosines from 0 to 1."""
_SLOPES, _AZIMUTHS = 64, 64


class GlossLobes(NamedTuple):
    """Of M materials (rows), at COLUMNS even cosines n·o from 0 to 1.

    sharpness: (M, COLUMNS) float64.
    along, up: (M, COLUMNS) float64; the axis is along r + up n, r the mirrored view.
    amplitude: (M, COLUMNS) float64, natural logarithm; of no meaning for materials without gloss.
    """

    sharpness: FloatArray
    along: FloatArray
    up: FloatArray
    amplitude: FloatArray


def gloss_lobes(materials: Materials) -> GlossLobes:
    """Tables for these materials.

    Integrals over the half vectors, in the measure of Beckmann's distribution itself: what is left
    is F G o·h / (n·o n·h), which is smooth.
    """
    cosine = np.maximum(np.linspace(0.0, 1.0, COLUMNS), LEAST_VIEW)
    # Just off the normal at the end: the two axes r and n have to span the plane.
    cosine = np.minimum(cosine, 1 - 1e-7)
    sine = np.sqrt(1 - cosine**2)
    nodes, weights = np.polynomial.legendre.leggauss(_SLOPES)
    parts = (1 + nodes) / 2
    azimuth = (np.arange(_AZIMUTHS) + 0.5) * (2 * math.pi / _AZIMUTHS)
    found = np.empty((4, len(materials.specular), COLUMNS))
    for row, (specular, roughness) in enumerate(
        zip(np.maximum(materials.specular, 1e-6), materials.roughness, strict=True)
    ):
        slope = roughness * np.sqrt(-np.log1p(-parts))[:, None]
        n_h = 1 / np.sqrt(1 + slope**2)
        x_h = slope * n_h * np.cos(azimuth)  # away from the viewer: r lies there
        o_h = cosine[:, None, None] * n_h - sine[:, None, None] * x_h
        n_i = 2 * o_h * n_h - cosine[:, None, None]
        x_i = 2 * o_h * x_h + sine[:, None, None]
        lit = (o_h > 0) & (n_i > 0)
        seen = smith(cosine, roughness)[:, None, None] / cosine[:, None, None]
        share = fresnel(o_h, specular) * smith(n_i, roughness) * seen * o_h / n_h
        share = np.where(lit, share, 0.0) * (weights / 2 / _AZIMUTHS)[:, None]
        albedo = share.sum(axis=(1, 2))
        x, z = (np.sum(share * part, axis=(1, 2)) for part in (x_i, n_i))
        length = np.hypot(x, z)
        sharpness = sharpness_of_resultant(length / albedo)
        along = x / length / sine
        found[0, row], found[1, row] = sharpness, along
        found[2, row] = z / length - along * cosine
        found[3, row] = np.log(albedo / integral(sharpness))
    return GlossLobes(*found)
