"""How hair lies in a photograph, and which pieces of it may be laid over a body.

Hairs are lines: luminance changes across them. The structure tensor, averaged over a neighbourhood
as a tensor and not as an angle, tells their direction up to its sign. The sign is told by shading:
hair is laid like tiles, so that from root to tip brightness rises slowly and at the tip falls at
once to what lies below.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.photo_fur.laying import Piece

_DERIVATIVE = 1.0
"""Deviation of the Gaussian by which luminance is smoothed before it is differentiated, pixels."""
_NEIGHBOURHOOD = 1 / 32
"""Deviation of that over which tensors are averaged, in shorter sides of the photograph."""
_STEP = 3.0
"""Pixels between the brightnesses whose differences tell the sign."""
_DISC = 0.275
"""Radius of a piece, in sides of a square as large as the fur."""
_LEAST_FUR, _LEAST_INSIDE = 0.8, 0.35
"""Of a piece: the share that is fur, and its middle's distance to what is none, in radii."""
_LEAST_COHERENCE = 0.5
"""Of a piece, in that of the photograph's median."""


class PhotographLie(NamedTuple):
    """How hair lies in a photograph, by pixel."""

    direction: NDArray[np.float64]
    """(y, x): towards the tips, radians from x (right) towards y (up)."""
    coherence: NDArray[np.float64]
    """(y, x): 0 where nothing has a direction, 1 where all lines are parallel."""
    slant: float
    """How sure the sign is: skewness of brightness's steps towards the tips, negative; 0 where
    nothing tells it."""


def photograph_lie(
    luminance: NDArray[np.floating], opaque: NDArray[np.bool_] | None = None
) -> PhotographLie:
    """Direction of the hair at each pixel of a photograph (y, x); what is not ``opaque`` has no
    say.

    >>> columns = np.arange(64)[None, :] + 0 * np.arange(64)[:, None]
    >>> lie = photograph_lie(np.sin(columns / 2.0))  # upright stripes
    >>> round(float(abs(np.sin(lie.direction)).min()), 3), bool(lie.coherence[32, 32] > 0.99)
    (1.0, True)
    """
    from scipy.ndimage import gaussian_filter

    shown = np.ones(luminance.shape) if opaque is None else opaque.astype(np.float64)
    logarithm = np.log(np.maximum(luminance, 1e-4)).astype(np.float64)
    logarithm = np.where(shown > 0, logarithm, np.median(logarithm[shown > 0]))
    down = gaussian_filter(logarithm, _DERIVATIVE, order=(1, 0)) * shown
    right = gaussian_filter(logarithm, _DERIVATIVE, order=(0, 1)) * shown
    reach = _NEIGHBOURHOOD * min(luminance.shape)
    across, both, along = (
        gaussian_filter(part, reach) for part in (right * right, right * down, down * down)
    )
    # Lines run across the gradient; rows go down, angles go up.
    direction = -0.5 * np.arctan2(2 * both, across - along) + np.pi / 2
    strength = np.hypot(across - along, 2 * both)
    coherence = strength / np.maximum(across + along, 1e-12)
    direction = _towards_the_mean(direction, strength * shown)
    slant = _slant(logarithm, direction, shown)
    if slant > 0:
        direction, slant = direction + np.pi, -slant
    return PhotographLie(np.angle(np.exp(1j * direction)), coherence, slant)


def disc_radius(shape: tuple[int, ...], opaque: NDArray[np.bool_] | None = None) -> float:
    """Of discs of which some fit beside each other into the fur of a photograph, in its widths.

    >>> round(disc_radius((64, 64)), 3), round(disc_radius((64, 128)), 3)
    (0.275, 0.194)
    """
    area = float(np.prod(shape)) if opaque is None else float(opaque.sum())
    return float(_DISC * np.sqrt(area) / shape[1])


def pieces_of(
    lie: PhotographLie,
    radius: float,
    opaque: NDArray[np.bool_] | None = None,
    radiance: NDArray[np.floating] | None = None,
) -> Piece:
    """Places of a photograph about which a disc of ``radius``, in photograph widths, is fur that
    lies one way, with how it lies there.

    With the photograph's radiance (y, x, 3) of these only the half whose colour is nearest to all
    places' median: a coat of many colours would be laid as a patchwork.

    Up to a fifth of a disc, at its rim, may be no fur: other patches cover it. A photograph smaller
    than a disc has one in its middle. Raises ValueError where no disc is fur.
    """
    from scipy.ndimage import distance_transform_edt, gaussian_filter

    height, width = lie.direction.shape
    shown = np.ones((height, width), bool) if opaque is None else opaque
    within = distance_transform_edt(np.pad(shown, 1))[1:-1, 1:-1]
    to_border = distance_transform_edt(np.pad(np.ones_like(shown), 1))[1:-1, 1:-1]
    if within.max() < 2:
        raise ValueError("no part of the photograph is fur; expected a disc of it.")
    wanted = min(radius * width, 0.98 * float(to_border.max()))
    pointing = np.exp(1j * lie.direction) * lie.coherence * shown
    mean = gaussian_filter(pointing.real, wanted / 2) + 1j * gaussian_filter(
        pointing.imag, wanted / 2
    )
    share = gaussian_filter(shown.astype(np.float64), wanted / 2, mode="nearest")
    deepest = within >= 0.98 * within.max()
    inside = (to_border >= wanted) & (within >= _LEAST_INSIDE * wanted) & (share >= _LEAST_FUR)
    if not inside.any():
        inside = deepest
    allowed = inside & (np.abs(mean) >= _LEAST_COHERENCE * np.median(np.abs(mean[inside])))
    if not allowed.any():
        allowed = inside
    step = max(1, round(wanted / 4))
    on_grid = np.zeros_like(allowed)
    on_grid[::step, ::step] = True
    rows, columns = np.nonzero(allowed & on_grid if (allowed & on_grid).any() else allowed)
    if radiance is not None:
        alike = _of_one_colour(radiance, shown, wanted / 2, (rows, columns))
        rows, columns = rows[alike], columns[alike]
    places = np.stack([columns + 0.5, height - rows - 0.5], axis=-1) / width
    return Piece(places, np.angle(mean[rows, columns]))


def _of_one_colour(
    radiance: NDArray[np.floating],
    shown: NDArray[np.bool_],
    reach: float,
    places: tuple[NDArray[np.integer], NDArray[np.integer]],
) -> NDArray[np.bool_]:
    """Whether the colour about each place is among the half nearest to their median, in logarithms
    of light."""
    from scipy.ndimage import gaussian_filter

    share = np.maximum(gaussian_filter(shown.astype(np.float64), reach), 1e-3)
    means = [
        gaussian_filter(np.where(shown, radiance[..., k], 0).astype(np.float64), reach) / share
        for k in range(3)
    ]
    colours = np.log(np.maximum(np.stack(means, axis=-1), 1e-3))[places]
    apart = np.linalg.norm(colours - np.median(colours, axis=0), axis=-1)
    return np.asarray(apart <= np.median(apart))


def _towards_the_mean(
    direction: NDArray[np.float64], strength: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Directions modulo 180 degrees, each turned to the side of the photograph's mean."""
    doubled = np.sum(strength * np.exp(2j * direction))
    mean = np.angle(doubled) / 2
    away = np.cos(direction - mean) < 0
    return np.where(away, direction + np.pi, direction)


def _slant(
    logarithm: NDArray[np.float64], direction: NDArray[np.float64], shown: NDArray[np.float64]
) -> float:
    """Skewness of brightness's steps along the directions."""
    from scipy.ndimage import map_coordinates

    rows, columns = np.mgrid[: logarithm.shape[0], : logarithm.shape[1]].astype(np.float64)
    there, here = (
        map_coordinates(
            logarithm,
            [rows - way * np.sin(direction), columns + way * np.cos(direction)],
            order=1,
            mode="nearest",
        )
        for way in (_STEP / 2, -_STEP / 2)
    )
    step = there - here
    step = step[shown > 0]
    step = step - step.mean()
    deviation = float(np.sqrt(np.mean(step**2)))
    return float(np.mean(step**3) / deviation**3) if deviation > 0 else 0.0
