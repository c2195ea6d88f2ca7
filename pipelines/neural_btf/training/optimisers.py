"""What the stages descend by: plain gradient descent as in the paper, else Adam and Muon."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

from pipelines.neural_btf.network import Decoder, Encoder
from pipelines.neural_btf.training.muon import Muon
from pipelines.neural_btf.training.plan import StageName

_ENCODER_RATE = 2e-3
_PARALLAX_RATE = 3.0
"""Of the plan's rate: parallax is in texels."""
_WARM_UP = 0.05
"""Share of a stage's steps on which the rate rises."""


def stage_optimisers(
    stage: StageName,
    encoder: Encoder,
    decoder: Decoder,
    texture: tuple[Tensor, Tensor],
    rate: float,
) -> list[torch.optim.Optimizer]:
    """The optimisers of what a stage trains; ``texture``: latents and parallax."""
    of_encoder, of_decoder = list(encoder.parameters()), list(decoder.parameters())
    if stage == "paper":
        return [torch.optim.SGD([*of_encoder, *of_decoder], lr=rate)]
    if stage == "encoder":
        return [adam([*of_encoder, *of_decoder], _ENCODER_RATE)]
    if stage == "distil":
        return [adam(of_encoder, _ENCODER_RATE)]
    latents, parallax = texture
    weights = {
        f"{kind}_{number}": getattr(layer, kind)
        for number, layer in enumerate(decoder.layers, start=1)
        for kind in ("weight", "bias")
    }
    return [*decoder_optimisers(weights, [latents], rate), parallax_optimiser(parallax, rate)]


def decoder_optimisers(
    weights: Mapping[str, Tensor], latents: Sequence[Tensor], rate: float
) -> list[torch.optim.Optimizer]:
    """Muon for a decoder's hidden layers, Adam for the others and for latents.

    ``weights``: ``weight_1``, ``bias_1`` …
    """
    hidden = [weights["weight_2"], weights["weight_3"]]
    others = [part for part in weights.values() if all(part is not matrix for matrix in hidden)]
    return [adam([*others, *latents], rate), Muon(hidden, lr=rate)]


def parallax_optimiser(parallax: Tensor, rate: float) -> torch.optim.Optimizer:
    """Adam for parallax; ``rate`` is that of the decoder."""
    return adam([parallax], _PARALLAX_RATE * rate)


def rate_share(stage: StageName, fraction: float) -> float:
    """Share of the largest rate after a fraction of a stage's steps, 0.001 to 1.

    Constant in `paper`; else one cycle: a short way up, and a cosine down to zero.
    """
    if stage == "paper":
        return 1.0
    rising = min(1.0, fraction / _WARM_UP + 0.01)
    falling = max(0.0, (fraction - _WARM_UP) / (1.0 - _WARM_UP))
    return max(1e-3, rising * 0.5 * (1.0 + math.cos(math.pi * falling)))


def adam(parameters: Sequence[Tensor], rate: float) -> torch.optim.Optimizer:
    """Adam as all stages but the paper's use it."""
    return torch.optim.Adam(parameters, lr=rate, betas=(0.9, 0.99), fused=True)
