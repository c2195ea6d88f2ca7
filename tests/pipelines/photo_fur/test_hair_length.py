"""How long hair is, against bodies whose thickness is known."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.geometry.eared_body import eared_body
from pipelines.geometry.shapes import sphere, square
from pipelines.photo_fur.hair_length import SHORTEST, body_thickness, hair_lengths


def test_a_balls_thickness_is_near_its_diameter() -> None:
    ball = sphere(48)
    found = body_thickness(ball.vertices, ball.normals, ball.triangles)
    # The median ray is aside: a chord at the tangent 0.5 from the diameter.
    chord = 2.0 * np.cos(np.arctan(0.5))
    np.testing.assert_allclose(found, chord, rtol=0.02)


def test_a_flat_body_is_as_thick_as_it_is_flat() -> None:
    ball = sphere(48)
    flat = ball.vertices * np.array([1.0, 1.0, 0.1])
    normals = ball.vertices * np.array([1.0, 1.0, 10.0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    found = body_thickness(flat, normals, ball.triangles)
    middle = np.hypot(flat[:, 0], flat[:, 1]) < 0.2
    assert found[middle].mean() == pytest.approx(0.2 / np.cos(np.arctan(0.5)), rel=0.05)


def test_a_sheet_has_hair_of_one_length() -> None:
    sheet = square(8)
    lengths = hair_lengths(sheet.vertices, sheet.normals, sheet.triangles)
    np.testing.assert_array_equal(lengths, 1.0)


def test_ears_and_legs_have_shorter_hair_than_the_back() -> None:
    body = eared_body(48)
    lengths = hair_lengths(body.vertices, body.normals, body.triangles)
    x, _, z = body.vertices.T
    back = lengths[(np.abs(x) < 0.3) & (z > 0.35)]
    ears, feet = lengths[z > 0.75], lengths[z < -0.6]
    assert back.mean() > 0.85
    assert ears.mean() < 0.65
    assert feet.mean() < 0.8
    assert SHORTEST <= lengths.min() <= lengths.max() <= 1.0


def test_copies_of_a_vertex_have_hair_as_long_as_each_other() -> None:
    body = eared_body(32)
    lengths = hair_lengths(body.vertices, body.normals, body.triangles)
    _, position = np.unique(body.vertices, axis=0, return_inverse=True)
    spread = [np.ptp(lengths[position == k]) for k in range(0, position.max(), 7)]
    assert max(spread) < 1e-9
