"""What stands behind a lit scene: its environment, turned as its lights are."""

import numpy as np
import pytest

from pipelines.drawing.stage import orbit
from pipelines.light.built_in_environments import sky
from pipelines.light.environment_maps import texel_directions
from pipelines.ssdf_lighting.drawing.frames import seen_behind
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, rotated


@pytest.mark.parametrize("turn", [0.0, 75.0, 200.0])
def test_the_sun_is_seen_where_its_light_comes_from(turn: float) -> None:
    """The brightest pixel is in the middle where the camera looks along the turned light's axis."""
    environment = sky(128, sun_azimuth=40.0, sun_elevation=35.0)
    brightest = np.argmax(environment.sum(axis=2))
    axis = texel_directions(128).reshape(-1, 3)[brightest]
    (towards,) = rotated(Lights(axis[None], np.array([100.0]), np.ones((1, 3))), turn).axes
    azimuth = np.degrees(np.arctan2(-towards[1], -towards[0]))
    camera = orbit((0.0, 0.0, 0.0), 2.0, azimuth, -np.degrees(np.arcsin(towards[2])))

    seen = seen_behind(environment, camera, (41, 31), turn).sum(axis=2)

    row, column = np.unravel_index(np.argmax(seen), seen.shape)
    assert abs(row - 15) <= 2
    assert abs(column - 20) <= 2
