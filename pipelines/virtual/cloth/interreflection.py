"""Light that goes on from yarn to yarn: irradiance at the vertices, and what they gather of it.

Surfaces reflect diffusely here, albedo times what enters the fibres (``T`` in ``fibre_brdf.py``, of
the mean of the channels), so that exchanging light and view leaves the result as it is.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from pipelines.virtual.cloth.fibre_brdf import diffuse_falloff, transmitted
from pipelines.virtual.cloth.shading import FloatArray, light_is_above


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def vertex_irradiance(
    normals: FloatArray,
    specular: FloatArray,
    lights: FloatArray,
    first: NDArray[np.int64],
    blocked: NDArray[np.bool_],
    out: FloatArray,
) -> None:
    """Fill out (V, L) with the light that enters the fibres: cos_i T(cos_i), 0 in shadow."""
    for v in prange(len(normals)):
        row = first[v]
        f0 = (specular[v, 0] + specular[v, 1] + specular[v, 2]) / 3
        for k in range(len(lights)):
            out[v, k] = 0.0
            if light_is_above(normals[v], normals[v], lights[k]):
                if not blocked[row]:
                    cosine = 0.0
                    for c in range(3):
                        cosine += normals[v, c] * lights[k, c]
                    out[v, k] = cosine * transmitted(f0, diffuse_falloff(cosine))
                row += 1


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def gather_interreflection(
    triangle: NDArray[np.int32],
    barycentric: FloatArray,
    triangles: NDArray[np.int32],
    albedo: FloatArray,
    irradiance: FloatArray,
    coloured: FloatArray,
    out: FloatArray,
) -> None:
    """Fill out (V, L, 3) with the mean of what the surfaces around each vertex send back.

    triangle: (V, K) hits of rays that are distributed as the cosine. barycentric: (V, K, 2) weights
    of the second and third corner. irradiance: (V, L) of direct light; coloured: (V, L, 3) of
    reflected light in addition, or (0, L, 3) for none.
    """
    rays = triangle.shape[1]
    for v in prange(len(triangle)):
        out[v] = 0.0
        for k in range(rays):
            if triangle[v, k] < 0:
                continue
            second, third = barycentric[v, k, 0], barycentric[v, k, 1]
            for corner in range(3):
                w = second if corner == 1 else third
                if corner == 0:
                    w = np.float32(1) - second - third
                u = triangles[triangle[v, k], corner]
                red = w * albedo[u, 0] / np.float32(rays)
                green = w * albedo[u, 1] / np.float32(rays)
                blue = w * albedo[u, 2] / np.float32(rays)
                for light in range(irradiance.shape[1]):
                    e = irradiance[u, light]
                    out[v, light, 0] += red * e
                    out[v, light, 1] += green * e
                    out[v, light, 2] += blue * e
                if len(coloured) > 0:
                    for light in range(irradiance.shape[1]):
                        out[v, light, 0] += red * coloured[u, light, 0]
                        out[v, light, 1] += green * coloured[u, light, 1]
                        out[v, light, 2] += blue * coloured[u, light, 2]
