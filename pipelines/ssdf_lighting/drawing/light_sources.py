"""What lights a traced picture: spherical Gaussians, or the probe that they stand for.

Both draw directions towards the light and know the density with which they do: what
:mod:`.ray_tracing` needs for its estimate.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipelines.light.environment_lookup import radiance_from_directions
from pipelines.light.environment_sampling import (
    direction_pdfs,
    make_environment_sampler,
    sample_directions,
)
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, evaluate, integral

FloatArray = NDArray[np.float64]

_LEAST_FACING = 0.02


class LightSource(Protocol):
    """Light from far away."""

    def drawn(self, normals: FloatArray, u: FloatArray) -> FloatArray:
        """Unit vectors (S, 3) towards the light, for surfaces of these normals (S, 3), of numbers
        (S, 3) in [0, 1)."""

    def density(self, normals: FloatArray, ways: FloatArray) -> FloatArray:
        """Density (S,) per steradian with which ``drawn`` gives ways (S, 3)."""

    def radiance(self, ways: FloatArray) -> FloatArray:
        """Radiance (S, 3) from ways (S, 3)."""


class GaussianSource:
    """Spherical Gaussians: one of them is chosen by its flux and by how it faces the surface."""

    def __init__(self, lights: Lights) -> None:
        self._lights = lights
        self._whole = integral(lights.sharpness)

    def drawn(self, normals: FloatArray, u: FloatArray) -> FloatArray:
        """See ``LightSource``."""
        sums = np.cumsum(self._chances(normals), axis=1)
        chosen = np.minimum(np.sum(sums < u[:, 2:], axis=1), len(self._whole) - 1)
        sharp = self._lights.sharpness[chosen]
        cosine = 1 + np.log1p(u[:, 0] * np.expm1(-2 * sharp)) / sharp
        return about(self._lights.axes[chosen], cosine, 2 * math.pi * u[:, 1])

    def density(self, normals: FloatArray, ways: FloatArray) -> FloatArray:
        """See ``LightSource``."""
        lobes = np.exp(self._lights.sharpness * (ways @ self._lights.axes.T - 1))
        density: FloatArray = np.sum(self._chances(normals) / self._whole * lobes, axis=1)
        return density

    def radiance(self, ways: FloatArray) -> FloatArray:
        """See ``LightSource``."""
        return evaluate(self._lights, ways)

    def _chances(self, normals: FloatArray) -> FloatArray:
        # Lights that are below the horizon by their own width are hardly worth a sample.
        lights = self._lights
        width = np.minimum(1.5 / np.sqrt(lights.sharpness), 1.0)
        facing = np.maximum((normals @ lights.axes.T + width) / (1 + width), _LEAST_FACING)
        chances: FloatArray = facing * (lights.amplitudes.mean(axis=1) * self._whole + 1e-30)
        return chances / chances.sum(axis=1, keepdims=True)


class ProbeSource:
    """A map (H, 2 H, 3) of radiance itself. Raises ValueError as ``check_environment``."""

    def __init__(self, radiance: NDArray[np.floating]) -> None:
        self._sampler = make_environment_sampler(radiance)

    def drawn(self, normals: FloatArray, u: FloatArray) -> FloatArray:
        """See ``LightSource``."""
        return sample_directions(self._sampler, u[:, :2])[0]

    def density(self, normals: FloatArray, ways: FloatArray) -> FloatArray:
        """See ``LightSource``."""
        return direction_pdfs(self._sampler, ways)

    def radiance(self, ways: FloatArray) -> FloatArray:
        """See ``LightSource``."""
        return radiance_from_directions(self._sampler.radiance, ways).astype(np.float64)


def about(pole: FloatArray, cosine: FloatArray, azimuth: FloatArray) -> FloatArray:
    """Unit vectors (S, 3) at these angles to poles (S, 3); Duff et al. 2017's tangents."""
    x, y, z = pole.T
    sign = np.copysign(1.0, z)
    a = -1 / (sign + z)
    b = x * y * a
    one = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=1)
    other = np.stack([b, sign + y * y * a, -y], axis=1)
    sine = np.sqrt(np.maximum(1 - cosine**2, 0.0))
    along, across = sine * np.cos(azimuth), sine * np.sin(azimuth)
    return along[:, None] * one + across[:, None] * other + cosine[:, None] * pole
