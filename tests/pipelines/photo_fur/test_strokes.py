"""Hair follows strokes near them, and what cannot be followed is refused."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.geometry.shapes import square
from pipelines.photo_fur.lie import lie_field
from pipelines.photo_fur.strokes import guides_along, strokes_of


def test_a_stroke_is_followed_near_it_and_forgotten_far_from_it() -> None:
    mesh = square(40)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    middle, size = (low + high) / 2, high - low
    stroke = middle + size * np.array([[0.0, -0.4, 0.0], [0.0, 0.4, 0.0]])
    east = np.tile([1.0, 0.0, 0.0], (len(mesh.vertices), 1))
    guides = guides_along([stroke], 0.06 * size[0], mesh.vertices, east)
    lie = lie_field(mesh.vertices, mesh.normals, mesh.triangles, guides, 0.02 * size[0])
    on = np.abs(mesh.vertices[:, 0] - middle[0]) < 0.03 * size[0]
    on &= np.abs(mesh.vertices[:, 1] - middle[1]) < 0.3 * size[1]
    far = np.abs(mesh.vertices[:, 0] - middle[0]) > 0.4 * size[0]
    assert lie.tangents[on, 1].min() > 0.99
    assert lie.tangents[far, 0].min() > 0.99


def test_of_two_strokes_at_a_place_the_last_one_counts() -> None:
    vertices = np.array([[0.0, 0.0, 0.0]])
    strokes = [[(-1, 0, 0), (1, 0, 0)], [(0, -1, 0), (0, 1, 0)]]
    guides = guides_along(strokes, 0.3, vertices, np.zeros((1, 3)))
    np.testing.assert_array_equal(guides, [[0.0, 10.0, 0.0]])


@pytest.mark.parametrize(
    ("stroke", "sentence"),
    [
        ([(0, 0, 0)], r"stroke 1 has no length; expected two different points\."),
        ([(0, 0, 0), (0, 0, 0)], r"stroke 1 has no length"),
        ([(0, 0, 5), (1, 0, 5)], r"stroke 1 passes the mesh at 5.*; expected it within 0\.1 of"),
    ],
)
def test_what_cannot_be_followed_is_refused(stroke: list[object], sentence: str) -> None:
    mesh = square(4)
    with pytest.raises(ValueError, match=sentence):
        guides_along([stroke], 0.1, mesh.vertices, mesh.normals)  # type: ignore[list-item]


@pytest.mark.parametrize("text", ["0,0 1,1", "a,b,c 1,1,1", "0,0,1 1,0", "0,0,nan 1,1,1", "0 0 1"])
def test_a_text_that_is_no_stroke_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"^'.*': expected points x,y,z"):
        strokes_of(text)


def test_no_text_is_no_stroke() -> None:
    assert strokes_of("") == strokes_of(" ; ") == []
