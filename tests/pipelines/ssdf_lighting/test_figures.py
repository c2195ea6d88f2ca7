"""Figures of merit: right data pass, planted faults are found."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.geometry import shapes
from pipelines.geometry.meshes import vertex_normals
from pipelines.geometry.rays import build_scene
from pipelines.ssdf_lighting.compression.lookup import matrix_along
from pipelines.ssdf_lighting.distances.octahedral import solid_angles, texel_directions
from pipelines.ssdf_lighting.distances.signed_distance import (
    distances_to_arcs,
    distances_to_samples,
)
from pipelines.ssdf_lighting.distances.visibility import RayOrigins, ray_origins, visible_directions
from pipelines.ssdf_lighting.distances.visible_edge import visible_edge
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights
from pipelines.ssdf_lighting.figures import (
    all_pairs_distances,
    compression_errors,
    distance_error,
    errors_along_axes,
    mean_brightness,
    psnr,
    sampled_rows,
    seam_ratio,
    shared_basis_rmse,
    sign_error,
    surface_area,
    turned_away,
    unused_share,
    visibility_error,
    visible_sphere_share,
    weighted_rmse,
)

N = 16
WAYS = texel_directions(N)
Bools = NDArray[np.bool_]


def some_maps(count: int = 6) -> Bools:
    """Above a floor, but for a cap that wanders."""
    turn = np.arange(count) * 2 * math.pi / count
    middle = np.stack([0.8 * np.cos(turn), 0.8 * np.sin(turn), np.full(count, 0.6)], -1)
    visible: Bools = (WAYS[:, 2] > 0.02) & ~(middle @ WAYS.T > 0.7)
    return visible


# ---- rows ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("count", "wanted"), [(5, 12), (16, 16), (1000, 12), (1000, 200), (1, 1)])
def test_sampled_rows_are_runs_from_end_to_end(count: int, wanted: int) -> None:
    rows = sampled_rows(count, wanted)
    assert (np.diff(rows) > 0).all()
    assert rows[0] == 0
    assert rows[-1] < count
    assert len(rows) <= max(wanted, 16)
    if wanted >= 32:
        assert rows[-1] == count - 1
        assert len(rows) == wanted // 16 * 16


# ---- scenes ----------------------------------------------------------------------------------


def test_area_and_turned_normals_of_a_square() -> None:
    flat = shapes.square(3)
    assert surface_area(2 * flat.vertices, flat.triangles) == pytest.approx(4.0)
    assert turned_away(flat.vertices, flat.triangles, flat.normals) == 0.0
    assert turned_away(flat.vertices, flat.triangles, -flat.normals) == 1.0
    # The corner at which one triangle is alone, of 18 triangles with three corners each.
    normals = flat.normals.copy()
    count = np.bincount(flat.triangles.ravel())
    alone = int(np.flatnonzero(count == 1)[0])
    normals[alone] *= -1
    assert turned_away(flat.vertices, flat.triangles, normals) == pytest.approx(1 / 54)


# ---- visibility ------------------------------------------------------------------------------


def test_the_seen_share_of_the_sphere_is_weighted_by_solid_angle() -> None:
    upper = WAYS[:, 2] > 0
    share = visible_sphere_share(np.stack([upper, ~upper, upper]), solid_angles(N))
    exact = solid_angles(N)[upper].sum() / (4 * math.pi)
    assert share == pytest.approx((1 + exact) / 3, abs=1e-12)


def test_wrong_signs_are_counted_over_blocks() -> None:
    visible = some_maps()
    distances = distances_to_samples(visible)
    assert sign_error([(distances, visible)]) == 0.0
    distances[0, :4] *= -1
    distances[5, :8] *= -1
    blocks = [(distances[:2], visible[:2]), (distances[2:], visible[2:])]
    assert sign_error(blocks) == pytest.approx(12 / distances.size)


def test_visibility_is_tested_by_another_method_and_faults_are_found() -> None:
    ball = shapes.sphere(10)
    around = ball.vertices, ball.triangles, vertex_normals(ball.vertices, ball.triangles)
    rays = build_scene(ball.vertices, ball.triangles)
    origins = ray_origins(rays, *around)
    visible = visible_directions(rays, origins, WAYS)

    def error(seen: Bools, sealed: Bools = origins.sealed) -> float:
        return visibility_error(*around[:2], origins.points, sealed, seen, WAYS)

    assert error(visible) == 0.0
    assert error(~visible) > 0.95  # all but rays past edges, left to either method
    random = np.random.default_rng(3)
    flipped = visible ^ (random.random(visible.shape) < 0.2)
    assert 0.1 < error(flipped) < 0.3
    assert 0.3 < error(np.ones_like(visible)) < 0.7
    assert 0.3 < error(np.zeros_like(visible)) < 0.7
    # Sealed vertices have to see nothing.
    everywhere = np.ones(len(visible), bool)
    assert error(np.zeros_like(visible), everywhere) == 0.0
    assert 0.3 < error(visible, everywhere) < 0.7
    # An origin inside the body.
    inside = RayOrigins((0.5 * origins.points).astype(np.float32), origins.sealed)
    assert not visible_directions(rays, inside, WAYS).any()
    wrong = visibility_error(*around[:2], inside.points, inside.sealed, visible, WAYS)
    assert wrong == pytest.approx(visible.mean(), abs=0.12)


# ---- distances -------------------------------------------------------------------------------


def test_all_pairs_are_the_definition() -> None:
    visible = some_maps(2)
    found = all_pairs_distances(visible)
    for row, seen in zip(found, visible, strict=True):
        for k in range(0, N * N, 13):
            others = WAYS[seen != seen[k]]
            least = np.arccos(np.clip(others @ WAYS[k], -1, 1)).min()
            assert row[k] == pytest.approx(least if seen[k] else -least, abs=1e-7)
    alike = np.stack([np.ones(N * N, bool), np.zeros(N * N, bool)])
    np.testing.assert_allclose(all_pairs_distances(alike), [[math.pi] * 256, [-math.pi] * 256])


def test_right_distances_have_no_error_and_one_fault_is_measured() -> None:
    visible = some_maps()
    right = distances_to_samples(visible)
    assert distance_error(right, visible, refined=False) < 1e-6
    wrong = right.copy()
    wrong[2, 77] *= 1.1
    fault = abs(float(wrong[2, 77] - right[2, 77]))
    assert distance_error(wrong, visible, refined=False) == pytest.approx(fault, rel=1e-3)
    turned = right.copy()
    turned[1, 200] *= -1
    expected = 2 * abs(float(right[1, 200]))
    assert distance_error(turned, visible, refined=False) == pytest.approx(expected, rel=1e-4)


def a_scene() -> tuple[Bools, NDArray[np.float32]]:
    """Refined distances below a square."""
    flat = shapes.square(2)
    rays = build_scene(flat.vertices + np.array([0.1, 0.2, 0.4]), flat.triangles)
    origins = RayOrigins(np.float32([[0, 0, 0], [0.3, 0.1, 0.1]]), np.zeros(2, bool))
    visible = visible_directions(rays, origins, WAYS)
    return visible, distances_to_arcs(visible, visible_edge(rays, origins.points, visible))


def test_refined_distances_lie_in_their_bounds_and_faults_do_not() -> None:
    visible, refined = a_scene()
    assert distance_error(refined, visible, refined=True) < 1e-5
    assert distance_error(distances_to_samples(visible), visible, refined=True) < 1e-5
    far = np.unravel_index(np.abs(refined).argmax(), refined.shape)
    for factor in (1.5, -1.0):
        wrong = refined.copy()
        wrong[far] *= factor
        assert distance_error(wrong, visible, refined=True) > 0.1
    # Samples alone tell that a row of another vertex is wrong.
    assert distance_error(refined[::-1], visible, refined=True) > 0.1


def test_where_all_is_alike_any_distance_of_that_sign_may_be_right() -> None:
    visible = np.zeros((1, N * N), bool)
    small = np.full((1, N * N), -0.3, np.float32)
    assert distance_error(small, visible, refined=True) == 0.0
    assert distance_error(-small, visible, refined=True) > 1.0


# ---- compression -----------------------------------------------------------------------------


def test_compression_errors_are_weighted_by_solid_angle() -> None:
    visible = some_maps(8)
    right = distances_to_samples(visible)
    normals = np.tile([0.0, 0.0, 1.0], (8, 1))
    blocks = [(np.arange(0, 3), right[:3]), (np.arange(3, 8), right[3:])]
    none = compression_errors(blocks, lambda rows: right[rows], normals)
    assert none.rmse == none.wrong_visibility == 0
    off = compression_errors(blocks, lambda rows: right[rows] + np.float32(0.25), normals)
    assert off.rmse == pytest.approx(0.25, rel=1e-5)
    np.testing.assert_allclose(off.vertex_rmse, 0.25, rtol=1e-5)
    # One texel of one vertex: by its share of the sphere.
    wrong = right.copy()
    texel = int(np.flatnonzero(visible[4])[5])
    wrong[4, texel] = -1.0
    share = solid_angles(N)[texel] / (4 * math.pi)
    found = compression_errors(blocks, lambda rows: wrong[rows], normals)
    change = (right[4, texel] + 1.0) ** 2 * share
    assert found.rmse == pytest.approx(math.sqrt(change / 8), rel=1e-5)
    assert found.vertex_rmse[4] == pytest.approx(math.sqrt(change), rel=1e-5)
    upper = solid_angles(N)[WAYS[:, 2] > 0].sum() / (4 * math.pi)
    assert found.wrong_visibility == pytest.approx(share / (8 * upper), rel=1e-5)
    # Below the tangent plane signs do not count.
    below = right.copy()
    below[:, WAYS[:, 2] < -1e-9] *= -1
    assert compression_errors(blocks, lambda rows: below[rows], normals).wrong_visibility == 0


def test_errors_weighted_by_solid_angle_and_along_axes() -> None:
    right = distances_to_samples(some_maps(8))
    assert weighted_rmse(right, right) == 0.0
    assert weighted_rmse(right + np.float32(0.25), right) == pytest.approx(0.25, rel=1e-5)
    one = right.copy()
    one[4, 33] += 1.0
    share = solid_angles(N)[33] / (4 * math.pi)
    assert weighted_rmse(one, right) == pytest.approx(math.sqrt(share / 8), rel=1e-5)
    blocks = [(np.arange(0, 3), right[:3]), (np.arange(3, 8), right[3:])]
    errors = errors_along_axes(
        blocks, lambda vertices, axes: matrix_along(right + np.float32(0.5), vertices, axes)
    )
    assert errors.shape == (8, 12)
    np.testing.assert_allclose(errors, 0.5, atol=1e-5)


def test_the_shared_basis_misses_what_it_leaves_out() -> None:
    right = distances_to_samples(some_maps(8))
    weighted = right.astype(np.float64) * root_weights(N * N)
    left, sigma, vectors = np.linalg.svd(weighted, full_matrices=False)
    for kept in (8, 5):
        coordinates = (left[:, :kept] * sigma[:kept]).astype(np.float32)
        found = shared_basis_rmse(right, coordinates, vectors[:kept].T.astype(np.float32))
        expected = math.sqrt((sigma[kept:] ** 2).sum() / right.size)
        assert found == pytest.approx(expected, rel=1e-3, abs=1e-6)


def test_cluster_numbers_without_a_triangle_are_found() -> None:
    assert unused_share(np.array([2, 0, 1, 1])) == 0.0
    assert unused_share(np.array([4, 0, 1, 1])) == 0.4
    assert unused_share(np.array([-1, 0])) == 1.0


def grid(size: int) -> NDArray[np.int32]:
    i, j = np.meshgrid(np.arange(size - 1), np.arange(size - 1), indexing="ij")
    a = (i * size + j).ravel()
    quads = np.stack([a, a + 1, a + size, a + 1, a + size + 1, a + size], -1)
    return quads.reshape(-1, 3).astype(np.int32)


def test_steps_across_borders_of_clusters_stand_out() -> None:
    size = 20
    triangles = grid(size)
    random = np.random.default_rng(0)
    errors = random.standard_normal((size * size, 200)).astype(np.float32)
    half = (np.arange(size * size) % size >= size // 2).astype(np.int32)
    # The same noise on both sides: no step.
    assert seam_ratio(errors, triangles, half) == pytest.approx(1, abs=0.02)
    # An offset of 3 on one side: the mean size of a normal number with variance 2 about 3.
    stepped = errors + 3 * half[:, None]
    spread, mean = math.sqrt(2.0), 3.0
    folded = spread * math.sqrt(2 / math.pi) * math.exp(-(mean**2) / (2 * spread**2))
    folded += mean * math.erf(mean / (spread * math.sqrt(2)))
    expected = folded / (spread * math.sqrt(2 / math.pi))
    assert seam_ratio(stepped, triangles, half) == pytest.approx(expected, rel=0.02)
    # The clusters elsewhere: the step is as often beside their border as in it.
    other = (np.arange(size * size) // size >= size // 2).astype(np.int32)
    assert seam_ratio(stepped, triangles, other) < 1.1


def test_what_is_far_from_a_border_does_not_hide_its_step() -> None:
    """Errors that are large in one place, where the border is not, and in another, where it is."""
    size = 20
    triangles = grid(size)
    column = np.arange(size * size) % size
    errors = np.random.default_rng(0).standard_normal((size * size, 200))
    half = (column >= size // 2).astype(np.int32)
    loud = errors * np.where(np.abs(column - 2) <= 1, 20.0, 1.0)[:, None]
    assert seam_ratio(loud, triangles, half) == pytest.approx(1, abs=0.02)
    louder = errors * np.where(np.abs(column - size // 2) <= 4, 20.0, 1.0)[:, None]
    assert seam_ratio(louder, triangles, half) == pytest.approx(1, abs=0.02)


def test_without_borders_there_is_no_seam() -> None:
    errors = np.random.default_rng(1).standard_normal((9, 5)).astype(np.float32)
    assert seam_ratio(errors, grid(3), np.zeros(9, np.int32)) == 1.0
    assert seam_ratio(errors, grid(3), np.arange(9, dtype=np.int32)) == 1.0


# ---- pictures --------------------------------------------------------------------------------


def test_pictures_are_compared_where_the_scene_is_shown() -> None:
    random = np.random.default_rng(0)
    reference = random.integers(20, 200, (6, 8, 3)).astype(np.uint8)
    shown = np.zeros((6, 8), bool)
    shown[2:5] = True
    picture = np.where(shown[..., None], reference + 10, 255).astype(np.uint8)
    assert psnr(picture, reference, shown) == pytest.approx(20 * math.log10(25.5))
    assert psnr(reference, reference, shown) > 100.0
    frames = np.stack([picture, np.where(shown[..., None], 0, picture)])
    expected = picture[shown].mean() / 2 / 255
    assert mean_brightness(frames, shown) == pytest.approx(expected)
