"""Whether a BSDF's `sample`, `eval` and `pdf` are of one piece, by integration and statistics."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

ROWS, COLUMNS = 20, 16
"""Bins of the sphere: of cos(theta), of phi."""
_POINTS = 8
_LEAST_EXPECTED = 8.0


def mitsuba() -> Any:
    """Mitsuba in its scalar variant."""
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    return mitsuba


def interaction(view: NDArray[np.floating], uv: Any = (0.5, 0.5), place: Any = (0, 0, 0)) -> Any:
    """A point of a plane z = 0, u along x, seen from a direction."""
    mi = mitsuba()
    si = mi.SurfaceInteraction3f()
    si.p, si.n, si.uv = mi.Point3f(*place), mi.Normal3f(0, 0, 1), mi.Point2f(*uv)
    si.sh_frame = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1])
    si.wi = mi.Vector3f(*np.asarray(view, float).tolist())
    return si


class Quadrature(NamedTuple):
    """Integrals over each bin of the sphere: of the density (bin,), of eval (bin, 3)."""

    density: NDArray[np.float64]
    value: NDArray[np.float64]


def integrate(bsdf: Any, si: Any) -> Quadrature:
    """`pdf` and `eval` over the sphere, by 8 x 8 points a bin."""
    mi = mitsuba()
    context = mi.BSDFContext()
    rows, columns = ROWS * _POINTS, COLUMNS * _POINTS
    cosine = -1 + 2 * (np.arange(rows) + 0.5) / rows
    phi = -np.pi + 2 * np.pi * (np.arange(columns) + 0.5) / columns
    found = np.zeros((rows, columns, 4))
    for row, z in enumerate(cosine):
        sine = np.sqrt(1 - z * z)
        for column, angle in enumerate(phi):
            wo = mi.Vector3f(sine * np.cos(angle), sine * np.sin(angle), z)
            value, density = bsdf.eval_pdf(context, si, wo)
            found[row, column] = (*value, density)
    bins = found.reshape(ROWS, _POINTS, COLUMNS, _POINTS, 4).sum(axis=(1, 3)).reshape(-1, 4)
    bins *= 4 * np.pi / (rows * columns)
    return Quadrature(bins[:, 3], bins[:, :3])


class Drawn(NamedTuple):
    """What `sample` returned: directions (n, 3), weights (n, 3), densities (n,), whether the
    direction is the only one possible (n,), whether there was any (n,)."""

    directions: NDArray[np.float64]
    weights: NDArray[np.float64]
    densities: NDArray[np.float64]
    is_delta: NDArray[np.bool_]
    is_valid: NDArray[np.bool_]


def draw(bsdf: Any, si: Any, count: int, seed: int) -> Drawn:
    """``count`` samples."""
    mi = mitsuba()
    context, rows = mi.BSDFContext(), []
    for one, two, three in np.random.default_rng(seed).random((count, 3)).tolist():
        found, weight = bsdf.sample(context, si, one, mi.Point2f(two, three))
        is_delta = bool(found.sampled_type & int(mi.BSDFFlags.Delta))
        rows.append((*found.wo, *weight, found.pdf, is_delta, found.pdf > 0))
    array = np.array(rows, np.float64)
    return Drawn(array[:, :3], array[:, 3:6], array[:, 6], array[:, 7] > 0, array[:, 8] > 0)


def p_value(drawn: Drawn, density: NDArray[np.float64]) -> float:
    """Pearson's chi-square of scattered directions against the density's integrals (bin,)."""
    scattered = drawn.is_valid & ~drawn.is_delta
    x, y, z = drawn.directions[scattered].T
    row = np.minimum(((z + 1) / 2 * ROWS).astype(int), ROWS - 1)
    turn = (np.arctan2(y, x) + np.pi) / (2 * np.pi)
    column = np.minimum((turn * COLUMNS).astype(int), COLUMNS - 1)
    seen = np.bincount(row * COLUMNS + column, minlength=ROWS * COLUMNS).astype(float)
    expected = density * len(drawn.densities)
    # The last bin: directions that are the only ones possible, or none.
    seen = np.append(seen, len(scattered) - scattered.sum())
    expected = np.append(expected, len(scattered) - expected.sum())
    many = expected >= _LEAST_EXPECTED
    seen = np.append(seen[many], seen[~many].sum())
    expected = np.append(expected[many], max(expected[~many].sum(), 1e-9))
    if expected[-1] < _LEAST_EXPECTED:  # joined with its neighbour
        seen = np.append(seen[:-2], seen[-2:].sum())
        expected = np.append(expected[:-2], expected[-2:].sum())
    statistic = ((seen - expected) ** 2 / expected).sum()
    return float(chi2.sf(statistic, len(expected) - 1))
