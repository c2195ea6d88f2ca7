"""Whether a photograph tells fur, and what can be mended: uneven light."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance, to_8bit
from pipelines.photo_fur.segmentation import largest_square

_FRAME = (0.05, 0.9, 0.35)
"""Colour of the better crop's frame, linear RGB."""
_DIMMED = 0.12
"""Of what is no fur, in the report's picture."""


class EvenlyLit(NamedTuple):
    """A photograph with its light's slope taken out."""

    radiance: NDArray[np.float32]
    """(y, x, 3) in [0, 1]."""
    unevenness: float
    """Deviation of the slope's logarithm before: 0.7 where it halves and doubles brightness."""


def evenly_lit(radiance: NDArray[np.floating], fur: NDArray[np.bool_] | None = None) -> EvenlyLit:
    """Divide by the light's slope: the quadric that fits the logarithm of luminance best.

    radiance (y, x, 3) in [0, 1], linear; fur (y, x), None for everywhere. The fur's mean logarithm
    stays, unless its brightest thousandth would clip; what was white stays so, since its brightness
    is not known. Patterns of the coat stay, since they are no quadric.

    >>> slope = np.exp(np.linspace(-1.0, 0.0, 64))[None, :, None] * np.full((64, 1, 3), 0.5)
    >>> even = evenly_lit(slope)
    >>> bool(np.ptp(even.radiance) < 1e-3), round(even.unevenness, 2)
    (True, 0.29)
    """
    slope = light_slope(luminance(radiance), fur)
    shown = slope if fur is None else slope[fur]
    even = radiance * np.exp(-slope)[..., None]
    white = max(1.0, float(np.quantile(even if fur is None else even[fur], 0.999)))
    even = np.clip(even / white, 0.0, 1.0)
    even[(radiance >= 1.0).all(axis=-1)] = 1.0
    return EvenlyLit(even.astype(np.float32), float(shown.std()))


def light_slope(
    grey: NDArray[np.floating], fur: NDArray[np.bool_] | None = None
) -> NDArray[np.float64]:
    """(y, x): the quadric nearest to the logarithm of luminance (y, x), less its mean over the
    fur."""
    height, width = grey.shape
    rows, columns = np.meshgrid(
        np.linspace(-1, 1, height), np.linspace(-1, 1, width), indexing="ij"
    )
    terms = np.stack([columns, rows, columns**2, columns * rows, rows**2], axis=-1)
    where = np.ones(grey.shape, bool) if fur is None else fur
    known, measured = terms[where], np.log(np.maximum(grey[where], 1e-3))
    middle = known.mean(axis=0)
    found = np.linalg.lstsq(known - middle, measured - measured.mean(), rcond=None)[0]
    return np.asarray((terms - middle) @ found)


def report_picture(
    radiance: NDArray[np.floating], fur: NDArray[np.bool_] | None
) -> NDArray[np.uint8]:
    """The photograph with what is no fur dimmed, and the largest square of fur in a frame: the
    better crop."""
    shown = np.array(radiance, np.float64)
    if fur is None:
        return to_8bit(shown)
    shown[~fur] *= _DIMMED
    left, top, side = largest_square(fur)
    thick = max(1, min(fur.shape) // 128)
    framed = np.zeros(fur.shape, bool)
    framed[top : top + side, left : left + side] = True
    framed[top + thick : top + side - thick, left + thick : left + side - thick] = False
    shown[framed] = _FRAME
    return to_8bit(shown)
