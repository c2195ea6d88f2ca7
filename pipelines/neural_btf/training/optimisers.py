"""What the stages descend by: plain gradient descent as in the paper, else Adam and Muon."""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from pipelines.neural_btf.network import Decoder, Encoder
from pipelines.neural_btf.training.plan import StageName

_ENCODER_RATE = 2e-3
_WARM_UP = 0.05
"""Share of a stage's steps on which the rate rises."""


def stage_optimisers(
    stage: StageName, encoder: Encoder, decoder: Decoder, latents: Tensor, rate: float
) -> list[torch.optim.Optimizer]:
    """The optimisers of what a stage trains; ``rate`` is the plan's."""
    of_encoder, of_decoder = list(encoder.parameters()), list(decoder.parameters())
    if stage == "paper":
        return [torch.optim.SGD([*of_encoder, *of_decoder], lr=rate)]
    if stage == "encoder":
        return [_adam([*of_encoder, *of_decoder], _ENCODER_RATE)]
    if stage == "distil":
        return [_adam(of_encoder, _ENCODER_RATE)]
    hidden = [decoder.second.weight, decoder.third.weight]
    others = [part for part in of_decoder if all(part is not matrix for matrix in hidden)]
    return [
        _adam([*others, latents], rate),
        torch.optim.Muon(hidden, lr=rate, weight_decay=0.0),
    ]


def rate_share(stage: StageName, fraction: float) -> float:
    """Share of the largest rate after a fraction of a stage's steps, 0.001 to 1.

    Constant in `paper`; else one cycle: a short way up, and a cosine down to zero.
    """
    if stage == "paper":
        return 1.0
    rising = min(1.0, fraction / _WARM_UP + 0.01)
    falling = max(0.0, (fraction - _WARM_UP) / (1.0 - _WARM_UP))
    return max(1e-3, rising * 0.5 * (1.0 + math.cos(math.pi * falling)))


def _adam(parameters: Sequence[Tensor], rate: float) -> torch.optim.Optimizer:
    return torch.optim.Adam(parameters, lr=rate, betas=(0.9, 0.99), fused=True)
