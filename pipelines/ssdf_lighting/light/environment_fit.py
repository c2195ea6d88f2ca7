"""A map of radiance as a sum of a few spherical Gaussians.

Suns are taken out first, each a Gaussian of its own with its flux, place and width (:mod:`.suns`):
their shadows have edges, and a blurred map has not.

The rest: least squares of radiance would see windows and nothing else. So the map is blurred, by
an SG of sharpness 100: a lamp keeps its flux and loses its edge. Differences are weighed by
1 / sqrt(radiance + mean), blurred too. An SG blurred by an SG is one again, nearly: 1 / λ add up.
What comes out sharper than it may be is made as wide as it must, and keeps its flux.

Lights are placed one by one where they help most (matching pursuit) and refined together after
each, by Levenberg and Marquardt's method. At last their amplitudes follow from nonnegative least
squares of what counts, the irradiance behind random occluders (:mod:`.fit_quality`), with the
map's flux given.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from pipelines.drawing.colour import luminance
from pipelines.light.environment_maps import check_environment, solid_angles, texel_directions
from pipelines.ssdf_lighting.light.fit_quality import (
    HEIGHT,
    FitErrors,
    fit_errors,
    occluded_cosines,
)
from pipelines.ssdf_lighting.light.sphere_maps import blurred, downsampled, fluxes
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, integral
from pipelines.ssdf_lighting.light.suns import split_suns

FloatArray = NDArray[np.float64]

MOST_LIGHTS = 24
LEAST_SHARPNESS = 0.5
MOST_SHARPNESS = 1000.0
"""Of the lights by default: a standard deviation of 1.8 degrees."""

_LIGHTS_A_SUN = 3  # at least: the rest has its share
_BLUR = 100.0  # a standard deviation of 5.7 degrees, two texels
_PLACES = 400  # that a new light is tried at
_SHARPNESSES = 7  # that it is tried with
_STEPS = 5  # of refinement after each light
_LAST_STEPS = 60
_ENOUGH = 1e-6  # relative gain of a step below which there are no more
_FLUX_WEIGHT = 1e3
_TINY = 1e-300


class Fit(NamedTuple):
    """Lights for a map, the suns last, and how far they are from it."""

    lights: Lights
    errors: FitErrors


class _Target(NamedTuple):
    """What is fitted: directions (P, 3), their solid angles (P,), blurred radiance (P, 3), weights
    (P,) of differences."""

    ways: FloatArray
    omega: FloatArray
    soft: FloatArray
    weights: FloatArray


class _Blobs(NamedTuple):
    """Blurred lights: axes (N, 3), log of the sharpness (N,), square roots of amplitudes (N, 3)."""

    axes: FloatArray
    rates: FloatArray
    roots: FloatArray


def fit_lights(
    radiance: NDArray[np.floating],
    count: int,
    *,
    seed: int = 0,
    least_sharpness: float = LEAST_SHARPNESS,
    most_sharpness: float = MOST_SHARPNESS,
    progress: Callable[[float], None] = lambda fraction: None,
) -> Fit:
    """Fit ``count`` SGs to a map (H, 2 H, 3) of radiance; the same for the same seed.

    The flux of the lights, the integral of radiance over the sphere, is the map's in each channel.
    Some lights may be black where fewer do as well.

    seed: turns the places at which lights are tried.
    least_sharpness, most_sharpness: of each light, 0 < least < most.
    progress: called with the fraction done in (0, 1], rising.

    Raises ValueError for a map that ``check_environment`` refuses, a count outside 1 to 24 and
    bounds out of order.
    """
    check_environment(radiance)
    if not 1 <= count <= MOST_LIGHTS:
        raise ValueError(f"count is {count}; expected 1 to {MOST_LIGHTS} lights.")
    if not 0.0 < least_sharpness < most_sharpness < math.inf:
        raise ValueError(
            f"sharpness is {least_sharpness:g} to {most_sharpness:g}; expected a finite range "
            "above 0."
        )
    suns, rest = split_suns(radiance, count // _LIGHTS_A_SUN)
    map_ = downsampled(rest, HEIGHT)
    level = float(fluxes(map_).mean()) / (4.0 * math.pi)
    count -= len(suns.sharpness)
    if level > 0:
        blur = 1.0 / (1.0 / _BLUR + 1.0 / most_sharpness)
        target = _target(map_ / level, blur)
        # A light may become a point here. Kept from it, a lamp that is one would be too wide, and
        # lights around it would be bent to make up for that.
        bounds = math.log(1.0 / (1.0 / least_sharpness + 1.0 / blur)), math.log(blur)
        blobs = _placed(target, count, bounds, np.random.default_rng(seed), progress)
        blobs = _refined(target, blobs, bounds, _LAST_STEPS)
        variance = np.exp(-blobs.rates) - 1.0 / blur
        sharpness = np.clip(1.0 / np.maximum(variance, _TINY), least_sharpness, most_sharpness)
        amplitudes = _with_flux(target, blobs, integral(sharpness), fluxes(map_) / level)
        soft = Lights(blobs.axes, sharpness, amplitudes * level)
        suns = Lights(*(np.concatenate(both) for both in zip(soft, suns, strict=True)))
    progress(1.0)
    return Fit(suns, fit_errors(suns, radiance))


# ---- the map ---------------------------------------------------------------------------------


def _target(map_: FloatArray, blur: float) -> _Target:
    height = len(map_)
    soft = blurred(map_, blur).reshape(-1, 3)
    omega = np.repeat(solid_angles(height), 2 * height)
    bright = luminance(soft)
    mean = float(omega @ bright) / (4.0 * math.pi)
    return _Target(
        texel_directions(height).reshape(-1, 3), omega, soft, np.sqrt(omega / (bright + mean))
    )


# ---- placing ---------------------------------------------------------------------------------


def _placed(
    target: _Target,
    count: int,
    bounds: tuple[float, float],
    rng: np.random.Generator,
    progress: Callable[[float], None],
) -> _Blobs:
    """One light after the other, each where it takes most of what is left, all refined then."""
    places = _spiral(_PLACES) @ Rotation.random(rng=rng).as_matrix().T
    rates = np.linspace(*bounds, _SHARPNESSES)
    less = target.ways @ places.T - 1.0
    # Single precision: only the largest gain is sought.
    book = np.concatenate(
        [np.exp(np.exp(rate) * less).astype(np.float32) for rate in rates], axis=1
    )
    squared = target.weights**2
    norms = squared.astype(np.float32) @ book**2
    blobs = _Blobs(np.empty((0, 3)), np.empty(0), np.empty((0, 3)))
    left = target.soft
    for number in range(count):
        fitting = (squared[:, None] * left).T.astype(np.float32) @ book
        best = int(np.argmax((np.maximum(fitting, 0.0) ** 2).sum(axis=0) / norms))
        axes = np.concatenate([blobs.axes, places[None, best % _PLACES]])
        every = np.append(blobs.rates, rates[best // _PLACES])
        values = _values(target.ways, axes, every)
        roots = np.sqrt(_nonnegative(values * target.weights[:, None], _weighted(target)))
        blobs = _refined(target, _Blobs(axes, every, roots), bounds, _STEPS)
        left = target.soft - _values(target.ways, blobs.axes, blobs.rates) @ blobs.roots**2
        progress((number + 1) / (count + 1))
    return blobs


def _spiral(count: int) -> FloatArray:
    """Unit vectors (count, 3), even over the sphere: Fibonacci's spiral."""
    number = np.arange(count) + 0.5
    z = 1.0 - 2.0 * number / count
    azimuth = number * (math.pi * (3.0 - math.sqrt(5.0)))
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=1)


def _values(ways: FloatArray, axes: FloatArray, rates: FloatArray) -> FloatArray:
    """SGs of amplitude 1: (P, N)."""
    return np.exp(np.exp(rates) * (ways @ axes.T - 1.0))


def _weighted(target: _Target) -> FloatArray:
    return target.soft * target.weights[:, None]


def _nonnegative(values: FloatArray, wanted: FloatArray) -> FloatArray:
    """Amplitudes (N, 3) >= 0 with values (P, N) times them nearest to what is wanted (P, 3)."""
    q, r = np.linalg.qr(values)
    return np.stack([nnls(r, column)[0] for column in (q.T @ wanted).T], axis=1)


def _with_flux(
    target: _Target, blobs: _Blobs, integrals: FloatArray, fluxes: FloatArray
) -> FloatArray:
    """Amplitudes (N, 3) of the lights before the blur, which have these integrals."""
    # A blurred light has the flux of the light.
    shares = integrals / integral(np.exp(blobs.rates))
    behind = occluded_cosines(target.ways) * target.omega
    values = behind @ _values(target.ways, blobs.axes, blobs.rates) * shares
    heavy = _FLUX_WEIGHT * np.linalg.norm(values) / np.linalg.norm(integrals)
    amplitudes = _nonnegative(
        np.concatenate([values, heavy * integrals[None]]),
        np.concatenate([behind @ target.soft, heavy * fluxes[None]]),
    )
    return amplitudes * (fluxes / np.maximum(integrals @ amplitudes, _TINY))


# ---- refining --------------------------------------------------------------------------------


def _refined(target: _Target, blobs: _Blobs, bounds: tuple[float, float], steps: int) -> _Blobs:
    """Levenberg and Marquardt's method for axes, sharpnesses and amplitudes of all lights."""
    count = len(blobs.axes)
    # A root of exactly 0 has no slope, and would stay.
    least = 1e-3 * max(float(blobs.roots.max()), _TINY)
    blobs = blobs._replace(roots=np.maximum(blobs.roots, least))
    damping, cost = 1e-2, _cost(target, blobs)
    for _ in range(steps):
        one, other = _across(blobs.axes)
        matrix, slope = _normal_equations(target, blobs, one, other)
        shrinking = slope[2 * count : 3 * count]
        free = np.ones(6 * count, bool)
        free[2 * count : 3 * count] = ~(
            ((blobs.rates <= bounds[0]) & (shrinking > 0))
            | ((blobs.rates >= bounds[1]) & (shrinking < 0))
        )
        diagonal = matrix.diagonal()
        before = cost
        while damping < 1e6:
            damped = matrix + np.diag(damping * (diagonal + 1e-9 * diagonal.max()))
            move = np.zeros(6 * count)
            move[free] = -np.linalg.solve(damped[np.ix_(free, free)], slope[free])
            moved = _moved(blobs, move.reshape(6, count), one, other, bounds)
            reached = _cost(target, moved)
            if reached < cost:
                blobs, cost = moved, reached
                break
            damping *= 4.0
        if before - cost <= _ENOUGH * before:
            break
        damping = max(damping / 5.0, 1e-9)
    return blobs


def _across(axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors (N, 3) each that stand on the axes and on each other."""
    upright = np.abs(axes[:, 2:]) < 0.9
    one = np.cross(axes, np.where(upright, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    return one, np.cross(axes, one)


def _moved(
    blobs: _Blobs,
    move: FloatArray,
    one: FloatArray,
    other: FloatArray,
    bounds: tuple[float, float],
) -> _Blobs:
    axes = blobs.axes + move[0, :, None] * one + move[1, :, None] * other
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    rates = np.clip(blobs.rates + np.clip(move[2], -1.0, 1.0), *bounds)
    return _Blobs(axes, rates, blobs.roots + move[3:].T)


def _cost(target: _Target, blobs: _Blobs) -> float:
    values = _values(target.ways, blobs.axes, blobs.rates) @ blobs.roots**2
    return float((((values - target.soft) * target.weights[:, None]) ** 2).sum())


def _normal_equations(
    target: _Target, blobs: _Blobs, one: FloatArray, other: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """J^T J (6 N, 6 N) and J^T r (6 N,) of the weighted differences r.

    The unknowns are the axes' moves along ``one`` and ``other``, the logs of the sharpnesses, and
    the roots of red, green and blue; N of each. Channels differ in amplitudes only, so J^T J comes
    from the products of four functions a light.
    """
    count = len(blobs.axes)
    less = target.ways @ blobs.axes.T - 1.0
    sharpness = np.exp(blobs.rates)
    values = np.exp(sharpness * less) * target.weights[:, None]
    steep = values * sharpness
    functions = np.concatenate(
        [steep * (target.ways @ one.T), steep * (target.ways @ other.T), steep * less, values],
        axis=1,
    )
    products = functions.T @ functions
    onto = functions.T @ (values @ blobs.roots**2 - _weighted(target))
    matrix, slope = np.zeros((6 * count, 6 * count)), np.zeros(6 * count)
    for channel in range(3):
        roots = blobs.roots[:, channel]
        factors = np.concatenate([np.tile(roots**2, 3), 2.0 * roots])
        mine = np.r_[: 3 * count, (3 + channel) * count : (4 + channel) * count]
        matrix[np.ix_(mine, mine)] += factors[:, None] * products * factors
        slope[mine] += factors * onto[:, channel]
    return matrix, slope
