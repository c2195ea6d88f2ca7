"""Where the camera stands: as usual, but in front of what is open."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.ssdf_lighting.drawing.camera_rays import camera_rays
from pipelines.ssdf_lighting.drawing.viewpoints import AZIMUTH, ELEVATION, viewpoint
from pipelines.ssdf_lighting.light.microfacets import Materials
from pipelines.ssdf_lighting.scene import Scene, built_in_scene, make_scene

ONE = Materials(np.full((1, 3), 0.5), np.zeros(1), np.full(1, 0.2))
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
INSIDE = np.array(
    [[0, 4, 6, 2], [1, 3, 7, 5], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4]]
)
"""Floor, ceiling, back, left, right and front of a room, as seen from inside."""


def box(*without: int, longest: float = 0.2) -> Scene:
    sides = np.delete(INSIDE, without, axis=0)
    triangles = np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])
    part = np.zeros(len(triangles), int)
    return make_scene(CUBE, triangles, part, ONE, longest=longest)


@pytest.mark.parametrize("name", ["teapot", "court"])
def test_what_stands_on_a_floor_is_seen_as_usual(name: str) -> None:
    found = viewpoint(built_in_scene(name, 6, 16), None, None, 4 / 3)
    assert (found.azimuth, found.elevation) == (AZIMUTH, ELEVATION)
    assert found.behind < 0.01


@pytest.mark.parametrize("longest", [0.2, np.inf])
def test_a_box_that_is_open_in_front_is_looked_into(longest: float) -> None:
    found = viewpoint(box(5, longest=longest), None, None, 4 / 3)
    assert found.behind == 0
    position = np.array(found.camera.position)
    assert position[1] < -1  # the front is at -y
    corners = CUBE - 0.5
    corners = corners / np.linalg.norm(corners, axis=1).max()
    origins, ways = camera_rays(found.camera, (4, 3), np.array([[0.0, 0], [4, 0], [4, 3], [0, 3]]))
    for one, other in zip(ways, np.roll(ways, -1, axis=0), strict=True):
        beside = np.cross(one, other)
        sides = (corners - origins[0]) @ beside
        assert (np.sign(sides) == np.sign(sides[0])).all()  # whole in the picture


def test_a_box_without_a_lid_is_looked_into_from_above() -> None:
    found = viewpoint(box(1), None, None, 4 / 3)
    usual = viewpoint(box(1), AZIMUTH, ELEVATION, 4 / 3)
    assert found.behind <= usual.behind
    assert usual.behind > 0.3


def test_what_was_asked_for_is_taken() -> None:
    found = viewpoint(box(5), 90.0, None, 4 / 3)
    assert (found.azimuth, found.elevation) == (90.0, ELEVATION)
    assert found.behind == 1
