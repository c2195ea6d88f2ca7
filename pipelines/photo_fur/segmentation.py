"""Where in a photograph the fur is: what looks like its middle and not like its border.

Pixels are told apart by smoothed colour and by how rough they are at two scales. Two mixtures of
Gaussians, of fur and of all else, begin with the middle of the photograph and its border and are
fitted in turns with the mask, as in Rother, Kolmogorov and Blake, "GrabCut" (2004), but that
neighbours agree by smoothing and not by a cut: hair has no sharp border.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import encode_srgb

if TYPE_CHECKING:
    from sklearn.mixture import GaussianMixture

LEAST_SEPARATION = 2.0
"""Standard deviations between fur and the rest; below, the photograph is of one thing."""
_SIDE = 256
"""Pixels of the longer side at which pixels are told apart."""
_ROUNDS = 5
_MOST_SAMPLES = 3000
_LEAST_SPREAD = 8.0
"""Variance (L*a*b* units) that any part of a mixture has: light varies."""
_LARGEST_HOLE = 1 / 500
"""Of the picture: smaller ones are shadows or dirt in the fur."""
_USUAL, _STRANGE = 3.0, 4.5
"""Standard deviations from the fur's mean look: of what tells that mean, and of what is no fur."""
_MIDDLE, _BORDER = 0.3, 0.04
"""Radius of what is fur at first, in half sides; width of what is not, in sides."""


def fur_mask(radiance: NDArray[np.floating]) -> NDArray[np.bool_] | None:
    """(y, x): where a photograph (y, x, 3) of linear RGB in [0, 1] shows fur; None: everywhere.

    The fur must be in the middle. Equal photographs have equal masks.

    >>> row = np.linspace(0, 0.2, 96)
    >>> red = np.stack([0.3 + row, 0.1 + row, row], axis=-1) * np.ones((96, 1, 1))
    >>> fur_mask(red) is None
    True
    """
    from skimage.transform import resize, resize_local_mean

    height, width = radiance.shape[:2]
    scale = min(1.0, _SIDE / max(height, width))
    shape = (max(8, round(height * scale)), max(8, round(width * scale)), 3)
    looks = _looks(resize_local_mean(radiance, shape, channel_axis=2))
    mask = _parted(looks)
    if separation(looks, mask) < LEAST_SEPARATION:
        mask = np.ones_like(mask)
    mask &= ~_strangers(looks, mask)
    if mask.all():
        return None
    return np.asarray(resize(mask.astype(np.float64), (height, width), order=1) >= 0.5)


def separation(looks: NDArray[np.floating], mask: NDArray[np.bool_]) -> float:
    """How far the mean looks (y, x, n) inside and outside a mask are apart, in their common
    standard deviation (Mahalanobis); 0 where either holds hardly a pixel."""
    inside, outside = looks[mask], looks[~mask]
    if min(len(inside), len(outside)) < 0.02 * mask.size:
        return 0.0
    step = inside.mean(axis=0) - outside.mean(axis=0)
    common = (np.cov(inside.T) + np.cov(outside.T)) / 2 + _LEAST_SPREAD * np.eye(looks.shape[-1])
    return float(np.sqrt(step @ np.linalg.solve(common, step)))


def largest_square(mask: NDArray[np.bool_]) -> tuple[int, int, int]:
    """Left, top and side of the largest square of a mask (y, x) that holds nothing else.

    The side is odd, and 0 where the mask is empty.

    >>> largest_square(np.array([[1, 1, 1, 0], [1, 1, 1, 1], [1, 1, 1, 1]], bool))
    (0, 0, 3)
    """
    from scipy.ndimage import distance_transform_cdt

    reach = distance_transform_cdt(np.pad(mask, 1), "chessboard")[1:-1, 1:-1]
    row, column = np.unravel_index(int(reach.argmax()), mask.shape)
    half = int(reach[row, column])
    if half == 0:
        return 0, 0, 0
    return int(column) - half + 1, int(row) - half + 1, 2 * half - 1


def _looks(radiance: NDArray[np.floating]) -> NDArray[np.float64]:
    """(y, x, 5): L*, a*, b*, and logarithms of the roughness of L* at two scales."""
    from scipy.ndimage import gaussian_filter
    from skimage.color import rgb2lab

    lab = rgb2lab(np.clip(encode_srgb(radiance), 0.0, 1.0))
    light = lab[..., 0]
    fine = light - gaussian_filter(light, 2.0)
    coarse = gaussian_filter(light, 1.5) - gaussian_filter(light, 5.0)
    rough = [
        10.0 * np.log(2.0 + gaussian_filter(part**2, reach))
        for part, reach in ((fine, 3.0), (coarse, 5.0))
    ]
    smooth = [gaussian_filter(lab[..., channel], 2.0) for channel in range(3)]
    return np.stack([*smooth, *rough], axis=-1)


def _parted(looks: NDArray[np.float64]) -> NDArray[np.bool_]:
    """The fur and what it surrounds."""
    from scipy.ndimage import gaussian_filter

    height, width = looks.shape[:2]
    rows, columns = np.mgrid[:height, :width]
    across, down = 2 * columns / (width - 1) - 1, 2 * rows / (height - 1) - 1
    radius = np.hypot(across, down)
    to_border = np.minimum.reduce([rows, columns, height - 1 - rows, width - 1 - columns])
    fur, rest = radius < _MIDDLE, to_border < max(1.0, _BORDER * min(height, width))
    expected = 1.0 - 1.3 * np.minimum(radius, 1.2)
    for _ in range(_ROUNDS):
        inside, outside = _mixture(looks[fur], 2), _mixture(looks[rest], 5)
        samples = looks.reshape(-1, looks.shape[-1])
        likelier = inside.score_samples(samples) - outside.score_samples(samples)
        evidence = gaussian_filter(np.clip(likelier, -8.0, 8.0).reshape(height, width), 2.0)
        fur = _whole(evidence + expected > 0, radius < _MIDDLE)
        rest = ~fur
        if min(fur.mean(), rest.mean()) < 0.02:
            break
    return fur


def _strangers(looks: NDArray[np.float64], fur: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """What lies in the fur and looks like no other of it: eyes, a nose, a collar."""
    from scipy.ndimage import binary_dilation, gaussian_filter, label

    usual = fur
    for _ in range(3):  # what is strange has no say in what is usual
        apart = looks - looks[usual].mean(axis=0)
        common = np.cov(looks[usual].T) + _LEAST_SPREAD * np.eye(looks.shape[-1])
        distance = np.sqrt(np.einsum("yxn,nm,yxm->yx", apart, np.linalg.inv(common), apart))
        usual = fur & (distance < _USUAL)
    parts, _ = label(fur & (gaussian_filter(distance, 2.0) > _STRANGE))
    large = np.bincount(parts.ravel()) >= _LARGEST_HOLE * fur.size
    large[0] = False
    return np.asarray(binary_dilation(large[parts], iterations=3))


def _mixture(looks: NDArray[np.float64], parts: int) -> GaussianMixture:
    from sklearn.mixture import GaussianMixture

    random = np.random.default_rng(0)
    chosen = looks[random.permutation(len(looks))[:_MOST_SAMPLES]]
    mixture = GaussianMixture(
        min(parts, len(chosen)), reg_covar=_LEAST_SPREAD, random_state=0, max_iter=100, tol=1e-2
    )
    return mixture.fit(chosen)


def _whole(mask: NDArray[np.bool_], middle: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The part of a mask that most of the middle belongs to, without small holes."""
    from scipy.ndimage import label

    parts, _ = label(mask)
    within = np.bincount(parts[middle & mask], minlength=1)
    found = parts == within.argmax() if within.sum() else middle
    holes, _ = label(~found)
    small = np.bincount(holes.ravel()) < _LARGEST_HOLE * mask.size
    small[0] = False
    return np.asarray(found | small[holes])
