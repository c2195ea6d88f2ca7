"""Averaged ABRDFs against plain means, whole and by parts."""

from __future__ import annotations

import numpy as np

from pipelines.neural_btf.latent_texture import averaged, level_sizes
from pipelines.neural_btf.mips import averaged_abrdfs

VALUES = np.random.default_rng(0).random((6 * 5, 12, 3)).astype(np.float16)
VIEWS = np.repeat(np.arange(4), 3)


def test_every_level_is_the_average_of_what_it_covers() -> None:
    found = averaged_abrdfs(lambda a, b: VALUES[a:b], (6, 5), VIEWS, budget=1 << 20)
    np.testing.assert_array_equal(found.photographs, np.arange(12))
    sizes = level_sizes(6, 5)[1:]
    assert len(found.levels) == len(sizes)
    for level, size in zip(found.levels, sizes, strict=True):
        np.testing.assert_allclose(level, averaged(VALUES, (6, 5), size), atol=1e-3)


def test_a_budget_keeps_whole_views() -> None:
    texels = sum(rows * columns for rows, columns in level_sizes(6, 5)[1:])
    budget = 6 * texels * 7  # photographs of two views
    found = averaged_abrdfs(lambda a, b: VALUES[a:b], (6, 5), VIEWS, budget=budget)
    assert len(found.photographs) == 6
    assert np.bincount(VIEWS[found.photographs], minlength=4).tolist().count(3) == 2
    whole = averaged_abrdfs(lambda a, b: VALUES[a:b], (6, 5), VIEWS, budget=1 << 20)
    for part, level in zip(found.levels, whole.levels, strict=True):
        np.testing.assert_array_equal(part, level[:, found.photographs])


def test_a_single_texel_has_no_coarser_levels() -> None:
    found = averaged_abrdfs(lambda a, b: VALUES[a:b], (1, 1), VIEWS, budget=1 << 20)
    assert found.levels == ()
