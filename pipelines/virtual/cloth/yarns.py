"""Yarns: tubes swept along curves, with fibres that wind about them; all periodic in the tile.

A yarn is a curve of S points that goes on after the last one, moved by ``period`` (a row that
crosses the tile), or a short end with a tip (a tuft of pile, ``period`` None). About each point
stands a ring of A corners, so that all yarns of one kind are arrays (Y, S, A, …). The surface
is really displaced - twisted plies, bundles of fibres - and its normals are those of the displaced
surface, so that shading, shadows and silhouettes agree.

One unit is the side of the tile [0, 1] x [0, 1]; z points to the camera.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class Tubes(NamedTuple):
    """Surfaces of Y yarns: R rings (S, and the first one again if periodic) of A corners.

    positions: (Y, R, A, 3). normals: (Y, R, A, 3) unit vectors out of the yarn.
    fibres: (Y, R, A, 3) unit vectors along the fibres at the surface.
    """

    positions: FloatArray
    normals: FloatArray
    fibres: FloatArray

    def triangles(self) -> NDArray[np.int32]:
        """Rows (F, 3) of the flattened vertices; counter-clockwise seen from outside."""
        yarns, rings, corners = self.positions.shape[:3]
        here = np.arange(corners)
        ring = corners * np.arange(rings - 1)[:, None]
        a, b = ring + here, ring + (here + 1) % corners
        one = np.stack([a, b, a + corners, b, b + corners, a + corners], axis=-1).reshape(-1, 3)
        first = rings * corners * np.arange(yarns)[:, None, None]
        return (first + one).reshape(-1, 3).astype(np.int32)


def sweep(
    centres: FloatArray,
    radii: FloatArray,
    *,
    period: tuple[float, float, float] | None,
    up: tuple[float, float, float] = (0.0, 0.0, 1.0),
    flatness: float = 1.0,
    turns: float = 0.0,
) -> Tubes:
    """Sweep tubes along curves.

    centres: (Y, S, 3). radii: (Y, S, A) distance of the surface from the curve, by ring and angle;
        angle 0 is to the left, a quarter turn towards ``up``.
    period: where each curve goes on after its last point, from its first; None: it ends there.
    up: any direction that no curve runs along; it turns the rings.
    flatness: height over width of the cross-section.
    turns: of the fibres about the yarn over one period, positive with growing angle.
    """
    steps, corners = radii.shape[1:]
    along = _difference(centres, period)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    left = np.cross(up, along)
    left /= np.linalg.norm(left, axis=-1, keepdims=True)
    top = np.cross(along, left)
    angle = 2 * np.pi * np.arange(corners) / corners
    wide, high = np.cos(angle)[:, None], flatness * np.sin(angle)[:, None]
    spokes = left[:, :, None] * wide + top[:, :, None] * high
    positions = centres[:, :, None] + radii[..., None] * spokes
    down = _difference(positions, period)
    around = np.roll(positions, -1, axis=2) - np.roll(positions, 1, axis=2)
    normals = np.cross(around, down)
    # Per step, ``down`` is two of S steps and ``around`` two of A corners.
    fibres = down + (turns * corners / steps) * around
    parts = [positions, normalize(normals), normalize(fibres)]
    if period is not None:
        parts = [np.concatenate([p, p[:, :1]], axis=1) for p in parts]
        parts[0][:, -1] += period
    return Tubes(*parts)


def _difference(points: FloatArray, period: tuple[float, float, float] | None) -> FloatArray:
    """Central differences (over two steps) along axis 1."""
    if period is None:
        return 2 * np.gradient(points, axis=1)
    after, before = np.roll(points, -1, axis=1), np.roll(points, 1, axis=1)
    after[:, -1] += period
    before[:, 0] -= period
    return after - before


def normalize(vectors: FloatArray) -> FloatArray:
    """Vectors (..., 3) at length 1; zero stays zero."""
    scaled: FloatArray = vectors / np.maximum(
        np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12
    )
    return scaled


def smooth_noise(
    rng: np.random.Generator, shape: tuple[int, ...], scales: tuple[float, ...]
) -> FloatArray:
    """Gaussian noise of mean 0 and variance 1, periodic in every axis with a scale.

    shape: of the result. scales: one an axis: standard deviation, in samples, of the Gaussian that
        smooths the noise along it; 0 leaves it white. Axes before the last len(scales) are
        independent.
    """
    noise = rng.standard_normal(shape)
    axes = tuple(range(len(shape) - len(scales), len(shape)))
    spectrum = np.fft.fftn(noise, axes=axes)
    power = 1.0
    for axis, scale in zip(axes, scales, strict=True):
        frequency = np.fft.fftfreq(shape[axis])
        response = np.exp(-2 * (np.pi * scale * frequency) ** 2)
        power *= float((response**2).mean())
        spectrum *= response.reshape([-1 if a == axis else 1 for a in range(len(shape))])
    smooth: FloatArray = np.fft.ifftn(spectrum, axes=axes).real / math.sqrt(power)
    return smooth


def wind_pattern(pattern: FloatArray, turns: int) -> FloatArray:
    """Wind a pattern (Y, S, A) about its yarns by whole turns over the S steps of the period."""
    steps, corners = pattern.shape[1:]
    place = (np.arange(corners) - turns * corners * np.arange(steps)[:, None] / steps) % corners
    low = np.floor(place).astype(np.int64)
    part = place - low
    rows = np.arange(steps)[:, None]
    wound: FloatArray = (1 - part) * pattern[:, rows, low % corners]
    return wound + part * pattern[:, rows, (low + 1) % corners]


def ply_outline(plies: int, corners: int, roundness: float = 0.55) -> FloatArray:
    """Radius (A,) of a bundle of round plies, at most 1: 1 at the middle of each ply.

    roundness: radius of a ply; 1 is a single round yarn, smaller values have deeper furrows.
    """
    if plies == 1:
        return np.ones(corners)
    sector = 2 * np.pi / plies
    angle = (2 * np.pi * np.arange(corners) / corners + sector / 2) % sector - sector / 2
    centre = 1 - roundness
    inside = np.maximum(roundness**2 - (centre * np.sin(angle)) ** 2, 0.0)
    return centre * np.cos(angle) + np.sqrt(inside)
