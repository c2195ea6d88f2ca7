"""All rivals of a BTF at one number of bytes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.btf_rivals.components import components_of
from benchmarks.btf_rivals.latent_texture import latent_texture
from benchmarks.btf_rivals.nulls import nulls
from benchmarks.btf_rivals.photographs import photographs
from benchmarks.btf_rivals.rival import MeasuredBtf, Rival
from benchmarks.btf_rivals.tucker import factorisation
from pipelines.light.directions import Pairs


def rivals_at(
    abrdfs: NDArray[np.float16],
    size: tuple[int, int],
    pairs: Pairs,
    budget: int,
    *,
    steps: int,
    seed: int,
) -> list[Rival]:
    """Every rival of ABRDFs (M, N, 3) at no more than ``budget`` bytes, and the two nulls.

    ``size`` is (rows, columns) of the texels, ``pairs`` every view with every light, by views;
    ``steps`` train the latent texture. The nulls have the bytes that they have.
    Raises ValueError where the budget is too small for one of them.
    """
    measured = MeasuredBtf(abrdfs, size, pairs, seed=seed)
    components = components_of(measured)
    return [
        factorisation("pca", measured, components, budget, cosines=False),
        factorisation("tucker", measured, components, budget, cosines=False),
        factorisation("tucker_cosines", measured, components, budget, cosines=True),
        latent_texture(measured, components, budget, steps=steps),
        photographs(measured, budget),
        *nulls(measured),
    ]
