"""The decoder in NumPy against torch's, and its inputs against Eq. 7-9 written out."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import torch

from pipelines.light.directions import all_pairs, hemisphere_table, unit_vectors
from pipelines.neural_btf.decoder_arrays import (
    DECODER_ARRAY_NAMES,
    DECODER_PARAMETERS,
    LATENTS,
    decode_in_numpy,
    direction_inputs,
    direction_inputs_of_vectors,
)
from pipelines.neural_btf.network import Decoder, decoder_arrays


def test_the_decoders_parameters_are_counted_from_its_layers() -> None:
    assert sum(part.numel() for part in Decoder().parameters()) == DECODER_PARAMETERS


def test_the_decoder_in_numpy_agrees_with_torchs() -> None:
    torch.manual_seed(0)
    decoder, latents, directions = Decoder(), torch.randn(6, LATENTS), torch.randn(11, 4)
    found = decode_in_numpy(decoder_arrays(decoder), latents.numpy(), directions.numpy())
    with torch.no_grad():
        expected = decoder.double().grid(latents.double(), directions.double())
    np.testing.assert_allclose(found, expected.numpy(), rtol=1e-9, atol=1e-12)


def test_the_names_are_those_of_the_networks_arrays_in_order() -> None:
    assert tuple(decoder_arrays(Decoder())) == DECODER_ARRAY_NAMES


def test_direction_inputs_are_light_then_view_on_the_stereographic_plane() -> None:
    pairs = all_pairs(hemisphere_table(15), hemisphere_table(41))
    found = direction_inputs(pairs)
    assert (found.shape, found.dtype) == ((15 * 41, 4), np.float32)
    for number in (0, 1, 40, 41, 300, 614):
        expected = [
            part
            for theta, phi in (pairs.light[number], pairs.view[number])
            for part in (
                math.tan(theta / 2) * math.cos(phi),
                math.tan(theta / 2) * math.sin(phi),
            )
        ]
        np.testing.assert_allclose(found[number], expected, atol=1e-7)


def test_inputs_of_vectors_are_those_of_their_angles() -> None:
    pairs = all_pairs(hemisphere_table(15), hemisphere_table(41))
    found = direction_inputs_of_vectors(unit_vectors(pairs.light), unit_vectors(pairs.view))
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, direction_inputs(pairs), atol=1e-7)


def test_a_compressed_btf_is_packed_and_weighed_without_torch() -> None:
    code = """
import sys
import numpy as np
from pipelines.neural_btf import figures
from pipelines.neural_btf.compressed import compressed_btf
decoder = {"weight_1": np.zeros((106, 12), np.float32)}
btf = compressed_btf(decoder, np.zeros((5, 8), np.float32), np.zeros(48, np.int32), 1.0, (6, 8))
print(btf.payload_bytes, "torch" in sys.modules, "numba" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [str(4 * (106 * 12 + 40 + 48)), "False", "False"]
