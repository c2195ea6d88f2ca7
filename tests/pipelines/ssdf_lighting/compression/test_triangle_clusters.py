"""Clusters of triangles against brute force over all centres."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.clustering import k_means_from_farthest
from pipelines.geometry import shapes
from pipelines.geometry.repair import repair_mesh
from pipelines.ssdf_lighting.compression.triangle_clusters import (
    Clusters,
    clusters_by_distance,
    clusters_by_position,
)

Floats = NDArray[np.float64]


@pytest.fixture(scope="module")
def ball() -> tuple[Floats, NDArray[np.int32]]:
    mesh = shapes.sphere(16)
    mended = repair_mesh(mesh.vertices, mesh.triangles)
    return mended.vertices, mended.triangles


def check(found: Clusters, of_triangles: Floats, of_vertices: Floats, count: int) -> None:
    """Lloyd's fixed point, and vertices with the nearest centre."""
    assert found.triangle.dtype == found.vertex.dtype == np.int32
    assert sorted(set(found.triangle.tolist())) == list(range(count))
    means = np.stack([of_triangles[found.triangle == one].mean(axis=0) for one in range(count)])
    for points, labels in ((of_triangles, found.triangle), (of_vertices, found.vertex)):
        away = ((points[:, None] - means) ** 2).sum(axis=2)
        own = away[np.arange(len(points)), labels]
        np.testing.assert_allclose(own, away.min(axis=1), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("count", [1, 5, 40])
def test_clusters_by_position_are_those_of_the_centroids(
    ball: tuple[Floats, NDArray[np.int32]], count: int
) -> None:
    vertices, triangles = ball
    found = clusters_by_position(vertices, triangles, count, 3)
    centroids = vertices[triangles].mean(axis=1)
    np.testing.assert_array_equal(found.triangle, k_means_from_farthest(centroids, count, 3))
    check(found, centroids, vertices, count)
    again = clusters_by_position(vertices, triangles, count, 3)
    np.testing.assert_array_equal(found.vertex, again.vertex)


@pytest.mark.parametrize("count", [1, 6, 30])
def test_clusters_by_distance_are_those_of_the_leading_coordinates(
    ball: tuple[Floats, NDArray[np.int32]], count: int
) -> None:
    vertices, triangles = ball
    random = np.random.default_rng(0)
    mixed = np.sin(vertices @ random.standard_normal((3, 40)) * 2).astype(np.float32)
    found = clusters_by_distance(mixed, triangles, count, 1)
    leading = mixed[:, :32].astype(np.float64)
    check(found, leading[triangles].mean(axis=1), leading, count)
    other = mixed.copy()
    other[:, 32:] = 100.0
    np.testing.assert_array_equal(
        clusters_by_distance(other, triangles, count, 1).vertex, found.vertex
    )


def test_what_is_alike_but_far_apart_is_together_by_distance_only(
    ball: tuple[Floats, NDArray[np.int32]],
) -> None:
    """The upper and the lower cap of a sphere see alike, its belt another thing."""
    vertices, triangles = ball
    alike = np.abs(vertices[:, 2:]) > 0.7
    coordinates = np.where(alike, 5.0, -5.0).astype(np.float32)
    by_distance = clusters_by_distance(coordinates, triangles, 2, 0).vertex
    assert len({(bool(a), int(c)) for a, c in zip(alike[:, 0], by_distance, strict=True)}) == 2
    by_position = clusters_by_position(vertices, triangles, 2, 0).vertex
    top, bottom = vertices[:, 2].argmax(), vertices[:, 2].argmin()
    assert by_distance[top] == by_distance[bottom]
    assert len(set(by_position.tolist())) == 2


def test_more_clusters_than_triangles_are_refused() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    triangles = np.array([[0, 1, 2], [1, 3, 2]])
    with pytest.raises(ValueError, match=r"^clusters is 3; expected 1 to 2"):
        clusters_by_position(vertices, triangles, 3, 0)
    with pytest.raises(ValueError, match=r"^clusters is 3; expected 1 to 2"):
        clusters_by_distance(vertices.astype(np.float32), triangles, 3, 0)
