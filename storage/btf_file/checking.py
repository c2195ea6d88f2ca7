"""Whether a file can hold what it is to hold."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from storage.btf_file import layout
from storage.btf_file.contents import LARGEST_SYMBOL, BtfFile, Quantised, Tensor, level_size


def check_contents(btf: BtfFile) -> None:
    """Raise ValueError, one sentence, for a BTF that no file can hold."""
    texels = btf.height * btf.width
    if not (1 <= btf.height <= 65535 and 1 <= btf.width <= 65535):
        _refuse("size", f"{btf.height} x {btf.width}", "1 to 65535 texels a side")
    vectors = texels if btf.ids is None else len(_shaped(btf.latents))
    channels = _shaped(btf.latents)[-1] if len(_shaped(btf.latents)) == 2 else 0
    if not 1 <= channels <= layout.MOST_CHANNELS or texels * channels > layout.MOST_LATENTS:
        expected = f"1 to {layout.MOST_CHANNELS} channels, {layout.MOST_LATENTS} in all"
        _refuse("latents", f"{texels} x {channels}", expected)
    if btf.ids is not None:
        vectors = _shaped(btf.latents)[0]
        if btf.ids.shape != (texels,) or btf.ids.min() < 0 or btf.ids.max() >= vectors:
            _refuse("ids", f"{btf.ids.shape}, not all latent vectors'", f"({texels},)")
        if vectors > texels:
            _refuse("latent vectors", f"{vectors}", f"at most {texels}, the texels")
    _check_tensor("latents", btf.latents, (vectors, channels), channels)
    most = (max(btf.height, btf.width) - 1).bit_length()
    if len(btf.mips) > most:
        _refuse("coarser levels", f"{len(btf.mips)}", f"at most {most}")
    for number, level in enumerate(btf.mips, 1):
        shape = math.prod(level_size(btf.height, btf.width, number)), channels
        _check_tensor(f"level {number}", level, shape, channels)
        if not np.array_equal(level.step, btf.mips[0].step):
            _refuse(f"level {number}", "of other steps", "the steps of level 1")
    _check_decoder("decoder", btf.decoder, channels)
    if btf.student:
        _check_decoder("student", btf.student, channels)
    _check_numbers(btf)


def _check_numbers(btf: BtfFile) -> None:
    numbers = np.array([btf.alpha, btf.least, btf.largest], np.float32)
    if not (0 < numbers[0] < math.inf and numbers[1] <= numbers[2]):
        _refuse("alpha, least, largest", f"{numbers.tolist()}", "above 0, and two in order")
    parallax = btf.parallax
    if parallax is not None and (parallax.shape != (9, 2) or not np.isfinite(parallax).all()):
        _refuse("parallax", f"{parallax.shape}, or not finite", "(9, 2) finite numbers")


def _check_decoder(name: str, decoder: Mapping[str, Tensor], channels: int) -> None:
    layers = len(decoder) // 2
    names = {f"{kind}_{layer}" for layer in range(1, layers + 1) for kind in ("weight", "bias")}
    if set(decoder) != names or not 1 <= layers <= layout.MOST_LAYERS:
        _refuse(name, f"{sorted(decoder)}", f"weight_1, bias_1 to {layout.MOST_LAYERS} layers")
    inputs = channels + layout.DIRECTIONS
    weights = 0
    for layer in range(1, layers + 1):
        outputs = _shaped(decoder[f"bias_{layer}"])[0]
        if not 1 <= outputs <= layout.MOST_WIDTH:
            _refuse(f"{name}, layer {layer}", f"{outputs}", f"1 to {layout.MOST_WIDTH} outputs")
        _check_tensor(f"weight_{layer}", decoder[f"weight_{layer}"], (outputs, inputs))
        _check_tensor(f"bias_{layer}", decoder[f"bias_{layer}"], (outputs,))
        weights += outputs * (inputs + 1)
        inputs = outputs
    if inputs != layout.COLOURS:
        _refuse(f"{name}, outputs", f"{inputs}", f"{layout.COLOURS} colours")
    if weights > layout.MOST_WEIGHTS:
        _refuse(f"{name}, weights", f"{weights}", f"at most {layout.MOST_WEIGHTS}")


def _check_tensor(
    name: str, tensor: Tensor, shape: tuple[int, ...], channels: int | None = None
) -> None:
    """``channels``: there is a step for each; None: there is one step."""
    if _shaped(tensor) != shape:
        _refuse(name, f"{_shaped(tensor)}", f"{shape}")
    if isinstance(tensor, Quantised):
        steps = np.asarray(tensor.step, np.float32)
        if steps.shape != (() if channels is None else (channels,)):
            _refuse(f"{name}, step", f"{steps.shape}", "one, or for latents one a channel")
        if not (np.isfinite(steps).all() and (steps > 0).all()):
            _refuse(f"{name}, step", "not finite, or not above 0", "positive numbers")
        if not np.issubdtype(tensor.symbols.dtype, np.integer):
            _refuse(f"{name}, symbols", f"{tensor.symbols.dtype}", "whole numbers")
        if np.abs(tensor.symbols.astype(np.int64)).max() > LARGEST_SYMBOL:
            _refuse(f"{name}, symbols", "larger", f"-{LARGEST_SYMBOL} to {LARGEST_SYMBOL}")
    elif not np.isfinite(tensor).all():
        _refuse(name, "not finite", "finite values")


def _shaped(tensor: Tensor) -> tuple[int, ...]:
    return (tensor.symbols if isinstance(tensor, Quantised) else tensor).shape


def _refuse(field: str, found: str, expected: str) -> None:
    raise ValueError(f"BTF file: {field} is {found}; expected {expected}.")
