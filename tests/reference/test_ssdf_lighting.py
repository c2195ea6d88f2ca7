"""The ray-traced reference of the SSDF lighting against Mitsuba's direct illumination.

A sphere on a floor.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from pipelines.drawing.stage import orbit
from pipelines.geometry.meshes import Mesh
from pipelines.geometry.rays import build_scene, first_hits
from pipelines.geometry.shapes import sphere, square
from pipelines.ssdf_lighting.drawing.camera_rays import camera_rays, pixel_centres
from pipelines.ssdf_lighting.drawing.light_sources import GaussianSource
from pipelines.ssdf_lighting.drawing.ray_tracing import ray_traced
from pipelines.ssdf_lighting.light.shading import Materials
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, evaluate
from pipelines.ssdf_lighting.scene import LitMesh
from tests.reference.lit_scene import Part, light_map, mitsuba, pictures

Array = NDArray[np.float64]

SIZE = (40, 30)
SAMPLES = 128
RUNS = 16
"""Independent pictures; their spread is the error, whatever the samples of one have in common."""
CAMERA = orbit((0.0, 0.0, 0.8), 6.0, -60.0, 30.0, view_angle=28.0)
MATERIALS = Materials(
    np.array([[0.5, 0.3, 0.2], [0.6, 0.6, 0.6]]), np.array([0.04, 0.0]), np.array([0.3, 0.3])
)


def lights() -> Lights:
    axes = np.array([[0.5, -0.6, 0.6], [-0.7, -0.3, 0.5], [0.1, -0.9, 0.2], [0.0, 0.0, 1.0]])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    colours = np.array([[3.0, 2.5, 2.0], [0.5, 1.0, 2.0], [2.0, 0.5, 0.5], [0.4, 0.4, 0.4]])
    return Lights(axes, np.array([30.0, 8.0, 15.0, 1.0]), colours)


def objects() -> tuple[Mesh, Mesh]:
    ball, floor = sphere(24), square(4)
    return (
        Mesh(ball.vertices + np.array([0, 0, 1.0]), ball.triangles, ball.uvs, ball.normals),
        Mesh(floor.vertices * 8, floor.triangles, floor.uvs, floor.normals),
    )


def mean_and_error(pictures: Iterable[Array]) -> tuple[Array, Array]:
    values = np.stack(list(pictures))
    return values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(RUNS)


def clearly_shown() -> NDArray[np.bool_]:
    """Pixels (H, W) that show one object, the sphere not from its rim: there, smooth normals turn
    away from the viewer, and each renderer makes something else of them."""
    meshes = objects()
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    triangles = np.concatenate([meshes[0].triangles, meshes[1].triangles + len(meshes[0].vertices)])
    origins, ways = camera_rays(CAMERA, SIZE, pixel_centres(SIZE))
    hit = first_hits(build_scene(vertices, triangles), origins, ways).triangle
    kind = np.where(hit < 0, 2, np.where(hit < len(meshes[0].triangles), 0, 1))
    kind = kind.reshape(SIZE[::-1])
    return binary_erosion(kind == 0, iterations=2) | binary_erosion(kind == 1, iterations=2)


def traced(materials: Materials) -> tuple[Array, Array]:
    ball, floor = objects()
    mesh = LitMesh(
        np.concatenate([ball.vertices, floor.vertices]),
        np.concatenate([ball.triangles, floor.triangles + len(ball.vertices)]),
        np.concatenate([ball.normals, floor.normals]),
        np.repeat([0, 1], [len(ball.vertices), len(floor.vertices)]),
        materials,
    )
    return mean_and_error(
        ray_traced(mesh, GaussianSource(lights()), CAMERA, SIZE, SAMPLES, seed=seed).radiance[
            ..., :3
        ]
        for seed in range(RUNS)
    )


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> tuple[Array, Array]:
    """Matt and glossy light by Mitsuba, and the error of both."""
    parts = [Part(mesh.vertices, mesh.triangles, mesh.normals) for mesh in objects()]
    folder = tmp_path_factory.mktemp("meshes")
    render = pictures(folder, parts, MATERIALS, lights(), CAMERA, SIZE, SAMPLES, 100)
    return mean_and_error(render(run) for run in range(RUNS))


def differences(rendered: tuple[Array, Array], materials: Materials) -> Array:
    """(traced - rendered) / error (P, 3) of the clearly shown pixels."""
    shown = clearly_shown()
    assert shown.mean() > 0.4
    values, error = traced(materials)
    gap = (values - rendered[0])[shown]
    z: Array = gap / np.sqrt(error**2 + rendered[1] ** 2)[shown]
    return z


def test_mitsuba_sees_the_lights_that_we_mean() -> None:
    mi = mitsuba()
    scene = mi.load_dict({"type": "scene", "sky": light_map(lights())})
    for way in np.random.default_rng(0).normal(size=(50, 3)):
        towards = way / np.linalg.norm(way)
        interaction = mi.SurfaceInteraction3f()
        interaction.wi = mi.Vector3f(*(-towards))
        found = np.array(scene.environment().eval(interaction))
        np.testing.assert_allclose(found, evaluate(lights(), towards), rtol=2e-3)


def test_sphere_and_floor_agree_with_mitsuba(rendered: tuple[Array, Array]) -> None:
    """Of errors that are estimates from 16 pictures each, z has a root mean square of 1.04."""
    z = differences(rendered, MATERIALS)
    assert 0.9 < np.sqrt(np.mean(z**2)) < 1.2
    assert np.abs(z.mean(axis=0)).max() < 4 / np.sqrt(len(z))


@pytest.mark.parametrize(
    "wrong",
    [
        pytest.param(MATERIALS._replace(specular=np.array([0.06, 0.0])), marks=pytest.mark.slow),
        pytest.param(MATERIALS._replace(roughness=np.array([0.2, 0.3])), marks=pytest.mark.slow),
        MATERIALS._replace(albedo=MATERIALS.albedo * 1.05),
    ],
)
def test_a_wrong_material_is_found_out(rendered: tuple[Array, Array], wrong: Materials) -> None:
    assert np.sqrt(np.mean(differences(rendered, wrong) ** 2)) > 1.3
