"""SSDFs in few bytes: errors against the whole matrix, budgets kept, degenerate scenes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression.compact import (
    MEMORY_STEP,
    CompactCodes,
    cluster_factors,
    cluster_vectors,
    cosine_transform,
    decoded_coordinates,
    inverse_cosine_transform,
    quantise,
    quantise_to_bytes,
    quantise_to_rmse,
    shared_vectors,
    sigma_of,
    squared_error,
)
from pipelines.ssdf_lighting.compression.compact_file import from_bytes, to_bytes
from pipelines.ssdf_lighting.compression.compact_memory import pack
from pipelines.ssdf_lighting.compression.decoder_tables import decoded_rows, tables_of_packed
from pipelines.ssdf_lighting.compression.shared_basis import SharedBasis
from pipelines.ssdf_lighting.distances.octahedral import texel_directions
from pipelines.ssdf_lighting.distances.signed_distance import distances_to_samples
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights

Matrix = NDArray[np.float32]
Ints = NDArray[np.int32]

N = 16


def some_distances(count: int = 500, seed: int = 0) -> tuple[Matrix, Ints]:
    """SSDFs on a floor with two posts, a vertex at each of random places; and six clusters."""
    random = np.random.default_rng(seed)
    place = random.uniform(-2, 2, (count, 2))
    ways = texel_directions(N)
    visible = np.repeat(ways[None, :, 2] > 0, count, axis=0)
    for post in ((0.3, 0.2), (-1.0, 0.8)):
        away = np.array(post) - place
        far = np.linalg.norm(away, axis=1, keepdims=True)
        azimuth = np.arctan2(ways[:, 1], ways[:, 0]) - np.arctan2(away[:, 1:], away[:, :1])
        narrow = np.cos(azimuth) > np.cos(np.arctan(0.4 / far))
        low = ways[:, 2] / np.hypot(ways[:, 0], ways[:, 1]) < 1.5 / far
        visible &= ~(narrow & low)
    cluster = (place[:, 0] > 0) * 3 + np.digitize(place[:, 1], [-0.7, 0.7])
    return distances_to_samples(visible), cluster.astype(np.int32)


def basis_of(matrix: Matrix, rank: int | None = None) -> SharedBasis:
    """By NumPy; all of it, or the ``rank`` strongest vectors."""
    weighted = matrix.astype(np.float64) * root_weights(matrix.shape[1])
    _, sigma, right = np.linalg.svd(weighted, full_matrices=False)
    kept = len(sigma) if rank is None else rank
    vectors = right[:kept].T
    return SharedBasis(
        vectors.astype(np.float32),
        sigma[:kept],
        (weighted @ vectors).astype(np.float32),
        float((sigma[kept:] ** 2).sum()),
    )


class Given(NamedTuple):
    """A scene's distances, clusters and shared basis."""

    matrix: Matrix
    cluster: Ints
    basis: SharedBasis


@pytest.fixture(scope="module")
def scene() -> Given:
    matrix, cluster = some_distances()
    return Given(matrix, cluster, basis_of(matrix, 120))


def made(scene: Given, step: float) -> CompactCodes:
    return quantise(scene.basis, scene.cluster, cluster_factors(scene.basis, scene.cluster), step)


def error_in_memory(matrix: Matrix, compact: CompactCodes) -> float:
    """RMSE in radians by solid angle, of all vertices as they are decoded from memory."""
    found = decoded_rows(tables_of_packed(pack(compact)), np.arange(len(matrix)))
    weighted = (found.astype(np.float64) - matrix) * root_weights(matrix.shape[1])
    return float(np.sqrt((weighted**2).mean()))


def assert_same(one: CompactCodes, other: CompactCodes) -> None:
    for name, a, b in zip(CompactCodes._fields, one, other, strict=True):
        np.testing.assert_array_equal(a, b, err_msg=name)


# ---- the parts -------------------------------------------------------------------------------


def test_cosines_are_orthonormal_and_come_back() -> None:
    rows = np.random.default_rng(0).standard_normal((3, 64))
    found = cosine_transform(rows)
    assert found.shape == rows.shape
    np.testing.assert_allclose(inverse_cosine_transform(found), rows, atol=1e-12)
    np.testing.assert_allclose(found @ found.T, rows @ rows.T, atol=1e-12)
    # By the definition: the first is the mean, the one to its right half a wave along x.
    x = np.tile(np.cos(np.pi * (np.arange(8) + 0.5) / 8), 8)
    assert found[0, 0] == pytest.approx(rows[0].sum() / 8)
    assert found[0, 1] == pytest.approx((rows[0] * x).sum() * math.sqrt(2) / 8)


def test_factors_are_the_svd_of_each_cluster_about_its_centre(scene: Given) -> None:
    factors = cluster_factors(scene.basis, scene.cluster)
    assert len(factors) == 6
    for number, one in enumerate(factors):
        rows = scene.basis.coordinates[scene.cluster == number].astype(np.float64)
        np.testing.assert_allclose(one.centre, rows.mean(axis=0), atol=1e-9)
        np.testing.assert_allclose(one.centre + one.left @ one.right, rows, atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(one.left, axis=0), one.sigma, atol=1e-9)
        np.testing.assert_allclose(one.right @ one.right.T, np.eye(len(one.right)), atol=1e-9)


def test_levels_are_quarters_of_octaves() -> None:
    np.testing.assert_allclose(sigma_of(np.array([0, 4, 8, 2]), 0.5), [0.5, 1, 2, 0.5 * 2**0.5])


def test_what_is_decoded_is_near_what_was_given(scene: Given) -> None:
    step = 0.02
    compact = made(scene, step)
    rank = len(compact.shared)
    vectors = shared_vectors(compact)
    sigma = scene.basis.sigma[:rank]
    # Entries of vectors times sigma are rounded to the step: errors below it, all in all.
    off = (vectors - scene.basis.vectors[:, :rank].T) * sigma[:, None]
    assert np.sqrt((off**2).mean()) < step
    centres, _ = cluster_vectors(compact)
    for number, one in enumerate(cluster_factors(scene.basis, scene.cluster)):
        size = compact.sizes[number]
        limit = step / math.sqrt(size)
        assert np.abs(centres[number] - one.centre[:rank]).max() < limit
    missed = decoded_coordinates(compact) - scene.basis.coordinates[:, :rank]
    assert np.sqrt((missed.astype(np.float64) ** 2).mean()) < 2 * step
    assert compact.resolution == N
    assert compact.sizes.sum() == len(scene.matrix)
    np.testing.assert_array_equal(scene.cluster[compact.vertices_in_order], np.sort(scene.cluster))


# ---- errors ----------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [0.01, 0.05, 0.2, 0.6])
def test_the_error_without_the_matrix_is_that_of_the_matrix(scene: Given, step: float) -> None:
    compact = made(scene, step)
    found = math.sqrt(squared_error(scene.basis, compact) / scene.matrix.size)
    assert found == pytest.approx(error_in_memory(scene.matrix, compact), rel=0.02)


def test_larger_steps_are_more_error_and_fewer_bytes(scene: Given) -> None:
    tried = [made(scene, step) for step in (0.01, 0.03, 0.1, 0.3, 1.0)]
    errors = [squared_error(scene.basis, one) for one in tried]
    sizes = [len(to_bytes(one)) for one in tried]
    memory = [pack(one).nbytes for one in tried]
    assert errors == sorted(errors)
    for counts in (sizes, memory):
        assert counts == sorted(counts, reverse=True)
    assert all(file < there for file, there in zip(sizes, memory, strict=True))


def test_units_do_not_matter(scene: Given) -> None:
    """Eight times the distances with eight times the step: the same codes."""
    more = SharedBasis(
        scene.basis.vectors,
        8 * scene.basis.sigma,
        8 * scene.basis.coordinates,
        64 * scene.basis.lost,
    )
    one, other = made(scene, 0.125), made(scene._replace(basis=more), 1.0)
    assert other.step == 8 * one.step
    assert_same(one, other._replace(step=one.step))
    assert squared_error(more, other) == pytest.approx(64 * squared_error(scene.basis, one))


def test_rounding_favours_no_sign(scene: Given) -> None:
    """A mirrored matrix has mirrored codes."""
    mirrored = scene.basis._replace(coordinates=-scene.basis.coordinates)
    one, other = made(scene, 0.1), made(scene._replace(basis=mirrored), 0.1)
    np.testing.assert_array_equal(one.centre, -other.centre)


# ---- budgets ---------------------------------------------------------------------------------


@pytest.mark.parametrize("rmse", [0.006, 0.02, 0.06, 0.3])
def test_the_error_asked_for_is_met_and_used_up(scene: Given, rmse: float) -> None:
    compact = quantise_to_rmse(scene.basis, scene.cluster, rmse)
    found = math.sqrt(squared_error(scene.basis, compact) / scene.matrix.size)
    assert found <= rmse
    assert found > 0.95 * rmse
    assert error_in_memory(scene.matrix, compact) < 1.02 * rmse


@pytest.mark.parametrize("above", [1.003, 1.02, 1.1, 1.5])
def test_an_error_just_above_what_the_shared_basis_loses_is_met(scene: Given, above: float) -> None:
    few = basis_of(scene.matrix, 40)
    rmse = above * math.sqrt(few.lost / scene.matrix.size)
    compact = quantise_to_rmse(few, scene.cluster, rmse)
    found = math.sqrt(squared_error(few, compact) / scene.matrix.size)
    assert found <= rmse


def test_less_error_than_the_shared_basis_loses_is_refused(scene: Given) -> None:
    few = basis_of(scene.matrix, 40)
    rmse = 0.999 * math.sqrt(few.lost / scene.matrix.size)
    with pytest.raises(ValueError, match=r"^the error asked for is .* rad; expected more than the"):
        quantise_to_rmse(few, scene.cluster, rmse)


@pytest.mark.parametrize("budget", [2500, 8000, 40_000])
@pytest.mark.parametrize("form", ["file", "memory"])
def test_the_bytes_asked_for_are_kept_and_used_up(scene: Given, budget: int, form: str) -> None:
    def count(compact: CompactCodes) -> int:
        return len(to_bytes(compact)) if form == "file" else pack(compact).nbytes

    if form == "memory" and budget == 2500:
        budget = 5000
    compact = quantise_to_bytes(scene.basis, scene.cluster, count, budget)
    assert 0.93 * budget < count(compact) <= budget


def test_more_bytes_are_less_error(scene: Given) -> None:
    def count(compact: CompactCodes) -> int:
        return len(to_bytes(compact))

    errors = [
        squared_error(scene.basis, quantise_to_bytes(scene.basis, scene.cluster, count, budget))
        for budget in (3000, 6000, 12_000, 24_000)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] > 4 * errors[-1]


def test_too_few_bytes_are_refused(scene: Given) -> None:
    with pytest.raises(ValueError, match=r"^10 bytes are out of reach; expected more\.$"):
        quantise_to_bytes(scene.basis, scene.cluster, lambda c: len(to_bytes(c)), 10)


# ---- degenerate ------------------------------------------------------------------------------


def round_trip(matrix: Matrix, cluster: Ints, step: float, rank: int | None = None) -> CompactCodes:
    """Through the file and through memory; both as exact as the step allows."""
    basis = basis_of(matrix, rank)
    compact = quantise(basis, cluster, cluster_factors(basis, cluster), step)
    assert_same(from_bytes(to_bytes(compact)), compact)
    expected = math.sqrt(squared_error(basis, compact) / matrix.size)
    assert error_in_memory(matrix, compact) < 1.1 * expected + MEMORY_STEP * step
    return compact


def test_one_cluster(scene: Given) -> None:
    compact = round_trip(scene.matrix, np.zeros(len(scene.matrix), np.int32), 0.05)
    assert len(compact.ranks) == 1


def test_a_cluster_for_each_vertex() -> None:
    matrix, _ = some_distances(30)
    compact = round_trip(matrix, np.arange(30, dtype=np.int32), 0.02)
    np.testing.assert_array_equal(compact.ranks, 0)
    assert compact.basis.shape[0] == compact.weights.size == 0


def test_clusters_of_equal_rows_have_no_vectors(scene: Given) -> None:
    """Two different rows, many times."""
    rows = scene.matrix[[3, 400]]
    cluster = np.repeat(np.array([0, 1], np.int32), [40, 25])
    compact = round_trip(rows[cluster], cluster, 0.01)
    np.testing.assert_array_equal(compact.ranks, 0)


def test_some_clusters_with_vectors_and_some_without(scene: Given) -> None:
    matrix = np.concatenate([np.repeat(scene.matrix[:1], 9, axis=0), scene.matrix[:200]])
    cluster = np.repeat(np.array([1, 0], np.int32), [9, 200])
    compact = round_trip(matrix, cluster, 0.03)
    assert compact.ranks[1] == 0 < compact.ranks[0]


@pytest.mark.parametrize("value", [math.pi, -math.pi])
def test_vertices_that_all_see_everything_or_nothing(value: float) -> None:
    matrix = np.full((60, N * N), value, np.float32)
    cluster = (np.arange(60) % 3).astype(np.int32)
    for rank in (None, 1):
        compact = round_trip(matrix, cluster, 0.01, rank)
        assert len(compact.shared) == 1
    found = quantise_to_rmse(basis_of(matrix, 1), cluster, 0.01)
    assert error_in_memory(matrix, found) < 0.0105


def test_one_vertex(scene: Given) -> None:
    round_trip(scene.matrix[:1], np.zeros(1, np.int32), 0.01)


def test_steps_so_large_that_nothing_is_left(scene: Given) -> None:
    """What is decoded then is 0 everywhere."""
    compact = made(scene, 1e3)
    assert len(compact.shared) == 0
    assert_same(from_bytes(to_bytes(compact)), compact)
    total = float(((scene.matrix * root_weights(N * N)).astype(np.float64) ** 2).sum())
    assert squared_error(scene.basis, compact) == pytest.approx(total, rel=1e-4)
    assert error_in_memory(scene.matrix, compact) == pytest.approx(
        math.sqrt(total / scene.matrix.size), rel=1e-4
    )
