"""A decoder whose weights and biases are rounded whenever they are used."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.utils import parametrize

from pipelines.neural_btf.network import Decoder, decoder_arrays, decoder_of
from pipelines.neural_btf.training.quantiser import Quantiser

_FIRST_STEPS = {"weight": 0.08, "bias": 0.02}
"""Steps of quantisation at first, in standard deviations."""


def widened(decoder: Decoder, more: int) -> Decoder:
    """A copy that takes so many more latents, and does not heed them yet."""
    arrays = decoder_arrays(decoder)
    of_latents, of_directions = np.split(arrays["weight_1"], [decoder.latents], axis=1)
    nothing = np.zeros((len(of_latents), more), np.float32)
    wider = np.concatenate([of_latents, nothing, of_directions], axis=1)
    return decoder_of({**arrays, "weight_1": wider})


def quantised_decoder(decoder: Decoder) -> Decoder:
    """The decoder itself, with a `Quantiser` on each weight matrix and bias."""
    for layer in decoder.layers:
        for name in ("weight", "bias"):
            first = Quantiser(getattr(layer, name), _FIRST_STEPS[name], by_channel=False)
            parametrize.register_parametrization(layer, name, first)
    return decoder


def quantised_parts(decoder: Decoder) -> dict[str, tuple[Quantiser, Tensor]]:
    """Quantiser and unrounded values of ``weight_1``, ``bias_1`` …"""
    parts = {}
    for number, layer in enumerate(decoder.layers, start=1):
        for name in ("weight", "bias"):
            entry: Any = layer.get_submodule(f"parametrizations.{name}")
            parts[f"{name}_{number}"] = (entry[0], entry.original)
    return parts


def unrounded(decoder: Decoder) -> dict[str, Tensor]:
    """Unrounded values of ``weight_1``, ``bias_1`` …"""
    return {name: original for name, (_, original) in quantised_parts(decoder).items()}


def whole_numbers(decoder: Decoder) -> dict[str, tuple[NDArray[np.int32], NDArray[np.float32]]]:
    """Whole numbers and step () of ``weight_1``, ``bias_1`` …"""
    return {
        name: (quantiser.symbols(original), quantiser.steps().reshape(()))
        for name, (quantiser, original) in quantised_parts(decoder).items()
    }
