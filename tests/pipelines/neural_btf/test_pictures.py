"""Pictures: the photographs that are asked for, and content that follows what is given."""

from __future__ import annotations

import math

import numpy as np
import pytest
from matplotlib import colormaps
from numpy.typing import NDArray

from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.light.directions import Pairs, all_pairs, hemisphere_table, unit_vectors
from pipelines.neural_btf.pictures import (
    PAPER_PAIRS,
    cluster_map,
    error_picture,
    loss_curve,
    material_wall,
    nearest_images,
    photograph_sheet,
    restored_picture,
    shown_images,
)

TABLE: NDArray[np.float64] = hemisphere_table(81)
FULL: Pairs = all_pairs(TABLE, TABLE)


def some_photographs(count: int = 2, seed: int = 0) -> NDArray[np.float32]:
    return np.random.default_rng(seed).gamma(1, 0.3, (count, 12, 10, 3)).astype(np.float32)


def degrees(pairs: Pairs, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
    """View theta and phi, light theta and phi."""
    return np.degrees(np.hstack([pairs.view[numbers], pairs.light[numbers]]))


def assert_picture(picture: NDArray[np.uint8], *, least: int) -> None:
    assert picture.dtype == np.uint8
    assert picture.shape[2:] == (3,)
    assert least <= min(picture.shape[:2]) <= max(picture.shape[:2]) < 2000


# ---- which photographs -----------------------------------------------------------------------


def test_the_pairs_of_figure_7_are_in_the_81_table() -> None:
    found = nearest_images(FULL, PAPER_PAIRS)
    np.testing.assert_allclose(
        degrees(FULL, found), [(15, 60, 30, 60), (75, 345, 45, 0)], atol=1e-9
    )


def test_every_photograph_is_nearest_to_its_own_pair() -> None:
    numbers = np.random.default_rng(0).integers(0, len(FULL.view), 40)
    wanted = [tuple(row) for row in degrees(FULL, numbers)]
    found = nearest_images(FULL, wanted)  # type: ignore[arg-type]
    for one in (FULL.view, FULL.light):
        np.testing.assert_allclose(unit_vectors(one[found]), unit_vectors(one[numbers]))


def test_nearest_is_by_the_arc_of_both_directions() -> None:
    """Across phi = 0, and with the theta of the coarse table."""
    coarse = all_pairs(hemisphere_table(15), hemisphere_table(15))
    wanted = (58.0, 359.0, 33.0, 62.0)
    found = nearest_images(coarse, [wanted])[0]
    arcs = []
    for view, light in zip(coarse.view, coarse.light, strict=True):
        steps = [
            math.acos(min(1.0, float(unit_vectors(a) @ unit_vectors(np.radians(b)))))
            for a, b in ((view, wanted[:2]), (light, wanted[2:]))
        ]
        arcs.append(steps[0] ** 2 + steps[1] ** 2)
    assert found == int(np.argmin(arcs))
    np.testing.assert_allclose(degrees(coarse, np.array([found]))[0], (60, 0, 30, 60), atol=1e-9)


@pytest.mark.parametrize("count", [15, 41, 81, 151])
def test_shown_photographs_are_different_and_the_first_is_from_above(count: int) -> None:
    table = hemisphere_table(count)
    pairs = all_pairs(table, table)
    numbers = shown_images(pairs)
    assert len(set(numbers.tolist())) == len(numbers) == 6
    assert numbers[0] == 0


# ---- sheets ----------------------------------------------------------------------------------


def test_a_sheet_shows_the_photographs_side_by_side_exposed_alike() -> None:
    images = some_photographs(3)
    sheet = photograph_sheet(images)
    assert_picture(sheet, least=192)
    times = math.ceil(192 / 10)
    encoded = to_8bit(images * auto_exposure(images))
    assert sheet.shape == (12 * times + 8, 3 * (10 * times + 8), 3)
    for number in range(3):
        left = number * (10 * times + 8) + 4
        tile = sheet[4 : 4 + 12 * times, left : left + 10 * times]
        np.testing.assert_array_equal(tile[times // 2 :: times, times // 2 :: times],
                                      encoded[number])  # fmt: skip


def test_large_photographs_are_not_enlarged() -> None:
    assert photograph_sheet(np.ones((2, 200, 210, 3), np.float16)).shape == (208, 2 * 218, 3)


def test_a_wall_has_every_material_in_every_frame() -> None:
    panels = [np.full((4, 6, 8, 3), 50 * number, np.uint8) for number in (1, 2, 3)]
    panels[1][2] = 7
    found = material_wall(panels)
    assert found.shape == (4, 12, 16, 3)
    assert set(np.unique(found[0]).tolist()) == {0, 50, 100, 150}
    assert set(np.unique(found[2]).tolist()) == {0, 50, 7, 150}


# ---- figures ---------------------------------------------------------------------------------


def test_a_cluster_map_has_one_colour_for_each_cluster_and_texels_row_by_row() -> None:
    ids = np.random.default_rng(1).integers(0, 9, 6 * 8)
    picture = cluster_map(ids, 6, 8)
    assert_picture(picture, least=200)
    times = picture.shape[1] // 8
    assert picture.shape[0] == 6 * times
    texels = picture[times // 2 :: times, times // 2 :: times].reshape(-1, 3)
    colours = {tuple(colour) for colour in texels.tolist()}
    pairs = {(int(one), *colour) for one, colour in zip(ids, texels.tolist(), strict=True)}
    assert len(colours) == len(pairs) == len(set(ids.tolist()))


def pairs_of(count: int) -> Pairs:
    return Pairs(FULL.light[1000 : 1000 + count], FULL.view[1000 : 1000 + count])


def test_a_restored_picture_has_a_row_for_every_photograph() -> None:
    one, three = (
        restored_picture(some_photographs(count), some_photographs(count), pairs_of(count))
        for count in (1, 3)
    )
    assert_picture(one, least=250)
    assert_picture(three, least=800)
    assert three.shape == (pytest.approx(3 * one.shape[0], abs=3), one.shape[1], 3)


def columns_of(picture: NDArray[np.uint8]) -> list[float]:
    """Mean brightness of the quarters, titles cut off."""
    middle = picture[picture.shape[0] // 4 : -picture.shape[0] // 4]
    return [float(quarter.mean()) for quarter in np.array_split(middle, 4, axis=1)]


def test_the_difference_is_dark_where_the_restoration_is_right() -> None:
    images = some_photographs(1)
    exact = columns_of(restored_picture(images, images, pairs_of(1)))
    wrong = columns_of(restored_picture(images, images * 0.7, pairs_of(1)))
    assert exact[0] == pytest.approx(exact[1], abs=3)
    assert wrong[0] == pytest.approx(exact[0], abs=1)
    assert wrong[1] < exact[1] - 3
    assert wrong[2] > exact[2] + 20
    assert wrong[3] > exact[3] + 10


def test_a_row_is_exposed_by_its_original() -> None:
    images = some_photographs(1)
    one = columns_of(restored_picture(images, images, pairs_of(1)))
    dark = columns_of(restored_picture(images * 0.01, images * 0.01, pairs_of(1)))
    np.testing.assert_allclose(dark, one, atol=3)


def test_a_loss_curve_shows_its_values() -> None:
    step = np.arange(1, 101)
    falling, level = (loss_curve(step, value) for value in (1 / step, np.full(100, 0.1)))
    for picture in (falling, level):
        assert_picture(picture, least=250)
        blue = (picture.astype(int) @ [-1, 0, 1]) > 60
        assert blue.any()
    # A falling line takes more of the height than a level one.
    heights = [
        np.ptp(np.flatnonzero(((p.astype(int) @ [-1, 0, 1]) > 60).any(axis=1)))
        for p in (falling, level)
    ]
    assert heights[0] > 150
    assert heights[1] < 10


def test_an_error_picture_shows_where_the_errors_are() -> None:
    """One error is ten times the others: these have the colour of a tenth, in one part only."""
    coarse = all_pairs(hemisphere_table(15), hemisphere_table(15))
    texels, images = np.full((8, 8), 0.02), np.full(225, 0.02)
    of_texel, of_view, of_light = texels.copy(), images.copy(), images.copy()
    of_texel[2, 3] = 0.2
    of_view[:15] = 0.2  # all photographs of the first view
    of_light[::15] = 0.2
    tenth = np.array(colormaps["magma"](0.1)[:3]) * 255
    for part, picture in enumerate(
        (
            error_picture(of_texel, images, coarse),
            error_picture(texels, of_view, coarse),
            error_picture(texels, of_light, coarse),
        )
    ):
        assert_picture(picture, least=300)
        alike = np.abs(picture - tenth).max(axis=2) < 3
        counts = [int(third.sum()) for third in np.array_split(alike, 3, axis=1)]
        assert int(np.argmax(counts)) == part
        assert counts[part] > 600  # 63 texels or 14 points; a colour bar has less
        assert sum(counts) - counts[part] < 300
