"""The relief of a material by its shading, and what it does to photographs: shadows and parallax.

Heights are in texels over the mean plane; x is to the right, y up, as directions have them. Rows of
arrays run from the top. All is approximate (Lambert's law, no interreflection): enough to tell
whether photographs and directions belong together, not to measure a surface.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

STEEPEST_LIGHT = np.radians(62.0)
"""Beyond it shadows are most of the shading."""
_LONGEST_WAVES = 2  # over the patch: longer ones are the lamp's and the borders'
_FARTHEST = 24  # texels that a shadow may fall
_STEP = 0.75  # texels along a ray
_PENUMBRA = 0.6  # texels of height: how softly texels go dark


def slopes(
    photographs: Floats, lights: NDArray[np.float64], rings: list[NDArray[np.intp]]
) -> Floats:
    """Slopes (2, y, x) of the surface along x and y, by how its brightness follows the light.

    photographs: (light, y, x), seen from straight above. lights: (light, 2). rings: those of one
    theta each, all around; the rest is not looked at. Albedo cancels: each texel is compared with
    its own mean over a ring.
    """
    total = np.zeros((2, *photographs.shape[1:]))
    weights = 0.0
    for ring in rings:
        theta = float(lights[ring[0], 0])
        if theta > STEEPEST_LIGHT:
            continue
        around = np.stack([np.cos(lights[ring, 1]), np.sin(lights[ring, 1])])
        waves = np.linalg.pinv(np.vstack([np.ones(len(ring)), around]).T)[1:]
        ratio = relative(photographs[ring], 0.001)
        # cos(theta) - sin(theta) (p cos(phi) + q sin(phi)), over its mean cos(theta).
        weight = np.sin(theta) ** 2
        total -= weight / np.tan(theta) * np.einsum("kl,lyx->kyx", waves, ratio)
        weights += weight
    return (total / max(weights, 1e-9)).astype(np.float32)


def relative(photographs: Floats, floor: float) -> Floats:
    """Photographs (n, y, x) over each texel's mean; ``floor``, of the mean of all, is added."""
    mean = photographs.mean(axis=0)
    return np.asarray(photographs / (mean + floor * photographs.mean() + 1e-12), np.float32)


def heights(slope: Floats) -> Floats:
    """The relief (y, x) whose slopes are nearest to (2, y, x); what no relief has is lost.

    Least squares in the frequency domain (Frankot, Chellappa 1988).
    """
    rows, columns = slope.shape[1:]
    wy, wx = np.meshgrid(
        -2 * np.pi * np.fft.fftfreq(rows), 2 * np.pi * np.fft.fftfreq(columns), indexing="ij"
    )
    squared = wx**2 + wy**2
    squared[0, 0] = 1.0
    p, q = np.fft.fft2(slope)
    spectrum = -1j * (wx * p + wy * q) / squared
    lowest = 2 * np.pi * _LONGEST_WAVES / max(rows, columns)
    spectrum *= 1 - np.exp(-squared / lowest**2)
    spectrum[0, 0] = 0.0
    return np.fft.ifft2(spectrum).real.astype(np.float32)


def shaded(relief: Floats, lights: NDArray[np.float64]) -> Floats:
    """Brightness (light, y, x) of a white matt relief seen from above, with its shadows."""
    down, right = np.gradient(relief)
    found = np.empty((len(lights), *relief.shape), np.float32)
    for picture, (theta, phi) in zip(found, lights, strict=True):
        along = right * np.cos(phi) - down * np.sin(phi)
        matt = np.clip(np.cos(theta) - np.sin(theta) * along, 0.0, None)
        picture[:] = matt * np.clip(0.5 + _clearance(relief, theta, phi) / _PENUMBRA, 0.0, 1.0)
    return found


def _clearance(relief: Floats, theta: float, phi: float) -> Floats:
    """How far above every texel's highest obstacle its ray to the light passes."""
    rise = 1.0 / np.tan(theta)
    reach = min(_FARTHEST, int(np.ptp(relief) / rise) + 1)
    least = np.full(relief.shape, np.inf, np.float32)
    for distance in np.arange(1.0, reach + 1.0, _STEP):
        np.minimum(least, relief + distance * rise - _beside(relief, distance, phi), out=least)
    return least


def parallax(relief: Floats, view: NDArray[np.float64]) -> Floats:
    """Where a view sees the surface, (y, x): texels from every texel of the mean plane on its ray,
    in the direction of the view's phi."""
    theta, phi = view
    high, low = float(relief.max()) * np.tan(theta), float(relief.min()) * np.tan(theta)
    found, missing = np.zeros_like(relief), np.ones(relief.shape, bool)
    above = np.full_like(relief, -1.0)
    for distance in np.arange(min(np.ceil(high), _FARTHEST), max(low, -_FARTHEST) - _STEP, -_STEP):
        here = _beside(relief, distance, phi) * np.float32(np.tan(theta)) - np.float32(distance)
        met = missing & (here >= 0)
        share = here[met] / np.maximum(here[met] - above[met], 1e-6)
        found[met] = distance + _STEP * np.minimum(share, 1.0)
        missing &= ~met
        above = here
    return found


def moved(texture: Floats, distance: Floats, phi: float) -> Floats:
    """What a texture (y, x) has ``distance`` (y, x) from every texel in the direction phi."""
    from scipy import ndimage

    rows, columns = np.indices(texture.shape, np.float32)
    places = [rows - distance * np.sin(phi), columns + distance * np.cos(phi)]
    return np.asarray(ndimage.map_coordinates(texture, places, order=1, mode="nearest"), np.float32)


def _beside(values: Floats, distance: float, phi: float) -> Floats:
    """What is ``distance`` texels from every texel in the direction phi."""
    from scipy import ndimage

    way = (distance * np.sin(phi), -distance * np.cos(phi))
    return np.asarray(ndimage.shift(values, way, order=1, mode="nearest"), np.float32)
