"""How forms and rivals of one BTF are judged: by the same photographs and the same figures."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs
from pipelines.neural_btf.abrdf_pool import AbrdfReader
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.quality import judged_images, quality
from pipelines.neural_btf.restoration import restored_abrdfs

_EVERY = 7
"""Of more than a thousand photographs every seventh is judged: no multiple of a table's 81 lights,
so that all views and lights take part."""
_FIGURES = (
    "rmse",
    "rmse_over_null",
    "rmse_over_null_60",
    "rmse_over_deviation",
    "worst_photographs",
    "worst_texels",
    "psnr",
    "ssim",
    "flip",
    "flip_60",
    "grazing_detail",
)


class Judge(NamedTuple):
    """Measured ABRDFs and the photographs that errors are taken over."""

    abrdfs: NDArray[np.floating]
    """(texel, image, 3), radiance."""
    pairs: Pairs
    size: tuple[int, int]
    """Rows and columns of a photograph."""
    alpha: float
    chosen: NDArray[np.int64]
    """Numbers of the photographs."""

    @property
    def some(self) -> Pairs:
        """Their directions."""
        return Pairs(self.pairs.light[self.chosen], self.pairs.view[self.chosen])

    def figures(self, restore: AbrdfReader) -> dict[str, Any]:
        """Errors of a reader of ABRDFs (texel, chosen image, 3), radiance."""
        found = quality(
            restore,
            lambda first, last: self.abrdfs[first:last, self.chosen],
            self.some,
            self.size,
            self.alpha,
        )
        return {name: found[name] for name in _FIGURES if name in found}

    def figures_of(self, btf: CompressedBtf) -> dict[str, Any]:
        """Errors of a BTF."""
        return self.figures(restored_abrdfs(btf, self.some))


def judge_of(
    abrdfs: NDArray[np.floating], pairs: Pairs, size: tuple[int, int], alpha: float
) -> Judge:
    """Judge by all photographs, or by every seventh of many and those that are looked at.

    >>> from pipelines.light.directions import all_pairs, hemisphere_table
    >>> pairs = all_pairs(hemisphere_table(81), hemisphere_table(81))
    >>> len(judge_of(np.zeros((4, 6561, 3)), pairs, (2, 2), 1.0).chosen)
    960
    """
    count = len(pairs.light)
    every = np.arange(0, count, _EVERY if count > 1000 else 1)
    return Judge(abrdfs, pairs, size, alpha, np.union1d(every, judged_images(pairs)))
