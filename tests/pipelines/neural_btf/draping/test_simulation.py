"""The fallen cloth by what cloth keeps: lengths of threads, a place outside the table, rest."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.neural_btf.draping import simulation
from pipelines.neural_btf.draping.draped_cloth import draped_cloth
from pipelines.neural_btf.draping.simulation import PARTICLES, SIDE, fallen_cloth
from pipelines.neural_btf.draping.table import HEIGHT, RADIUS, distances, table_mesh

SPACING = SIDE / (PARTICLES - 1)


@pytest.mark.parametrize("axis", [0, 1])
def test_threads_keep_their_length_within_four_percent(axis: int) -> None:
    steps = np.linalg.norm(np.diff(fallen_cloth(), axis=axis), axis=-1) / SPACING
    assert steps.min() > 0.98
    assert steps.max() < 1.04
    assert steps.mean() == pytest.approx(1.0, abs=0.005)


def test_no_particle_is_in_the_table_or_below_the_floor() -> None:
    particles = fallen_cloth().reshape(-1, 3)
    assert distances(particles).min() > 0.99 * simulation.CLEARANCE
    assert particles[:, 2].min() > 0.99 * simulation.CLEARANCE


def test_no_point_of_the_smooth_surface_is_in_the_tables_mesh_or_below_the_floor() -> None:
    """The table's distances are not asked: Open3D's own, of the mesh that is drawn."""
    import open3d as o3d

    table = table_mesh()
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor(table.vertices.astype(np.float32)),
        o3d.core.Tensor(table.triangles.astype(np.uint32)),
    )
    points = draped_cloth().vertices
    assert points[:, 2].min() > 0
    assert scene.compute_distance(points.astype(np.float32)).numpy().min() > 0.002
    # Open below: a ray upwards from a point outside meets the table an even number of times.
    rays = np.concatenate([points, np.tile([0.013, 0.021, 1.0], (len(points), 1))], axis=1)
    assert (scene.count_intersections(rays.astype(np.float32)).numpy() % 2 == 0).all()


def test_distances_are_those_to_the_tables_mesh() -> None:
    import open3d as o3d

    table = table_mesh()
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor(table.vertices.astype(np.float32)),
        o3d.core.Tensor(table.triangles.astype(np.uint32)),
    )
    points = np.random.default_rng(0).uniform((-1, -1, 0.5), (1, 1, 1.5), (4000, 3))
    found = distances(points)
    outside = found > 0
    assert 0.5 < outside.mean() < 1
    expected = scene.compute_distance(points[outside].astype(np.float32)).numpy()
    assert np.abs(found[outside] - expected).max() < 1e-3


def test_the_cloth_is_at_rest() -> None:
    """Let go once more for a fifth of a second, in which what falls freely falls 20 cm."""
    particles = fallen_cloth()
    later = particles.reshape(-1, 3).copy()
    simulation._simulate(later, PARTICLES, SPACING, 240)
    moved = np.linalg.norm(later.reshape(particles.shape) - particles, axis=-1)
    assert moved.mean() < 5e-4
    assert moved.max() < 5e-3


def test_the_cloth_lies_on_the_table_and_hangs_down_to_the_floor() -> None:
    particles = fallen_cloth()
    above = np.hypot(particles[..., 0], particles[..., 1]) < RADIUS - 0.06
    above &= particles[..., 2] > HEIGHT / 2  # and not folded in below it
    assert above.sum() > 400
    np.testing.assert_allclose(particles[above][:, 2], HEIGHT + simulation.CLEARANCE, atol=2e-3)
    edge = np.concatenate([particles[0], particles[-1], particles[:, 0], particles[:, -1]])
    assert edge[:, 2].max() < HEIGHT - 0.25
    assert edge[:, 2].min() < 0.02


def test_the_hanging_edge_folds() -> None:
    """A cone without folds has one radius at each height."""
    particles = fallen_cloth()
    ring = particles[np.abs(particles[..., 2] - 0.75) < 0.02]
    radius = np.hypot(ring[:, 0], ring[:, 1])
    assert np.ptp(radius) > 0.06


def test_the_same_cloth_each_time() -> None:
    first = fallen_cloth().copy()
    fallen_cloth.cache_clear()
    np.testing.assert_array_equal(fallen_cloth(), first)


def test_a_free_cloth_falls_as_the_closed_form_says() -> None:
    """v' = g - c v with nothing below but the floor, far away: c is larger in the second half."""
    u, v = np.meshgrid(np.arange(5.0), np.arange(5.0))
    start = np.stack([u.ravel() * 0.1 + 3, v.ravel() * 0.1 + 3, np.full(25, 9.0)], axis=-1)
    fallen = start.copy()
    seconds = 0.5
    simulation._simulate(fallen, 5, 0.1, round(seconds / simulation._STEP))
    np.testing.assert_allclose(fallen[:, :2], start[:, :2], atol=1e-12)
    drop = start[:, 2] - fallen[:, 2]
    assert np.ptp(drop) < 1e-12
    half, slow, fast = seconds / 2, simulation._DRAG, simulation._LATE_DRAG
    speed = 9.81 / slow * (1 - np.exp(-slow * half))
    expected = 9.81 / slow * (half - (1 - np.exp(-slow * half)) / slow)
    expected += 9.81 / fast * half + (speed - 9.81 / fast) * (1 - np.exp(-fast * half)) / fast
    assert drop[0] == pytest.approx(expected, rel=0.01)


def test_normals_and_tangents_are_those_of_the_mesh() -> None:
    cloth = draped_cloth()
    a, b, c = (cloth.vertices[cloth.triangles[:, k]] for k in range(3))
    face = np.cross(b - a, c - a)
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    mean = cloth.normals[cloth.triangles].mean(axis=1)
    cosine = np.sum(face * mean, axis=1) / np.linalg.norm(mean, axis=1)
    assert np.quantile(cosine, 0.01) > 0.99
    np.testing.assert_allclose(np.sum(cloth.normals * cloth.tangents, axis=1), 0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(cloth.tangents, axis=1), 1)
    # Places grow along the tangents: dP/du of the grid.
    side = round(len(cloth.vertices) ** 0.5)
    grid, places = (x.reshape(side, side, -1) for x in (cloth.vertices, cloth.places))
    along = grid[:, 1:] - grid[:, :-1]
    assert (places[:, 1:, 0] > places[:, :-1, 0]).all()
    tangents = cloth.tangents.reshape(side, side, 3)[:, :-1]
    cosine = np.sum(along * tangents, axis=-1) / np.linalg.norm(along, axis=-1)
    assert np.quantile(cosine, 0.01) > 0.99


def test_places_are_metres_on_the_cloth() -> None:
    """Nowhere stretched by more than threads are: no tile is larger than another."""
    cloth = draped_cloth()
    side = round(len(cloth.vertices) ** 0.5)
    grid, places = (x.reshape(side, side, -1) for x in (cloth.vertices, cloth.places))
    for axis in (0, 1):
        world, flat = (np.linalg.norm(np.diff(x, axis=axis), axis=-1) for x in (grid, places))
        assert (world / flat).min() > 0.88  # in the sharpest folds
        assert (world / flat).max() < 1.2
        assert (world / flat).std() < 0.02
