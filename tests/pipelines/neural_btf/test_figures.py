"""The figures of the checks against the paper's table and cases with known answers."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from pipelines.light.directions import Pairs, all_pairs, hemisphere_table
from pipelines.neural_btf.compressed import CompressedBtf, compressed_btf
from pipelines.neural_btf.figures import (
    dark_share,
    explained_share,
    loss_ratio,
    mean_brightness,
    mean_radiance,
    missing_pairs,
    smallest_cluster,
    spread_ratio,
    statistics_error,
    table_bytes,
    transposition_error,
)
from pipelines.neural_btf.network import Decoder, decoder_arrays


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


# ---- network -------------------------------------------------------------------------------


def untrained(clusters: int) -> CompressedBtf:
    """Of 6 x 8 texels."""
    torch.manual_seed(0)
    random = np.random.default_rng(0)
    latents = random.standard_normal((clusters, 8)).astype(np.float32)
    ids = random.integers(0, clusters, 48).astype(np.int32) if clusters < 48 else np.arange(48)
    return compressed_btf(decoder_arrays(Decoder()), latents, ids, 2.0, (6, 8))


@pytest.mark.parametrize("clusters", [5, 48])
def test_a_payload_is_that_of_the_table(clusters: int) -> None:
    assert untrained(clusters).payload_bytes == table_bytes(clusters, 48)


def test_the_loss_ratio_is_of_the_last_tenth_over_the_first() -> None:
    assert loss_ratio(np.array([2.0, 4.0, *[7.0] * 16, 1.0, 0.5])) == pytest.approx(0.75 / 3)
    assert loss_ratio(np.array([2.0, 9.0, 3.0])) == pytest.approx(1.5)


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


# ---- values and pictures -------------------------------------------------------------------


def test_dark_photographs_are_counted_in_all_blocks() -> None:
    images = np.full((7, 2, 3, 3), 0.5, np.float16)
    images[[1, 6]] = 0
    images[3] = -0.25
    images[4] = 0
    images[4, 1, 2, 0] = 0.01  # one texel is enough
    assert dark_share([images[:2], images[2:]]) == pytest.approx(3 / 7)


def test_the_mean_radiance_is_over_all_values_whatever_the_blocks() -> None:
    images = np.random.default_rng(5).gamma(1, 1, (9, 4, 5, 3)).astype(np.float16)
    expected = images.astype(np.float64).mean()
    for cut in (1, 4, 8):
        assert mean_radiance([images[:cut], images[cut:]]) == pytest.approx(expected, rel=1e-12)


def test_the_explained_share_is_that_of_the_squares() -> None:
    matrix = np.random.default_rng(6).standard_normal((20, 6))
    matrix -= matrix.mean(axis=0)
    lengths = np.linalg.svd(matrix, compute_uv=False)
    whole = float(np.sum(matrix**2))
    assert explained_share(lengths, whole) == pytest.approx(1.0)
    assert explained_share(lengths[:2], whole) == pytest.approx(
        float(np.sum(lengths[:2] ** 2) / np.sum(lengths**2))
    )


def test_the_mean_brightness_is_of_the_codes() -> None:
    assert mean_brightness(np.array([[[0, 255]]], np.uint8)) == 0.5


# ---- clusters --------------------------------------------------------------------------------


def test_the_smallest_cluster_is_0_where_sizes_are_wrong_or_one_is_empty() -> None:
    ids = np.array([0, 2, 1, 2, 0, 2], np.int32)
    assert smallest_cluster(ids, np.array([2, 1, 3])) == 1
    assert smallest_cluster(ids, np.array([2, 2, 2])) == 0
    assert smallest_cluster(ids, np.array([2, 1, 3, 0])) == 0


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
