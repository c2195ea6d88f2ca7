"""A rival of a compressed BTF, what it is made from, and its error."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs

_TRIAL_TEXELS = 300
_BLOCK = 200


class Rival(NamedTuple):
    """Another form of the same BTF: what it costs, and what is restored of those bytes."""

    name: str
    bytes: int
    settings: dict[str, Any]
    """What its search chose."""
    restore: Callable[[int, int], NDArray[np.float32]]
    """ABRDFs of texels first … last - 1 over all pairs, (texel, image, 3), radiance."""
    by_texel: bool = True
    """Whether a texel is had without those far from it; some rivals decode all at once."""


class MeasuredBtf:
    """ABRDFs (M, N, 3) of ``size`` (rows, columns) texels, on a grid of views x lights.

    Raises ValueError where texels or pairs are no such grid.
    """

    def __init__(
        self, abrdfs: NDArray[np.float16], size: tuple[int, int], pairs: Pairs, *, seed: int = 0
    ) -> None:
        texels, images, _ = abrdfs.shape
        if size[0] * size[1] != texels:
            raise ValueError(f"size is {size}; expected rows x columns of {texels} texels.")
        self.abrdfs, self.size, self.pairs, self.seed = abrdfs, size, pairs, seed
        views = np.unique(pairs.view, axis=0)
        lights = images // len(views)
        self.views, self.lights = pairs.view[::lights], pairs.light[:lights]
        """Directions (V, 2) and (L, 2), radians."""
        if not (
            np.array_equal(np.repeat(self.views, lights, axis=0), pairs.view)
            and np.array_equal(np.tile(self.lights, (len(views), 1)), pairs.light)
        ):
            raise ValueError("pairs are no grid; expected every view with every light, by views.")
        self.alpha = float(abrdfs.max())
        random = np.random.default_rng(seed)
        count = min(_TRIAL_TEXELS, texels)
        self.trial_texels = np.sort(random.choice(texels, count, replace=False))
        """Texels that searches judge by; what is reported is of all of them."""

    @functools.cached_property
    def trial_abrdfs(self) -> NDArray[np.float32]:
        """ABRDFs (texel, image, 3) of the trial texels."""
        return self.abrdfs[self.trial_texels].astype(np.float32)

    def trial_error(self, restored: NDArray[np.float32]) -> float:
        """RMSE over alpha of what is restored (texel, image, 3) of the trial texels."""
        step = (restored - self.trial_abrdfs).ravel()
        return float(np.sqrt(np.dot(step, step) / step.size) / self.alpha)


def rival_rmse(rival: Rival, abrdfs: NDArray[np.float16], alpha: float) -> float:
    """RMSE over alpha of all that a rival restores, against ABRDFs (texel, image, 3)."""
    total = 0.0
    for first in range(0, len(abrdfs), _BLOCK):
        wanted = abrdfs[first : first + _BLOCK].astype(np.float32)
        step = (rival.restore(first, first + len(wanted)) - wanted).ravel()
        total += float(np.dot(step, step))
    return float(np.sqrt(total / abrdfs.size) / alpha)
