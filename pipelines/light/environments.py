"""Light from far away: equirectangular maps of radiance, a few to start with, and their sampling.

A map is linear radiance (H, W, 3) float32, W = 2 H, z up, as seen from inside (not mirrored),
which is also what ``pipelines.drawing.stage`` draws. Row 0 touches the zenith, row H - 1 the
nadir, all rows are equally high in angle. Azimuth 0 (+x) is in the middle of the picture,
azimuth 90 (+y) a quarter of the width from the left edge: azimuth falls with the column.

Radiance is constant in each texel. So the density by which directions are drawn is exactly
proportional to what is drawn from, and sampling and evaluation agree to the last bit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from pipelines.drawing.colour import luminance

Radiance = NDArray[np.float32]
FloatArray = NDArray[np.float64]

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

# ---- sampling ----
_FLOOR = 0.01  # of the mean luminance, added to every texel's
# Samples keep off their texel's borders by this part of it, so that rounding moves none across,
# and off the poles, where the azimuth would be lost. Enough for heights up to some ten thousand.
_MARGIN = 1e-9


class Sampler(NamedTuple):
    """An environment, ready for drawing directions from it.

    radiance: (H, W, 3) float32, the map.
    row_cdf: (H + 1,) float64, from 0 to 1, of the rows.
    column_cdf: (H, W + 1) float64, from 0 to 1, of the columns in each row.
    density: (H, W) float64, per steradian, constant in each texel and nowhere 0.
    """

    radiance: Radiance
    row_cdf: FloatArray
    column_cdf: FloatArray
    density: FloatArray


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


# ---- the grid --------------------------------------------------------------------------------


def texel_directions(height: int) -> FloatArray:
    """Unit vectors (H, W, 3) to the centres of the texels. Raises ValueError for height < 1."""
    _check_height(height)
    theta = (np.arange(height) + 0.5) * (math.pi / height)
    azimuth = math.pi - (np.arange(2 * height) + 0.5) * (math.pi / height)
    directions = np.empty((height, 2 * height, 3))
    directions[..., 0] = np.outer(np.sin(theta), np.cos(azimuth))
    directions[..., 1] = np.outer(np.sin(theta), np.sin(azimuth))
    directions[..., 2] = np.cos(theta)[:, None]
    return directions


def solid_angles(height: int) -> FloatArray:
    """Steradians (H,) of one texel in each row; exact. Raises ValueError for height < 1."""
    _check_height(height)
    middle = (np.arange(height) + 0.5) * (math.pi / height)
    # cos a - cos b as a product, which does not cancel near the poles.
    heights = 2.0 * np.sin(middle) * math.sin(math.pi / (2 * height))
    return heights * (math.pi / height)


def _check_height(height: int) -> None:
    if height < 1:
        raise ValueError(f"height is {height}; expected 1 or more.")


# ---- environments ----------------------------------------------------------------------------


def uniform(height: int, value: float = 1.0) -> Radiance:
    """The same radiance from everywhere: (H, W, 3) float32.

    Raises ValueError for height < 1 and for a value that is not finite and positive.
    """
    _check_height(height)
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
    _check_height(height)
    radiance = np.full((height, 2 * height, 3), _ROOM)
    for azimuth, elevation, radius, level, tint in _LAMPS:
        colour = np.array(tint)
        disc = _disc(height, azimuth, elevation, _CORE_OF_LAMPS * radius, radius)
        radiance += disc[..., None] * (level * colour / luminance(colour))
    return radiance.astype(np.float32)


def rotated(radiance: Radiance, degrees: float) -> Radiance:
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


# ---- sampling: compiled ----------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
def texel_of(height: int, width: int, x: float, y: float, z: float) -> tuple[int, int]:
    """Row and column that hold a direction; it need not be a unit vector.

    Always inside the map: what has no azimuth or no direction at all (zero, NaN) gets some texel.
    """
    # In single precision a sample near a border would end up in the neighbouring texel.
    x, y, z = np.float64(x), np.float64(y), np.float64(z)
    # The arc cosine would be inaccurate at the poles, and differ by the vector's length.
    down = math.atan2(math.sqrt(x * x + y * y), z) * (height / math.pi)
    along = (0.5 - math.atan2(y, x) / (2.0 * math.pi)) * width
    row, column = height - 1, width - 1
    if down < row:  # NaN is not
        row = int(down)
    if along < column:
        column = int(along)
    return row, column


@njit(cache=True, error_model="numpy")
def density_of(density: FloatArray, x: float, y: float, z: float) -> float:
    """Density (per steradian) of ``sample_direction`` at a direction; ``density`` is (H, W)."""
    row, column = texel_of(density.shape[0], density.shape[1], x, y, z)
    return density[row, column]


@njit(cache=True, error_model="numpy")
def radiance_of(radiance: Radiance, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Radiance from a direction: that of its texel; ``radiance`` is (H, W, 3)."""
    row, column = texel_of(radiance.shape[0], radiance.shape[1], x, y, z)
    return radiance[row, column, 0], radiance[row, column, 1], radiance[row, column, 2]


@njit(cache=True, error_model="numpy")
def _drawn(cdf: FloatArray, u: float) -> tuple[int, float]:
    """Interval of a cdf (n + 1,) that holds u, and the place in it, off its ends."""
    low, high = 0, cdf.shape[0] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if cdf[middle] <= u:
            low = middle
        else:
            high = middle
    place = (u - cdf[low]) / (cdf[low + 1] - cdf[low])
    if not place > _MARGIN:  # NaN is not
        place = _MARGIN
    return low, min(place, 1.0 - _MARGIN)


@njit(cache=True, error_model="numpy")
def sample_direction(
    row_cdf: FloatArray, column_cdf: FloatArray, density: FloatArray, u1: float, u2: float
) -> tuple[float, float, float, float]:
    """Draw a direction from two numbers in [0, 1]: unit vector x, y, z and its density.

    The arrays are those of ``Sampler``. Inside a texel directions are uniform in solid angle.
    ``texel_of`` finds the texel again, in double precision: of a direction rounded to single
    precision the density has to be looked up anew.
    """
    height, width = density.shape
    row, down = _drawn(row_cdf, u1)
    column, along = _drawn(column_cdf[row], u2)
    # From the nearer pole, to be accurate there: 1 - cos of its two borders.
    sign, steps = 1.0, row
    if 2 * row >= height:
        sign, steps, down = -1.0, height - 1 - row, 1.0 - down
    near = math.sin(steps * (0.5 * math.pi / height))
    far = math.sin((steps + 1) * (0.5 * math.pi / height))
    near, far = 2.0 * near * near, 2.0 * far * far
    lack = near + down * (far - near)
    radius = math.sqrt(lack * (2.0 - lack))
    azimuth = math.pi * (1.0 - 2.0 * (column + along) / width)
    z = sign * (1.0 - lack)
    return radius * math.cos(azimuth), radius * math.sin(azimuth), z, density[row, column]


@njit(cache=True, error_model="numpy")
def _fill_samples(
    row_cdf: FloatArray,
    column_cdf: FloatArray,
    density: FloatArray,
    u: FloatArray,
    directions: FloatArray,
    found: FloatArray,
) -> None:
    for i in range(len(u)):
        x, y, z, p = sample_direction(row_cdf, column_cdf, density, u[i, 0], u[i, 1])
        directions[i, 0], directions[i, 1], directions[i, 2], found[i] = x, y, z, p


@njit(cache=True, error_model="numpy")
def _fill_radiance(radiance: Radiance, directions: FloatArray, found: Radiance) -> None:
    for i in range(len(directions)):
        x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
        found[i, 0], found[i, 1], found[i, 2] = radiance_of(radiance, x, y, z)


@njit(cache=True, error_model="numpy")
def _fill_density(density: FloatArray, directions: FloatArray, found: FloatArray) -> None:
    for i in range(len(directions)):
        x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
        found[i] = density_of(density, x, y, z)


# ---- sampling: whole arrays ------------------------------------------------------------------


def sampler(radiance: NDArray[np.floating]) -> Sampler:
    """Make a map ready for drawing directions in proportion to its luminance.

    1 % of the mean luminance is added everywhere, so that no light is missed, be it as faint to
    the eye as blue. Raises ValueError for a map that ``check_environment`` refuses.
    """
    check_environment(radiance)
    with np.errstate(over="ignore"):
        kept = np.ascontiguousarray(radiance, dtype=np.float32)
    check_environment(kept)  # again: doubles may be too large or too small for float32
    height = len(kept)
    solid_angle = solid_angles(height)[:, None]
    weights = luminance(kept.astype(np.float64))
    weights += _FLOOR * (solid_angle * weights).sum() / (4.0 * math.pi)
    density = weights / (solid_angle * weights).sum()
    chances = solid_angle * density
    return Sampler(kept, _cdf(chances.sum(axis=1)), _cdf(chances), density)


def _cdf(chances: FloatArray) -> FloatArray:
    """Sums (..., n + 1) of the last axis (..., n), from 0 to exactly 1."""
    sums = np.cumsum(chances, axis=-1)
    sums /= sums[..., -1:]
    return np.concatenate([np.zeros_like(sums[..., :1]), sums], axis=-1)


def sample(sampler: Sampler, u: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Draw N directions from numbers (N, 2) in [0, 1].

    Returns unit vectors (N, 3) and their densities (N,) per steradian, both float64.
    Raises ValueError for another shape and for numbers outside.
    """
    numbers = _rows_of(u, 2, "u")
    if not ((numbers >= 0) & (numbers <= 1)).all():
        raise ValueError("u: found numbers outside [0, 1] or NaN, expected them inside.")
    directions, found = np.empty((len(numbers), 3)), np.empty(len(numbers))
    _fill_samples(sampler.row_cdf, sampler.column_cdf, sampler.density, numbers, directions, found)
    return directions, found


def evaluate(radiance: Radiance, directions: ArrayLike) -> Radiance:
    """Radiance (N, 3) float32 from directions (N, 3), which need not be unit vectors.

    Raises ValueError for another shape of the directions and for a map that is not (H, 2 H, 3).
    """
    ways = _rows_of(directions, 3, "directions")
    if radiance.ndim != 3 or radiance.shape[1:] != (2 * len(radiance), 3) or not len(radiance):
        raise ValueError(f"environment: found shape {radiance.shape}, expected (H, 2 H, 3).")
    found = np.empty((len(ways), 3), np.float32)
    _fill_radiance(radiance, ways, found)
    return found


def pdf(sampler: Sampler, directions: ArrayLike) -> FloatArray:
    """Density (N,) per steradian with which ``sample`` draws directions (N, 3).

    Raises ValueError for another shape.
    """
    ways = _rows_of(directions, 3, "directions")
    found = np.empty(len(ways))
    _fill_density(sampler.density, ways, found)
    return found


def _rows_of(values: ArrayLike, length: int, name: str) -> FloatArray:
    rows = np.ascontiguousarray(values, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != length:
        raise ValueError(f"{name}: found shape {rows.shape}, expected (N, {length}).")
    return rows
