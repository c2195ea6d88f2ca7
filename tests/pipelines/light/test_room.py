"""The room's map: that it is what `docs.room` traces, and that its windows are found."""

from __future__ import annotations

import re

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from docs.room import __main__ as making
from docs.room.furnishing import furnished_room
from docs.room.looks import EYE
from pipelines.drawing.colour import luminance
from pipelines.light import room as room_module
from pipelines.light.environment_maps import (
    check_environment,
    mean_radiance,
    rotate_environment,
    solid_angles,
    texel_directions,
)
from pipelines.light.environment_sampling import make_environment_sampler, sample_directions
from pipelines.light.room import ROOM_ROWS, room

ROWS = 64
OUTSIDE = 0.6
"""Luminance of the lawn and more: nothing inside but lamps and what the sun shines on has it."""


@pytest.fixture(scope="module")
def traced() -> NDArray[np.float32]:
    """By few rays, in coarse pieces; the denoiser makes up for it."""
    return making.traced_room(ROWS, samples=8, gathered=24, step=0.6)


def _difference(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    """Median difference of the logarithms of luminance."""
    return float(np.median(np.abs(np.log(luminance(one)) - np.log(luminance(other)))))


def test_the_map_is_the_one_that_its_code_traces(traced: NDArray[np.float32]) -> None:
    stored = room(ROWS)
    assert _difference(stored, traced) < 0.08
    assert np.allclose(mean_radiance(stored), mean_radiance(traced), rtol=0.05)
    for degrees in (6.0, 90.0):  # null: turned
        assert _difference(rotate_environment(stored, degrees), traced) > 0.12


def test_a_written_map_is_read_back(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    ramp = np.linspace(0.05, 5.0, ROOM_ROWS, dtype=np.float32)
    made = np.broadcast_to(ramp[:, None, None], (ROOM_ROWS, 2 * ROOM_ROWS, 3))
    path = tmp_path_factory.mktemp("room") / "room.exr"
    making.write_room(path, made)
    monkeypatch.setattr(room_module, "_FILE", path)
    assert np.allclose(room(ROOM_ROWS), made, rtol=0.02, atol=0.01)


def test_the_file_is_small() -> None:
    assert room_module._FILE.stat().st_size < 1_000_000


@pytest.mark.parametrize("rows", [16, 100, ROOM_ROWS])
def test_every_size_has_the_same_light(rows: int) -> None:
    radiance = room(rows)
    check_environment(radiance)
    assert radiance.shape == (rows, 2 * rows, 3)
    assert radiance.dtype == np.float32
    assert np.allclose(mean_radiance(radiance), mean_radiance(room(512)), rtol=0.02)


@pytest.mark.parametrize("rows", [15, ROOM_ROWS + 1])
def test_other_sizes_are_refused(rows: int) -> None:
    with pytest.raises(ValueError, match=re.escape(f"height is {rows}; expected 16 to 1024.")):
        room(rows)


def _windows(height: int) -> NDArray[np.bool_]:
    """Directions (H, W) from the glass through the windows' holes, by geometry alone."""
    ways, seen = texel_directions(height), np.zeros((height, 2 * height), np.bool_)
    for window in furnished_room()[1]:
        axis = int(np.argmin(np.abs(window.one) + np.abs(window.other)))
        far = (window.corner[axis] - EYE[axis]) / ways[..., axis]
        places = np.array(EYE) + far[..., None] * ways
        low = window.corner
        high = window.corner + window.one + window.other
        inside = (places >= low - 1e-9) & (places <= high + 1e-9)
        inside[..., axis] = far > 0
        seen |= inside.all(axis=-1)
    return seen


def test_the_windows_are_where_the_walls_have_holes_and_look_out() -> None:
    """Two thirds of the holes are glass, the rest are frames and bars; of what else lies about as
    high, one part in twenty is as bright."""
    seen, bright = _windows(256), luminance(room(256))
    assert np.mean(bright[seen] > OUTSIDE) > 0.6
    above = texel_directions(256)[..., 2] > -0.1
    assert np.mean(bright[above & ~seen] > OUTSIDE) < 0.05


def test_the_sampler_finds_the_windows() -> None:
    """Directions go to them by their share of the light, which is many times that of the sphere."""
    sampler = make_environment_sampler(room(256))
    seen = _windows(256)
    steradians = np.broadcast_to(solid_angles(256)[:, None], seen.shape)
    bright = luminance(sampler.radiance.astype(np.float64)) * steradians
    share, of_sphere = bright[seen].sum() / bright.sum(), steradians[seen].sum() / (4 * np.pi)
    ways, _ = sample_directions(sampler, np.random.default_rng(1).random((20_000, 2)))
    row = (np.arccos(ways[:, 2]) / np.pi * 256).astype(int)
    column = ((0.5 - np.arctan2(ways[:, 1], ways[:, 0]) / (2 * np.pi)) * 512).astype(int)
    drawn = seen[np.clip(row, 0, 255), np.clip(column, 0, 511)].mean()
    assert abs(drawn - share) < 0.02
    assert drawn > 4 * of_sphere


def test_there_is_something_to_see() -> None:
    """Behind a glass, where pictures look: lights and darks, edges, several hues; an even wall
    has none."""
    part = room(512)[220:350, 130:260]
    bright = luminance(part.astype(np.float64))
    assert np.quantile(bright, 0.95) > 8 * np.quantile(bright, 0.05)
    edges = np.abs(np.diff(np.log(bright), axis=1))
    assert (edges > 0.1).mean() > 0.1
    shown = (part / part.max(axis=2, keepdims=True)).astype(np.float32)
    hue = cv2.cvtColor(shown, cv2.COLOR_RGB2HSV)
    assert len(np.unique((hue[hue[..., 1] > 0.3][:, 0] // 30).astype(int))) >= 4
