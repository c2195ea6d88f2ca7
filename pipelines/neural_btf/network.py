"""Encoder and decoder of the neural BTF (paper 1, section 2.4; Rainer et al. 2019).

The encoder turns an ABRDF into 8 latents; the decoder turns latents and a pair of directions into
the RGB of one texel. Only the decoder and the latents are kept at run time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from pipelines.neural_btf.decoder_arrays import DIRECTIONS, HIDDEN, LATENTS, DecoderArrays

_MOST_AFTER_POOLING = 503
"""Values that may be left after the pooling: 1508 photographs need one block, 22 801 four."""


def encoder_blocks(images: int) -> int:
    """Blocks of convolution and pooling: 3 for 6561 photographs, 4 for 22 801, 1 for 1508."""
    return max(1, math.ceil(math.log(images / _MOST_AFTER_POOLING, 3)))


def default_widths(images: int) -> tuple[int, ...]:
    """Channels of the blocks of an encoder for so many photographs: 8, 16, 16, … (unsaid)."""
    return (8, *(16,) * (encoder_blocks(images) - 1))


def most_encoder_blocks(images: int) -> int:
    """Blocks that leave at least one value of so many photographs."""
    blocks = 0
    while images >= 3:
        images, blocks = images // 3, blocks + 1
    return blocks


class Encoder(nn.Module):
    """ABRDFs (texel, image, channel), standardised, to latents (texel, 8).

    A block is a convolution over the photographs' numbers (kernel 3, stride 1, padding 1), max
    pooling (kernel 3, stride 3) and batch normalisation, with the ReLU that the paper names as the
    network's activation. ``widths`` are the channels of the blocks.
    """

    def __init__(self, images: int, widths: Sequence[int]) -> None:
        super().__init__()
        self.widths = tuple(widths)
        blocks, channels, length = [], 3, images
        for width in widths:
            blocks += [
                nn.Conv1d(channels, width, kernel_size=3, stride=1, padding=1),
                nn.MaxPool1d(kernel_size=3, stride=3),
                nn.BatchNorm1d(width),
                nn.ReLU(),
            ]
            channels, length = width, length // 3
        if length < 1:
            raise ValueError(
                f"widths has {len(widths)} blocks for {images} photographs; expected at most "
                f"{most_encoder_blocks(images)}, as every block leaves a third."
            )
        self.blocks = nn.Sequential(*blocks)
        self.latents = nn.Linear(channels * length, LATENTS)

    def forward(self, abrdfs: Tensor) -> Tensor:
        """Latents of standardised ABRDFs (x3)."""
        found: Tensor = self.latents(self.blocks(abrdfs.transpose(1, 2)).flatten(1))
        return found


class Decoder(nn.Module):
    """12 inputs (8 latents, light, view on the stereographic plane), 3 x 106 neurons, RGB.

    ``hidden``: neurons of a hidden layer, 106 in the paper; ``latents``: 8 in the paper.
    """

    def __init__(self, hidden: int = HIDDEN, latents: int = LATENTS) -> None:
        super().__init__()
        self.latents = latents
        self.first = nn.Linear(latents + DIRECTIONS, hidden)
        self.second = nn.Linear(hidden, hidden)
        self.third = nn.Linear(hidden, hidden)
        self.last = nn.Linear(hidden, 3)

    @property
    def layers(self) -> tuple[nn.Linear, ...]:
        """The four layers in order."""
        return self.first, self.second, self.third, self.last

    def forward(self, latents: Tensor, directions: Tensor) -> Tensor:
        """RGB over alpha, (n, 3), of latents (n, 8) and pairs of directions (n, 4)."""
        return self._after_first(self.first(torch.cat([latents, directions], dim=1)))

    def grid(self, latents: Tensor, directions: Tensor) -> Tensor:
        """RGB over alpha, (texel, pair, 3): every texel's latents with every pair of directions.

        The first layer is a sum of what the latents and what the directions bring; both are
        computed once, not for every combination.
        """
        of_latents = latents @ self.first.weight[:, : self.latents].T
        of_directions = directions @ self.first.weight[:, self.latents :].T + self.first.bias
        summed = of_latents[:, None] + of_directions[None]
        colours = self._after_first(summed.flatten(0, 1))
        return colours.reshape(len(latents), len(directions), 3)

    def grid_by_view(self, latents: Tensor, directions: Tensor) -> Tensor:
        """RGB over alpha, (texel, view * light, 3): latents (texel, view, 8), which differ by the
        view, with pairs of directions (view, light, 4)."""
        of_latents = latents @ self.first.weight[:, : self.latents].T
        of_directions = directions @ self.first.weight[:, self.latents :].T + self.first.bias
        summed = of_latents[:, :, None] + of_directions[None]
        colours = self._after_first(summed.flatten(0, 2))
        return colours.reshape(len(latents), -1, 3)

    def _after_first(self, values: Tensor) -> Tensor:
        hidden = torch.relu(self.third(torch.relu(self.second(torch.relu(values)))))
        colours: Tensor = self.last(hidden)
        return colours


def decoder_arrays(decoder: Decoder) -> dict[str, NDArray[np.float32]]:
    """A decoder's `decoder_arrays.DecoderArrays`.

    >>> arrays = decoder_arrays(Decoder())
    >>> arrays["weight_1"].shape, arrays["bias_4"].shape, sum(part.size for part in arrays.values())
    ((106, 12), (3,), 24383)
    """
    arrays = {}
    for number, layer in enumerate(decoder.layers, start=1):
        arrays[f"weight_{number}"] = layer.weight.detach().cpu().numpy().astype(np.float32)
        arrays[f"bias_{number}"] = layer.bias.detach().cpu().numpy().astype(np.float32)
    return arrays


def decoder_of(arrays: DecoderArrays) -> Decoder:
    """The decoder of arrays named as `decoder_arrays` names them."""
    neurons, inputs = arrays["weight_1"].shape
    decoder = Decoder(neurons, inputs - DIRECTIONS)
    with torch.no_grad():
        for number, layer in enumerate(decoder.layers, start=1):
            for kind, part in (("weight", layer.weight), ("bias", layer.bias)):
                values = np.ascontiguousarray(arrays[f"{kind}_{number}"], dtype=np.float32)
                part.copy_(torch.from_numpy(values))
    return decoder.eval()


def encoder_vector(encoder: Encoder) -> NDArray[np.float32]:
    """Parameters and batch statistics of an encoder in one vector, for storage."""
    state = encoder.state_dict().values()
    floats = [part.detach().cpu().numpy().ravel() for part in state if part.is_floating_point()]
    return np.concatenate(floats).astype(np.float32)


def encoder_of(vector: NDArray[np.float32], images: int, widths: Sequence[int]) -> Encoder:
    """The encoder of a vector that `encoder_vector` made."""
    encoder = Encoder(images, widths)
    state, start = encoder.state_dict(), 0
    expected = sum(part.numel() for part in state.values() if part.is_floating_point())
    if len(vector) != expected:
        raise ValueError(f"encoder has {len(vector)} numbers; expected {expected}.")
    for name, part in state.items():
        if part.is_floating_point():
            values = vector[start : start + part.numel()].reshape(tuple(part.shape))
            state[name] = torch.from_numpy(values.copy())
            start += part.numel()
    encoder.load_state_dict(state)
    return encoder.eval()


def device() -> torch.device:
    """A graphics card where there is one, else the CPU."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def autocast(on: torch.device) -> torch.autocast:
    """Products in bfloat16 where there are instructions for it, else in single precision.

    Without them, as on processors with AVX2 alone, bfloat16 takes ten times as long.
    """
    fast = on.type != "cpu" or torch.backends.cpu.get_cpu_capability() == "AVX512"
    return torch.autocast(on.type, torch.bfloat16, enabled=fast)
