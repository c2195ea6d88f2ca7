"""The decoder as arrays: its size, its inputs and its values, in NumPy (figure 5).

No torch here: a compressed BTF is loaded, weighed and checked without. `network.Decoder` is the
same in torch, which trains and decodes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.light.directions import Pairs, stereographic, stereographic_of_vectors

LATENTS = 8
DIRECTIONS = 4
"""Light and view on the stereographic plane, two numbers each."""
HIDDEN = 106
"""Neurons of a hidden layer: three of them give the 24 383 parameters of the paper's table 1."""
STUDENT_HIDDEN = 44
"""Neurons of a hidden layer of the smaller decoder: a fifth of the products, four a vector."""
LAYERS = 4
DECODER_PARAMETERS = (
    (LATENTS + DIRECTIONS) * HIDDEN + HIDDEN + 2 * (HIDDEN * HIDDEN + HIDDEN) + HIDDEN * 3 + 3
)
"""24 383."""

DecoderArrays = Mapping[str, NDArray[np.floating]]
"""Weights (out, in) and biases (out,) of the four layers, ``weight_1``, ``bias_1`` … ``bias_4``."""

DECODER_ARRAY_NAMES = tuple(
    f"{kind}_{layer}" for layer in range(1, LAYERS + 1) for kind in ("weight", "bias")
)


def direction_inputs(pairs: Pairs) -> NDArray[np.float32]:
    """Light and view of pairs as the decoder takes them, (image, 4) (Eq. 7-9).

    >>> from pipelines.light.directions import all_pairs, hemisphere_table
    >>> table = hemisphere_table(15)
    >>> inputs = direction_inputs(all_pairs(table, table))
    >>> inputs.shape, inputs[0].tolist()  # from above, lit from above
    ((225, 4), [0.0, 0.0, 0.0, 0.0])
    """
    both = [stereographic(pairs.light), stereographic(pairs.view)]
    return np.concatenate(both, axis=-1).astype(np.float32)


def direction_inputs_of_vectors(light: ArrayLike, view: ArrayLike) -> NDArray[np.float32]:
    """The same of unit vectors (n, 3) in the texture's frame, z >= 0: (n, 4)."""
    both = [stereographic_of_vectors(light), stereographic_of_vectors(view)]
    return np.concatenate(both, axis=1).astype(np.float32)


def decode_in_numpy(
    arrays: DecoderArrays, latents: NDArray[np.floating], directions: NDArray[np.floating]
) -> NDArray[np.float64]:
    """RGB over alpha, (texel, pair, 3), for latents (texel, 8) and direction inputs (pair, 4).

    The network written out in double precision: what torch's is compared with.

    >>> sizes = (12, 106, 106, 106, 3)
    >>> arrays = {f"weight_{n}": np.zeros((sizes[n], sizes[n - 1])) for n in range(1, 5)}
    >>> arrays |= {f"bias_{n}": np.full(sizes[n], 0.5) for n in range(1, 5)}
    >>> values = decode_in_numpy(arrays, np.zeros((7, 8)), np.zeros((2, 4)))
    >>> values.shape, values[0, 0].tolist()
    ((7, 2, 3), [0.5, 0.5, 0.5])
    """
    inputs = [latents[:, None].repeat(len(directions), 1), directions[None].repeat(len(latents), 0)]
    values = np.concatenate(inputs, axis=-1).astype(np.float64)
    for layer in range(1, LAYERS + 1):
        values = values @ arrays[f"weight_{layer}"].T.astype(np.float64) + arrays[f"bias_{layer}"]
        if layer < LAYERS:
            values = np.maximum(values, 0.0)
    return values
