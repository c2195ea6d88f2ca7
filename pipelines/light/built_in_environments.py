"""Environments that need no file: even light, a clear sky with a sun, a dim room with lamps."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance
from pipelines.light.environment_maps import (
    FloatArray,
    Radiance,
    check_height,
    solid_angles,
    texel_directions,
)

# ---- sky ----
_ALBEDO_OF_GROUND = 0.2
_SUN_PER_SKY = 5.0  # irradiance: the sun's at normal incidence, the dome's on the ground
_CORE_OF_SUN = 0.8  # of the sun's radius; from here its edge softens

# Preetham, Shirley and Smits 1999, appendix A.2. Rows A to E of the Perez function: slope in
# turbidity, constant; first of the luminance Y, then of the chromaticities x and y.
_PEREZ = np.array([
    [[0.1787, -1.4630], [-0.3554, 0.4275], [-0.0227, 5.3251], [0.1206, -2.5771], [-0.0670, 0.3703]],
    [[-0.0193, -0.2592], [-0.0665, 0.0008], [-0.0004, 0.2125], [-0.0641, -0.8989],
     [-0.0033, 0.0452]],
    [[-0.0167, -0.2608], [-0.0950, 0.0092], [-0.0079, 0.2102], [-0.0441, -1.6537],
     [-0.0109, 0.0529]],
])  # fmt: skip
# Chromaticities x and y of the zenith: rows T^2, T, 1; columns theta^3, theta^2, theta, 1.
_ZENITH = np.array([
    [[0.00166, -0.00375, 0.00209, 0.0], [-0.02903, 0.06377, -0.03202, 0.00394],
     [0.11693, -0.21196, 0.06052, 0.25886]],
    [[0.00275, -0.00610, 0.00317, 0.0], [-0.04214, 0.08970, -0.04153, 0.00516],
     [0.15346, -0.26756, 0.06670, 0.26688]],
])  # fmt: skip
_SRGB_OF_XYZ = np.array([
    [3.2404542, -1.5371385, -0.4985314],
    [-0.9692660, 1.8760108, 0.0415560],
    [0.0556434, -0.2040259, 1.0572252],
])  # fmt: skip
_WAVELENGTHS = np.array([0.610, 0.550, 0.465])  # micrometres; where sRGB's primaries peak

# ---- lamps ----
_ROOM = 0.02
_CORE_OF_LAMPS = 0.6
# Azimuth, elevation, radius in degrees; luminance at the core; colour, scaled to luminance 1.
_LAMPS = (
    (30.0, 55.0, 24.0, 3.6, (1.00, 0.93, 0.82)),
    (150.0, 38.0, 16.0, 4.5, (0.85, 0.94, 1.00)),
    (-40.0, 35.0, 13.0, 5.0, (1.00, 0.86, 0.68)),
    (-140.0, 65.0, 22.0, 1.6, (0.92, 0.97, 1.00)),
    (175.0, 0.0, 10.0, 3.0, (1.00, 0.90, 0.75)),
)

_STEPS_PER_RADIUS = 12  # of a disc; sub-samples of texels are no farther apart
_LEAST_STEPS = 4  # a side of a texel


def uniform(height: int, value: float = 1.0) -> Radiance:
    """The same radiance from everywhere: (H, W, 3) float32.

    Raises ValueError for height < 1 and for a value that is not finite and positive.
    """
    check_height(height)
    if not 0.0 < value < math.inf:
        raise ValueError(f"value is {value}; expected finite radiance above 0.")
    return np.full((height, 2 * height, 3), value, dtype=np.float32)


def sky(
    height: int,
    *,
    sun_azimuth: float,
    sun_elevation: float,
    sun_radius: float = 2.5,
    turbidity: float = 3.0,
) -> Radiance:
    """Clear sky with a sun over grey ground: (H, W, 3) float32.

    height: of the map in texels, even, so that the horizon lies between two rows.
    sun_azimuth, sun_elevation: of the sun's centre, degrees; elevation in (0, 90].
    sun_radius: degrees, in (0.1, 30]; the real sun's is 0.27. Its edge is soft from 0.8 of it on.
    turbidity: haze, in [2, 10]; 2 is very clear.

    The dome is the model of Preetham, Shirley and Smits ("A practical analytic model for
    daylight", 1999), negative components of sRGB cut off, scaled such that its mean radiance,
    sun apart, has luminance 1. The sun's irradiance at normal incidence has 5 times the luminance
    of the dome's on the ground, whatever its radius and elevation: its radiance follows from its
    size. Its colour is what air and haze (their Rayleigh and Angstrom terms) leave of white. Its
    texels hold their mean over the disc, so its power does not depend on the height of the map;
    what is below the horizon is hidden. The ground reflects 0.2 of the light that dome and sun
    send down, evenly.

    Raises ValueError for a height that is odd or below 8 and for other parameters out of range.

    >>> from pipelines.light.environment_maps import texel_directions
    >>> radiance = sky(64, sun_azimuth=45.0, sun_elevation=30.0)
    >>> radiance.shape
    (64, 128, 3)
    >>> sun = radiance.sum(axis=-1).argmax()
    >>> texel_directions(64).reshape(-1, 3)[sun].round(1).tolist()
    [0.6, 0.6, 0.5]
    """
    if height < 8 or height % 2:
        raise ValueError(f"height is {height}; expected an even number of 8 or more.")
    if not math.isfinite(sun_azimuth):
        raise ValueError(f"sun_azimuth is {sun_azimuth}; expected finite degrees.")
    if not 0.0 < sun_elevation <= 90.0:
        raise ValueError(
            f"sun_elevation is {sun_elevation}; expected degrees above 0 and at most 90."
        )
    if not 0.1 < sun_radius <= 30.0:
        raise ValueError(f"sun_radius is {sun_radius}; expected degrees above 0.1 and at most 30.")
    if not 2.0 <= turbidity <= 10.0:
        raise ValueError(f"turbidity is {turbidity}; expected 2 to 10.")
    horizon = height // 2
    weights = solid_angles(height)[:horizon, None]
    dome = _dome(height, sun_azimuth, sun_elevation, turbidity)
    dome /= (weights * luminance(dome)).sum() / (2.0 * math.pi)

    borders = np.cos(np.arange(horizon + 1) * (math.pi / height))
    falling = weights * (0.5 * (borders[:-1] + borders[1:]))[:, None]  # integral of z in a texel
    from_dome = float((falling * luminance(dome)).sum())
    core = _CORE_OF_SUN * sun_radius
    level = _SUN_PER_SKY * from_dome / _irradiance_of_disc(core, sun_radius)
    sun = _disc(height, sun_azimuth, sun_elevation, core, sun_radius)
    lit = dome + sun[:horizon, :, None] * (level * _sun_colour(sun_elevation, turbidity))

    radiance = np.empty((height, 2 * height, 3))
    radiance[:horizon] = lit
    radiance[horizon:] = _ALBEDO_OF_GROUND / math.pi * (falling[..., None] * lit).sum(axis=(0, 1))
    return radiance.astype(np.float32)


def lamps(height: int) -> Radiance:
    """A dim room with five round lamps, soft at their edges: (H, W, 3) float32.

    Lamps differ in size, brightness and tint; four are well above the horizon, one is on it. The
    mean radiance has luminance 0.3. Raises ValueError for height < 1.
    """
    check_height(height)
    radiance = np.full((height, 2 * height, 3), _ROOM)
    for azimuth, elevation, radius, level, tint in _LAMPS:
        colour = np.array(tint)
        disc = _disc(height, azimuth, elevation, _CORE_OF_LAMPS * radius, radius)
        radiance += disc[..., None] * (level * colour / luminance(colour))
    return radiance.astype(np.float32)


def _dome(height: int, azimuth: float, elevation: float, turbidity: float) -> FloatArray:
    """Linear sRGB (H / 2, W, 3) of the sky without the sun, in kcd/m^2."""
    zenith_angle = math.radians(90.0 - elevation)
    directions = texel_directions(height)[: height // 2]
    gamma = np.arccos(np.clip(directions @ _unit_vector(azimuth, elevation), -1.0, 1.0))
    above = directions[..., 2]

    chi = (4.0 / 9.0 - turbidity / 120.0) * (math.pi - 2.0 * zenith_angle)
    zenith_y = (4.0453 * turbidity - 4.9710) * math.tan(chi) - 0.2155 * turbidity + 2.4192
    powers = np.array([turbidity**2, turbidity, 1.0])
    zenith_x_y = powers @ _ZENITH @ zenith_angle ** np.array([3.0, 2.0, 1.0, 0.0])
    # Y, x and y in this order, here as in the tables.
    values = []
    for table, at_zenith in zip(_PEREZ, (zenith_y, *zenith_x_y), strict=True):
        shape = table @ np.array([turbidity, 1.0])
        there = _perez(shape, np.array(1.0), np.array(zenith_angle))
        values.append(at_zenith * _perez(shape, above, gamma) / there)
    big_y, x, y = values
    xyz = np.stack([x / y, np.ones_like(x), (1.0 - x - y) / y], axis=-1) * big_y[..., None]
    return np.maximum(xyz @ _SRGB_OF_XYZ.T, 0.0)


def _perez(shape: FloatArray, cosine: FloatArray, gamma: FloatArray) -> FloatArray:
    """Perez' distribution: ``cosine`` of the angle to the zenith, ``gamma`` that to the sun."""
    a, b, c, d, e = shape
    return (1 + a * np.exp(b / cosine)) * (1 + c * np.exp(d * gamma) + e * np.cos(gamma) ** 2)


def _sun_colour(elevation: float, turbidity: float) -> FloatArray:
    """Linear sRGB (3,) of luminance 1: white light through air and haze (the paper's A.1)."""
    zenith_angle = 90.0 - elevation
    mass = 1.0 / (
        math.cos(math.radians(zenith_angle)) + 0.15 * (93.885 - zenith_angle) ** -1.253
    )  # of air on the way, 1 from the zenith
    air = 0.008735 * _WAVELENGTHS**-4.08
    haze = (0.04608 * turbidity - 0.04586) * _WAVELENGTHS**-1.3
    left = np.exp(-mass * (air + haze))
    return left / luminance(left)


# ---- soft discs ------------------------------------------------------------------------------
# A disc is 1 inside its core and falls to 0 at its radius, linearly in the cosine of the angle
# to its centre: nearly a parabola, with integrals in closed form.


def _unit_vector(azimuth: float, elevation: float) -> FloatArray:
    around, above = math.radians(azimuth), math.radians(elevation)
    return np.array(
        [math.cos(above) * math.cos(around), math.cos(above) * math.sin(around), math.sin(above)]
    )


def _irradiance_of_disc(core: float, radius: float) -> float:
    """Irradiance at normal incidence from a disc of unit radiance; angles in degrees."""
    inner, outer = math.sin(math.radians(core)), math.sin(math.radians(radius))
    # pi (1 - (a^2 + a b + b^2) / 3), a and b the cosines, without their cancellation.
    mixed = 1.0 - math.cos(math.radians(core)) * math.cos(math.radians(radius))
    return math.pi / 3.0 * (inner * inner + outer * outer + mixed)


def _disc(height: int, azimuth: float, elevation: float, core: float, radius: float) -> FloatArray:
    """Means (H, W) over texels of a disc; angles in degrees.

    Samples lie on a finer grid, as fine as the disc needs, but only about the disc. Scaling
    removes what error is left in the total.
    """
    width = 2 * height
    degrees = 180.0 / height  # of a texel
    steps = max(_LEAST_STEPS, math.ceil(_STEPS_PER_RADIUS * degrees / radius))
    theta_of_centre = 90.0 - elevation
    first_row = max(math.floor((theta_of_centre - radius) / degrees), 0)
    last_row = min(math.floor((theta_of_centre + radius) / degrees), height - 1)
    columns = _columns_of_disc(width, azimuth, theta_of_centre, radius)

    offsets = (np.arange(steps) + 0.5) / steps
    places = (columns[:, None] + offsets).ravel() * (2.0 * math.pi / width)
    across = np.cos(math.pi - places - math.radians(azimuth))
    sine, cosine = _unit_vector(0.0, elevation)[[0, 2]]
    faint, full = math.cos(math.radians(radius)), math.cos(math.radians(core))
    means = np.zeros((height, width))
    for row in range(first_row, last_row + 1):
        theta = (row + offsets) * (math.pi / height)
        weights = np.sin(theta) / np.sin(theta).sum()  # as their solid angles
        close = np.abs(np.degrees(theta) - theta_of_centre) < radius
        if not close.any():
            continue
        theta, weights = theta[close], weights[close]
        to_centre = np.outer(sine * np.sin(theta), across) + (cosine * np.cos(theta))[:, None]
        inside = np.clip((to_centre - faint) / (full - faint), 0.0, 1.0)
        means[row, columns % width] = (weights @ inside).reshape(len(columns), steps).mean(axis=1)
    total = (solid_angles(height)[:, None] * means).sum()
    return means * (math.pi * (2.0 - faint - full) / total)


def _columns_of_disc(
    width: int, azimuth: float, theta_of_centre: float, radius: float
) -> NDArray[np.int64]:
    """Columns that a disc may touch, each once; to be taken modulo the width."""
    if not radius < theta_of_centre < 180.0 - radius:
        return np.arange(width)  # a pole is in it
    sine = math.sin(math.radians(radius)) / math.sin(math.radians(theta_of_centre))
    reach = math.degrees(math.asin(min(sine, 1.0))) * width / 360.0
    centre = (0.5 - azimuth / 360.0) * width
    first, last = math.floor(centre - reach), math.floor(centre + reach)
    return np.arange(first, min(last + 1, first + width))
