"""Light from far away, as equirectangular maps of linear radiance.

A map is (H, W, 3) float32 with W = 2 H, z up, as seen from inside (not mirrored): row 0 lies at the
zenith, azimuth 0 (+x) is in the middle of the picture and azimuth 90 (+y) a quarter of the width
from its left edge. A texel has one radiance: what is looked up, sampled and integrated agrees.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from pipelines.colour import luminance

# OpenMP first: the TBB that Open3D brings along is too old for numba, which says so aloud.
numba.config.THREADING_LAYER_PRIORITY = ["omp", "tbb", "workqueue"]  # type: ignore[attr-defined]

SUN_TO_SKY = 5.0
"""The sun's irradiance on a surface that faces it, over the sky's on the ground."""
_GROUND_ALBEDO = 0.2
_SUN_SAMPLES = 8
_FLOOR = 0.01
_XYZ_TO_RGB = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560],
     [0.0556434, -0.2040259, 1.0572252]]
)  # fmt: skip  # IEC 61966-2-1, D65


def check_environment(radiance: ArrayLike) -> None:
    """Raises ValueError for what is no map of radiance: wrong shape, NaN, infinite, negative or
    black everywhere."""
    values = np.asarray(radiance)
    if values.ndim != 3 or values.shape[2] != 3 or values.shape[1] != 2 * values.shape[0]:
        raise ValueError(
            f"environment has the shape {values.shape}; expected (height, 2 height, 3)."
        )
    for good, words in (
        (np.isfinite(values), "finite radiance"),
        (values >= 0, "radiance of 0 or more"),
    ):
        if not good.all():
            row, column, channel = np.argwhere(~good)[0]
            raise ValueError(
                f"environment is {values[row, column, channel]} at column {column}, row {row}; "
                f"expected {words}."
            )
    if not values.any():
        raise ValueError("environment is all black; expected some light.")


def solid_angles(height: int) -> NDArray[np.float64]:
    """Solid angle (H,) of a texel in each row, steradians."""
    borders = np.cos(np.pi * np.arange(height + 1) / height)
    return (borders[:-1] - borders[1:]) * np.pi / height


def texel_directions(height: int) -> NDArray[np.float64]:
    """Unit vectors (H, W, 3) of the texels' middles."""
    return _directions(np.arange(height) + 0.5, np.arange(2 * height) + 0.5, height)


def _directions(
    rows: NDArray[np.float64], columns: NDArray[np.float64], height: int
) -> NDArray[np.float64]:
    polar = np.pi * rows / height
    azimuth = np.pi - np.pi * columns / height
    sine = np.sin(polar)[:, None]
    return np.stack(
        [
            sine * np.cos(azimuth),
            sine * np.sin(azimuth),
            np.broadcast_to(np.cos(polar)[:, None], (len(rows), len(columns))),
        ],
        axis=-1,
    )


# ---- built-in light ----------------------------------------------------------------------------


def uniform(height: int, value: float = 1.0) -> NDArray[np.float32]:
    """The same radiance from everywhere."""
    return np.full((height, 2 * height, 3), value, np.float32)


def sky(
    height: int,
    *,
    sun_azimuth: float,
    sun_elevation: float,
    sun_radius: float = 2.5,
    turbidity: float = 3.0,
) -> NDArray[np.float32]:
    """A clear sky with its sun over grey ground (Preetham, Shirley, Smits, "A practical analytic
    model for daylight", 1999).

    Angles in degrees. The sky alone has a mean luminance of 1; the sun, as large as it is, shines
    ``SUN_TO_SKY`` times as much onto a surface that faces it as the sky onto the ground, which has
    an albedo of 0.2. Raises ValueError for an elevation outside (0, 90], a radius outside (0.1, 30]
    or a turbidity outside [2, 10], and a height below 8 or odd.
    """
    for name, value, low, high in (
        ("sun_elevation", sun_elevation, 0.0, 90.0),
        ("sun_radius", sun_radius, 0.1, 30.0),
        ("turbidity", turbidity, 2.0, 10.0),
    ):
        if not low <= value <= high or (value == low and name != "turbidity"):
            raise ValueError(f"{name} is {value:g}; expected {low:g} to {high:g}.")
    if height < 8 or height % 2:
        raise ValueError(f"height of the sky is {height}; expected an even number of at least 8.")
    around, above = np.radians(sun_azimuth), np.radians(sun_elevation)
    sun = np.array(
        [np.cos(above) * np.cos(around), np.cos(above) * np.sin(around), np.sin(above)]
    )
    half = height // 2
    directions = texel_directions(height)[:half]
    dome = _daylight(directions, sun, turbidity)
    solid = solid_angles(height)[:half, None]
    dome /= np.sum(luminance(dome) * solid) / (2 * np.pi)
    fall = solid * directions[..., 2]
    from_sky = np.einsum("yxc,yx->c", dome, fall)
    disc = _disc(height, sun, np.radians(sun_radius))
    # A sun seen through as much air as its elevation asks for.
    colour = np.exp(-np.array([0.06, 0.12, 0.28]) / max(np.sin(above), 0.05))
    colour *= SUN_TO_SKY * luminance(from_sky) / luminance(colour)
    facing = np.sum(disc * solid_angles(height)[:, None] * np.maximum(texel_directions(height) @ sun, 0))
    direct = disc[..., None] * (colour / facing)
    radiance = np.zeros((height, 2 * height, 3))
    radiance[:half] = dome
    ground = _GROUND_ALBEDO / np.pi * (from_sky + colour * sun[2])
    radiance[half:] = ground
    radiance += direct
    return radiance.astype(np.float32)


def _daylight(
    directions: NDArray[np.float64], sun: NDArray[np.float64], turbidity: float
) -> NDArray[np.float64]:
    """Linear sRGB of the sky, in no particular unit; colours outside of the gamut are clipped."""
    t = turbidity
    # Perez's five coefficients for Y, x, y (the paper's appendix A.2).
    coefficients = np.array(
        [
            [0.1787 * t - 1.4630, -0.3554 * t + 0.4275, -0.0227 * t + 5.3251,
             0.1206 * t - 2.5771, -0.0670 * t + 0.3703],
            [-0.0193 * t - 0.2592, -0.0665 * t + 0.0008, -0.0004 * t + 0.2125,
             -0.0641 * t - 0.8989, -0.0033 * t + 0.0452],
            [-0.0167 * t - 0.2608, -0.0950 * t + 0.0092, -0.0079 * t + 0.2102,
             -0.0441 * t - 1.6537, -0.0109 * t + 0.0529],
        ]
    )  # fmt: skip
    theta_sun = np.arccos(np.clip(sun[2], -1, 1))
    chi = (4 / 9 - t / 120) * (np.pi - 2 * theta_sun)
    powers = theta_sun ** np.arange(3, -1, -1)
    turbidities = np.array([t * t, t, 1.0])
    zenith = np.array(
        [
            (4.0453 * t - 4.9710) * np.tan(chi) - 0.2155 * t + 2.4192,
            turbidities
            @ np.array([[0.00166, -0.00375, 0.00209, 0.0], [-0.02903, 0.06377, -0.03202, 0.00394],
                        [0.11693, -0.21196, 0.06052, 0.25886]]) @ powers,
            turbidities
            @ np.array([[0.00275, -0.00610, 0.00317, 0.0], [-0.04214, 0.08970, -0.04153, 0.00516],
                        [0.15346, -0.26756, 0.06670, 0.26688]]) @ powers,
        ]
    )  # fmt: skip
    cosine = np.maximum(directions[..., 2], 0.01)
    gamma = np.arccos(np.clip(directions @ sun, -1, 1))

    def perez(c: NDArray[np.float64], cos_theta: Any, angle: Any) -> Any:
        return (1 + c[0] * np.exp(c[1] / cos_theta)) * (
            1 + c[2] * np.exp(c[3] * angle) + c[4] * np.cos(angle) ** 2
        )

    bright, x, y = (
        zenith[i] * perez(coefficients[i], cosine, gamma) / perez(coefficients[i], 1.0, theta_sun)
        for i in range(3)
    )
    bright = np.maximum(bright, 0.0)
    xyz = np.stack([bright * x / y, bright, bright * (1 - x - y) / y], axis=-1)
    return np.maximum(xyz @ _XYZ_TO_RGB.T, 0.0)


def _disc(height: int, centre: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """Part (H, W) of each texel inside a disc on the sphere, its rim soft over a fifth of it."""
    covered = np.zeros((height, 2 * height))
    reach = 1.2 * radius + 2 * np.pi / height
    rows, columns = np.nonzero(texel_directions(height) @ centre > np.cos(reach))
    steps = (np.arange(_SUN_SAMPLES) + 0.5) / _SUN_SAMPLES
    for down in steps:
        for right in steps:
            polar = np.pi * (rows + down) / height
            azimuth = np.pi - np.pi * (columns + right) / height
            way = np.stack(
                [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
            )
            away = np.arccos(np.clip(centre @ way, -1, 1)) / radius
            covered[rows, columns] += np.clip((1.1 - away) / 0.2, 0.0, 1.0)
    return covered / _SUN_SAMPLES**2


_LAMPS = (
    # azimuth, elevation, radius in degrees; linear RGB
    (-70.0, 42.0, 11.0, (9.0, 8.4, 7.6)),
    (-150.0, 28.0, 7.0, (9.0, 10.0, 12.0)),
    (25.0, 63.0, 9.0, (10.0, 9.0, 7.5)),
    (120.0, 12.0, 6.0, (9.0, 6.5, 4.5)),
    (60.0, -2.0, 14.0, (1.6, 1.8, 2.2)),
)


def lamps(height: int) -> NDArray[np.float32]:
    """A dim room with five round lamps, warm and cool."""
    radiance = np.full((height, 2 * height, 3), 0.02)
    for azimuth, elevation, radius, colour in _LAMPS:
        around, above = np.radians(azimuth), np.radians(elevation)
        centre = np.array(
            [np.cos(above) * np.cos(around), np.cos(above) * np.sin(around), np.sin(above)]
        )
        radiance += _disc(height, centre, np.radians(radius))[..., None] * np.array(colour)
    return radiance.astype(np.float32)


def rotated(radiance: NDArray[np.float32], degrees: float) -> NDArray[np.float32]:
    """The map turned about z: a light at azimuth a is at a + degrees afterwards.

    Whole columns are rolled; between them two neighbours are mixed, so the mean stays.
    """
    width = radiance.shape[1]
    shift = -degrees / 360.0 * width
    whole = int(np.floor(shift))
    part = np.float32(shift - whole)
    turned = np.roll(radiance, whole, axis=1)
    if part == 0:
        return turned
    return (1 - part) * turned + part * np.roll(turned, 1, axis=1)


# ---- sampling ----------------------------------------------------------------------------------


class Sampler(NamedTuple):
    """A map with what is needed to draw directions from it.

    ``radiance`` (H, W, 3) float32; ``row_cdf`` (H + 1,), ``column_cdf`` (H, W + 1) float64;
    ``density`` (H, W) float64 per steradian: as the luminance, and a hundredth of its mean, so that
    no light is missed.
    """

    radiance: NDArray[np.float32]
    row_cdf: NDArray[np.float64]
    column_cdf: NDArray[np.float64]
    density: NDArray[np.float64]


def sampler(radiance: NDArray[np.floating]) -> Sampler:
    """Prepare a map for sampling. Raises ValueError as :func:`check_environment`."""
    check_environment(radiance)
    held = np.ascontiguousarray(radiance, np.float32)
    height = len(held)
    solid = solid_angles(height)[:, None]
    bright = luminance(held.astype(np.float64))
    weight = bright + _FLOOR * float(np.sum(bright * solid) / (4 * np.pi))
    power = weight * solid
    rows = power.sum(axis=1)
    total = rows.sum()
    row_cdf = np.concatenate([[0.0], np.cumsum(rows) / total])
    columns = np.cumsum(power, axis=1) / rows[:, None]
    column_cdf = np.concatenate([np.zeros((height, 1)), columns], axis=1)
    row_cdf[-1], column_cdf[:, -1] = 1.0, 1.0
    return Sampler(held, row_cdf, column_cdf, weight / total)


@njit(cache=True)
def texel_of(height, width, x, y, z):  # type: ignore[no-untyped-def]
    """Row and column of a direction."""
    row = int(np.arccos(min(max(z, -1.0), 1.0)) / np.pi * height)
    column = int((0.5 - np.arctan2(y, x) / (2.0 * np.pi)) * width)
    return min(max(row, 0), height - 1), min(max(column, 0), width - 1)


@njit(cache=True)
def _find(cdf, u):  # type: ignore[no-untyped-def]
    """The step of a running sum that u falls into, and how far."""
    low, high = 0, len(cdf) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if cdf[middle] <= u:
            low = middle
        else:
            high = middle
    width = cdf[low + 1] - cdf[low]
    inside = (u - cdf[low]) / width if width > 0.0 else 0.5
    # Not quite to the border, where the neighbour begins.
    return low, min(max(inside, 1e-9), 1.0 - 1e-9)


@njit(cache=True)
def sample_direction(row_cdf, column_cdf, density, u1, u2):  # type: ignore[no-untyped-def]
    """A direction for two numbers in [0, 1), and its density: (x, y, z, pdf)."""
    height, width = density.shape
    row, down = _find(row_cdf, u1)
    column, right = _find(column_cdf[row], u2)
    top, bottom = np.cos(np.pi * row / height), np.cos(np.pi * (row + 1) / height)
    z = top + down * (bottom - top)
    azimuth = np.pi - 2.0 * np.pi * (column + right) / width
    sine = np.sqrt(max(1.0 - z * z, 0.0))
    return sine * np.cos(azimuth), sine * np.sin(azimuth), z, density[row, column]


@njit(cache=True)
def density_of(density, x, y, z):  # type: ignore[no-untyped-def]
    """Density per steradian of a direction."""
    row, column = texel_of(density.shape[0], density.shape[1], x, y, z)
    return density[row, column]


@njit(cache=True)
def radiance_of(radiance, x, y, z):  # type: ignore[no-untyped-def]
    """Radiance (r, g, b) from a direction."""
    row, column = texel_of(radiance.shape[0], radiance.shape[1], x, y, z)
    return radiance[row, column, 0], radiance[row, column, 1], radiance[row, column, 2]


@njit(cache=True)
def _sample_many(row_cdf, column_cdf, density, u, directions, found):  # type: ignore[no-untyped-def]
    for i in range(len(u)):
        x, y, z, p = sample_direction(row_cdf, column_cdf, density, u[i, 0], u[i, 1])
        directions[i, 0], directions[i, 1], directions[i, 2], found[i] = x, y, z, p


@njit(cache=True)
def _texels(height, width, directions, rows, columns):  # type: ignore[no-untyped-def]
    for i in range(len(directions)):
        rows[i], columns[i] = texel_of(
            height, width, directions[i, 0], directions[i, 1], directions[i, 2]
        )


def sample(
    light: Sampler, u: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Directions (N, 3) for numbers (N, 2) in [0, 1), and their densities (N,) per steradian."""
    directions, found = np.empty((len(u), 3)), np.empty(len(u))
    _sample_many(light.row_cdf, light.column_cdf, light.density, u, directions, found)
    return directions, found


def _texels_of(
    shape: tuple[int, ...], directions: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    rows, columns = np.empty(len(directions), np.int64), np.empty(len(directions), np.int64)
    _texels(shape[0], shape[1], np.asarray(directions, np.float64), rows, columns)
    return rows, columns


def evaluate(
    radiance: NDArray[np.float32], directions: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Radiance (N, 3) from directions (N, 3)."""
    return radiance[_texels_of(radiance.shape, directions)]


def pdf(light: Sampler, directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Densities (N,) per steradian with which directions (N, 3) are drawn."""
    return light.density[_texels_of(light.density.shape, directions)]
