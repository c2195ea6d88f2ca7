"""Rounding, its gradients and its price, by hand."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from pipelines.neural_btf.training.quantiser import Quantiser


def quantiser_with(steps: list[float]) -> Quantiser:
    found = Quantiser(torch.randn(50, len(steps)), 0.1, by_channel=True)
    with torch.no_grad():
        found.log_step.copy_(torch.log(torch.tensor(steps)))
    return found


def test_values_are_whole_numbers_of_steps_and_held_to_a_byte() -> None:
    quantiser = quantiser_with([0.5, 0.01])
    given = torch.tensor([[0.7, 0.0149], [-0.8, 9.0], [100.0, -9.0]])
    expected = torch.tensor([[0.5, 0.01], [-1.0, 1.27], [63.5, -1.27]])
    torch.testing.assert_close(quantiser(given), expected)
    np.testing.assert_array_equal(quantiser.symbols(given), [[1, 1], [-2, 127], [127, -127]])
    torch.testing.assert_close(
        quantiser(given),
        torch.from_numpy(quantiser.symbols(given).astype(np.float32) * quantiser.steps()),
    )


def test_the_first_steps_leave_no_value_outside() -> None:
    given = torch.zeros(1000, 2)
    given[:, 0] = torch.randn(1000)
    given[7] = torch.tensor([500.0, 3.0])
    for by_channel in (True, False):
        quantiser = Quantiser(given, 0.1, by_channel=by_channel)
        step = float(quantiser.step.max())
        assert float((quantiser(given) - given).abs().max()) <= step / 2 + 1e-3


def test_gradients_pass_the_rounding_and_tell_steps_what_it_misses() -> None:
    quantiser = quantiser_with([0.5])
    given = torch.tensor([[0.7], [1.0], [80.0]], requires_grad=True)
    quantiser(given).sum().backward()
    assert given.grad is not None
    torch.testing.assert_close(given.grad, torch.tensor([[1.0], [1.0], [0.0]]))
    # d/ds of s * round(v / s): round(v / s) - v / s inside, 127 outside; times s, for the log.
    wanted = (1 - 1.4) + (2 - 2.0) + 127
    assert quantiser.log_step.grad is not None
    assert float(quantiser.log_step.grad) == pytest.approx(0.5 * wanted, rel=1e-5)


@pytest.mark.parametrize("step", [0.05, 0.3, 1.0, 3.0])
def test_bits_are_the_entropy_of_rounded_normal_numbers(step: float) -> None:
    values = torch.from_numpy(np.random.default_rng(1).standard_normal((40_000, 1))).float()
    quantiser = quantiser_with([step])
    _, counts = np.unique(quantiser.symbols(values), return_counts=True)
    share = counts / counts.sum()
    entropy = -(share * np.log2(share)).sum()
    found = float(quantiser.bits(values).detach()) / len(values)
    assert found == pytest.approx(entropy, rel=0.03, abs=0.15)
