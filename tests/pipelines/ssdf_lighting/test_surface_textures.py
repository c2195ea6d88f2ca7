"""Textures: what is sampled where, and how far away; what places look like by it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb
from pipelines.ssdf_lighting.surface_textures import (
    Sampler,
    Texture,
    TexturedMaterial,
    Wrap,
    bent_normals,
)

CODES = np.random.default_rng(3).integers(0, 256, (4, 8, 3), np.uint8)
WHITE = TexturedMaterial(0, (1.0, 1.0, 1.0), 0.0, (0.0, 0.0, 0.0), 1.0)


def albedo(texture: Texture, uvs: list[tuple[float, float]], apart: float = 0.0) -> NDArray:
    places = np.array([[uv, uv] for uv in uvs])
    material = WHITE._replace(colour=texture)
    footprint = np.full((len(uvs), 2), apart)
    return Sampler(material).looks_at(places, np.ones((len(uvs), 3)), footprint).albedo


def test_the_middle_of_a_texel_is_its_colour_and_row_0_is_the_top() -> None:
    found = albedo(Texture(CODES), [(0.5 / 8, 1 - 0.5 / 4), (7.5 / 8, 0.5 / 4), (2.5 / 8, 2.5 / 4)])
    expected = decode_srgb(np.array([CODES[0, 0], CODES[3, 7], CODES[1, 2]]) / 255)
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_between_texels_light_is_mixed_not_codes() -> None:
    black_and_white = np.repeat(np.array([[[0], [255]]], np.uint8), 3, axis=2)
    found = albedo(Texture(black_and_white, ("clamp", "clamp")), [(0.5, 0.5)])
    np.testing.assert_allclose(found, 0.5, atol=1e-9)


@pytest.mark.parametrize(
    ("wrap", "column"), [("repeat", [2, 6, 0]), ("mirror", [5, 6, 7]), ("clamp", [7, 0, 7])]
)
def test_what_lies_outside(wrap: Wrap, column: list[int]) -> None:
    places = [(1 + 2.5 / 8, 0.875), (-1.5 / 8, 0.875), (3 + 0.5 / 8, 0.875)]
    if wrap == "mirror":
        column = [5, 1, 7]
    found = albedo(Texture(CODES, (wrap, "clamp")), places)
    np.testing.assert_allclose(found, decode_srgb(CODES[0, column] / 255), atol=1e-9)


def test_from_afar_a_texture_is_its_mean() -> None:
    found = albedo(Texture(CODES), [(0.3, 0.4), (0.9, 0.1)], apart=4.0)
    mean = decode_srgb(CODES / 255).mean(axis=(0, 1))
    np.testing.assert_allclose(found, np.tile(mean, (2, 1)), atol=0.01)


def test_metal_takes_the_colour_from_the_albedo_to_the_gloss() -> None:
    surface = Texture(np.array([[[255, 128, 255], [255, 128, 0]]], np.uint8))
    material = TexturedMaterial(0, (0.9, 0.6, 0.3), 1.0, (0.04, 0.04, 0.04), 1.0, surface=surface)
    places = np.array([[[0.25, 0.5]] * 2, [[0.75, 0.5]] * 2])
    found = Sampler(material).looks_at(places, np.ones((2, 3)), np.zeros((2, 2)))
    np.testing.assert_allclose(found.albedo, [[0, 0, 0], [0.9, 0.6, 0.3]], atol=1e-9)
    np.testing.assert_allclose(found.specular, [0.6, 0.04])
    np.testing.assert_allclose(found.tint, [[1.5, 1, 0.5], [1, 1, 1]])
    np.testing.assert_allclose(found.roughness, (128 / 255) ** 2)


def test_colours_of_corners_multiply_the_base_colour() -> None:
    places = np.zeros((1, 2, 2))
    found = Sampler(WHITE).looks_at(places, np.array([[0.5, 0.25, 1.0]]), np.zeros((1, 2)))
    np.testing.assert_allclose(found.albedo, [[0.5, 0.25, 1.0]])


def test_bumps_that_are_too_small_to_see_make_the_gloss_rougher() -> None:
    steep = np.array([[[40, 128, 210], [216, 128, 210]]] * 2, np.uint8)
    material = WHITE._replace(specular=(0.04,) * 3, roughness=0.3, normal=Texture(steep))
    places = np.full((1, 2, 2), 0.5)
    for apart, rougher in ((0.0, True), (2.0, True)):
        footprint = np.full((1, 2), apart)
        found = Sampler(material).looks_at(places, np.ones((1, 3)), footprint)
        assert (found.roughness[0] > 0.09 + 0.1) == rougher


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_bump_leans_along_its_texture_coordinates(mirrored: bool) -> None:
    """u along +y; v along -x, or, mirrored, along +x."""
    edges = np.array([[[0.0, 2, 0], [-3, 0, 0]]])
    uv_edges = np.array([[[1.0, 0], [0, -1 if mirrored else 1]]])
    normals, lean = np.array([[0.0, 0, 1]]), 0.6
    along = bent_normals(normals, edges, uv_edges, np.array([[lean, 0, 0.8]]))
    across = bent_normals(normals, edges, uv_edges, np.array([[0, lean, 0.8]]))
    np.testing.assert_allclose(along, [[0, lean, 0.8]], atol=1e-12)
    np.testing.assert_allclose(across, [[lean if mirrored else -lean, 0, 0.8]], atol=1e-12)


def test_without_an_area_on_the_texture_the_normal_stays() -> None:
    normals = np.array([[0.0, 0, 1]])
    edges, none = np.array([[[1.0, 0, 0], [0, 1, 0]]]), np.zeros((1, 2, 2))
    found = bent_normals(normals, edges, none, np.array([[0.6, 0, 0.8]]))
    np.testing.assert_array_equal(found, normals)
