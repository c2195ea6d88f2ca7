"""The ray-traced reference against closed forms and quadrature, by its own standard error."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera
from pipelines.geometry.meshes import Mesh
from pipelines.geometry.shapes import square
from pipelines.light.built_in_environments import lamps
from pipelines.light.environment_maps import solid_angles, texel_directions
from pipelines.ssdf_lighting.drawing.light_sources import GaussianSource, ProbeSource
from pipelines.ssdf_lighting.drawing.ray_tracing import Traced, ray_traced
from pipelines.ssdf_lighting.light.microfacets import gloss
from pipelines.ssdf_lighting.light.shading import Materials
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights
from pipelines.ssdf_lighting.scene import LitMesh

Array = NDArray[np.float64]

FLOOR = square()
WHITE = Materials(np.ones((1, 3)), np.zeros(1), np.ones(1))
DOWN = Camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), height=0.01)


def leaning(degrees: float) -> Camera:
    """From so far off the floor's normal, towards +x, onto a small part of its middle."""
    theta = np.radians(degrees)
    return Camera(
        (5 * float(np.sin(theta)), 0.0, 5 * float(np.cos(theta))), (0.0, 0.0, 0.0), height=0.01
    )


def lit(mesh: Mesh, materials: Materials) -> LitMesh:
    """All of one material."""
    objects = np.zeros(len(mesh.vertices), int)
    return LitMesh(mesh.vertices, mesh.triangles, mesh.normals, objects, materials)


def plane(
    materials: Materials, lights: Lights, camera: Camera, *, count: int = 30, samples: int = 64
) -> Traced:
    """``count`` x ``count`` pixels of a plane, all alike."""
    return ray_traced(
        lit(FLOOR, materials), GaussianSource(lights), camera, (count, count), samples, seed=1
    )


def hemisphere(count: int = 500) -> tuple[Array, Array]:
    nodes, weights = np.polynomial.legendre.leggauss(count)
    z, phi = (nodes + 1) / 2, 2 * np.pi * (np.arange(2 * count) + 0.5) / (2 * count)
    level = np.sqrt(1 - z * z)[:, None]
    height = np.broadcast_to(z[:, None], (count, 2 * count))
    ways = np.stack([level * np.cos(phi), level * np.sin(phi), height], axis=-1)
    return ways.reshape(-1, 3), np.repeat(weights / 2 * np.pi / count, 2 * count)


def light_from(ways: Array, lights: Lights) -> Array:
    glow: Array = np.exp(lights.sharpness * (ways @ lights.axes.T - 1)) @ lights.amplitudes
    return glow


def check_mean(traced: Traced, expected: Array) -> None:
    """All pixels are alike and independent: their mean lies within four of its errors, and they
    spread by no more than the standard error says (samples spread evenly: by less)."""
    values, error = traced.radiance[..., :3], traced.standard_error
    assert (traced.radiance[..., 3] == 1).all()
    spread = values.std(axis=(0, 1), ddof=1)
    mean_error = spread / np.sqrt(error[..., 0].size)
    assert (mean_error < 0.01 * expected).all()
    np.testing.assert_array_less(np.abs(values.mean(axis=(0, 1)) - expected), 4 * mean_error)
    assert (spread < 1.15 * np.sqrt(np.mean(error**2, axis=(0, 1)))).all()


def some_lights() -> Lights:
    axes = np.array([[0.3, 0.2, 0.9], [-0.8, 0.1, 0.4], [0.2, -0.9, -0.1], [-0.4, 0.0, 0.9]])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    return Lights(
        axes,
        np.array([4.0, 60.0, 12.0, 150.0]),
        np.array([[1, 0.5, 0.2], [0.3, 2, 0.6], [1, 1, 3], [5.0, 4, 3]]),
    )


def test_a_matt_plane_under_lights() -> None:
    materials = WHITE._replace(albedo=np.array([[0.8, 0.5, 0.3]]))
    ways, weights = hemisphere()
    expected = (weights * ways[:, 2]) @ light_from(ways, some_lights()) / np.pi
    check_mean(plane(materials, some_lights(), leaning(50)), expected * materials.albedo[0])


@pytest.mark.parametrize(("degrees", "roughness"), [(20, 0.15), (60, 0.3), (80, 0.5)])
def test_a_glossy_plane_under_lights(degrees: float, roughness: float) -> None:
    materials = Materials(np.full((1, 3), 0.1), np.array([0.04]), np.array([roughness]))
    ways, weights = hemisphere()
    theta = np.radians(degrees)
    view = np.array([np.sin(theta), 0.0, np.cos(theta)])
    half = ways + view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    values = gloss(ways[:, 2], view[2], half[:, 2], half @ view, 0.04, roughness)
    expected = (weights * (values + 0.1 / np.pi * ways[:, 2])) @ light_from(ways, some_lights())
    check_mean(plane(materials, some_lights(), leaning(degrees)), expected)


def test_shadow_of_a_square_in_even_light() -> None:
    """A square of side 1.6, 0.8 above the point: the form factor of a parallel rectangle."""
    reach, height = 0.8, 0.8
    roof = square()
    vertices = np.concatenate([FLOOR.vertices, roof.vertices * 2 * reach + [0, 0, height]])
    triangles = np.concatenate([FLOOR.triangles, roof.triangles + len(FLOOR.vertices)])
    side = np.hypot(reach, height)
    hidden = 4 / np.pi * reach / side * np.arctan(reach / side)
    even = Lights(np.array([[0.0, 0.6, 0.8]]), np.array([1e-6]), np.ones((1, 3)))
    camera = Camera((4.0, 0.0, 1.0), (0.0, 0.0, 0.0), height=1e-4)
    normals = np.concatenate([FLOOR.normals, -roof.normals])
    mesh = LitMesh(vertices, triangles, normals, np.zeros(len(vertices), int), WHITE)
    traced = ray_traced(mesh, GaussianSource(even), camera, (16, 16), 256, seed=3)
    check_mean(traced, np.full(3, 1 - hidden))


def test_light_from_below_the_triangle_does_not_arrive() -> None:
    """Normals that lean over towards a light below the horizon."""
    normals = np.tile([0.8, 0.0, 0.6], (len(FLOOR.vertices), 1))
    below = Lights(np.array([[0.9797959, 0.0, -0.2]]), np.array([1000.0]), np.ones((1, 3)))
    traced = ray_traced(
        lit(FLOOR, WHITE)._replace(normals=normals), GaussianSource(below), DOWN, (4, 4), 64
    )
    assert traced.radiance[..., :3].max() < 1e-6


def test_a_plane_under_a_map_of_radiance() -> None:
    """The probe itself: a matt and a glossy plane by quadrature over the map's texels."""
    height = 64
    radiance = lamps(height)
    ways = texel_directions(height).reshape(-1, 3)
    weights = np.repeat(solid_angles(height), 2 * height) * (ways[:, 2] > 0)
    materials = Materials(np.array([[0.7, 0.4, 0.2]]), np.array([0.05]), np.array([0.4]))
    theta = np.radians(40)
    view = np.array([np.sin(theta), 0.0, np.cos(theta)])
    half = ways + view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    shine = gloss(ways[:, 2], view[2], half[:, 2], half @ view, 0.05, 0.4)[:, None]
    reflected = shine + materials.albedo / np.pi * ways[:, 2:]
    expected = (weights[:, None] * reflected * radiance.reshape(-1, 3)).sum(axis=0)
    source = ProbeSource(radiance)
    traced = ray_traced(lit(FLOOR, materials), source, leaning(40), (30, 30), 64, seed=2)
    check_mean(traced, expected)


def test_a_picture_is_repeatable_and_knows_its_borders() -> None:
    wide = Camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), height=1.5)
    pictures = [plane(WHITE, some_lights(), wide, count=12, samples=16) for _ in range(2)]
    np.testing.assert_array_equal(pictures[0].radiance, pictures[1].radiance)
    coverage = pictures[0].radiance[..., 3]
    np.testing.assert_allclose(coverage.mean(), (1 / 1.5) ** 2, atol=0.01)
    assert (coverage[0] == 0).all()
    assert not pictures[0].radiance[0].any()
