"""Principal components and right singular vectors against NumPy's singular value decomposition."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.lowrank import ColumnBlocks, principal_components, right_singular_vectors


def decaying(rows: int, columns: int, *, decay: float = 0.7, seed: int = 0) -> NDArray[np.float64]:
    """A matrix with singular values 10 · decay^i about columns that have means of their own."""
    random = np.random.default_rng(seed)
    count = min(rows, columns)
    left = np.linalg.qr(random.standard_normal((rows, count)))[0]
    right = np.linalg.qr(random.standard_normal((columns, count)))[0]
    return (left * (10 * decay ** np.arange(count))) @ right.T + random.standard_normal(columns)


def in_blocks(matrix: NDArray[np.floating], cuts: Sequence[int] = ()) -> ColumnBlocks:
    return lambda: np.split(matrix, sorted(cuts), axis=1)


def centred_svd(
    matrix: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    left, lengths, right = np.linalg.svd(matrix - matrix.mean(axis=0), full_matrices=False)
    return left, lengths, right.T


@pytest.mark.parametrize(("rows", "columns"), [(60, 400), (400, 60), (80, 80)])
def test_singular_values_and_components_are_those_of_the_svd(rows: int, columns: int) -> None:
    matrix = decaying(rows, columns)
    found = principal_components(in_blocks(matrix, [17, 18, 40]), 6)
    left, lengths, right = centred_svd(matrix)
    np.testing.assert_allclose(found.singular_values, lengths[:6], rtol=1e-4)
    # Up to their signs: the same directions.
    np.testing.assert_allclose(np.abs(np.sum(found.loadings * right[:, :6], axis=0)), 1, atol=1e-4)
    along = np.abs(np.sum(found.scores * left[:, :6], axis=0))
    np.testing.assert_allclose(along, lengths[:6], rtol=1e-4)


def test_scores_times_loadings_are_the_best_matrix_of_that_rank() -> None:
    matrix = decaying(70, 300)
    rank = 5
    found = principal_components(in_blocks(matrix, [100]), rank)
    _, lengths, _ = centred_svd(matrix)
    centred = matrix - matrix.mean(axis=0)
    error = np.linalg.norm(centred - found.scores.astype(np.float64) @ found.loadings.T)
    best = np.sqrt(np.sum(lengths[rank:] ** 2))  # Eckart, Young
    assert best * (1 - 1e-6) <= error <= best * 1.001


def test_a_slowly_decaying_spectrum_is_found_to_a_fraction_of_a_per_cent() -> None:
    """Squares that fall as 1 / i: the worst of the ten is the last."""
    random = np.random.default_rng(3)
    left = np.linalg.qr(random.standard_normal((200, 200)))[0]
    right = np.linalg.qr(random.standard_normal((500, 200)))[0]
    matrix = (left * np.arange(1, 201) ** -0.5) @ right.T
    lengths = centred_svd(matrix)[1]
    found = principal_components(in_blocks(matrix, [250]), 10)
    np.testing.assert_allclose(found.singular_values, lengths[:10], rtol=0.01)
    rough = principal_components(in_blocks(matrix, [250]), 10, iterations=0)
    assert (np.abs(rough.singular_values / lengths[:10] - 1)).max() > 0.03


@settings(max_examples=25, deadline=None)
@given(st.sets(st.integers(1, 89), max_size=12))
def test_it_does_not_matter_where_the_blocks_are_split(cuts: set[int]) -> None:
    matrix = decaying(30, 90)
    whole = principal_components(in_blocks(matrix), 4)
    split = principal_components(in_blocks(matrix, sorted(cuts)), 4)
    np.testing.assert_allclose(split.singular_values, whole.singular_values, rtol=1e-5)
    np.testing.assert_allclose(split.scores, whole.scores, atol=1e-4)
    np.testing.assert_allclose(split.loadings, whole.loadings, atol=1e-4)


def test_loadings_are_orthonormal_and_scores_orthogonal_with_their_lengths() -> None:
    found = principal_components(in_blocks(decaying(50, 200), [70]), 7)
    gram = found.loadings.astype(np.float64).T @ found.loadings
    np.testing.assert_allclose(gram, np.eye(7), atol=1e-5)
    gram = found.scores.astype(np.float64).T @ found.scores
    lengths = found.singular_values
    np.testing.assert_allclose(gram, np.diag(lengths**2), atol=1e-5 * lengths[0] ** 2)
    assert (np.diff(lengths) <= 0).all()


def test_what_all_rows_have_in_common_is_taken_off() -> None:
    matrix = decaying(40, 120)
    found = principal_components(in_blocks(matrix, [50]), 5)
    np.testing.assert_allclose(found.scores.mean(axis=0), 0, atol=1e-5 * found.singular_values[0])
    shifted = principal_components(in_blocks(matrix + 3 * np.arange(120), [50]), 5)
    np.testing.assert_allclose(shifted.scores, found.scores, atol=1e-3)


def test_the_largest_entry_of_every_loading_is_positive() -> None:
    for seed in range(4):
        loadings = principal_components(in_blocks(decaying(40, 90, seed=seed)), 6).loadings
        assert (loadings[np.abs(loadings).argmax(axis=0), np.arange(6)] > 0).all()


def test_components_beyond_the_rank_of_the_matrix_have_length_0() -> None:
    random = np.random.default_rng(1)
    matrix = random.standard_normal((30, 3)) @ random.standard_normal((3, 100))
    found = principal_components(in_blocks(matrix, [33]), 8)
    lengths = centred_svd(matrix)[1]
    np.testing.assert_allclose(found.singular_values[:3], lengths[:3], rtol=1e-5)
    assert (found.singular_values[3:] < 1e-5 * lengths[0]).all()
    assert (np.linalg.norm(found.scores[:, 3:], axis=0) < 1e-5 * lengths[0]).all()
    assert np.isfinite(found.loadings).all()


def test_a_matrix_of_equal_rows_has_no_components() -> None:
    found = principal_components(in_blocks(np.tile(np.arange(20.0), (10, 1))), 3)
    np.testing.assert_array_equal(found.singular_values, 0)
    np.testing.assert_array_equal(found.scores, 0)
    assert np.isfinite(found.loadings).all()


@pytest.mark.parametrize(("rows", "columns"), [(12, 40), (40, 12)])
def test_as_many_components_as_the_matrix_can_have_give_it_back(rows: int, columns: int) -> None:
    matrix = decaying(rows, columns, decay=0.9)
    found = principal_components(in_blocks(matrix), 12)
    given_back = found.scores @ found.loadings.T + matrix.mean(axis=0)
    np.testing.assert_allclose(given_back, matrix, atol=1e-4)


def test_half_floats_are_read() -> None:
    matrix = decaying(40, 100).astype(np.float16)
    found = principal_components(in_blocks(matrix, [30]), 4)
    lengths = centred_svd(matrix.astype(np.float64))[1]
    np.testing.assert_allclose(found.singular_values, lengths[:4], rtol=1e-4)


def test_equal_seeds_give_equal_bits() -> None:
    blocks = in_blocks(decaying(40, 100), [30])
    for one, two in zip(
        principal_components(blocks, 4, seed=5), principal_components(blocks, 4, seed=5),
        strict=True,
    ):  # fmt: skip
        np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("rank", [-1, 0, 11])
def test_a_rank_that_the_matrix_cannot_have_is_refused(rank: int) -> None:
    message = rf"^rank is {rank}; expected 1 to 10 for a 10 x 25 matrix\.$"
    with pytest.raises(ValueError, match=message):
        principal_components(in_blocks(np.ones((10, 25)), [7]), rank)


def test_no_blocks_are_refused() -> None:
    with pytest.raises(ValueError, match="0 x 0 matrix"):
        principal_components(lambda: [], 1)


# ---- right singular vectors ------------------------------------------------------------------


def with_spectrum(rows: int, spectrum: NDArray[np.float64], columns: int) -> NDArray[np.float64]:
    """A matrix with these singular values."""
    random = np.random.default_rng(len(spectrum))
    left = np.linalg.qr(random.standard_normal((rows, len(spectrum))))[0]
    right = np.linalg.qr(random.standard_normal((columns, len(spectrum))))[0]
    matrix: NDArray[np.float64] = (left * spectrum) @ right.T
    return matrix


SPECTRA = {
    "decaying": 10 * 0.9 ** np.arange(100),
    "slow": np.arange(1.0, 201.0) ** -1.0,
    "steps": np.repeat([30.0, 3.0, 0.1], [5, 20, 175]),
}


@pytest.mark.parametrize("columns", [200, 900])
@pytest.mark.parametrize("name", SPECTRA)
@pytest.mark.parametrize("share", [0.3, 1e-2, 1e-4])
def test_the_fewest_right_singular_vectors_that_leave_out_so_much(
    share: float, name: str, columns: int
) -> None:
    """By a complete decomposition (200 columns), and by iteration in a subspace (900)."""
    spectrum = SPECTRA[name]
    matrix = with_spectrum(300, spectrum, columns)
    total = (spectrum**2).sum()
    found = right_singular_vectors(matrix.T @ matrix, share * total)
    left_out = total - np.cumsum(spectrum**2)
    fewest = int(np.argmax(left_out <= share * total * (1 + 1e-9))) + 1
    assert fewest <= found.vectors.shape[1] <= fewest + (columns > 256)
    kept = len(found.singular_values)
    np.testing.assert_allclose(found.singular_values, spectrum[:kept], rtol=1e-3)
    vectors = found.vectors.astype(np.float64)
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(kept), atol=1e-5)
    lost = ((matrix - matrix @ vectors @ vectors.T) ** 2).sum()
    assert found.lost == pytest.approx(lost, rel=1e-3, abs=1e-6 * total)
    assert found.lost <= share * total
    signs = vectors[np.abs(vectors).argmax(axis=0), np.arange(kept)]
    assert (signs > 0).all()


def test_right_singular_vectors_are_those_of_the_svd() -> None:
    matrix = with_spectrum(300, SPECTRA["decaying"], 900)
    found = right_singular_vectors(matrix.T @ matrix, 1e-3 * (matrix**2).sum())
    right = np.linalg.svd(matrix, full_matrices=False)[2]
    kept = len(found.singular_values)
    np.testing.assert_allclose(np.abs((found.vectors.T * right[:kept]).sum(axis=1)), 1, atol=1e-3)


def test_where_nearly_all_are_needed_all_are_found() -> None:
    """Noise, of which the subspace would have to be nearly everything."""
    matrix = np.random.default_rng(2).standard_normal((500, 400))
    gram = matrix.T @ matrix
    found = right_singular_vectors(gram, 1e-4 * np.trace(gram))
    squares = np.linalg.eigvalsh(gram)[::-1]
    fewest = int(np.argmax(squares.sum() - np.cumsum(squares) <= 1e-4 * squares.sum())) + 1
    assert len(found.singular_values) == fewest
    np.testing.assert_allclose(found.singular_values**2, squares[:fewest], rtol=1e-9)


@pytest.mark.parametrize("columns", [40, 300])
@pytest.mark.parametrize("lost", [0.0, 1e-300, 1e-13])
@pytest.mark.parametrize("rank", [0, 1, 5, 30])
def test_a_matrix_of_low_rank_and_nothing_to_be_lost(rank: int, lost: float, columns: int) -> None:
    """What rounding leaves counts, so there may be more vectors than the rank, but no fewer."""
    for seed in range(4):
        random = np.random.default_rng(seed)
        matrix = random.standard_normal((50, rank)) @ random.standard_normal((rank, columns))
        found = right_singular_vectors(matrix.T @ matrix, lost)
        kept = len(found.singular_values)
        assert max(rank, 1) <= kept <= columns
        assert found.vectors.shape == (columns, kept)
        assert np.isfinite(found.vectors).all()
        lengths = np.linalg.svd(matrix, compute_uv=False)[:kept]
        np.testing.assert_allclose(
            found.singular_values[: len(lengths)],
            lengths,
            atol=1e-4 * max(lengths.max(initial=0.0), 1e-9),
        )
        assert found.lost <= max(lost, 1e-9 * (matrix**2).sum())


def test_all_may_be_lost_and_one_is_left() -> None:
    matrix = with_spectrum(50, np.array([3.0, 2.0, 1.0]), 20)
    found = right_singular_vectors(matrix.T @ matrix, 100.0)
    np.testing.assert_allclose(found.singular_values, [3.0], rtol=1e-6)
    assert found.lost == pytest.approx(5.0)
