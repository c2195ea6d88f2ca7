"""Pictures of cloth against closed forms: irradiance from even light, a disc of sun, half a sky."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera, orbit
from pipelines.geometry.meshes import grid_triangles
from pipelines.light.built_in_environments import sky, uniform
from pipelines.light.environment_maps import solid_angles, texel_directions
from pipelines.neural_btf.draping.draped_cloth import DrapedCloth
from pipelines.neural_btf.draping.gathering import (
    FLOOR,
    floor_radiance,
    floor_shading,
    lighting_of,
    plane_filling,
)
from pipelines.neural_btf.draping.rendering import Rendered, View, camera_rays, render
from pipelines.neural_btf.draping.scene import Scene, scene_of, seen
from pipelines.neural_btf.importance import ImportanceTable, importance_table
from pipelines.neural_btf.material import FlatColour, Material

WHITE = FlatColour((1.0, 1.0, 1.0))
ABOVE = orbit((0.0, 0.0, 1.0), 2.0, -90.0, 90.0, view_angle=20.0)
SIZE = (16, 12)


def sheet(
    height: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]],
    steps: int = 2,
) -> DrapedCloth:
    """A square of 2 m about the middle, at a height; u along x, v along y."""
    x, y = np.meshgrid(np.linspace(-1, 1, steps), np.linspace(-1, 1, steps))
    z = height(x, y)
    slope_x, slope_y = (height(x + dx, y + dy) - z for dx, dy in ((1e-6, 0), (0, 1e-6)))
    normals = np.stack([-slope_x / 1e-6, -slope_y / 1e-6, np.ones_like(z)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    tangents = np.stack([np.ones_like(z), np.zeros_like(z), slope_x / 1e-6], axis=-1)
    tangents /= np.linalg.norm(tangents, axis=-1, keepdims=True)
    flat = [np.stack([x, y, z], axis=-1), normals, tangents]
    points, normals, tangents = (values.reshape(-1, 3) for values in flat)
    places = np.stack([x, y], axis=-1).reshape(-1, 2)
    return DrapedCloth(points, grid_triangles(2, 2), normals, tangents, places)


FLAT = scene_of(sheet(lambda x, y: np.ones_like(x)))
NO_SHADE = np.ones((4, 4, 3), np.float32)


def picture(
    scene: Scene,
    environment: NDArray[np.float32],
    *materials: Material,
    samples: int = 64,
    camera: Camera = ABOVE,
    table: ImportanceTable | None = None,
    seed: int = 0,
) -> Rendered:
    view = View(camera, SIZE, samples, (0.5, 0.5), seed)
    fitted = table or importance_table(materials[0])
    return render(scene, lighting_of(environment), NO_SHADE, materials, fitted, view)


def test_white_cloth_under_even_light_is_as_bright_as_the_light() -> None:
    found = picture(FLAT, uniform(16, 0.7), WHITE)
    assert (found.cloth == 1).all()
    assert found.pictures.mean() == pytest.approx(0.7, rel=0.005)
    assert found.pictures.std() < 0.05


def test_under_a_sky_it_has_its_irradiance_over_pi_in_each_colour() -> None:
    """Whatever directions are drawn from: the table of another material gives the same."""
    environment = sky(64, sun_azimuth=20.0, sun_elevation=40.0, sun_radius=5.0)
    cosine = np.maximum(texel_directions(64)[..., 2:], 0) * solid_angles(64)[:, None, None]
    expected = (cosine * environment).sum(axis=(0, 1)) / math.pi
    shares = np.random.default_rng(0).uniform(0.2, 3.0, (6, 12, 12, 24)).astype(np.float32)
    for table in (None, ImportanceTable(shares)):
        found = picture(FLAT, environment, WHITE, samples=256, table=table)
        means = found.pictures[0].reshape(-1, 3)
        error = means.std(axis=0) / math.sqrt(len(means))
        assert (np.abs(means.mean(axis=0) - expected) < 4.5 * error + 0.002 * expected).all()


def test_a_tilted_cloth_sees_part_of_sky_and_of_floor() -> None:
    """Slope 1: of even light 1, (1 + cos 45°) / 2 from above, the rest from the floor."""
    scene = scene_of(sheet(lambda x, y: 1.0 + y))
    found = picture(scene, uniform(64), WHITE, samples=128, camera=orbit((0, 0, 1), 2, -90, 45))
    sky_part = (1 + math.cos(math.pi / 4)) / 2
    expected = sky_part + (1 - sky_part) * np.array(FLOOR)
    means = found.pictures[0][found.cloth == 1].mean(axis=0)
    np.testing.assert_allclose(means, expected, rtol=0.01)


def test_a_wall_takes_half_of_the_sky_from_the_foot_it_stands_at() -> None:
    """At the foot of a high wall: half of an even sky's irradiance."""
    cloth = sheet(lambda x, y: np.ones_like(x))
    wall = np.array([[-60.0, 0, 1], [60, 0, 1], [60, 0, 60], [-60, 0, 60]])
    scene = scene_of(cloth, wall, np.array([[0, 1, 2], [0, 2, 3]]), np.tile([0.0, -1, 0], (4, 1)))
    camera = orbit((0.0, -0.01, 1.0), 0.5, -90.0, 80.0, view_angle=0.5)
    found = picture(scene, uniform(16), WHITE, samples=256, camera=camera)
    assert found.pictures[0].mean() == pytest.approx(0.5, abs=0.02)


def test_values_are_asked_for_in_the_frame_of_the_texture_and_at_its_places() -> None:
    asked: list[tuple[NDArray[np.float64], ...]] = []

    class Told(FlatColour):
        def radiance_at(self, places, light, view, footprint=None):  # type: ignore[no-untyped-def]
            """As its own, and tells what was asked."""
            asked.append((places, light, view, footprint))
            return super().radiance_at(places, light, view, footprint)

    camera = orbit((0.2, -0.4, 1.0), 2.0, 0.0, 45.0, view_angle=0.01)
    picture(FLAT, uniform(16), Told((1, 1, 1)), camera=camera, table=importance_table(WHITE))
    places, _, view, footprint = (np.concatenate(parts) for parts in zip(*asked, strict=True))
    np.testing.assert_allclose(places, np.tile([0.4, -0.8], (len(places), 1)), atol=2e-3)
    half = math.sqrt(0.5)
    np.testing.assert_allclose(view, np.tile([half, 0, half], (len(view), 1)), atol=1e-3)
    # A pixel over the samples in it, 1 / cosine longer one way, in tiles of half a metre.
    pixel = 2.0 * 2 * math.tan(math.radians(0.005)) / 12
    np.testing.assert_allclose(footprint, pixel / math.sqrt(half * 64) / 0.5, rtol=1e-3)


def test_the_back_of_a_cloth_is_seen_and_lit_from_its_side() -> None:
    below = orbit((0.0, 0.0, 1.0), 0.9, -90.0, -60.0, view_angle=20.0)
    found = picture(FLAT, uniform(16), WHITE, camera=below)
    np.testing.assert_allclose(found.pictures[0].mean(axis=(0, 1)), FLOOR, rtol=0.01)


def test_materials_share_their_random_numbers() -> None:
    environment = sky(32, sun_azimuth=20.0, sun_elevation=40.0)
    half = FlatColour((0.5, 0.5, 0.5))
    both = picture(FLAT, environment, WHITE, half, samples=4)
    np.testing.assert_allclose(both.pictures[0], 2 * both.pictures[1], rtol=1e-5)
    again = picture(FLAT, environment, WHITE, samples=4)
    np.testing.assert_array_equal(again.pictures[0], both.pictures[0])
    other = picture(FLAT, environment, WHITE, samples=4, seed=1)
    assert not np.allclose(other.pictures[0], both.pictures[0])


@pytest.mark.parametrize("samples", [0, 3])
def test_samples_are_even(samples: int) -> None:
    with pytest.raises(ValueError, match=f"samples is {samples}; expected an even number"):
        picture(FLAT, uniform(16), WHITE, samples=samples)


def test_rays_go_where_the_pinhole_formula_says() -> None:
    camera = Camera((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 90.0)
    ways = camera_rays(camera, (40, 20), np.array([[20.0, 10.0], [30.0, 10.0], [20.0, 0.0]]))
    half = math.sqrt(0.5)
    expected = [[0, 1, 0], [half, half, 0], [0, half, half]]
    np.testing.assert_allclose(ways, expected, atol=1e-12)


def test_sights_lie_on_the_surface_that_faces_the_eye() -> None:
    ways = camera_rays(ABOVE, SIZE, np.array([[8.0, 6.0], [2.0, 3.0]]))
    which, sights = seen(FLAT, ABOVE, ways)
    assert which.tolist() == [0, 1]
    np.testing.assert_allclose(sights.position[:, 2], 1.0, atol=1e-3)
    assert (sights.position[:, 2] > 1.0).all()
    np.testing.assert_allclose(sights.frame[0], np.eye(3), atol=1e-9)


# ---- the floor -------------------------------------------------------------------------------


def test_far_from_the_cloth_the_floor_is_unshaded_and_below_it_dark() -> None:
    scene = scene_of(sheet(lambda x, y: np.full_like(x, 0.02)))
    shading = floor_shading(scene, lighting_of(uniform(32)), 26, 64)
    assert shading[0, 0].mean() == pytest.approx(1.0, abs=0.02)
    assert shading[12:14, 12:14].max() < 0.05


def test_below_a_small_sheet_the_floor_loses_what_the_form_factor_says() -> None:
    """A square of 2 m, 1 m above: 4 x the form factor of a corner's square, seen from below."""
    shading = floor_shading(FLAT, lighting_of(uniform(32)), 27, 1024)
    corner = 2 / math.sqrt(2) * math.atan(1 / math.sqrt(2)) / (2 * math.pi)
    assert shading[13, 13].mean() == pytest.approx(1 - 4 * corner, abs=0.03)


def test_the_floor_has_its_irradiance_times_albedo_over_pi_and_fades() -> None:
    lighting = lighting_of(uniform(64, 2.0))
    np.testing.assert_allclose(lighting.floor, 2.0 * np.array(FLOOR), rtol=1e-3)
    found = floor_radiance(NO_SHADE, lighting, np.array([[0.0, 0.0], [2.4, 0.0], [1e6, 0.0]]))
    np.testing.assert_allclose(found / lighting.floor, [[1.0] * 3, [0.65] * 3, [0.3] * 3])


def test_numbers_fill_the_square_evenly() -> None:
    """As many in each sixteenth as belong there, within two; random ones are off by far more."""
    filled = plane_filling(1600, 2)
    counts = np.histogram2d(*filled.T, bins=(4, 4), range=[(0, 1), (0, 1)])[0]
    assert np.abs(counts - 100).max() <= 4
    random = np.random.default_rng(0).random((1600, 2))
    assert np.abs(np.histogram2d(*random.T, bins=(4, 4))[0] - 100).max() > 10
