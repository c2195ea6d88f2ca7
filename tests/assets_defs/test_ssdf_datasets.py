"""SSDF datasets and the objects of `pipelines`: what goes in comes out, and fits its schema."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from assets_defs.ssdf_lighting import datasets
from pipelines.ssdf_lighting.compression.clustered_pca import clustered_pca
from pipelines.ssdf_lighting.compression.compact_file import compress
from pipelines.ssdf_lighting.compression.decoder import Decoder
from pipelines.ssdf_lighting.compression.lookup import matrix_along
from pipelines.ssdf_lighting.compression.shared_basis import shared_basis
from pipelines.ssdf_lighting.compression.triangle_clusters import clusters_by_position
from pipelines.ssdf_lighting.distances.octahedral import texel_directions
from pipelines.ssdf_lighting.distances.signed_distance import distances_to_samples
from pipelines.ssdf_lighting.distances.visibility import scene_visibility, unpacked
from pipelines.ssdf_lighting.figures import CompressionErrors
from pipelines.ssdf_lighting.light.environment_fit import Fit
from pipelines.ssdf_lighting.light.fit_quality import FitErrors
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights
from pipelines.ssdf_lighting.scene import Scene, built_in_scene
from pipelines.ssdf_lighting.surface_textures import SurfaceTextures, Texture, TexturedMaterial
from storage.schemas import ssdf_lighting as schemas

N = 16


@pytest.fixture(scope="module")
def scene() -> Scene:
    return built_in_scene("court", 4, 8)


@pytest.fixture(scope="module")
def matrix(scene: Scene) -> NDArray[np.float32]:
    """SSDFs of a floor that tilts from vertex to vertex."""
    tilted = texel_directions(N)[:, 2] + 0.3 * scene.vertices @ texel_directions(N).T
    return distances_to_samples(tilted > 0)


def assert_same(one: Any, other: Any) -> None:
    for name, a, b in zip(one._fields, one, other, strict=True):
        np.testing.assert_array_equal(a, b, err_msg=name)
        assert np.asarray(a).dtype == np.asarray(b).dtype, name


def test_a_scene_comes_back(scene: Scene) -> None:
    noted = scene._replace(notes=("one edge was open.",))
    dataset = schemas.SCENE_MESH.conform(datasets.scene_dataset(noted, "court"))
    assert dataset.attrs["name"] == "court"
    found = datasets.scene_of(dataset)
    assert_same(found.materials, noted.materials)
    assert found.notes == noted.notes
    assert_same(
        found._replace(materials=None, notes=None), noted._replace(materials=None, notes=None)
    )


def test_a_scene_with_textures_comes_back(scene: Scene) -> None:
    rng = np.random.default_rng(0)
    wide, high = (rng.integers(0, 256, (*size, 3), np.uint8) for size in ((2, 5), (7, 3)))
    material = TexturedMaterial(1, (1.0, 0.5, 0.25), 0.75, (0.04, 0.03, 0.02), 0.5)
    textures = SurfaceTextures(
        rng.random((len(scene.triangles), 3, 2, 2), np.float32),
        rng.random((len(scene.triangles), 3, 3), np.float32),
        (
            material._replace(row=0),
            material._replace(
                colour=Texture(wide, ("clamp", "mirror"), 1), normal=Texture(high), bend=0.5
            ),
        ),
    )
    tint = np.array([[1.5, 1.0, 0.5]] * 3)
    shown = scene._replace(textures=textures, materials=scene.materials._replace(tint=tint))
    found = datasets.scene_of(schemas.SCENE_MESH.conform(datasets.scene_dataset(shown, "court")))
    assert_same(found.materials, shown.materials)
    assert found.textures is not None
    np.testing.assert_array_equal(found.textures.uvs, textures.uvs)
    np.testing.assert_array_equal(found.textures.colours, textures.colours)
    plain, painted = found.textures.materials
    assert plain == textures.materials[0]
    assert painted._replace(colour=None, normal=None) == textures.materials[1]._replace(
        colour=None, normal=None
    )
    assert painted.colour is not None
    assert painted.normal is not None
    assert (painted.colour.wrap, painted.colour.mapping) == (("clamp", "mirror"), 1)
    np.testing.assert_array_equal(painted.colour.texels, wide)
    np.testing.assert_array_equal(painted.normal.texels, high)


def test_what_vertices_see_comes_back(scene: Scene) -> None:
    seen = scene_visibility(scene.vertices, scene.triangles, scene.normals, N)
    dataset = schemas.VISIBILITY.conform(datasets.visibility_dataset(seen, N))
    visible = datasets.visible_of(dataset)
    np.testing.assert_array_equal(visible, unpacked(seen.visible, N * N))
    assert visible.shape == (len(scene.vertices), N * N)
    np.testing.assert_array_equal(datasets.visible_of(dataset.isel(vertex=[5, 2])), visible[[5, 2]])
    assert_same(datasets.ray_origins_of(dataset), seen.origins)


def test_a_stored_matrix_is_read_in_blocks(
    scene: Scene, matrix: NDArray[np.float32], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(datasets, "_ROWS", 100)
    stored = xr.Dataset({"distances": (("vertex", "direction"), matrix)}).chunk(vertex=64)
    blocks = list(datasets.distance_blocks(stored))
    assert len(blocks) == -(-len(matrix) // 100)
    np.testing.assert_array_equal(np.concatenate([rows for rows, _ in blocks]), range(len(matrix)))
    np.testing.assert_array_equal(np.concatenate([block for _, block in blocks]), matrix)
    vertices = np.sort(np.random.default_rng(0).integers(0, len(matrix), 150))
    axes = np.random.default_rng(1).normal(size=(150, 3, 3)).astype(np.float32)
    found = datasets.matrix_distances_along(stored, vertices, axes)
    np.testing.assert_array_equal(found, matrix_along(matrix, vertices, axes))


def test_clusters_and_their_basis_come_back(scene: Scene, matrix: NDArray[np.float32]) -> None:
    clusters = clusters_by_position(scene.vertices, scene.triangles, 5, 0)
    basis = shared_basis(lambda: [matrix], matrix.shape, 0.05)
    dataset = schemas.TRIANGLE_CLUSTERS.conform(datasets.clusters_dataset(clusters, basis))
    assert_same(datasets.clusters_of(dataset), clusters)
    assert_same(datasets.shared_basis_of(dataset), basis)


def test_both_forms_decode_as_they_did(scene: Scene, matrix: NDArray[np.float32]) -> None:
    clusters = clusters_by_position(scene.vertices, scene.triangles, 5, 0)
    file = compress(matrix, scene.triangles, clusters=5, rmse=0.1)
    pca = clustered_pca(lambda rows: matrix[rows], scene.triangles, clusters.triangle, values=3)
    counts = {"raw": matrix.nbytes, "file": len(file), "memory": 7}
    errors = CompressionErrors(0.1, 0.02, np.full(len(matrix), 0.1, np.float32))
    some = np.array([17, 3, 200])
    for variables, decoder in (
        (datasets.file_variables(file), Decoder.of_file(file)),
        (datasets.pca_variables(pca), Decoder.of_pca(pca, len(matrix))),
    ):
        dataset = datasets.basis_dataset(variables, counts, errors)
        stored = schemas.SSDF_BASIS.conform(dataset)
        assert int(stored["bytes_memory"]) == 7
        found = datasets.decoder_of(stored)
        np.testing.assert_array_equal(found.distances(some), decoder.distances(some))


def test_lights_come_back() -> None:
    random = np.random.default_rng(0)
    lights = Lights(random.normal(size=(3, 3)), random.uniform(1, 9, 3), random.random((3, 3)))
    fit = Fit(lights, FitErrors(0.3, 0.2, 0.1, 0.15))
    radiance = random.random((4, 8, 3))
    dataset = schemas.ENVIRONMENT_LIGHTS.conform(
        datasets.lights_dataset(radiance, fit, 1e-9, "hall.hdr")
    )
    assert dataset.attrs["name"] == "hall.hdr"
    assert dataset["radiance"].dtype == np.float32
    assert_same(datasets.lights_of(dataset), lights)
