"""The figures of the checks against the paper's table and cases with known answers."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from pipelines.light.directions import Pairs, all_pairs, hemisphere_table
from pipelines.neural_btf.figures import (
    DECODER_PARAMETERS,
    decoded_plainly,
    missing_pairs,
    spread_ratio,
    statistics_error,
    table_bytes,
    transposition_error,
)
from pipelines.neural_btf.network import LATENTS, Decoder, decoder_arrays


@pytest.mark.parametrize(
    ("clusters", "exact", "paper_kb"),
    [(10_000, 417_532, 408), (500, 153_532, 150), (1000, 169_532, 166), (2000, 201_532, 197)],
)
def test_bytes_are_those_of_table_1(clusters: int, exact: int, paper_kb: int) -> None:
    assert table_bytes(clusters, 10_000) == exact
    assert round(exact / 1024) == paper_kb


@pytest.mark.parametrize(
    ("clusters", "ratio"), [(10_000, 1885.7), (500, 5128.1), (1000, 4644.1), (2000, 3906.7)]
)
def test_ratios_are_those_of_the_exact_sizes(clusters: int, ratio: float) -> None:
    raw = 6561 * 10_000 * 3 * 4
    assert raw / table_bytes(clusters, 10_000) == pytest.approx(ratio, abs=0.05)


def test_the_decoders_parameters_are_counted_from_its_layers() -> None:
    assert sum(part.numel() for part in Decoder().parameters()) == DECODER_PARAMETERS


def test_the_plain_decoder_agrees_with_torchs() -> None:
    torch.manual_seed(0)
    decoder, latents, directions = Decoder(), torch.randn(6, LATENTS), torch.randn(11, 4)
    found = decoded_plainly(decoder_arrays(decoder), latents.numpy(), directions.numpy())
    with torch.no_grad():
        expected = decoder.double().grid(latents.double(), directions.double())
    np.testing.assert_allclose(found, expected.numpy(), rtol=1e-9, atol=1e-12)


# ---- pairs -----------------------------------------------------------------------------------


def test_no_pair_is_missing_from_a_full_table() -> None:
    assert missing_pairs(all_pairs(hemisphere_table(15), hemisphere_table(41))) == 0


def test_pairs_that_are_missing_or_there_twice_are_counted() -> None:
    pairs = all_pairs(hemisphere_table(15), hemisphere_table(15))
    order = np.random.default_rng(0).permutation(225)
    kept = Pairs(pairs.light[order[:-3]], pairs.view[order[:-3]])
    assert missing_pairs(kept) == 3
    doubled = np.append(order, order[:2])
    assert missing_pairs(Pairs(pairs.light[doubled], pairs.view[doubled])) == 2


# ---- clusters --------------------------------------------------------------------------------


def test_the_spread_is_all_in_one_cluster_and_none_in_clusters_of_one() -> None:
    scores = np.random.default_rng(0).standard_normal((30, 4)).astype(np.float32)
    assert spread_ratio(scores, np.zeros(30, int)) == pytest.approx(1.0)
    assert spread_ratio(scores, np.arange(30)) == 0.0


def test_the_spread_inside_and_between_clusters_is_the_whole() -> None:
    """The analysis of variance: within + between = total."""
    random = np.random.default_rng(1)
    scores, ids = random.standard_normal((200, 3)) + 5, random.integers(0, 7, 200)
    total = np.sum((scores - scores.mean(axis=0)) ** 2)
    between = sum(
        np.sum(ids == one) * np.sum((scores[ids == one].mean(axis=0) - scores.mean(axis=0)) ** 2)
        for one in range(7)
    )
    assert spread_ratio(scores, ids) == pytest.approx(1 - between / total, rel=1e-9)


# ---- transposition and statistics ------------------------------------------------------------


def test_the_transposition_error_is_the_largest_misplacement() -> None:
    images = np.random.default_rng(2).random((5, 3, 4, 3)).astype(np.float16)
    abrdfs = np.array([[image[y, x] for image in images] for y in range(3) for x in range(4)])
    assert transposition_error(abrdfs, images) == 0
    wrong = abrdfs.astype(np.float64)
    wrong[7, 2, 1] -= 0.25
    assert transposition_error(wrong, images) == pytest.approx(0.25)
    by_columns = np.array([[image[y, x] for image in images] for x in range(4) for y in range(3)])
    assert transposition_error(by_columns, images) > 0.1


@pytest.mark.parametrize("which", ["mean", "deviation"])
def test_the_statistics_error_is_the_largest_of_both(which: str) -> None:
    images = np.random.default_rng(3).random((4, 6, 5, 3))
    x2 = np.log(1 + images).reshape(4, 30, 3)
    found = {"mean": x2.mean(axis=1), "deviation": x2.std(axis=1)}
    assert statistics_error(found["mean"], found["deviation"], images) < 1e-12
    found[which] = found[which].copy()
    found[which][2, 1] += 0.125
    assert statistics_error(found["mean"], found["deviation"], images) == pytest.approx(0.125)
