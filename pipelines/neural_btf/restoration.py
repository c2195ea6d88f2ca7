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


class RestorationErrors(NamedTuple):
    """Root of the mean squared error of values over alpha (Eq. 10), over the three channels."""

    rmse: float
    """Over all images and texels."""
    of_image: NDArray[np.float64]
    """(image,)."""
    of_texel: NDArray[np.float64]
    """(texel,)."""


def restoration_errors(
    compressed: CompressedBtf,
    read: AbrdfReader,
    pairs: Pairs,
    *,
    block: int,
    progress: Callable[[float], None] = lambda fraction: None,
) -> RestorationErrors:
    """Compare all of a BTF with what is restored, ``block`` texels at a time.

    ``read`` gives measured ABRDFs (texel, image, 3).

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
    directions = direction_inputs(pairs)
    of_image = np.zeros(len(directions))
    of_texel = np.zeros(compressed.texels)
    for first in range(0, compressed.texels, block):
        last = min(first + block, compressed.texels)
        step = compressed.abrdfs(first, last, directions)
        step -= read(first, last).astype(np.float32) / np.float32(compressed.alpha)
        squares = np.einsum("tic,tic->ti", step, step).astype(np.float64) / 3
        of_image += squares.sum(axis=0)
        of_texel[first:last] = squares.mean(axis=1)
        progress(last / compressed.texels)
    return RestorationErrors(
        float(np.sqrt(of_texel.mean())),
        np.sqrt(of_image / compressed.texels),
        np.sqrt(of_texel),
    )
