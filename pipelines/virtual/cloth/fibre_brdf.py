"""The reflectance of a yarn's surface: many fibres that lie side by side.

A spot of yarn is a flat bundle of parallel fibres. Each is a smooth cylinder, so that the
microscopic normals spread widely across the fibres and little along them: an anisotropic
microfacet lobe, narrow along the fibre direction t, wide across it, makes the band of gloss that
silk shows. Light that enters the fibres comes out coloured and without a direction: a diffuse
lobe, with what the gloss has not taken.

    f = F(i.h) D(h) G(i, o) / (4 cos_i cos_o)  +  albedo / pi  T(cos_i) T(cos_o) / T_mean

    D   anisotropic GGX, roughness (along, across)
    G   height-correlated Smith masking and shadowing, 1 / (1 + Lambda(i) + Lambda(o))
        (Heitz, "Understanding the masking-shadowing function in microfacet-based BRDFs",
        JCGT 3(2), 2014, Eq. 85, 86 and 99)
    F   Schlick's Fresnel term from F0 (RGB, ``specular``) at normal incidence to
        F90 = min(1, 50 F0) at grazing (Lagarde and de Rousiers, "Moving Frostbite to PBR",
        SIGGRAPH 2014 course), so that F0 = 0 has no gloss at all: the diffuse lobe alone,
        which is then exactly Lambert's
    T   1 - F0 - (F90 - F0) (1 - c/2)^5, the share of light that is left for the diffuse lobe
        (Ashikhmin and Shirley, "An anisotropic Phong BRDF model", JGT 5(2), 2000, Eq. 5, whose
        lobe this is for F90 = 1); T_mean is its cosine-weighted mean, so that the lobe's
        directional albedo is albedo * T(cos_o)

The function is symmetric in its two directions and reflects at most what comes in, whatever
the parameters (tested). F0 of a single dielectric surface is some 0.05; above that it stands for
the light that passes a fibre and leaves it on the far side as if mirrored, too.

Directions are in the local frame: x along the fibre, y across it, z the normal. The kernels here
are compiled into the renderer's; `fibre_brdf` is the same for arrays.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

F90_PER_F0 = 50.0
_HALF_FIFTH_MEAN = 5.0 / 28.0  # cosine-weighted mean of (1 - c/2)^5 over the hemisphere


@njit(cache=True, nogil=True, error_model="numpy")
def grazing_fresnel(f0: float) -> float:
    """F90 of Schlick's Fresnel term: how a surface of this F0 mirrors at grazing incidence."""
    return min(1.0, F90_PER_F0 * f0)


@njit(cache=True, nogil=True, error_model="numpy")
def microfacet_lobe(
    ix: float, iy: float, iz: float, ox: float, oy: float, oz: float, along: float, across: float
) -> tuple[float, float]:
    """Evaluate D G / (4 cos_i cos_o), and Schlick's (1 - i.h)^5, for unit vectors above."""
    hx, hy, hz = ix + ox, iy + oy, iz + oz
    scale = 1.0 / math.sqrt(hx * hx + hy * hy + hz * hz)
    hx, hy, hz = hx * scale, hy * scale, hz * scale
    slope = (hx / along) ** 2 + (hy / across) ** 2 + hz * hz
    # With cos (1 + 2 Lambda) = sqrt(cos^2 + ...) no cosine stands in a denominator:
    # G / (4 cos_i cos_o) = 1 / (2 (cos_o root_i + cos_i root_o)).
    root_i = math.sqrt(iz * iz + (along * ix) ** 2 + (across * iy) ** 2)
    root_o = math.sqrt(oz * oz + (along * ox) ** 2 + (across * oy) ** 2)
    density = 1.0 / (math.pi * along * across * slope * slope)
    lobe = density / (2.0 * (oz * root_i + iz * root_o))
    grazing = max(0.0, 1.0 - (ix * hx + iy * hy + iz * hz))
    square = grazing * grazing
    return lobe, square * square * grazing


@njit(cache=True, nogil=True, error_model="numpy")
def diffuse_falloff(cosine: float) -> float:
    """Evaluate (1 - c/2)^5 of Ashikhmin and Shirley's diffuse lobe."""
    base = 1.0 - 0.5 * cosine
    square = base * base
    return square * square * base


@njit(cache=True, nogil=True, error_model="numpy")
def transmitted(f0: float, falloff: float) -> float:
    """T: what is left for the diffuse lobe; ``falloff`` is `diffuse_falloff` of the cosine."""
    return 1.0 - f0 - (grazing_fresnel(f0) - f0) * falloff


@njit(cache=True, nogil=True, error_model="numpy")
def mean_transmitted(f0: float) -> float:
    """T_mean: the cosine-weighted mean of T over the hemisphere."""
    return transmitted(f0, _HALF_FIFTH_MEAN)


@njit(cache=True, nogil=True, error_model="numpy")
def _reflectance(
    light: np.ndarray,
    view: np.ndarray,
    albedo: np.ndarray,
    specular: np.ndarray,
    roughness: np.ndarray,
    out: np.ndarray,
) -> None:
    for k in range(len(light)):
        iz, oz = light[k, 2], view[k, 2]
        if iz <= 0.0 or oz <= 0.0:
            out[k] = 0.0
            continue
        lobe, schlick = microfacet_lobe(
            light[k, 0], light[k, 1], iz, view[k, 0], view[k, 1], oz,
            roughness[k, 0], roughness[k, 1],
        )  # fmt: skip
        for c in range(3):
            f0 = specular[k, c]
            fresnel = f0 + (grazing_fresnel(f0) - f0) * schlick
            through = transmitted(f0, diffuse_falloff(iz)) * transmitted(f0, diffuse_falloff(oz))
            diffuse = albedo[k, c] / math.pi * through / mean_transmitted(f0)
            out[k, c] = fresnel * lobe + diffuse


def fibre_brdf(
    light: ArrayLike,
    view: ArrayLike,
    *,
    albedo: ArrayLike,
    specular: ArrayLike,
    roughness: ArrayLike,
) -> NDArray[np.float64]:
    """Evaluate the BRDF (..., 3) in 1/sr.

    light, view: (..., 3) unit vectors in the frame of fibre, across, normal; the result is 0 where
        one of them is below the surface.
    albedo: (..., 3) of the diffuse lobe, 0 to 1. specular: (..., 3) F0, 0 to 1, below 1.
    roughness: (..., 2) GGX alpha along and across the fibre, above 0 and at most 1.
    The arguments broadcast. Raises ValueError for parameters out of range.
    Source: module docstring.
    """
    parts = [np.asarray(a, np.float64) for a in (light, view, albedo, specular, roughness)]
    for name, value, fine in (
        ("albedo", parts[2], (parts[2] >= 0) & (parts[2] <= 1)),
        ("specular", parts[3], (parts[3] >= 0) & (parts[3] < 1)),
        ("roughness", parts[4], (parts[4] > 0) & (parts[4] <= 1)),
    ):
        if not fine.all():
            raise ValueError(f"{name}: out of range, found {value.min()} to {value.max()}")
    shape = np.broadcast_shapes(*(a.shape[:-1] for a in parts))
    flat = [np.broadcast_to(a, (*shape, a.shape[-1])).reshape(-1, a.shape[-1]) for a in parts]
    out = np.empty((len(flat[0]), 3))
    light, view, albedo, specular, roughness = (np.ascontiguousarray(a) for a in flat)
    _reflectance(light, view, albedo, specular, roughness, out)
    return out.reshape(*shape, 3)
