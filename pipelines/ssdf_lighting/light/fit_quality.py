"""How well lights stand for a map of radiance: in what is seen of them, in tone, behind occluders.

What a scene shows of an environment is its irradiance behind whatever hides part of it. So the
error that matters is that of the light that random occluders let through to random normals: of
straight edges, as the shading takes them for, a few degrees soft. Least squares of it is least
squares over all pairs of normal and edge at once.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance
from pipelines.light.environment_maps import solid_angles, texel_directions
from pipelines.ssdf_lighting.light.sphere_maps import downsampled, fluxes
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, evaluate, integral
from pipelines.ssdf_lighting.light.suns import split_suns

FloatArray = NDArray[np.float64]

HEIGHT = 64
"""Rows of the maps that are compared."""
_NORMALS = 16  # rows of the map of irradiance
_OCCLUDERS = 1024
_SOFT = 0.05  # of the occluders' edges, radians
_SHARPEST = 600.0  # that texels of a map of 64 rows can show
_MOST_SUNS = 16
_TINY = 1e-300


class FitErrors(NamedTuple):
    """Relative RMS errors of lights against a map, averaged down to 64 x 128 texels.

    error: of radiance. With a sun it says how well the sun's disc is drawn, and nothing else.
    tone_error: of log(1 + radiance / mean luminance), which sees the dome too.
    irradiance_error: of the irradiance over all normals, unshadowed.
    shadowed_error: of the irradiance behind random occluders.
    """

    error: float
    tone_error: float
    irradiance_error: float
    shadowed_error: float


def fit_errors(lights: Lights, radiance: NDArray[np.floating]) -> FitErrors:
    """The errors of lights against a map (H, 2 H, 3).

    Suns, the map's as well as the lights', stay where they are, but are as wide as texels.
    """
    suns, rest = split_suns(radiance, _MOST_SUNS)
    ways, omega = (
        texel_directions(HEIGHT).reshape(-1, 3),
        np.repeat(solid_angles(HEIGHT), 2 * HEIGHT),
    )
    true = downsampled(rest, HEIGHT).reshape(-1, 3) + evaluate(_widened(suns), ways)
    found = evaluate(_widened(lights), ways)
    mean = float(omega @ luminance(true)) / (4.0 * math.pi)
    normals = texel_directions(_NORMALS).reshape(-1, 3)
    falling = np.maximum(normals @ ways.T, 0.0) * omega
    of_normals = np.repeat(solid_angles(_NORMALS), 2 * _NORMALS)
    behind = occluded_cosines(ways) * omega
    return FitErrors(
        _relative(found, true, omega),
        _relative(np.log1p(found / mean), np.log1p(true / mean), omega),
        _relative(falling @ found, falling @ true, of_normals),
        _relative(behind @ found, behind @ true, np.ones(len(behind))),
    )


def occluded_cosines(ways: FloatArray) -> FloatArray:
    """(K, P): how much K surfaces, each behind an edge of its own, see of light from ways (P, 3).

    Normals and edges are uniformly random, the same in each call: the cosine above the horizon,
    times a step of a few degrees across a great circle.
    """
    random = np.random.default_rng(0)
    normals, edges = random.normal(size=(2, _OCCLUDERS, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    step = 0.5 + 0.5 * np.tanh((edges @ ways.T) / _SOFT)
    seen: FloatArray = np.maximum(normals @ ways.T, 0.0) * step
    return seen


def flux_error(lights: Lights, radiance: NDArray[np.floating]) -> float:
    """Largest relative error, over the channels, of the integral of the lights' radiance."""
    wanted = fluxes(radiance.astype(np.float64))
    found = integral(lights.sharpness) @ lights.amplitudes
    return float((np.abs(found - wanted) / np.maximum(wanted, _TINY)).max())


def _widened(lights: Lights) -> Lights:
    wide = np.minimum(lights.sharpness, _SHARPEST)
    kept = integral(lights.sharpness) / integral(wide)
    return Lights(lights.axes, wide, lights.amplitudes * kept[:, None])


def _relative(found: FloatArray, true: FloatArray, weights: FloatArray) -> float:
    return math.sqrt(float((weights @ (found - true) ** 2).sum() / (weights @ true**2).sum()))
