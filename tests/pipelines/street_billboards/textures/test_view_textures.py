"""Textures sampled from photographs of a painted wall, whose every texel is known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.geometry.cameras import project_points
from pipelines.street_billboards.billboards import OVERLAP, axes_facing
from pipelines.street_billboards.capture.exposure import exposure_lut
from pipelines.street_billboards.textures.texture_tables import (
    EMPTY,
    SEEN,
    SIDE,
    UNSEEN,
    join_views,
)
from pipelines.street_billboards.textures.view_directions import fan_position
from pipelines.street_billboards.textures.view_textures import view_textures
from tests.pipelines.street_billboards.painted_wall import (
    FAN,
    VOXEL,
    Scene,
    on_the_wall,
    painting,
    texel_points,
)

ROW = [(x, -5.0, 0.3) for x in (-4.0, -2.0, 0.0, 2.0, 4.0)]


def reddish(colours: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Texels with a good part of the pole in them."""
    return (colours[..., 0] > 105) & (colours[..., 1] < 75)


def test_colours_are_those_of_the_painting() -> None:
    walls = on_the_wall([(x, 0.0, z) for x in (-1.0, 0.0, 1.0) for z in (0.0, 1.0)])
    found = view_textures(walls, VOXEL, Scene().photographs(ROW, size=(160, 140), focal=100))
    assert (np.diff(found.first) == len(ROW)).all()
    for number in range(6):
        truth = painting(texel_points(walls, number))
        rows = slice(found.first[number], found.first[number + 1])
        assert (found.states[rows] == SEEN).all()
        assert np.abs(found.colours[rows] - truth).max() < 2.5
        wanted = fan_position(np.array(ROW) - walls.centre[number], FAN)
        np.testing.assert_array_equal(found.direction[rows], np.sort(np.rint(wanted)))


def test_sharpness_is_pixels_to_a_texel() -> None:
    found = view_textures(on_the_wall(), VOXEL, Scene().photographs([(0.0, -5.0, 0.0)]))
    texel = 2 * VOXEL * (0.5 + OVERLAP) / SIDE
    assert found.sharpness[0] == pytest.approx(120 * texel / 5, rel=1e-5)


def test_fine_photographs_are_averaged() -> None:
    # A chequer pattern of single pixels is grey to texels of three pixels and more.
    photographs = Scene().photographs([(0.0, -2.0, 0.0)], focal=260.0, size=(200, 200))
    y, x = np.mgrid[:200, :200]
    photographs.pixels[0] = ((x + y) % 2 * 200)[..., None]
    found = view_textures(on_the_wall(), VOXEL, photographs)
    assert found.sharpness[0] > 3
    assert np.abs(found.colours[found.states == SEEN] - 100.0).max() < 60


def test_a_pole_is_not_painted_on_the_wall() -> None:
    scene, wall = Scene(pole=(0.1, -1.5, 0.06)), on_the_wall()
    photographs = scene.photographs(ROW)
    found = view_textures(wall, VOXEL, photographs)
    truth = painting(texel_points(wall, 0))
    seen = found.states == SEEN
    assert not reddish(found.colours[seen]).any()
    off = np.abs(found.colours.astype(float) - truth).max(axis=-1)
    assert off[seen].max() < 2.5
    # Hidden, not looked through; and only where the pole and its rim are.
    assert not (found.states == EMPTY).any()
    assert 0.02 < (found.states == UNSEEN).mean() < 0.25
    paper = view_textures(wall, VOXEL, photographs, plain=True)
    assert reddish(paper.colours[paper.states == SEEN]).sum() > 30
    inside = np.abs(texel_points(wall, 0) - wall.voxel[0]).max(axis=-1) <= VOXEL * (0.5 + OVERLAP)
    np.testing.assert_array_equal(paper.states == SEEN, np.tile(inside, (len(ROW), 1, 1)))


def test_beside_the_wall_it_is_looked_through() -> None:
    end = 0.13
    wall = on_the_wall()
    found = view_textures(wall, VOXEL, Scene(end=end).photographs(ROW))
    x = texel_points(wall, 0)[..., 0]
    # A pixel of the wall's rim is up to 7 cm wide when looked at from the side.
    assert (found.states[:, x > end + 0.07] == EMPTY).all()
    assert (found.states[:, x < end - 0.07] == SEEN).all()


def test_a_wall_farther_back_is_looked_through_to() -> None:
    wall = on_the_wall([(0.0, -1.2, 0.0)])
    found = view_textures(wall, VOXEL, Scene().photographs([(0.0, -5.0, 0.0)]))
    assert len(found.direction) == 0
    np.testing.assert_array_equal(found.first, [0, 0])


def test_outside_of_pictures_nothing_is_known() -> None:
    wall = on_the_wall()
    photographs = Scene().photographs([(0.0, -5.0, 0.1)], target=(0.7, 0.0, 0.2), size=(50, 44))
    found = view_textures(wall, VOXEL, photographs)
    pixels, _ = project_points(
        photographs.intrinsics[0], photographs.to_world[0], texel_points(wall, 0)
    )
    inside = (np.abs(pixels - [24.5, 21.5]) < [25, 22]).all(axis=-1)
    assert 0.1 < inside.mean() < 0.9
    np.testing.assert_array_equal(found.states[0], np.where(inside, SEEN, UNSEEN))


def test_the_next_best_photograph_fills_in() -> None:
    # Both in one direction of the fan; the nearer is asked first, a pole stands before it.
    scene = Scene(pole=(0.05, -2.5, 0.05))
    spots = [(0.0, -5.0, 0.0), (0.25, -5.5, 0.0)]
    photographs = scene.photographs(spots)
    photographs.pixels[1] = np.maximum(photographs.pixels[1], 40) - 40  # its colours are known
    wall = on_the_wall()
    truth = painting(texel_points(wall, 0))
    found = view_textures(wall, VOXEL, photographs)
    assert len(found.direction) == 1
    first_only = view_textures(
        wall, VOXEL, type(photographs)(*(array[:1] for array in photographs))
    )
    hidden = first_only.states[0] == UNSEEN
    assert hidden.sum() > 50
    np.testing.assert_array_equal(found.colours[0][~hidden], first_only.colours[0][~hidden])
    filled = hidden & (found.states[0] == SEEN)
    assert filled.sum() > 0.5 * hidden.sum()
    darker = np.maximum(truth, 40) - 40
    assert np.abs(found.colours[0][filled] - darker[filled]).max() < 2.5
    # The paper asks one photograph a view.
    plain = view_textures(wall, VOXEL, photographs, plain=True)
    assert reddish(plain.colours[0]).any()


def test_codes_even_out_exposures() -> None:
    photographs = Scene().photographs(ROW)
    gains = np.exp(np.random.default_rng(0).normal(0, 0.3, (len(ROW), 3)))
    taken = exposure_lut(1 / gains)
    exposed = np.stack(
        [codes[shot, np.arange(3)] for codes, shot in zip(taken, photographs.pixels, strict=True)]
    )
    assert (exposed != photographs.pixels).any()
    wall = on_the_wall()
    found = view_textures(
        wall, VOXEL, photographs._replace(pixels=exposed, exposure_lut=exposure_lut(gains))
    )
    truth = painting(texel_points(wall, 0))
    assert np.abs(found.colours[found.states == SEEN].mean(axis=0) - truth.mean((0, 1))).max() < 1.5
    assert np.abs(found.colours - truth).max() < 6


def test_far_and_averted_photographs_are_not_asked() -> None:
    spots = [(0.0, -5.0, 0.0), (3.0, -39.0, 0.0), (0.0, -0.8, 0.0), (2.0, 5.0, 0.0)]
    found = view_textures(on_the_wall(), VOXEL, Scene().photographs(spots), farthest=30.0)
    assert len(found.direction) == 1
    with_far = view_textures(
        on_the_wall(), VOXEL, Scene().photographs([(9.0, -20.0, 0.0)], focal=400), farthest=30.0
    )
    assert len(with_far.direction) == 1


def test_unknown_depth_says_nothing_against_a_surface() -> None:
    photographs = Scene().photographs([(0.0, -5.0, 0.0)])
    photographs.depth[:] = np.nan
    assert (view_textures(on_the_wall(), VOXEL, photographs).states == SEEN).all()
    # Of one that turns nobody knows where in the voxel it is.
    assert len(view_textures(on_the_wall(turns=True), VOXEL, photographs).direction) == 0


@pytest.mark.parametrize("deviation", [0.0, 0.04])
def test_what_turns_is_seen_only_where_depth_lies_in_the_voxel(deviation: float) -> None:
    rng = np.random.default_rng(0)
    photographs = Scene().photographs([(-1.5, -4.0, 0.4), (2.0, -4.5, 0.8)])
    # Patches at depths that are in the voxel, before it and behind it.
    away = np.linalg.norm(photographs.to_world[:, :3, 3], axis=1)[:, None, None]
    patches = away + rng.uniform(-0.7, 1.2, (2, 10, 12)).repeat(8, axis=1).repeat(8, axis=2)
    photographs = photographs._replace(
        depth=patches.astype(np.float32),
        deviation=np.full(patches.shape, deviation, np.float32),
    )
    tree = on_the_wall(turns=True)
    found = view_textures(tree, VOXEL, photographs)
    assert len(found.direction) == 2
    counts = np.zeros(3, int)
    for k, eye in enumerate(photographs.to_world[:, :3, 3]):
        place = int(np.rint(fan_position(eye - tree.centre[0], FAN)))
        view = int(np.flatnonzero(found.direction == place)[0])
        row, column = axes_facing(tree.centre[0], eye)
        half = tree.half_s[0, 0]
        for y in range(SIDE):
            for x in range(SIDE):
                s, t = (2 * x + 1) / SIDE - 1, 1 - (2 * y + 1) / SIDE
                point = tree.centre[0] + half * (s * row + t * column)
                pixel, z = project_points(photographs.intrinsics[k], photographs.to_world[k], point)
                u, v = (int(i) for i in np.floor(pixel + 0.5))
                # The stretch of the ray inside the voxel, by trying.
                tried = np.linspace(0.5, 1.5, 2001)
                along = eye + tried[:, None] * (point - eye)
                inside = (np.abs(along) <= VOXEL * (0.5 + OVERLAP)).all(axis=1)
                state = found.states[view, y, x]
                counts[state] += 1
                if not inside.any():
                    assert state != SEEN
                    continue
                near, far = z * tried[inside][[0, -1]]
                around = patches[k, v - 1 : v + 2, u - 1 : u + 2]
                slack = 3 * deviation + 0.006  # the steps of the tried ones
                if state == SEEN:
                    assert near - slack <= patches[k, v, u] <= far + slack
                    assert around.min() >= near - slack
                elif state == EMPTY:
                    assert patches[k, v, u] > far + 3 * deviation - 0.006
                else:
                    assert around.min() < near - 3 * deviation + 0.006
    assert counts.min() > 50


def test_views_that_show_little_are_dropped() -> None:
    # One camera sees all of the wall, another beside it the left sixth of it.
    photographs = Scene().photographs([(0.0, -5.0, 0.0), (-3.0, -4.0, 0.0)])
    wall = on_the_wall()
    pixels, _ = project_points(
        photographs.intrinsics[1], photographs.to_world[1], texel_points(wall, 0)
    )
    border = np.quantile(pixels[..., 0], 1 / 6)
    photographs.depth[1, :, int(border) :] = 1.0
    found = view_textures(wall, VOXEL, photographs)
    assert len(found.direction) == 1


def test_billboards_may_be_done_in_parts() -> None:
    photographs = Scene(end=0.4, pole=(0.1, -1.5, 0.06)).photographs(ROW)
    walls = on_the_wall([(x, 0.0, 0.0) for x in (-1.0, 0.0, 0.5, 4.5)])
    whole = view_textures(walls, VOXEL, photographs)
    parts = join_views(
        [
            view_textures(type(walls)(*(array[rows] for array in walls)), VOXEL, photographs)
            for rows in (slice(0, 1), slice(1, 4))
        ]
    )
    for one, other in zip(whole, parts, strict=True):
        np.testing.assert_array_equal(one, other)
