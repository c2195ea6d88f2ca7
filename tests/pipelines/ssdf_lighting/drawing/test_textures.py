"""Textures on the stage and in the traced picture: in the same places, of the same colours."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.stage import orbit
from pipelines.geometry import shapes
from pipelines.ssdf_lighting.drawing.light_sources import GaussianSource
from pipelines.ssdf_lighting.drawing.ray_tracing import ray_traced
from pipelines.ssdf_lighting.drawing.stage_view import LitActor, draw_lit
from pipelines.ssdf_lighting.figures import colour_error, psnr, reflectance
from pipelines.ssdf_lighting.light.microfacets import Materials
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights
from pipelines.ssdf_lighting.scene import Scene, make_scene, split_by_part
from pipelines.ssdf_lighting.surface_textures import (
    SurfaceTextures,
    Texture,
    TexturedMaterial,
    Wrap,
)

SIZE = (96, 72)
CAMERA = orbit((0.0, 0.0, 0.0), 4.0, azimuth=-60.0, elevation=50.0, view_angle=30.0)
LIGHTS = Lights(
    np.array([[0.6, 0.0, 0.8], [-0.6, 0.48, 0.64]]),
    np.array([25.0, 3.0]),
    np.array([[4.0, 3.5, 3.0], [0.6, 0.8, 1.0]]),
)
_RNG = np.random.default_rng(5)
TILES = _RNG.integers(20, 235, (4, 4, 3), np.uint8)
COLOUR = Texture(TILES.repeat(16, axis=0).repeat(16, axis=1))
SURFACE = Texture(
    np.array([[[255, 90, 0], [255, 220, 255]]], np.uint8).repeat(16, axis=0).repeat(16, axis=1)
)


def waves(side: int = 64) -> Texture:
    """Normals of waves along u."""
    slope = 0.5 * np.cos(np.arange(side) * 4 * np.pi / side)
    normal = np.stack([-slope, 0 * slope, np.ones(side)], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    codes = np.rint((normal + 1) / 2 * 255).astype(np.uint8)
    return Texture(np.ascontiguousarray(np.broadcast_to(codes, (side, side, 3))))


def material(**maps: Any) -> TexturedMaterial:
    return TexturedMaterial(0, (1.0, 1.0, 1.0), 0.0, (0.04,) * 3, 0.6)._replace(**maps)


def square(made: TexturedMaterial, times: float = 1.0, shift: float = 0.0) -> Scene:
    """A square that lies flat; texture coordinates from ``shift`` to ``shift + times``."""
    flat = shapes.square(4)
    uvs = (flat.vertices[:, :2] + 0.5) * times + shift
    corners = np.repeat(uvs[flat.triangles][:, :, None], 2, axis=2).astype(np.float32)
    colours = np.ones((*flat.triangles.shape, 3), np.float32)
    materials = Materials(np.full((1, 3), 0.5), np.array([0.04]), np.array([0.36]))
    textures = SurfaceTextures(corners, colours, (made,))
    part = np.zeros(len(flat.triangles), int)
    return make_scene(flat.vertices, flat.triangles, part, materials, textures)


def drawn(scene: Scene, reflected: float = 0.0) -> NDArray[np.float32]:
    """Nothing hides light but the surface itself; with light from other surfaces."""
    mesh = split_by_part(scene).mesh
    actor = LitActor(mesh, LIGHTS)
    places = mesh.vertices @ np.array([[1.0, 0.5, 0.2], [0.3, 1.0, 0.1], [0.0, 0.0, 0.0]])
    actor.show_bounced(reflected * (1.0 + places))

    def horizon(axes: NDArray[np.float32]) -> NDArray[np.float64]:
        height = np.einsum("vlc,vc->vl", axes, mesh.normals)
        return np.arcsin(np.clip(height, -1.0, 1.0))

    return draw_lit(SIZE, actor, CAMERA, LIGHTS, horizon)


def traced(scene: Scene, samples: int = 64) -> NDArray[np.float64]:
    mesh = split_by_part(scene).mesh
    return ray_traced(mesh, GaussianSource(LIGHTS), CAMERA, SIZE, samples, jittered=False).radiance


def pictures(scene: Scene) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.bool_]]:
    stage, rays = drawn(scene), traced(scene)
    shown = (stage[..., 3] > 0.5) & (rays[..., 3] > 0.5)
    scale = auto_exposure(stage[shown][:, :3])
    return to_8bit(stage[..., :3] * scale), to_8bit(rays[..., :3] * scale), shown


def test_textures_of_one_colour_draw_as_the_material_itself() -> None:
    codes = np.array([188, 99, 50], np.uint8)
    flat = Texture(np.full((8, 8, 3), codes, np.uint8))
    gloss = Texture(np.full((8, 8, 3), [255, 153, 0], np.uint8))
    normal = Texture(np.full((8, 8, 3), [128, 128, 255], np.uint8))
    textured = square(material(colour=flat, surface=gloss, normal=normal, roughness=1.0))
    linear = ((codes / 255 + 0.055) / 1.055) ** 2.4
    plain = square(material())._replace(
        textures=None,
        materials=Materials(linear[None], np.array([0.04]), np.array([(153 / 255) ** 2])),
    )
    for reflected in (0.0, 0.4):
        found, expected = drawn(textured, reflected), drawn(plain, reflected)
        shown = expected[..., 3] > 0.5
        np.testing.assert_allclose(found[shown], expected[shown], rtol=0.02, atol=2e-3)


@pytest.mark.parametrize(
    ("made", "times", "least"),
    [
        (material(colour=COLOUR), 1.0, 30.0),
        (material(colour=COLOUR, surface=SURFACE), 2.0, 27.0),
        (material(colour=COLOUR, normal=waves()), 1.0, 27.0),
    ],
    ids=["colour", "surface", "normal"],
)
def test_the_shader_shows_what_rays_find(
    made: TexturedMaterial, times: float, least: float
) -> None:
    stage, rays, shown = pictures(square(made, times))
    assert psnr(stage, rays, shown) > least
    assert colour_error(stage, rays, shown) < 0.01


@pytest.mark.parametrize(
    "wrap",
    [("repeat", "clamp"), ("mirror", "mirror"), ("clamp", "mirror"), ("mirror", "repeat")],
)
def test_the_shader_wraps_as_rays_do(wrap: tuple[Wrap, Wrap]) -> None:
    scene = square(material(colour=COLOUR._replace(wrap=wrap)), times=3.0, shift=-1.2)
    stage, rays, shown = pictures(scene)
    assert psnr(stage, rays, shown) > 23.5
    other = wrap[0], "repeat" if wrap[1] != "repeat" else "clamp"
    wrong = square(material(colour=COLOUR._replace(wrap=other)), times=3.0, shift=-1.2)
    assert psnr(pictures(wrong)[0], rays, shown) < 22.0


def test_each_texture_is_used() -> None:
    """Taken away, it moves the figures that watch over lit scenes."""
    whole = square(material(colour=COLOUR, surface=SURFACE, normal=waves()))
    stage, rays, shown = pictures(whole)
    assert psnr(stage, rays, shown) > 25.0
    for name, least in (("colour", 6.0), ("surface", 3.0), ("normal", 2.0)):
        (made,) = whole.textures.materials if whole.textures else ()
        without = square(made._replace(**{name: None}))
        assert psnr(pictures(without)[0], rays, shown) < psnr(stage, rays, shown) - least


def test_a_texture_set_to_one_colour_moves_the_figures() -> None:
    whole = square(material(colour=COLOUR))
    red = Texture(np.full((2, 2, 3), [200, 30, 20], np.uint8))
    constant = square(material(colour=red))
    _, rays, shown = pictures(whole)
    assert colour_error(pictures(constant)[0], rays, shown) > 0.1
    black = square(material(colour=Texture(np.zeros((2, 2, 3), np.uint8))))
    assert reflectance(whole) > 0.2
    assert reflectance(black) == pytest.approx(0.04)


def test_from_afar_a_fine_texture_does_not_shimmer() -> None:
    """Checks far smaller than a pixel are their mean light."""
    checks = (np.indices((64, 64)).sum(axis=0) % 2 * 255).astype(np.uint8)
    fine = square(material(colour=Texture(checks[..., None].repeat(3, axis=2))), times=40.0)
    grey = square(material(base=(0.5, 0.5, 0.5)))
    found, expected = drawn(fine), drawn(grey)
    shown = expected[..., 3] > 0.5
    np.testing.assert_allclose(found[shown], expected[shown], rtol=0.02, atol=2e-3)
