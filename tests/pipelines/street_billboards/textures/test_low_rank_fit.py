"""Low-rank fits with gaps: against the SVD, on data of known rank, and where little was seen."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.street_billboards.textures.low_rank_fit import fit_low_rank

Matrix = NDArray[np.float32]


def of_rank(views: int, rank: int, texels: int, seed: int = 0) -> Matrix:
    random = np.random.default_rng(seed)
    factors = random.normal(size=(views, rank)) * 10 + 20, random.normal(size=(rank, texels))
    return (random.uniform(80, 160, (views, 1)) + factors[0] @ factors[1]).astype(np.float32)


def squared_error(values: Matrix, seen: NDArray[np.bool_], rank: int) -> float:
    means, weights, images = fit_low_rank(values, seen, rank)
    return float(((values - means[:, None] - weights @ images)[seen] ** 2).sum())


@settings(deadline=None, max_examples=15)
@given(views=st.integers(1, 8), rank=st.integers(0, 8), seed=st.integers(0, 1000))
def test_without_gaps_it_is_the_truncated_svd(views: int, rank: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    values = random.uniform(0, 255, (views, 200)).astype(np.float32)
    rank = min(rank, views)
    lengths = np.linalg.svd(values - values.mean(axis=1, keepdims=True), compute_uv=False)
    least = (lengths[rank:].astype(np.float64) ** 2).sum()
    found = squared_error(values, np.ones(values.shape, np.bool_), rank)
    assert found == pytest.approx(least, rel=1e-4, abs=1.0)


def test_gaps_of_low_rank_data_are_recovered() -> None:
    values = of_rank(8, 2, 1024)
    seen = np.random.default_rng(1).random(values.shape) < 0.7
    means, weights, images = fit_low_rank(values, seen, 2, ridge=1e-3, sweeps=100)
    off = values - means[:, None] - weights @ images
    # Where five views or more determine the two numbers of a texel.
    assert np.abs(off[:, seen.sum(axis=0) >= 5]).max() < 0.5
    assert np.abs(off[seen]).max() < 0.5


def test_filling_with_zeros_or_means_is_worse() -> None:
    values = of_rank(6, 1, 1024) + np.random.default_rng(2).normal(size=(6, 1024)).astype("f4")
    seen = np.random.default_rng(1).random(values.shape) < 0.6
    means, weights, images = fit_low_rank(values, seen, 1)
    off = (values - means[:, None] - weights @ images)[~seen & seen.any(axis=0)]
    filled = np.where(seen, values, (values * seen).sum(1, keepdims=True) / seen.sum(1)[:, None])
    middle = filled.mean(axis=1, keepdims=True)
    left, lengths, right = np.linalg.svd(filled - middle, full_matrices=False)
    naive = values - middle - lengths[0] * np.outer(left[:, 0], right[0])
    naive = naive[~seen & seen.any(axis=0)]
    assert np.sqrt((off**2).mean()) < 3.0
    assert (off**2).mean() < 0.05 * (naive**2).mean()


@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 1000), share=st.floats(0.2, 0.95))
def test_more_components_leave_less(seed: int, share: float) -> None:
    random = np.random.default_rng(seed)
    values = of_rank(5, 3, 300, seed) + random.normal(size=(5, 300)).astype(np.float32)
    seen = random.random(values.shape) < share
    errors = [squared_error(values, seen, rank) for rank in range(6)]
    # Next to nothing is left of a component more than there are: that need not fall any further,
    # and the weights' pull may cost that little.
    assert all(b <= a + 1e-3 * errors[0] for a, b in itertools.pairwise(errors))
    assert errors[5] < 0.05 * errors[0]


def test_components_that_grow_alike_do_not_blow_up() -> None:
    """With images left as they were solved for, the weights of this one passed 1e25."""
    random = np.random.default_rng(54)
    values = of_rank(5, 3, 300, 54) + random.normal(size=(5, 300)).astype(np.float32)
    seen = random.random(values.shape) < 0.8
    fits = [fit_low_rank(values, seen, 2, sweeps=sweeps) for sweeps in (30, 60)]
    for _, weights, images in fits:
        assert np.abs(weights).max() < 4 * np.ptp(values)
        assert np.abs(images).max() < 20
    np.testing.assert_allclose(
        fits[0].weights @ fits[0].images, fits[1].weights @ fits[1].images, atol=1.0
    )


def test_images_are_orthogonal_centred_and_of_unit_size() -> None:
    values = of_rank(6, 3, 500)
    seen = np.random.default_rng(3).random(values.shape) < 0.8
    seen[:, :7] = False
    _, weights, images = fit_low_rank(values, seen, 3)
    known = seen.any(axis=0)
    np.testing.assert_allclose(images @ images.T / 500, np.eye(3), atol=1e-3)
    np.testing.assert_allclose(images[:, known].mean(axis=1), 0.0, atol=1e-2)
    assert (images[:, :7] == 0).all()
    assert (np.diff(np.linalg.norm(weights, axis=0)) <= 0).all()


def test_a_view_that_saw_nothing_looks_like_the_others() -> None:
    values = of_rank(1, 1, 400).repeat(5, axis=0)
    seen = np.ones(values.shape, np.bool_)
    seen[2] = False
    means, weights, images = fit_low_rank(np.where(seen, values, 9e3).astype("f4"), seen, 1)
    assert np.abs(means[2] + weights[2] @ images - values[0]).max() < 0.5


def test_views_count_by_their_weights() -> None:
    random = np.random.default_rng(0)
    values = random.uniform(0, 255, (4, 300)).astype(np.float32)
    seen = np.ones(values.shape, np.bool_)
    means, weights, images = fit_low_rank(values, seen, 1, view_weights=np.array([100.0, 1, 1, 1]))
    errors = ((values - means[:, None] - weights @ images) ** 2).mean(axis=1)
    assert errors[0] < 0.01 * errors[1:].min()


def test_ranks_that_do_not_exist_are_refused() -> None:
    values = of_rank(3, 1, 50)
    seen = np.ones(values.shape, np.bool_)
    seen[1] = False
    with pytest.raises(ValueError, match="rank is 3; expected 0 to 2"):
        fit_low_rank(values, seen, 3)


_FIT = """
import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from pipelines.street_billboards.textures.low_rank_fit import fit_low_rank
rng = np.random.default_rng(4)
values = rng.random((9, 1024)).astype(np.float32) * 255
seen = rng.random((9, 1024)) < 0.7
found = hashlib.sha256()
for rank in (1, 4, 7):
    for array in fit_low_rank(values, seen, rank):
        found.update(np.ascontiguousarray(array).tobytes())
print(found.hexdigest())
"""


@pytest.mark.slow
def test_a_kernel_from_the_cache_gives_the_same_bits(tmp_path: Path) -> None:
    """The first process compiles, the second reads what it left."""
    said = [
        subprocess.run(
            [sys.executable, "-c", _FIT],
            env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for _ in range(2)
    ]
    assert said[0] == said[1]
