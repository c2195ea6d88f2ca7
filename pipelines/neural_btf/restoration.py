"""What a compressed BTF restores, against what was measured."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs
from pipelines.neural_btf.abrdf_pool import AbrdfReader
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.decoder_arrays import direction_inputs
from pipelines.neural_btf.quality import judged_images, quality_figures
from pipelines.neural_btf.quality_sums import compare


class RestorationErrors(NamedTuple):
    """Root of the mean squared error of values over alpha (Eq. 10), over the three channels."""

    rmse: float
    """Over all images and texels."""
    of_image: NDArray[np.float64]
    """(image,)."""
    of_texel: NDArray[np.float64]
    """(texel,)."""
    quality: dict[str, float]
    """All figures of `quality`, with their nulls."""


def restored_abrdfs(compressed: CompressedBtf, pairs: Pairs) -> AbrdfReader:
    """A reader of restored ABRDFs (texel, image, 3), radiance: what `quality.quality` compares."""
    directions = direction_inputs(pairs)
    alpha = np.float32(compressed.alpha)
    return lambda first, last: compressed.abrdfs(first, last, directions) * alpha


def restoration_errors(
    compressed: CompressedBtf,
    read: AbrdfReader,
    pairs: Pairs,
    *,
    block: int,
    progress: Callable[[float], None] = lambda fraction: None,
) -> RestorationErrors:
    """Compare all of a BTF with what is restored, about ``block`` texels at a time.

    ``read`` gives measured ABRDFs (texel, image, 3), radiance.

    >>> from pipelines.light.directions import all_pairs, hemisphere_table
    >>> from pipelines.neural_btf.compressed import CompressedBtf
    >>> from pipelines.neural_btf.network import Decoder, decoder_arrays
    >>> pairs = all_pairs(hemisphere_table(15), hemisphere_table(15))
    >>> latents = np.zeros((12, 8), np.float32)
    >>> btf = CompressedBtf(decoder_arrays(Decoder()), latents, None, 1.0, height=3, width=4)
    >>> measured = btf.photographs(pairs).reshape(225, 12, 3).transpose(1, 0, 2)
    >>> errors = restoration_errors(btf, lambda a, b: measured[a:b], pairs, block=5)
    >>> errors.rmse < 1e-6, errors.of_image.shape, errors.of_texel.shape
    (True, (225,), (12,))
    """
    compared = compare(
        restored_abrdfs(compressed, pairs),
        read,
        pairs,
        (compressed.height, compressed.width),
        judged=judged_images(pairs),
        block=block,
        progress=progress,
    )
    figures = quality_figures(compared, pairs, compressed.alpha)
    return RestorationErrors(
        figures["rmse"],
        np.sqrt(compared.of_image) / compressed.alpha,
        np.sqrt(compared.of_texel) / compressed.alpha,
        figures,
    )
