"""Numbers of paths: orders are permutations, pairs are stratified, events are independent."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from pipelines.glass_scratches.drawing.path_numbers import PAIRS, PathEvent, path_numbers, permuted

SEED = np.uint64(0x1234_5678_9ABC_DEF1)


@pytest.mark.parametrize("count", [1, 2, 3, 5, 16, 17, 64, 100, 255, 1000, 1024])
def test_every_key_gives_a_permutation(count: int) -> None:
    orders = {
        tuple(permuted(index, count, np.uint64(key)) for index in range(count)) for key in range(40)
    }
    assert all(sorted(order) == list(range(count)) for order in orders)
    assert count < 5 or len(orders) > 25  # of 120 orders of five, 40 draws meet some twice


def test_each_index_goes_everywhere_equally_often() -> None:
    count, keys = 16, 4000
    rng = np.random.default_rng(0)
    found = np.zeros((count, count))
    for key in rng.integers(0, 2**63, keys, dtype=np.uint64):
        for index in range(count):
            found[index, permuted(index, count, key)] += 1
    statistic = ((found - keys / count) ** 2 / (keys / count)).sum()
    assert chi2.sf(statistic, (count - 1) ** 2) > 1e-4


def _numbers(samples: int, depth: int, pair: int) -> np.ndarray:
    return np.array(
        [path_numbers(PathEvent(SEED, n, samples, depth), pair) for n in range(samples)]
    )


@pytest.mark.parametrize("depth", [0, 3])
def test_first_events_are_stratified(depth: int) -> None:
    """Of 256 numbers about 16 lie in each sixteenth: by chance alone they would not."""
    for pair in range(PAIRS):
        for column in _numbers(256, depth, pair).T:
            counts = np.bincount((column * 16).astype(int), minlength=16)
            assert np.abs(counts - 16).max() <= 3


def test_numbers_of_two_events_are_not_tied() -> None:
    """In cells of both events' numbers, over all pairs of the first events."""
    samples, cells = 1024, 8
    columns = [
        _numbers(samples, d, p)[:, k] for d in range(4) for p in range(PAIRS) for k in (0, 1)
    ]
    worst = 0.0
    for one in range(len(columns)):
        for other in range(one):
            if other == one - 1 and one % 2:  # the two of a pair are meant to be
                continue
            joint = np.zeros((cells, cells))
            np.add.at(
                joint,
                ((columns[one] * cells).astype(int), (columns[other] * cells).astype(int)),
                1,
            )
            expected = samples / cells**2
            worst = max(worst, float(((joint - expected) ** 2 / expected).sum()))
    # The largest of some 1100 statistics of at most 49 degrees of freedom (margins are even).
    assert worst < chi2.isf(1e-7, (cells - 1) ** 2)
