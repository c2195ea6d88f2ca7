"""Shells against Eq. 3 in closed form."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipelines.geometry import shapes
from pipelines.photo_fur.attenuation import MOST_LAYERS
from pipelines.photo_fur.shells import (
    make_shell_mesh,
    shell_heights,
    shell_vertices,
    usual_thickness,
)


@settings(deadline=None)
@given(st.floats(1e-6, 1e6), st.integers(1, MOST_LAYERS))
def test_heights_are_equation_3(thickness: float, layers: int) -> None:
    """h(n) = (n/N) hb is the depth from the tips: the height is what is left."""
    exact = [Fraction(thickness) * (1 - Fraction(n, layers)) for n in range(1, layers + 1)]
    heights = shell_heights(thickness, layers)
    np.testing.assert_allclose(
        heights, [float(h) for h in exact], rtol=1e-9, atol=1e-15 * thickness
    )
    assert heights[-1] == 0.0


@settings(deadline=None)
@given(st.floats(0.01, 10.0), st.integers(2, 60))
def test_steps_are_equal_and_the_first_is_a_step_below_the_thickness(
    thickness: float, layers: int
) -> None:
    heights = shell_heights(thickness, layers)
    np.testing.assert_allclose(-np.diff(heights), thickness / layers, rtol=1e-9)
    assert heights[0] == pytest.approx(thickness - thickness / layers, rel=1e-9)


def test_vertices_lie_above_their_own_along_the_normal() -> None:
    rng = np.random.default_rng(6)
    skin = rng.normal(size=(50, 3)).astype(np.float32)
    normals = rng.normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    shells = shell_vertices(skin, normals, 0.3, 7)
    assert shells.shape == (7, 50, 3)
    assert shells.dtype == np.float32
    np.testing.assert_array_equal(shells[-1], skin)
    for number in range(1, 8):
        offset = shells[number - 1].astype(np.float64) - skin
        height = 0.3 * (7 - number) / 7
        np.testing.assert_allclose((offset * normals).sum(axis=1), height, atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(offset, axis=1), height, atol=1e-6)


def test_shells_of_a_sphere_are_spheres() -> None:
    points = np.random.default_rng(7).normal(size=(200, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    radii = np.linalg.norm(shell_vertices(points, points, 0.5, 5), axis=2)
    expected = np.array([1.4, 1.3, 1.2, 1.1, 1.0])
    np.testing.assert_allclose(radii, np.tile(expected[:, None], (1, 200)), rtol=1e-6)


def test_a_shell_mesh_is_the_mesh_with_its_shells() -> None:
    mesh = shapes.sphere(12)
    shells = make_shell_mesh(mesh, 5, thickness=0.4, repeats=2.5)
    np.testing.assert_array_equal(
        shells.vertices, shell_vertices(mesh.vertices, mesh.normals, 0.4, 5)
    )
    np.testing.assert_array_equal(shells.normals, mesh.normals)
    np.testing.assert_array_equal(shells.triangles, mesh.triangles)
    np.testing.assert_array_equal(shells.uvs, 2.5 * mesh.uvs)
    assert shells.layers == 5
    np.testing.assert_array_equal(shells.heights, shell_heights(0.4, 5))


def test_the_usual_thickness_is_6_percent_of_the_radius_wherever_the_mesh_stands() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [6.0, 8.0, 0.0]])
    for place in (0.0, [3.0, -7.0, 100.0]):
        assert usual_thickness(corners + place) == pytest.approx(0.06 * 5.0)
    mesh = shapes.teapot(4)
    assert make_shell_mesh(mesh, 3).thickness == usual_thickness(mesh.vertices)


@pytest.mark.parametrize("thickness", [math.nan, math.inf, -math.inf, 0.0, -0.0, -1.0])
def test_a_thickness_that_is_no_length_is_refused(thickness: float) -> None:
    message = rf"^thickness is {thickness:g}; expected a positive length in mesh units\.$"
    with pytest.raises(ValueError, match=message):
        shell_heights(thickness, 8)
    with pytest.raises(ValueError, match=message):
        shell_vertices(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), thickness, 8)


@pytest.mark.parametrize("layers", [0, -3, MOST_LAYERS + 1])
def test_a_number_of_layers_that_cannot_be_drawn_is_refused(layers: int) -> None:
    with pytest.raises(ValueError, match=rf"^layers is {layers}; expected 1 to"):
        shell_heights(1.0, layers)
