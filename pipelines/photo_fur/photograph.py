"""A photograph made ready for the model: exposure, size, and its medium."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance, to_8bit
from pipelines.photo_fur.attenuation import PAPER_ENDS, Attenuation, fit_attenuation

HIGHLIGHT_SHARE = 0.001
"""Share of the channels' values that may clip when an HDR photograph is exposed."""


class FurPhotograph(NamedTuple):
    """A photograph of fur and the medium that its histogram tells."""

    radiance: NDArray[np.floating]
    """(y, x, 3), linear RGB, white = 1."""
    luminance: NDArray[np.floating]
    """(y, x), linear."""
    attenuation: Attenuation
    opaque: NDArray[np.bool_] | None = None
    """(y, x): where there is fur; None for everywhere."""


def fur_photograph(
    radiance: NDArray[np.floating],
    *,
    tail: float = 0.005,
    ends: tuple[float, float] = PAPER_ENDS,
) -> FurPhotograph:
    """Luminance and medium of a photograph (y, x, 3) that is exposed already (``expose``).

    ``tail``: share of the pixels cut off at each end of the histogram; ``ends``: depths of the
    brightest and darkest pixels that are left (``CALIBRATED_ENDS``, or the paper's). Raises
    ValueError where the photograph has a single luminance.

    >>> import numpy as np
    >>> radiance = np.linspace(0.1, 0.9, 192).reshape(8, 8, 3)
    >>> photograph = fur_photograph(radiance)
    >>> photograph.luminance.shape, round(photograph.attenuation.coefficient, 2)
    ((8, 8), 2.16)
    """
    grey = luminance(radiance)
    medium = fit_attenuation(grey, tail=tail).with_ends_at(ends)
    return FurPhotograph(radiance, grey, medium)


def fur_colours(photograph: FurPhotograph) -> NDArray[np.uint8]:
    """The photograph's colours (y, x, 3), 8-bit sRGB.

    A transparent pixel has the colour of the nearest opaque one: filters mix it into the rim.
    """
    from scipy.ndimage import distance_transform_edt

    colours = to_8bit(photograph.radiance)
    if photograph.opaque is None:
        return colours
    nearest = distance_transform_edt(
        ~photograph.opaque, return_distances=False, return_indices=True
    )
    return colours[tuple(nearest)]


def expose(
    radiance: NDArray[np.floating], opaque: NDArray[np.bool_] | None = None
) -> NDArray[np.float32]:
    """Linear radiance scaled into [0, 1]; a photograph that already lies there stays as it is.

    White is the radiance that only HIGHLIGHT_SHARE of the values exceed, but never below 1: an
    HDR photograph is darkened where it must be, not brightened. Pixels (y, x) that are not
    ``opaque`` have no say.

    >>> import numpy as np
    >>> expose(np.array([[[0.25, 0.5, 0.75]]])).tolist()  # inside [0, 1]: as it is
    [[[0.25, 0.5, 0.75]]]
    >>> expose(np.full((2, 2, 3), 4.0)).ravel().tolist() == [1.0] * 12
    True
    """
    seen = radiance if opaque is None else radiance[opaque]
    white = max(1.0, float(np.quantile(seen, 1.0 - HIGHLIGHT_SHARE)))
    return np.clip(radiance / white, 0.0, 1.0).astype(np.float32)


def fit_size(radiance: NDArray[np.floating], largest_side: int) -> NDArray[np.float32]:
    """The photograph averaged down until its longer side has at most ``largest_side`` pixels."""
    from skimage.transform import resize_local_mean

    height, width, channels = radiance.shape
    scale = largest_side / max(height, width)
    if scale >= 1.0:
        return radiance.astype(np.float32)
    shape = (max(1, round(height * scale)), max(1, round(width * scale)), channels)
    return resize_local_mean(radiance, shape, channel_axis=2).astype(np.float32)


def fit_cutout(
    radiance: NDArray[np.floating], opaque: NDArray[np.bool_], largest_side: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """The opaque pixels averaged down as ``fit_size`` does; what is half opaque stays so.

    Returns the radiance, 0 where it is transparent, and where it is opaque.

    >>> import numpy as np
    >>> opaque = np.array([[True, True, True, False], [True, True, False, False]])
    >>> light, left = fit_cutout(np.full((2, 4, 3), 0.6), opaque, 2)
    >>> left.tolist(), (light[..., 0] * 10).round().tolist()
    ([[True, False]], [[6.0, 0.0]])
    """
    seen = np.where(opaque[..., None], radiance, 0).astype(np.float32)
    share = fit_size(opaque[..., None].astype(np.float32), largest_side)
    light = fit_size(seen, largest_side)
    left = share[..., 0] >= 0.5
    return np.where(left[..., None], light / np.maximum(share, 0.5), 0).astype(np.float32), left
