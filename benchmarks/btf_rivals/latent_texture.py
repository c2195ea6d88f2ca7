"""A latent texture with a small plain decoder, as neural materials use it: NeuMIP's, without mips.

Every texel has a few latents; four plain layers of 32 neurons make radiance of them and of the two
directions (Kuznetsov et al. 2021). Trained in float by Adam, the rate falling with a cosine; then
quantised: latents with steps by what an error of theirs does to the output, weights in whole bytes
or less, both entropy-coded. The number of latents, the start and the weights' bits are searched.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.btf_rivals.budget import filled
from benchmarks.btf_rivals.code_length import FACTOR, SCORES, code_bits
from benchmarks.btf_rivals.components import Components
from benchmarks.btf_rivals.rival import MeasuredBtf, Rival
from pipelines.neural_btf.decoder_arrays import direction_inputs

if TYPE_CHECKING:
    import torch

_HIDDEN = 32
_CHANNELS = (8, 12, 16, 24)
_WEIGHT_BITS = (6, 8, 10)
_BATCH_TEXELS, _BATCH_IMAGES = 64, 128
_RATE = 0.01
_SHORT = 8
"""A search's trainings take this part of the steps."""
_ROWS = 16


class _Network(NamedTuple):
    """Layers (weight, bias) and latents (texel, channel), in torch."""

    latents: torch.Tensor
    layers: list[torch.Tensor]

    def colours(self, latents: torch.Tensor, directions: torch.Tensor) -> torch.Tensor:
        """Values over alpha, (texel, image, 3), of latents (texel, c) x directions (image, 4)."""
        import torch

        first, bias, *rest = self.layers
        channels = latents.shape[1]
        hidden = (latents @ first[:, :channels].T)[:, None] + (
            directions @ first[:, channels:].T + bias
        )
        for weight, shift in zip(rest[::2], rest[1::2], strict=True):
            hidden = torch.relu(hidden) @ weight.T + shift
        return hidden


class _Quantised(NamedTuple):
    bytes: int
    network: _Network
    weight_bits: int


def latent_texture(
    measured: MeasuredBtf, components: Components, budget: int, *, steps: int
) -> Rival:
    """The best latent texture of ``budget`` bytes; the last training takes ``steps`` steps.

    A step is 64 texels x 128 photographs. Raises ValueError where the budget is too small.
    """
    tries: dict[tuple[int, str], float] = {}
    for channels in _CHANNELS:
        if channels < len(components.tensor):
            tries[channels, "components"] = _tried(measured, components, budget, steps, channels)
    if not tries:
        raise ValueError("a latent texture wants 8 principal components; give it a larger BTF.")
    channels = min(tries, key=lambda key: tries[key])[0]
    tries[channels, "random"] = _tried(measured, None, budget, steps, channels)
    start = min((s for c, s in tries if c == channels), key=lambda s: tries[channels, s])
    given = components if start == "components" else None
    network = _trained(measured, given, channels, steps)
    coded = _best_code(measured, network, budget)[1]
    if coded is None:
        raise ValueError(f"{budget} bytes are too few for a latent texture; give it more.")

    def restore(first: int, last: int) -> NDArray[np.float32]:
        return _restored(measured, coded.network, np.arange(first, last))

    settings = {"channels": channels, "start": start, "steps": steps}
    settings |= {"weight_bits": coded.weight_bits, "hidden": _HIDDEN}
    return Rival("latent_texture", coded.bytes, settings, restore)


def _tried(
    measured: MeasuredBtf, start: Components | None, budget: int, steps: int, channels: int
) -> float:
    """RMSE on the trial texels after a short training, in the budget's bytes."""
    short = max(1, steps // _SHORT)
    return _best_code(measured, _trained(measured, start, channels, short), budget)[0]


# ---- training --------------------------------------------------------------------------------


def _trained(
    measured: MeasuredBtf, start: Components | None, channels: int, steps: int
) -> _Network:
    """Trained in float, from principal components or, without them, at random."""
    import torch

    random = np.random.default_rng((measured.seed, channels))
    texels, images, _ = measured.abrdfs.shape
    if start is None:
        first = random.standard_normal((texels, channels)).astype(np.float32)
    else:
        first = start.texels[:, 1 : 1 + channels] * np.float32(texels**0.5)
    latents = torch.from_numpy(first.copy()).requires_grad_()
    network = _Network(latents, _first_layers(channels, random))
    directions = torch.from_numpy(direction_inputs(measured.pairs))
    optimiser = torch.optim.Adam([latents, *network.layers], lr=_RATE)
    for step in range(steps):
        optimiser.param_groups[0]["lr"] = _RATE * 0.5 * (1 + math.cos(math.pi * step / steps))
        some = random.integers(texels, size=min(_BATCH_TEXELS, texels))
        of = random.integers(images, size=min(_BATCH_IMAGES, images))
        wanted = torch.from_numpy(measured.abrdfs[some[:, None], of].astype(np.float32))
        found = network.colours(latents[torch.from_numpy(some)], directions[torch.from_numpy(of)])
        loss = ((found - wanted / measured.alpha) ** 2).mean()
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        optimiser.step()
    return _Network(latents.detach(), [part.detach() for part in network.layers])


def _first_layers(channels: int, random: np.random.Generator) -> list[torch.Tensor]:
    """Random weights by the width of what they take (He et al. 2015), biases of 0."""
    import torch

    widths = [channels + 4, _HIDDEN, _HIDDEN, _HIDDEN, 3]
    layers = []
    for inputs, outputs in itertools.pairwise(widths):
        weight = random.standard_normal((outputs, inputs)) * math.sqrt(2 / inputs)
        for values in (weight, np.zeros(outputs)):
            layers.append(torch.from_numpy(values.astype(np.float32)).requires_grad_())
    return layers


# ---- quantisation ----------------------------------------------------------------------------


def _best_code(
    measured: MeasuredBtf, network: _Network, budget: int
) -> tuple[float, _Quantised | None]:
    """The split of bits between weights and latents with the least error on the trial texels."""
    best: tuple[float, _Quantised | None] = (math.inf, None)
    worth = _worth(measured, network)
    for bits in _WEIGHT_BITS:
        layers, layer_bits = _coded_layers(network.layers, bits)

        def encode(
            step: float,
            layers: list[torch.Tensor] = layers,
            used: float = layer_bits,
            bits: int = bits,
        ) -> _Quantised:
            latents, latent_bits = _coded_latents(measured, network.latents, step / worth)
            total = int(np.ceil((latent_bits + used) / 8)) + 4
            return _Quantised(total, _Network(latents, layers), bits)

        coded = filled(encode, budget, 0.02)
        if coded is None:
            continue
        restored = _restored(measured, coded.network, measured.trial_texels)
        error = measured.trial_error(restored)
        if error < best[0]:
            best = error, coded
    return best


def _worth(measured: MeasuredBtf, network: _Network) -> NDArray[np.float32]:
    """Root of the mean squared change of the output by each latent, (channel,)."""
    import torch

    random = np.random.default_rng(measured.seed)
    some = torch.from_numpy(measured.trial_texels[:64])
    of = torch.from_numpy(random.integers(measured.abrdfs.shape[1], size=256))
    directions = torch.from_numpy(direction_inputs(measured.pairs))[of]
    latents = network.latents[some]
    small = 1e-2 * latents.std(dim=0)
    with torch.no_grad():
        before = network.colours(latents, directions)
        changes = []
        for channel, by in enumerate(small):
            moved = latents.clone()
            moved[:, channel] += by
            step = (network.colours(moved, directions) - before) / by
            changes.append(float(step.square().mean().sqrt()))
    return np.maximum(np.array(changes, np.float32), 1e-9)


def _coded_latents(
    measured: MeasuredBtf, latents: torch.Tensor, steps: NDArray[np.float32]
) -> tuple[torch.Tensor, float]:
    """Latents as they are decoded, and their bits with a step and a mean of each channel."""
    import torch

    values = latents.numpy()
    mean = values.mean(axis=0).astype(np.float16).astype(np.float32)
    symbols = np.rint((values - mean) / steps).astype(np.int32)
    bits = code_bits(np.ascontiguousarray(symbols.T).reshape(-1, *measured.size), SCORES)
    return torch.from_numpy((symbols * steps + mean).astype(np.float32)), bits + 32 * len(steps)


def _coded_layers(layers: list[torch.Tensor], bits: int) -> tuple[list[torch.Tensor], float]:
    """Weights with a step for each layer, biases as half floats, and the bits of all."""
    import torch

    coded, total = [], 0.0
    for values in layers:
        if values.ndim == 1:
            coded.append(values.half().float())
            total += 16 * values.numel()
            continue
        step = float(values.abs().max()) / (2 ** (bits - 1) - 1)
        symbols = np.rint(values.numpy() / step).astype(np.int32)
        coded.append(torch.from_numpy((symbols * step).astype(np.float32)))
        total += min(code_bits(symbols, FACTOR), float(bits * symbols.size)) + 16
    return coded, total


def _restored(
    measured: MeasuredBtf, network: _Network, texels: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Radiance (texel, image, 3), a few texels at a time."""
    import torch

    directions = torch.from_numpy(direction_inputs(measured.pairs))
    result = np.empty((len(texels), len(directions), 3), np.float32)
    with torch.no_grad():
        for first in range(0, len(texels), _ROWS):
            some = torch.from_numpy(texels[first : first + _ROWS])
            found = network.colours(network.latents[some], directions)
            result[first : first + _ROWS] = found.numpy()
    return np.clip(result, 0.0, 1.0) * np.float32(measured.alpha)
