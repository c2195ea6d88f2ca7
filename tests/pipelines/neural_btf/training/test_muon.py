"""Muon beside PyTorch's, which multiplies in bfloat16, and beside singular values."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from pipelines.neural_btf.training.muon import Muon, orthogonalised


@pytest.mark.parametrize("shape", [(12, 12), (24, 8), (8, 24)])
def test_steps_are_those_of_pytorch(shape: tuple[int, int]) -> None:
    torch.manual_seed(0)
    first, gradients = torch.randn(shape), torch.randn(6, *shape)
    ours, theirs = (first.clone().requires_grad_() for _ in range(2))
    both = [
        (ours, Muon([ours], lr=0.02)),
        (theirs, torch.optim.Muon([theirs], lr=0.02, weight_decay=0.0)),
    ]
    for gradient in gradients:
        for matrix, optimiser in both:
            matrix.grad = gradient.clone()
            optimiser.step()
    moved = (theirs - first).norm()
    assert (ours - theirs).norm() < 0.02 * moved  # bfloat16 has eight bits
    assert (ours - first).norm() > 0.9 * moved


@pytest.mark.parametrize("shape", [(30, 30), (40, 10), (10, 40)])
def test_singular_values_become_about_one_and_vectors_stay(shape: tuple[int, int]) -> None:
    matrix = torch.from_numpy(np.random.default_rng(1).standard_normal(shape))
    left, before, right = torch.linalg.svd(matrix, full_matrices=False)
    heard = before > 0.01 * before.norm()
    after = torch.diagonal(left.T @ orthogonalised(matrix) @ right.T)
    assert float(before[heard].max() / before[heard].min()) > 2
    assert 0.65 < float(after[heard].min()) <= float(after.max()) < 1.25
    torch.testing.assert_close(left @ torch.diag(after) @ right, orthogonalised(matrix))


def test_a_matrix_without_a_gradient_stays() -> None:
    matrix = torch.ones(3, 3, requires_grad=True)
    Muon([matrix], lr=1.0).step()
    assert torch.equal(matrix, torch.ones(3, 3))
