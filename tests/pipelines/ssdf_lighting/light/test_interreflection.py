"""Light between surfaces against closed forms: a sphere from inside, plates, energy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.geometry.rays import build_scene
from pipelines.geometry.shapes import sphere, square
from pipelines.ssdf_lighting.distances.visibility import ray_origins, scene_visibility
from pipelines.ssdf_lighting.drawing.bounced_light import BouncedLight
from pipelines.ssdf_lighting.light.interreflection import (
    BounceFactors,
    bounce_factors,
    bounced,
    factor_sums,
)
from pipelines.ssdf_lighting.light.microfacets import Materials
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights
from pipelines.ssdf_lighting.scene import Scene, built_in_scene

Array = NDArray[np.float64]


def of_one_material(
    vertices: Array, triangles: NDArray[np.integer], normals: Array, albedo: tuple[float, ...]
) -> Scene:
    materials = Materials(np.array([albedo]), np.zeros(1), np.ones(1))
    part = np.zeros(len(triangles), np.int32)
    return Scene(vertices, triangles, normals, part, materials, np.zeros(3), 1.0, ())


def factors_of(scene: Scene, patches: int = 64) -> BounceFactors:
    rays = build_scene(scene.vertices, scene.triangles)
    origins = ray_origins(rays, scene.vertices, scene.triangles, scene.normals)
    return bounce_factors(scene, origins, patches)


def inside_of_a_sphere(albedo: tuple[float, ...] = (0.8, 0.5, 0.0)) -> Scene:
    ball = sphere(24)
    return of_one_material(ball.vertices, ball.triangles[:, ::-1], -ball.normals, albedo)


def test_inside_a_sphere_light_comes_from_everywhere_alike() -> None:
    """Each order of reflection is the mean of the one before, times the albedo: a geometric series
    of five, wherever the light falls at first."""
    factors = factors_of(inside_of_a_sphere())
    np.testing.assert_allclose(factor_sums(factors), 1.0, atol=0.02)
    direct = np.zeros((*factors.samples.shape, 3))
    lit = np.arange(len(direct)) % 3 == 0
    direct[lit] = [1.0, 2.0, 5.0]
    found = bounced(factors, direct)
    # Patches are not quite of one size.
    mean = found.mean(axis=0)
    share = mean[0] / (0.8 * (1 - 0.8**5) / (1 - 0.8))
    assert share == pytest.approx(lit.mean(), rel=0.15)
    series = np.array([0.8, 0.5]) * (1 - np.array([0.8, 0.5]) ** 5) / (1 - np.array([0.8, 0.5]))
    np.testing.assert_allclose(mean[:2], share * series * [1.0, 2.0], rtol=0.02)
    assert mean[2] == 0.0
    assert found[:, 0].std() < 0.05 * mean[0]


def test_a_lit_plate_above_the_floor_has_its_form_factor() -> None:
    """A parallel square of side 1.6, 0.8 above the middle of the floor."""
    reach, height = 0.8, 0.8
    floor, roof = square(12), square(12)
    vertices = np.concatenate(
        [floor.vertices * 2 * reach, roof.vertices * 2 * reach * [1, -1, 1] + [0, 0, height]]
    )
    triangles = np.concatenate([floor.triangles, roof.triangles + len(floor.vertices)])
    normals = np.concatenate([floor.normals, -roof.normals])
    scene = of_one_material(vertices, triangles, normals, (0.5, 0.5, 0.5))
    factors = factors_of(scene)
    side = np.hypot(reach, height)
    expected = 4 / np.pi * reach / side * np.arctan(reach / side)
    middle = int(np.argmin(np.linalg.norm(vertices, axis=1)))
    assert factor_sums(factors)[middle] == pytest.approx(expected, abs=0.02)
    # What the roof alone reflects of a light of 1: half of that, once; a little more by the floor.
    above = vertices[factors.samples][..., 2] > 0.5 * height
    direct = np.repeat(above.astype(float)[..., None], 3, axis=2)
    found = bounced(factors, direct)[middle, 0]
    assert 0.5 * expected < found < 0.5 * expected * 1.3


def test_patches_and_sky_fill_the_hemisphere() -> None:
    """Conservation, on a scene of several surfaces: form factors, and rays to the sky."""
    scene = built_in_scene("court", 6, 16)
    seen = scene_visibility(scene.vertices, scene.triangles, scene.normals, 32)
    factors = bounce_factors(scene, seen.origins, 96)
    from pipelines.ssdf_lighting.distances.octahedral import solid_angles, texel_directions
    from pipelines.ssdf_lighting.distances.visibility import unpacked
    from pipelines.ssdf_lighting.figures import closure_error

    free = ~seen.origins.sealed
    visible = unpacked(seen.visible, 32 * 32)[free]
    parts = visible, scene.normals[free], texel_directions(32), solid_angles(32)
    assert closure_error(factor_sums(factors)[free], *parts) < 0.01
    # A null: half of the factors.
    assert closure_error(0.5 * factor_sums(factors)[free], *parts) > 0.1
    assert factors.nbytes < 26 * len(scene.vertices) + 64_000


def test_light_falls_through_the_distances() -> None:
    """Where distances say that nothing is visible nothing is reflected; else it turns with the
    lights and is proportional to them."""
    scene = inside_of_a_sphere((0.5, 0.5, 0.5))
    factors = factors_of(scene)
    lights = Lights(np.array([[0.0, 0.6, 0.8]]), np.array([40.0]), np.array([[1.0, 2.0, 4.0]]))
    light = BouncedLight(scene, factors, lights)

    def all_hidden(vertices: Array, axes: Array) -> Array:
        return np.full(axes.shape[:2], -np.pi)

    def all_open(vertices: Array, axes: Array) -> Array:
        return np.full(axes.shape[:2], np.pi)

    assert light.at_vertices(lights, all_hidden).max() < 1e-6
    shown = light.at_vertices(lights, all_open)
    np.testing.assert_allclose(shown[:, 1], 2 * shown[:, 0], rtol=1e-4)
    twice = lights._replace(amplitudes=2 * lights.amplitudes)
    np.testing.assert_allclose(light.at_vertices(twice, all_open), 2 * shown, rtol=1e-4)
    # Albedo 0.5, all of the flux falls on the inside, spread over 4 pi: 2 pi / 40 / 4 pi each time.
    series = sum(0.5**order for order in range(1, 6))
    assert shown[:, 0].mean() == pytest.approx(series * (2 * np.pi / 40) / (4 * np.pi), rel=0.1)
