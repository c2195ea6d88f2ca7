"""Encoder and decoder against the paper's sizes and the layers written out in NumPy."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from pipelines.neural_btf.decoder_arrays import HIDDEN, LATENTS
from pipelines.neural_btf.network import (
    Decoder,
    Encoder,
    decoder_arrays,
    decoder_of,
    default_widths,
    encoder_blocks,
    encoder_of,
    encoder_vector,
    most_encoder_blocks,
)


def used_encoder(images: int, widths: tuple[int, ...]) -> Encoder:
    """An encoder whose batch statistics are no longer those of the beginning."""
    torch.manual_seed(3)
    encoder = Encoder(images, widths)
    for part in encoder.blocks:
        if isinstance(part, torch.nn.BatchNorm1d):
            torch.nn.init.uniform_(part.weight, 0.5, 1.5)
            torch.nn.init.normal_(part.bias)
    for _ in range(3):
        encoder(0.4 + 1.5 * torch.randn(16, images, 3))
    return encoder.eval()


# ---- sizes -----------------------------------------------------------------------------------


def test_the_decoder_is_as_large_as_in_table_1() -> None:
    parameters = sum(part.numel() for part in Decoder().parameters())
    assert parameters == 24_383
    assert round(4 * parameters / 1024, 1) == 95.2


@pytest.mark.parametrize(("images", "blocks"), [(6561, 3), (22_801, 4), (1508, 1), (225, 1)])
def test_an_encoder_has_the_papers_blocks(images: int, blocks: int) -> None:
    assert encoder_blocks(images) == blocks
    assert default_widths(images) == (8, 16, 16, 16)[:blocks]
    latents = Encoder(images, [4] * blocks)(torch.zeros(2, images, 3))
    assert latents.shape == (2, LATENTS)


@pytest.mark.parametrize(
    ("images", "most"),
    [
        (2, 0),
        (26, 2),
        (27, 3),
        (225, 4),
        (6561, 8),
        (243, 5),
    ],
)
def test_more_blocks_than_photographs_can_be_pooled_by_are_refused(images: int, most: int) -> None:
    assert most_encoder_blocks(images) == most
    assert Encoder(images, [2] * most).widths == (2,) * most
    message = (
        rf"^widths has {most + 1} blocks for {images} photographs; expected at most {most}, as"
    )
    with pytest.raises(ValueError, match=message):
        Encoder(images, [2] * (most + 1))


# ---- layers ----------------------------------------------------------------------------------


def encoded_plainly(encoder: Encoder, abrdfs: NDArray[np.float64]) -> NDArray[np.float64]:
    """The encoder in use, one sum after the other: abrdfs (texel, image, 3)."""
    arrays = {name: part.numpy().astype(float) for name, part in encoder.state_dict().items()}
    values = abrdfs
    for first in range(0, len(encoder.blocks), 4):
        kernel, bias = (arrays[f"blocks.{first}.{kind}"] for kind in ("weight", "bias"))
        edged = np.pad(values, ((0, 0), (1, 1), (0, 0)))
        convolved = np.zeros((*values.shape[:2], len(kernel))) + bias
        for place in range(values.shape[1]):
            for tap in range(3):
                convolved[:, place] += edged[:, place + tap] @ kernel[:, :, tap].T
        pooled = np.stack(
            [
                convolved[:, start : start + 3].max(axis=1)
                for start in range(0, values.shape[1] - 2, 3)
            ],
            axis=1,
        )
        norm = {
            kind: arrays[f"blocks.{first + 2}.{kind}"]
            for kind in ("running_mean", "running_var", "weight", "bias")
        }
        centred = (pooled - norm["running_mean"]) / np.sqrt(norm["running_var"] + 1e-5)
        values = np.maximum(centred * norm["weight"] + norm["bias"], 0)
    # Channel by channel, the photographs one after the other.
    flat = values.transpose(0, 2, 1).reshape(len(values), -1)
    return flat @ arrays["latents.weight"].T + arrays["latents.bias"]


@pytest.mark.parametrize(("images", "widths"), [(20, (5,)), (31, (4, 6)), (81, (3, 4, 5))])
def test_the_encoder_is_convolution_pooling_and_normalisation(
    images: int, widths: tuple[int, ...]
) -> None:
    encoder = used_encoder(images, widths)
    abrdfs = np.random.default_rng(0).standard_normal((4, images, 3))
    with torch.no_grad():
        found = encoder(torch.from_numpy(abrdfs).float()).numpy()
    np.testing.assert_allclose(found, encoded_plainly(encoder, abrdfs), atol=1e-5)


def test_the_grid_is_the_decoder_on_every_combination() -> None:
    torch.manual_seed(0)
    decoder, latents, directions = Decoder(), torch.randn(5, LATENTS), torch.randn(7, 4)
    with torch.no_grad():
        grid = decoder.grid(latents, directions)
        assert grid.shape == (5, 7, 3)
        for texel in range(5):
            for pair in range(7):
                one = decoder(latents[texel : texel + 1], directions[pair : pair + 1])[0]
                torch.testing.assert_close(grid[texel, pair], one, rtol=1e-5, atol=1e-6)


def test_the_grid_has_the_gradient_of_the_decoder() -> None:
    """The first layer's weights are used in two parts: both must learn."""
    torch.manual_seed(1)
    decoder, latents, directions = Decoder(), torch.randn(4, LATENTS), torch.randn(6, 4)
    wanted = torch.rand(4, 6, 3)
    (decoder.grid(latents, directions) - wanted).square().mean().backward()
    of_grid = [part.grad.clone() for part in decoder.parameters() if part.grad is not None]
    decoder.zero_grad()
    plain = decoder(latents.repeat_interleave(6, dim=0), directions.repeat(4, 1))
    (plain.reshape(4, 6, 3) - wanted).square().mean().backward()
    assert len(of_grid) == 8
    for one, part in zip(of_grid, decoder.parameters(), strict=True):
        torch.testing.assert_close(one, part.grad, rtol=1e-4, atol=1e-7)


# ---- storage ---------------------------------------------------------------------------------


def test_a_decoder_comes_back_from_its_arrays() -> None:
    torch.manual_seed(2)
    decoder = Decoder()
    arrays = decoder_arrays(decoder)
    assert {name: part.shape for name, part in arrays.items()} == {
        "weight_1": (HIDDEN, 12), "bias_1": (HIDDEN,), "weight_2": (HIDDEN, HIDDEN),
        "bias_2": (HIDDEN,), "weight_3": (HIDDEN, HIDDEN), "bias_3": (HIDDEN,),
        "weight_4": (3, HIDDEN), "bias_4": (3,),
    }  # fmt: skip
    back = decoder_of(arrays)
    inputs = torch.randn(9, LATENTS), torch.randn(9, 4)
    with torch.no_grad():
        torch.testing.assert_close(back(*inputs), decoder(*inputs), rtol=0, atol=0)


def test_a_decoder_is_read_from_half_floats_and_slices() -> None:
    """What a lossy store or an array's view holds, too."""
    arrays = decoder_arrays(Decoder())
    halves = {name: part.astype(np.float16)[::-1][::-1] for name, part in arrays.items()}
    for name, part in decoder_arrays(decoder_of(halves)).items():
        np.testing.assert_array_equal(part, arrays[name].astype(np.float16))


def test_an_encoder_comes_back_from_its_vector_with_its_batch_statistics() -> None:
    encoder = used_encoder(81, (4, 6))
    back = encoder_of(encoder_vector(encoder), 81, (4, 6))
    assert not back.training
    abrdfs = torch.randn(5, 81, 3)
    with torch.no_grad():
        torch.testing.assert_close(back(abrdfs), encoder(abrdfs), rtol=0, atol=0)


@pytest.mark.parametrize("more", [1, -1])
def test_a_vector_of_another_encoder_is_refused(more: int) -> None:
    vector = encoder_vector(Encoder(81, (4, 6)))
    size = len(vector)
    message = rf"^encoder has {size + more} numbers; expected {size}\.$"
    with pytest.raises(ValueError, match=message):
        encoder_of(np.resize(vector, size + more), 81, (4, 6))
