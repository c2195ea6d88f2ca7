"""Whole numbers in place of weights and latents, while they are trained.

A value is a whole number, from -127 to 127, times a step that is learnt. Gradients pass the
rounding as if it were not there, and tell steps by how much rounding misses (Esser et al. 2020,
learned step size quantisation). `Quantiser.bits` is what the numbers take if each is coded by a
normal distribution of its channel: training weighs it against the error.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

LARGEST_SYMBOL = 127
_LEAST_DEVIATION = 0.05
_LEAST_CHANCE = 1e-9


class Quantiser(nn.Module):
    """Rounds values (…, channel) to multiples of a step a channel, or one step for all."""

    def __init__(self, values: Tensor, step: float, *, by_channel: bool) -> None:
        """``step``: at first, in standard deviations of what is rounded."""
        super().__init__()
        rows = values.detach().reshape(-1, values.shape[-1] if by_channel else 1)
        if not by_channel:
            rows = values.detach().reshape(-1, 1)
        deviation = rows.std(dim=0, correction=0)
        largest = rows.abs().amax(dim=0)
        first = torch.maximum(step * deviation, largest / LARGEST_SYMBOL)
        self.log_step = nn.Parameter(torch.log(first + 1e-8))

    @property
    def step(self) -> Tensor:
        """(channel,) or (1,)."""
        return torch.exp(self.log_step)

    def forward(self, values: Tensor) -> Tensor:
        """Multiples of the step, in float32."""
        scaled = values / self.step
        rounded = scaled + (torch.round(scaled) - scaled).detach()
        return rounded.clamp(-LARGEST_SYMBOL, LARGEST_SYMBOL) * self.step

    def bits(self, values: Tensor) -> Tensor:
        """What all numbers take together if a normal distribution a channel codes them."""
        return normal_bits((values / self.step).reshape(-1, len(self.log_step)))

    def whole(self, values: Tensor) -> Tensor:
        """The whole numbers as floats; gradients pass the rounding."""
        return self(values) / self.step

    def symbols(self, values: Tensor) -> NDArray[np.int32]:
        """The whole numbers, in the values' shape."""
        with torch.no_grad():
            rounded = torch.round(values / self.step).clamp(-LARGEST_SYMBOL, LARGEST_SYMBOL)
        return rounded.cpu().numpy().astype(np.int32)

    def steps(self) -> NDArray[np.float32]:
        """(channel,) or (1,) in NumPy."""
        return self.step.detach().cpu().numpy().astype(np.float32)


def normal_bits(numbers: Tensor, rounding: float = 0.0) -> Tensor:
    """Bits of numbers (n, channel), rounded, that a normal distribution a channel codes.

    ``rounding``: variance that rounding elsewhere adds to what is coded.
    """
    centred = numbers - numbers.mean(dim=0)
    deviation = torch.sqrt(centred.square().mean(dim=0) + rounding + _LEAST_DEVIATION**2)
    upper, lower = (centred + 0.5) / deviation, (centred - 0.5) / deviation
    chance = 0.5 * (torch.erf(upper * math.sqrt(0.5)) - torch.erf(lower * math.sqrt(0.5)))
    return -torch.log2(chance.clamp_min(_LEAST_CHANCE)).sum()
