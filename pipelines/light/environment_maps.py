"""Light from far away as equirectangular maps of radiance: checks, texels, turning.

A map is linear radiance (H, W, 3) float32, W = 2 H, z up, as seen from inside (not mirrored),
which is also what ``pipelines.drawing.stage`` draws. Row 0 touches the zenith, row H - 1 the
nadir, all rows are equally high in angle. Azimuth 0 (+x) is in the middle of the picture,
azimuth 90 (+y) a quarter of the width from the left edge: azimuth falls with the column.

Radiance is constant in each texel. So the density by which `environment_sampling` draws directions
is exactly proportional to what `environment_lookup` finds, to the last bit.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Radiance = NDArray[np.float32]
FloatArray = NDArray[np.float64]


def check_environment(radiance: NDArray[np.floating]) -> None:
    """Make sure that an array is a map of radiance.

    Raises ValueError for another shape than (H, 2 H, 3), for values that are no floats, NaN,
    infinite or negative, and for a map that is all black.
    """
    if radiance.ndim != 3 or radiance.shape != (len(radiance), 2 * len(radiance), 3):
        raise ValueError(f"environment: found shape {radiance.shape}, expected (H, 2 H, 3).")
    if radiance.size == 0:
        raise ValueError(f"environment: found shape {radiance.shape}, expected at least one row.")
    if radiance.dtype.kind != "f":
        raise ValueError(f"environment: found {radiance.dtype}, expected floats of radiance.")
    wrong = ~((radiance >= 0) & (radiance < np.inf))
    if wrong.any():
        row, column, channel = (int(index[0]) for index in np.nonzero(wrong))
        raise ValueError(
            f"environment: found {radiance[row, column, channel]} at column {column}, row {row}, "
            "expected finite radiance of 0 and more."
        )
    if not radiance.any():
        raise ValueError("environment: found nothing but black, expected some light.")


# ---- texels ----------------------------------------------------------------------------------


def texel_directions(height: int) -> FloatArray:
    """Unit vectors (H, W, 3) to the centres of the texels. Raises ValueError for height < 1.

    >>> directions = texel_directions(4)
    >>> directions.shape, bool(directions[0, 0, 2] > 0.9)
    ((4, 8, 3), True)
    """
    check_height(height)
    theta = (np.arange(height) + 0.5) * (math.pi / height)
    azimuth = math.pi - (np.arange(2 * height) + 0.5) * (math.pi / height)
    directions = np.empty((height, 2 * height, 3))
    directions[..., 0] = np.outer(np.sin(theta), np.cos(azimuth))
    directions[..., 1] = np.outer(np.sin(theta), np.sin(azimuth))
    directions[..., 2] = np.cos(theta)[:, None]
    return directions


def solid_angles(height: int) -> FloatArray:
    """Steradians (H,) of one texel in each row; exact. Raises ValueError for height < 1."""
    check_height(height)
    middle = (np.arange(height) + 0.5) * (math.pi / height)
    # cos a - cos b as a product, which does not cancel near the poles.
    heights = 2.0 * np.sin(middle) * math.sin(math.pi / (2 * height))
    return heights * (math.pi / height)


def mean_radiance(radiance: NDArray[np.floating]) -> FloatArray:
    """Mean over all directions (3,) of a map (H, 2 H, 3).

    >>> mean_radiance(np.full((4, 8, 3), 2.0, np.float32)).round(12).tolist()
    [2.0, 2.0, 2.0]
    """
    rows = radiance.mean(axis=1, dtype=np.float64)
    share = solid_angles(len(radiance)) * radiance.shape[1] / (4.0 * math.pi)
    return np.asarray(share @ rows)


def check_height(height: int) -> None:
    """Raise ValueError unless a map may have that many rows."""
    if height < 1:
        raise ValueError(f"height is {height}; expected 1 or more.")


# ---- turning ---------------------------------------------------------------------------------


def rotate_environment(radiance: Radiance, degrees: float) -> Radiance:
    """Turn a map about z, counter-clockwise seen from above: (H, W, 3) float32.

    A light at azimuth a is at a + degrees afterwards. By part of a texel, neighbouring columns are
    mixed, which keeps each row's mean. Raises ValueError for a map that ``check_environment``
    refuses and for degrees that are not finite.
    """
    check_environment(radiance)
    if not math.isfinite(degrees):
        raise ValueError(f"degrees is {degrees}; expected a finite angle.")
    width = radiance.shape[1]
    shift = (degrees % 360.0) * width / 360.0
    whole = math.floor(shift)
    part = np.float32(shift - whole)
    near = np.roll(radiance, -whole, axis=1)
    if part == 0:
        return near.astype(np.float32)
    far = np.roll(radiance, -whole - 1, axis=1)
    return ((1 - part) * near + part * far).astype(np.float32)
